"""Newton (newton-physics) on the processor: springs, and triangles of a material, in four of its solvers.

All formulas are from the kernels of Newton 1.8. mu and lambda are Lame's constants of plane stress, h is the thickness.

Springs follow Hooke's law in VBD, XPBD and the semi-implicit solver. XPBD corrects all springs at once, so that it
diverges above the largest step of explicit schemes, at any number of iterations; it resets its multipliers in each
step. It has no triangles, and ignores springs of negative stiffness.

Triangles of VBD and of the semi-implicit solver have one law, which is typed in two ways:

    W = A_0 [mu h/2 (tr C - 2 J) + (lambda + mu) h/2 (J - 1)^2]

``tri_ke = mu h`` in both, but ``tri_ka = lambda h`` in VBD and ``(lambda + mu) h`` in the semi-implicit solver. At
small strain it is Hooke's law. At a strain e, displacements differ by some 2 e from those by St. Venant-Kirchhoff's
law, which `delingette` has, and by less than e from those of small strain. Style3D has stiffnesses along, across and in
shear, and no contraction across: a material of nu = 0. It has no springs.

What is set besides, because Newton's defaults differ: gravity 0 and no ground; radius of particles 0, so that they do
not touch; ``tri_kd`` (10 by default) and ``kd`` 0; no limit of velocities (1e5 m/s); contacts of Style3D off. VBD has
the colours of `ModelBuilder.color`, as other scripts do, and its own by springs, which that does not see. Left as they
are: Style3D multiplies velocities by 0.998 in each step, and takes 10 iterations of conjugate gradients in each of its
iterations.

Positions are of single precision, and absolute: what a step moves below the last place of a position is lost. So nets
are centred at zero, which leaves XPBD's and VBD's slender bending 2e-4 off in place of 6e-3. Do the same in Newton.

Newton holds particles as a whole. A direction held singly is put back after each step. The force that would have kept
it there is added to the next step: at rest it is the support's reaction.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from ..handover.net import SpringNet
from ..handover.newton import colours, membrane, membrane_energies
from .base import DASHPOT, MASS_DAMPING, SPRING, EngineError, Parameter, Session, Setting, engine

FASTEST = 1e30
"""Largest velocity [m/s]: none. By default Newton has 1e5."""

TRI_KE = Parameter("N/m", "mu h = E h / (2 (1 + nu))")
TRI_KD = Parameter("N s/m", "beta tri_ke / 2 of triangles")
VBD = {"ke": SPRING, "tri_ke": TRI_KE, "tri_ka": Parameter("N/m", "lambda h = E h nu / (1 - nu^2)")}
SEMI_IMPLICIT = {"ke": SPRING, "tri_ke": TRI_KE, "tri_ka": Parameter("N/m", "(lambda + mu) h = E h / (2 (1 - nu))")}
STYLE3D = {"tri_aniso_ke": Parameter("N/m", "(E h, E h, E h / 2) along, across, in shear; for nu = 0 alone")}


def triangle_numbers(net: SpringNet, solver: str) -> dict[str, Any]:
    """Return numbers to type for the triangles of a net; empty where it has springs alone."""
    if not net.energies:
        return {}
    shear, first = membrane(net)
    if solver == "VBD":
        return {"tri_ke": shear, "tri_ka": first}
    if solver == "SemiImplicit":
        return {"tri_ke": shear, "tri_ka": first + shear}
    if first > 1e-6 * shear:
        raise EngineError(
            f"material: Poisson's ratio is {first / (first + 2 * shear):.3g}, Style3D have none; take a "
            "material of nu = 0"
        )
    return {"tri_aniso_ke": (2 * shear, 2 * shear, shear)}


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep Warp from printing its banner, compiled modules and times."""
    import warp

    before = warp.config.log_level, warp.ScopedTimer.enabled
    warp.config.log_level, warp.ScopedTimer.enabled = warp.LOG_ERROR, False
    try:
        yield
    finally:
        warp.config.log_level, warp.ScopedTimer.enabled = before


class _Session:
    """A model of Newton, damped over mass."""

    def __init__(self, net: SpringNet, setting: Setting, damping: float, solver: str) -> None:
        if solver == "XPBD" and np.any(net.stiffness < 0):
            raise EngineError(
                f"definition '{net.header['definition']}': has springs of negative stiffness, which Newton's XPBD "
                "leaves out; take 'patch' or 'lattice'"
            )
        middle = (net.points.min(axis=0) + net.points.max(axis=0)) / 2  # small numbers lose least by rounding
        with _quiet():
            import newton

            self.model = _model(replace(net, points=net.points - middle), solver)
            made = getattr(newton.solvers, f"Solver{solver}")
            taken: dict[str, Any] = {} if solver == "SemiImplicit" else {"iterations": setting.iterations}
            self.solver = made(self.model, **({"config": made.Config(**taken)} if solver == "Style3D" else taken))
            if solver == "Style3D":
                self.solver.collision = None
            self.now, self.next, self.control = self.model.state(), self.model.state(), self.model.control()
        self.step, self.substeps = setting.step, setting.substeps
        self.kept = np.float32(1 / (1 + damping * setting.step))
        singly = net.held & ~net.held.all(axis=1, keepdims=True)
        self.forces, self.guided = (np.pad(plane, ((0, 0), (0, 1))) for plane in (net.forces, singly))
        self.rest = self.now.particle_q.numpy().copy()
        self.reacting = self.model.particle_mass.numpy()[np.nonzero(self.guided)[0]] / setting.step**2

    def advance(self, frames: int) -> None:
        """Take a number of frames."""
        with _quiet(), np.errstate(over="ignore", invalid="ignore"):
            for _ in range(frames * self.substeps):
                self.now.particle_f.numpy()[:] = self.forces  # a view; the semi-implicit solver adds its own to them
                self.solver.step(self.now, self.next, self.control, None, self.step)
                self.now, self.next = self.next, self.now
                places, velocities = self.now.particle_q.numpy(), self.now.particle_qd.numpy()
                velocities *= self.kept
                self.forces[self.guided] -= self.reacting * (places - self.rest)[self.guided]
                places[self.guided], velocities[self.guided] = self.rest[self.guided], 0

    def displacements(self) -> np.ndarray:
        """Displacement of each particle [m]."""
        return (self.now.particle_q.numpy() - self.rest)[:, :2].astype(float)


def _model(net: SpringNet, solver: str) -> Any:
    """Model of a net; particles without mass are held."""
    import newton
    from warp import vec3

    assert net.masses is not None  # of a scene that moves
    count = len(net.points)
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
    if solver == "Style3D":
        newton.solvers.SolverStyle3D.register_custom_attributes(builder)
    masses = np.where(net.held.all(axis=1), 0, net.masses)
    places = [vec3(x, y, 0.0) for x, y in net.points.tolist()]
    builder.add_particles(places, [vec3(0.0)] * count, masses.tolist(), radius=[0.0] * count)
    there = net.stiffness != 0
    for (first, second), stiffness in zip(net.springs[there].tolist(), net.stiffness[there].tolist()):
        builder.add_spring(first, second, ke=stiffness, kd=0.0, control=0.0)
    builder.spring_rest_length = net.rest_lengths[there].tolist()
    if net.energies:
        cells = net.energies[0].cells
        numbers = dict.fromkeys(("tri_ke", "tri_ka", "tri_kd", "tri_drag", "tri_lift"), 0.0)
        numbers |= triangle_numbers(net, solver)
        each = {name: [value] * len(cells) for name, value in numbers.items()}
        own = {f"style3d:{name}": each.pop(name) for name in STYLE3D if name in each}
        builder.add_triangles(*cells.T.tolist(), custom_attributes=own, **each)
        if own:
            edges = net.points[cells[:, 1:]] - net.points[cells[:, :1]]
            builder.tri_poses = np.linalg.inv(np.swapaxes(edges, 1, 2)).tolist()  # along and across are x and y
            # The collision of Style3D, though off, wants an edge: one without bending.
            first, second = map(int, cells[0, :2])
            free = {"style3d:edge_rest_area": 1.0}
            builder.add_edge(-1, -1, first, second, rest=0.0, edge_ke=0.0, edge_kd=0.0, custom_attributes=free)
    if there.any():
        builder.set_coloring(colours(net))
    else:
        builder.color()
    builder.particle_max_velocity = FASTEST
    model = builder.finalize(device="cpu")
    model.particle_grid = None
    return model


BESIDES = (
    "tri_kd=0, tri_drag=0, tri_lift=0 and kd=0 (tri_kd is 10 by default); edge_ke=0; radius=0 of particles (0.1 m by "
    "default) and model.particle_grid=None; gravity 0; masses density times thickness times a third of the triangles' "
    "areas; points about the origin"
)
"""What a script sets besides, as runs here do."""


def _declared(solver: str, **own: Any) -> dict[str, Any]:
    """What the declaration of a solver has, besides its name, order and parameters."""

    def typed(net: SpringNet) -> dict[str, Any]:
        return ({"ke": net.stiffness} if np.any(net.stiffness) else {}) | triangle_numbers(net, solver)

    in_common = {
        "program": "Newton",
        "needs": ("newton", "warp"),
        "extra": "newton",
        "precisions": ("float32",),
        "laws": ("biquadratic",),
        "dampers": {"kd": DASHPOT} | ({"tri_kd": TRI_KD} if solver == "VBD" else {}),
        "besides": BESIDES,
        "measured": "1e-3, ten scenes, by the law that it has",
        "source": "Newton 1.8, newton.solvers",
    }
    return in_common | {"typed": typed} | own


COLOURS = "builder.color() before finalize(), of springs builder.set_coloring(groups that no spring joins); "


@engine(
    "newton-vbd",
    order=150,
    parameters=VBD,
    **_declared("VBD", implicit=True, law=membrane_energies, besides=COLOURS + BESIDES),
)
def vbd(net: SpringNet, setting: Setting, damping: float) -> Session:
    """Newton's solver VBD: implicit steps by vertex block descent."""
    return _Session(net, setting, damping, "VBD")


XPBD_MEASURED = "1e-3, nine of ten scenes; 8e-3 near buckling, by rounding: the same steps in double are 5e-4 off"


@engine(
    "newton-xpbd",
    order=151,
    parameters={"ke": SPRING},
    **_declared("XPBD", implicit=True, laws=(), measured=XPBD_MEASURED),
)
def xpbd(net: SpringNet, setting: Setting, damping: float) -> Session:
    """Newton's solver XPBD: springs alone, all at once in an iteration."""
    return _Session(net, setting, damping, "XPBD")


@engine(
    "newton-semi-implicit",
    order=152,
    parameters=SEMI_IMPLICIT,
    **_declared("SemiImplicit", iterates=False, law=membrane_energies),
)
def semi_implicit(net: SpringNet, setting: Setting, damping: float) -> Session:
    """Newton's solver SemiImplicit: explicit steps."""
    return _Session(net, setting, damping, "SemiImplicit")


STYLE = {
    "springs": False,
    "implicit": True,
    "dampers": MASS_DAMPING,
    "measured": "1e-3, nine of ten scenes, by the law that it has; 2e-3 in slender bending",
}


@engine("newton-style3d", order=153, parameters=STYLE3D, **_declared("Style3D", **STYLE))
def style3d(net: SpringNet, setting: Setting, damping: float) -> Session:
    """Newton's solver Style3D: implicit steps by projective dynamics."""
    return _Session(net, setting, damping, "Style3D")

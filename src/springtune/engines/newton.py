"""Newton (newton-physics) on the processor: springs, and triangles of a material, in its solvers VBD and XPBD.

Formulas are from the kernels of Newton 1.8; mu and lambda are Lame's constants of plane stress, t is the thickness.
XPBD corrects all springs at once and diverges above the largest step of explicit schemes. It has no triangles, and
ignores springs of negative stiffness. Triangles of VBD have the law

    W = A_0 [mu t/2 (tr C - 2 J) + (lambda + mu) t/2 (J - 1)^2],  tri_ke = mu t,  tri_ka = lambda t.

At a strain e, displacements differ by some 2 e from those by St. Venant-Kirchhoff's law, which `delingette` has.

Newton's defaults differ in gravity, ground, radius of particles, damping (``tri_kd`` is 10) and the limit of
velocities. `ModelBuilder.color` does not see springs, so VBD gets our own colours. Positions are of single precision,
so nets are centred at zero: VBD's slender bending is 2e-4 off then, else 6e-3. Newton holds particles as a whole: a
direction held singly is put back after each step, with the force that would have kept it there in the next.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from ..handover.net import SpringNet
from ..handover.newton import colours, membrane, membrane_energies
from .base import SPRING_STIFFNESS, Parameter, Session, Setting, engine, refuse_pushing_springs

LARGEST_VELOCITY = 1e30  # largest velocity [m/s]: none. By default Newton has 1e5

TRIANGLES = {
    "tri_ke": Parameter("N/m", "mu t = E t / (2 (1 + nu))"),
    "tri_ka": Parameter("N/m", "lambda t = E t nu / (1 - nu^2)"),
}


def typed(net: SpringNet) -> dict[str, Any]:
    """Stiffness of each spring, and the constants of the triangles of a net that has them."""
    found = {"ke": net.stiffness} if np.any(net.stiffness) else {}
    return found | dict(zip(TRIANGLES, membrane(net))) if net.energies else found


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
        if solver == "XPBD":
            refuse_pushing_springs(net, "Newton's XPBD leaves these out")
        middle = (net.points.min(axis=0) + net.points.max(axis=0)) / 2  # small numbers lose least by rounding
        with _quiet():
            import newton

            self.model = _model(replace(net, points=net.points - middle))
            self.solver = getattr(newton.solvers, f"Solver{solver}")(self.model, iterations=setting.iterations)
            self.now, self.next, self.control = self.model.state(), self.model.state(), self.model.control()
        self.step, self.substeps = setting.step, setting.substeps
        self.velocity_share = np.float32(1 / (1 + damping * setting.step))
        singly = net.held & ~net.held.all(axis=1, keepdims=True)
        self.forces, self.guided = (np.pad(plane, ((0, 0), (0, 1))) for plane in (net.forces, singly))
        self.rest = self.now.particle_q.numpy().copy()
        self.reacting = self.model.particle_mass.numpy()[np.nonzero(self.guided)[0]] / setting.step**2

    def advance(self, frames: int) -> None:
        """Take a number of frames."""
        with _quiet(), np.errstate(over="ignore", invalid="ignore"):
            for _ in range(frames * self.substeps):
                self.now.particle_f.numpy()[:] = self.forces
                self.solver.step(self.now, self.next, self.control, None, self.step)
                self.now, self.next = self.next, self.now
                places, velocities = self.now.particle_q.numpy(), self.now.particle_qd.numpy()
                velocities *= self.velocity_share
                self.forces[self.guided] -= self.reacting * (places - self.rest)[self.guided]
                places[self.guided], velocities[self.guided] = self.rest[self.guided], 0

    def displacements(self) -> np.ndarray:
        """Displacement of each particle [m]."""
        return (self.now.particle_q.numpy() - self.rest)[:, :2].astype(float)


def _model(net: SpringNet) -> Any:
    """Model of a net; particles without mass are held."""
    import newton
    from warp import vec3

    count = len(net.points)
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
    masses = np.where(net.held.all(axis=1), 0, net.masses)
    places = [vec3(x, y, 0.0) for x, y in net.points.tolist()]
    builder.add_particles(places, [vec3(0.0)] * count, masses.tolist(), radius=[0.0] * count)
    there = net.stiffness != 0
    for (first, second), stiffness in zip(net.springs[there].tolist(), net.stiffness[there].tolist()):
        builder.add_spring(first, second, ke=stiffness, kd=0.0, control=0.0)
    builder.spring_rest_length = net.rest_lengths[there].tolist()
    if net.energies:
        cells = net.energies[0].cells
        numbers = dict(zip(TRIANGLES, membrane(net))) | dict.fromkeys(("tri_kd", "tri_drag", "tri_lift"), 0.0)
        builder.add_triangles(*cells.T.tolist(), **{name: [value] * len(cells) for name, value in numbers.items()})
    if there.any():
        builder.set_coloring(colours(net))
    else:
        builder.color()
    builder.particle_max_velocity = LARGEST_VELOCITY
    model = builder.finalize(device="cpu")
    model.particle_grid = None
    return model


SCRIPT_SETTINGS = (
    "tri_kd=0, tri_drag=0, tri_lift=0 and kd=0 (tri_kd is 10 by default); edge_ke=0; radius=0 of particles (0.1 m by "
    "default) and model.particle_grid=None; gravity 0; masses density times thickness times a third of the triangles' "
    "areas; points about the origin"
)
"""Further settings of a script, as runs here have them."""


NEWTON_COMMON: dict[str, Any] = {
    "program": "Newton",
    "needs": ("newton", "warp"),
    "extra": "newton",
    "precisions": ("float32",),
    "typed": typed,
    "source": "Newton 1.8, newton.solvers",
}


@engine(
    "newton-vbd",
    order=150,
    laws=("biquadratic",),
    law=membrane_energies,
    parameters={"ke": SPRING_STIFFNESS} | TRIANGLES,
    besides="builder.color() before finalize(), of springs builder.set_coloring(groups that no spring joins); "
    + SCRIPT_SETTINGS,
    measured="1e-3, ten scenes, by the law that it has",
    **NEWTON_COMMON,
)
def vbd(net: SpringNet, setting: Setting, damping: float) -> Session:
    """Newton's solver VBD: implicit steps by vertex block descent."""
    return _Session(net, setting, damping, "VBD")


@engine(
    "newton-xpbd",
    order=151,
    parameters={"ke": SPRING_STIFFNESS},
    besides=SCRIPT_SETTINGS,
    measured="1e-3, nine of ten scenes; 8e-3 near buckling, by rounding: the same steps in double are 5e-4 off",
    **NEWTON_COMMON,
)
def xpbd(net: SpringNet, setting: Setting, damping: float) -> Session:
    """Newton's solver XPBD: springs alone, all at once in an iteration."""
    return _Session(net, setting, damping, "XPBD")

"""Sheets for Newton (newton-physics): a script of its `ModelBuilder`, and OpenUSD as its importer reads it.

Read and run with Newton 1.8. Springs have our law and [N/m]. A triangle of Newton's solver VBD has Lame's constants of
plane stress times the thickness h [N/m]

    tri_ke = mu h = E h / (2 (1 + nu)),    tri_ka = lambda h = E h nu / (1 - nu^2)

and the law of `springtune.mechanics.energies.StableNeoHookeEnergy`. At small strain it is St. Venant-Kirchhoff's, which
`delingette` is; files have the equilibrium of Newton's law.

Its importer of USD takes tri_ke = E h / (1 - nu^2), tri_ka = 0, which is no material of that E and nu, and neither
springs, loads nor supports. So scripts have to type them, and files say which.
"""

import numpy as np

from ..mechanics.energies import Energy, StableNeoHookeEnergy
from ..problem.materials import Material
from .simulation import Simulation, about, lame, simulate
from .terms import Net

LAWS = ("biquadratic",)
"""Energies that triangles of Newton stand for."""

ITERATIONS = 10
"""Iterations in which VBD converges in a step that is stable in explicit schemes."""

SLOW, PATIENT = 300, (3.0, 60)
"""Loaded period over the largest explicit step above which a step is three times that one, with more iterations.

In single precision, what is left of h^2 f / m below the last place of a position is lost in each step.
"""

DECAYS = 12
"""Times in which the slowest mode comes down to 1/e that a script runs for."""


def membrane(net: Net) -> tuple[float, float]:
    """Return ``tri_ke`` and ``tri_ka`` [N/m] of all triangles; 0 where a net has springs alone."""
    for terms in net.energies:
        first, shear = lame(net, terms, "Newton")
        return shear, first
    return 0.0, 0.0


def membrane_energies(net: Net, reference: float) -> list[Energy]:
    """Energies of the triangles by Newton's law, over the reference stiffness."""
    shear, first = membrane(net)
    ones = np.ones(len(net.triangles)) / reference
    return [StableNeoHookeEnergy(net.points, net.triangles, shear * ones, first * ones)] if net.energies else []


def colours(net: Net) -> list[np.ndarray]:
    """Return groups of particles that neither a spring nor a triangle joins: VBD moves a group at once."""
    joined: list[set[int]] = [set() for _ in net.points]
    for cell in [*net.springs.tolist(), *net.triangles.tolist()]:
        for corner in cell:
            joined[corner].update(cell)
    chosen = np.full(len(net.points), -1)
    for corner, others in enumerate(joined):
        taken = {chosen[other] for other in others}
        chosen[corner] = next(colour for colour in range(len(joined)) if colour not in taken)
    return [np.flatnonzero(chosen == colour) for colour in range(chosen.max() + 1)]


SCRIPT = '''
REST = np.pad(POINTS, ((0, 0), (0, 1)))
WHOLE = np.all(HELD, axis=1)
SLIDES = np.pad(HELD & ~WHOLE[:, None], ((0, 0), (0, 1)))


def build():
    """The sheet as a model; particles without mass are held."""
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
    for place, mass, held in zip(REST, MASSES, WHOLE):
        builder.add_particle(wp.vec3(*place), wp.vec3(0.0), 0.0 if held else mass)
    for (first, second), stiffness, length in zip(SPRINGS, STIFFNESS, REST_LENGTHS):
        builder.add_spring(first, second, ke=stiffness, kd=0.0, control=0.0)
        builder.spring_rest_length[-1] = length
    for corners in TRIANGLES:
        builder.add_triangle(*corners, tri_ke=TRI_KE, tri_ka=TRI_KA, tri_kd=0.0, tri_drag=0.0, tri_lift=0.0)
    builder.set_coloring([np.array(group) for group in COLOURS])  # builder.color() does not see springs
    return builder.finalize()


def run(model, step=STEP, iterations=ITERATIONS, seconds=SECONDS):
    """Displacements [m] after a damped motion from rest."""
    solver = newton.solvers.SolverVBD(model, iterations=iterations)
    state, after, control = model.state(), model.state(), model.control()
    forces = np.pad(FORCES, ((0, 0), (0, 1)))
    for _ in range(round(seconds / step)):
        state.particle_f.assign(forces.astype(np.float32))
        solver.step(state, after, control, None, step)
        places, velocities = after.particle_q.numpy(), after.particle_qd.numpy()
        if SLIDES.any():
            # Newton holds particles as a whole: where one direction is held, a reaction grows until nothing slips.
            slip = np.where(SLIDES, places - REST, 0.0)
            forces = forces - np.array(MASSES)[:, None] / step**2 * slip
            places, velocities = places - slip, np.where(SLIDES, 0.0, velocities)
            after.particle_q.assign(places.astype(np.float32))
        after.particle_qd.assign((velocities / (1 + MASS_DAMPING * step)).astype(np.float32))
        state, after = after, state
    return (state.particle_q.numpy() - REST)[:, :2]


def along(displacements):
    """Mean displacement along the forces [m]."""
    return np.sum(FORCES * displacements) / max(np.abs(FORCES).sum(), 1e-300)


def main():
    found = along(run(build()))
    print(f"displacement along the load: {1e3 * found:.6g} mm")
    if EXPECTED is not None:
        print(f"expected at rest:            {1e3 * along(EXPECTED):.6g} mm")


if __name__ == "__main__":
    main()
'''


def newton_script(net: Net) -> str:
    """Script of a net for Newton's `ModelBuilder` and its solver VBD.

    Examples
    --------
    >>> import springtune as st
    >>> beam, rubber = st.Beam("40 mm", "20 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    >>> scene = st.Scene(beam, st.make_mesh(beam, "right", "20 mm"), rubber, "traction", "1 N", definition="delingette")
    >>> [path] = scene.springs.write("net.newton.py")
    >>> [line[:14] for line in path.read_text().splitlines() if line.startswith("TRI_K")]
    ['TRI_KE = 384.6', 'TRI_KA = 329.6']
    """
    simulation = _simulated(net)
    step, iterations = _pace(simulation)
    shear, first = membrane(net)
    there = net.stiffness != 0
    expected = simulation.displacements
    values = {
        "POINTS": net.points.tolist(),
        "MASSES": simulation.masses.tolist(),
        "SPRINGS": net.springs[there].tolist(),
        "STIFFNESS": net.stiffness[there].tolist(),
        "REST_LENGTHS": net.rest_lengths[there].tolist(),
        "TRIANGLES": net.triangles.tolist() if net.energies else [],
        "COLOURS": [group.tolist() for group in colours(net)],
        "TRI_KE": shear,
        "TRI_KA": first,
        "STEP": step,
        "ITERATIONS": iterations,
        "SECONDS": _seconds(simulation),
        "MASS_DAMPING": simulation.mass_damping,
    }
    lines = [f"# {line}" for line in [*about(net, simulation, _step(simulation)), *_law(net)]]
    lines += ["", "import newton", "import numpy as np", "import warp as wp", ""]
    lines += [f"{name} = {value!r}" for name, value in values.items()]
    lines += [f"HELD = np.array({net.held.tolist()!r})"]
    lines += [f"FORCES = np.array({net.forces.tolist()!r})"]
    lines += [f"EXPECTED = {None if expected is None else f'np.array({expected.tolist()!r})'}", ""]
    return "\n".join(lines) + SCRIPT


def _simulated(net: Net) -> Simulation:
    """Simulation by Newton's law; ValueError for what Newton lacks."""
    return simulate(net, "Newton", LAWS, membrane_energies)


def _pace(simulation: Simulation) -> tuple[float, int]:
    """Step of a file [s], and iterations in which VBD converges in it."""
    loaded, largest = simulation.loaded_frequency, simulation.largest_step
    if loaded and 2 * np.pi / loaded > SLOW * largest:
        return PATIENT[0] * largest, PATIENT[1]
    return simulation.step, ITERATIONS


def _step(simulation: Simulation) -> str:
    """What the step of a file is, for its comments."""
    step, iterations = _pace(simulation)
    return f"the one here is {step / simulation.largest_step:.2g} times that, in which {iterations} iterations converge"


def _seconds(simulation: Simulation) -> float:
    """Time in which the slowest mode that the load excites comes to rest [s]."""
    lowest, damping = simulation.frequency, simulation.mass_damping
    rate = damping / 2 - max(damping**2 / 4 - lowest**2, 0.0) ** 0.5
    return DECAYS / rate if rate else 100 * simulation.step


def _law(net: Net) -> list[str]:
    if not net.energies:
        return []
    return [
        "Triangles have Newton's law: mu/2 (tr C - 2 J) + (lambda + mu)/2 (J - 1)^2, mu = tri_ke, lambda = tri_ka.",
        "At small strain it is that of the definition; the displacement expected here is by Newton's law.",
    ]


USD = '''#usda 1.0
(
    defaultPrim = "sheet"
    doc = """{about}"""
    metersPerUnit = 1
    upAxis = "Z"
)

def Xform "sheet" (prepend apiSchemas = ["PhysicsDeformableBodyAPI"])
{{
    def Mesh "cloth" (
        prepend apiSchemas = ["PhysicsSurfaceDeformableSimAPI", "PhysicsCollisionAPI", "MaterialBindingAPI"]
    )
    {{
        int[] faceVertexCounts = {counts}
        int[] faceVertexIndices = {indices}
        point3f[] points = {points}
        float[] physics:thicknesses = [{thickness}]
        uniform token physics:thicknesses:elementType = "constant"
        uniform token subdivisionScheme = "none"
        rel material:binding:physics = </sheet/material>
        custom int2[] springtune:held = {held}
        custom vector3f[] springtune:forces = {forces}
        custom vector3f[] springtune:expectedDisplacements = {expected}
        custom float springtune:triKe = {tri_ke}
        custom float springtune:triKa = {tri_ka}
    }}

    def Material "material" (prepend apiSchemas = ["PhysicsMaterialAPI", "PhysicsSurfaceDeformableMaterialAPI"])
    {{
        float physics:density = {density}
        float physics:youngsModulus = {young}
        float physics:poissonsRatio = {poisson}
    }}
}}
'''

TO_SET = (
    "Newton's importer reads particles, masses and triangles. It takes tri_ke = E h / (1 - nu^2) and tri_ka = 0, which",
    "is another material: a script sets builder.tri_materials[t] = (triKe, triKa, 0, 0, 0) of all triangles. It also",
    "sets builder.particle_mass[i] = 0 where held has particle i with both its axes, 0 and 1, and ahead of each step",
    "state.particle_f = forces. These are the attributes springtune:... of the mesh; a name ending in .newton.py gives",
    "such a script, whose run(model) takes a model of this file, too.",
)
"""What a user's script has to do with a file in USD."""


def newton_usd(net: Net) -> str:
    """Sheet of a net of triangles as OpenUSD's deformable cloth, as Newton's importer reads it."""
    simulation = _simulated(net)
    name, material = net.header["definition"], net.header["material"]
    if not net.energies or np.any(net.stiffness):
        raise ValueError(
            f"definition '{name}': has springs, and deformable cloth of OpenUSD is triangles of a material; take "
            "'delingette', or a name ending in .newton.py"
        )
    shear, first = membrane(net)
    plane = material.get("plane", "stress")
    sheet = Material(material["young_modulus"], material["poisson_ratio"], plane=plane).in_plane
    moved = np.zeros((0, 2)) if simulation.displacements is None else simulation.displacements
    said = "\n".join([*about(net, simulation, _step(simulation)), *_law(net), *TO_SET])
    return USD.format(
        about=said.replace("\\", "/").replace('"', "'"),
        counts=[3] * len(net.triangles),
        indices=net.triangles.ravel().tolist(),
        points=_vectors(net.points),
        thickness=net.thickness,
        held=list(map(tuple, np.argwhere(net.held).tolist())),
        forces=_vectors(net.forces),
        expected=_vectors(moved),
        tri_ke=shear,
        tri_ka=first,
        density=material["density"],
        young=sheet.young_modulus,
        poisson=sheet.poisson_ratio,
    )


def _vectors(points: np.ndarray) -> str:
    """Vectors of three dimensions as USD has them."""
    return "[" + ", ".join(f"({x!r}, {y!r}, 0)" for x, y in points.tolist()) + "]"

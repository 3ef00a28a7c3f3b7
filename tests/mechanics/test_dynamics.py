"""Networks in motion: closed forms, limits of the step, orders of convergence, invariants."""

from functools import cache, partial
from types import SimpleNamespace

import numpy as np
import pytest

import springtune as st
from springtune.mechanics import EXPLICIT, INTEGRATORS, BackwardEuler, stepping
from springtune.mechanics.continuation import buckling
from springtune.mechanics.continuum import ends
from springtune.mechanics.dynamics import Motion, masses, relax
from springtune.mechanics.network import Network
from springtune.mechanics.statics import StaticProblem
from springtune.mesh.rows import lattice
from springtune.problem.boundary import held_directions, weights
from springtune.problem.loads import AXIAL, BENDING
from springtune.springs.lattice import uniform

from problems import CountedNetwork

STEEL = st.Material(210e9, 0.3, name="steel")
DENSITY = 7850.0
THICKNESS = 1e-3


def beam(
    definition="lattice", force=20e3, size=5e-3, mesh_type="structured", length=0.1, network_type=Network, **options
):
    """A clamped beam of steel, pulled at its end, with its true masses."""
    mesh = st.MESH_TYPES[mesh_type](length, 0.02, size)
    springs = st.DEFINITIONS[definition].springs(mesh, STEEL, THICKNESS)
    network = network_type(mesh, held_directions(mesh, AXIAL), springs.relative, springs.energies)
    inertia = masses(mesh, DENSITY, THICKNESS) / springs.reference
    return Motion(network, inertia, force / springs.reference * weights(mesh, AXIAL), **options)


def with_(motion, **options):
    kept = {"load": motion.load, "linear": motion.linear, "dampers": motion.dampers,
            "mass_damping": motion.mass_damping}  # fmt: skip
    return Motion(motion.network, motion.inertia[:, 0], **(kept | options))


def damped(motion):
    """The motion with critical damping of its loaded mode."""
    return with_(motion, mass_damping=motion.critical_damping)


def oscillator(**options):
    """One particle on one spring along x: a mass of 1 and a stiffness of 1 over the reference, omega = 1."""
    mesh = st.Mesh(np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 1.0]]), np.array([[0, 1, 2]]))
    directions = np.array([[True, True], [False, True], [True, True]])
    stiffness = np.where((mesh.edges == [0, 1]).all(axis=1), 1.0, 0.0)
    return Motion(Network(mesh, directions, stiffness), np.ones(3), linear=True, **options)


# -- masses and dampers ------------------------------------------------------------------------------------------------


def centre(mesh, masses):
    """Centre of mass [m]."""
    return masses @ mesh.points / masses.sum()


@pytest.mark.parametrize("mesh_type", st.MESH_TYPES)
def test_masses_have_the_total_and_the_centre_of_the_beam(mesh_type):
    mesh = st.MESH_TYPES[mesh_type](0.1, 0.02, 4e-3)
    found = masses(mesh, DENSITY, THICKNESS)
    assert found.sum() == pytest.approx(DENSITY * 0.1 * 0.02 * THICKNESS, rel=1e-9)
    assert centre(mesh, found) == pytest.approx([0.05, 0.01], rel=1e-9)


def test_a_quarter_of_a_trapezoid_to_each_corner_moves_its_centre():
    """The paper's "same inertia centre" holds for parallelograms only: bases 4 and 1, height 1."""
    mesh = st.Mesh(np.array([[0, 0], [4, 0], [1, 1], [0, 1]], dtype=float), np.zeros((0, 3), dtype=int),
                np.array([[0, 1, 2, 3]]))  # fmt: skip
    assert centre(mesh, masses(mesh, 1.0, 1.0)) == pytest.approx([1.25, 0.5])
    halves = st.Mesh(mesh.points, np.array([[0, 1, 2], [0, 2, 3]]))
    assert centre(halves, masses(halves, 1.0, 1.0)) == pytest.approx([1.4, 0.4])


# -- frequencies and steps ---------------------------------------------------------------------------------------------


def test_infinite_equilateral_lattice_has_a_highest_frequency_of_6_k_over_m():
    """A torus of 12 x 12 cells has the wave that is highest (formulas.md, Bloch scan)."""
    n = 12
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    steps = ((1, 0, 1.0, 0.0), (0, 1, 0.5, np.sqrt(0.75)), (-1, 1, -0.5, np.sqrt(0.75)))
    edges, vectors = [], []
    for di, dj, x, y in steps:
        edges.append(np.stack([i * n + j, (i + di) % n * n + (j + dj) % n], axis=1))
        vectors.append(np.tile([x, y], (n * n, 1)))
    edges = np.concatenate(edges)
    mesh = SimpleNamespace(points=np.zeros((n * n, 2)), edges=edges, edge_lengths=np.ones(len(edges)))
    network = Network(mesh, np.zeros((n * n, 2), dtype=bool), np.ones(len(edges)))
    network.rest_vectors = np.concatenate(vectors)
    motion = Motion(network, np.full(n * n, 1 / 7.0))
    assert motion.omega_max**2 == pytest.approx(6 * 7.0, rel=1e-6)
    assert motion.particle_bound**2 == pytest.approx(2 * 6 * 7.0)


@pytest.mark.parametrize("definition", ["uniform", "lattice", "area", "delingette"])
@pytest.mark.parametrize("mesh_type", ["structured", "free"])
def test_the_bound_by_particles_is_above_the_highest_frequency(definition, mesh_type):
    motion = beam(definition, mesh_type=mesh_type)
    dense = motion.stiffness_matrix.toarray() / np.sqrt(np.outer(motion.mass, motion.mass))
    assert motion.omega_max**2 == pytest.approx(np.linalg.eigvalsh(dense)[-1], rel=1e-8)
    assert motion.omega_max <= motion.particle_bound <= 2 * motion.omega_max


@pytest.mark.parametrize("xi, expected", [(0.05, 0.951), (0.2, 0.820), (0.3, 0.744), (1.0, 0.414)])
def test_limit_of_one_mode_with_lagged_damping(xi, expected):
    """Numbers of formulas.md; and dampers along springs, by the general way, agree with the formula."""
    lagged = oscillator(mass_damping=2 * xi).step_limit("central-difference-lagged")
    assert lagged / 2 == pytest.approx(expected, abs=5e-4)
    assert oscillator(mass_damping=2 * xi).step_limit("central-difference") == pytest.approx(2.0)
    dampers = 2 * xi * oscillator().network.stiffness
    assert oscillator(dampers=dampers).step_limit("central-difference") == pytest.approx(lagged, rel=1e-9)


DAMPINGS = {
    "none": lambda motion: {},
    "energies": lambda motion: {},
    "mass": lambda motion: {"mass_damping": 0.6 * motion.omega_max},
    "springs": lambda motion: {"dampers": 0.3 / motion.omega_max * motion.network.stiffness},
    "uneven": lambda motion: {
        "mass_damping": 0.1 * motion.omega_max,
        "dampers": 0.5 / motion.omega_max * np.random.default_rng(1).uniform(0, 1, len(motion.network.first)),
    },
}


@pytest.mark.parametrize("linear", [True, False])
@pytest.mark.parametrize("damping", DAMPINGS)
@pytest.mark.parametrize("integrator", EXPLICIT)
def test_limit_of_the_step_is_within_one_percent(integrator, damping, linear):
    """Below it 4,000 steps from noise stay bounded; above it they diverge."""
    motion = beam("delingette" if damping == "energies" else "lattice", force=0.0, size=0.01, linear=linear)
    motion = with_(motion, **DAMPINGS[damping](motion))
    noise = 1e-7 * np.random.default_rng(0).standard_normal(motion.load.shape) * ~motion.network.held
    limit = motion.step_limit(integrator)
    stable = motion.run(integrator, 0.99 * limit, 4_000, noise)
    assert stable.status == "moving" and np.abs(stable.displacements).max() <= 20 * np.abs(noise).max()
    growing = motion.run(integrator, 1.01 * limit, 4_000, noise)
    grown = growing.status != "moving" or np.abs(growing.displacements).max() > 1e3 * np.abs(noise).max()
    assert grown
    if linear:
        assert growing.status == "diverged" and "take at most" in growing.message


def test_limit_of_the_step_under_uneven_dampers_is_exact():
    """At the limit h the largest eigenvalue of 2 h C + h^2 K, over M, is 4."""
    motion = beam(force=0.0, size=0.01)
    motion = with_(motion, **DAMPINGS["uneven"](motion))
    step, root = motion.step_limit("central-difference"), 1 / np.sqrt(motion.mass)
    whole = (2 * step * motion.damper_matrix + step**2 * motion.stiffness_matrix).toarray()
    assert np.linalg.eigvalsh(whole * np.outer(root, root))[-1] == pytest.approx(4, rel=1e-9)


def test_lowest_loaded_mode_is_the_bars():
    """Omega = pi c / (2 L) of a clamped bar, c = sqrt(E / rho); its bending modes are lower and not loaded."""
    motion = beam(size=2e-3)
    expected = np.pi * np.sqrt(210e9 / DENSITY) / (2 * 0.1)
    assert motion.loaded_frequency == pytest.approx(expected, rel=0.02)
    dense = motion.stiffness_matrix.toarray() / np.sqrt(np.outer(motion.mass, motion.mass))
    lowest = np.sqrt(np.linalg.eigvalsh(dense)[0])
    assert lowest < 0.5 * motion.loaded_frequency


# -- runs --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("linear", [True, False])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_static_limit_is_the_static_solution(integrator, linear):
    motion = damped(beam(size=0.01, linear=linear))
    problem = StaticProblem(motion.network, weights(motion.network.mesh, AXIAL))
    s = motion.load.sum()
    static = (problem.linear(s) if linear else problem.nonlinear(s)).displacements
    step = 0.8 * motion.step_limit("symplectic-euler") if integrator in EXPLICIT else 1 / motion.loaded_frequency
    found = motion.run(integrator, step, 100_000, rest=1e-9)
    assert found.status == "rest" and not found.message
    assert np.abs(found.displacements - static).max() <= 1e-6 * np.abs(static).max()


@pytest.mark.parametrize("definition", ["lattice", "delingette"])
@pytest.mark.parametrize("linear", [True, False])
def test_dynamic_relaxation_ends_in_the_static_solution(definition, linear):
    motion = beam(definition)
    problem = StaticProblem(motion.network, weights(motion.network.mesh, AXIAL))
    s = motion.load.sum()
    static = (problem.linear(s) if linear else problem.nonlinear(s)).displacements
    found = relax(motion.network, motion.load, linear=linear)
    assert found.status == "rest" and found.residual <= 1e-10  # exact: the criterion itself
    assert np.abs(found.displacements - static).max() <= 1e-6 * np.abs(static).max()


DAMPED = {
    "mass": lambda ratio, low, high: (2 * ratio * low, 0.0),
    "springs": lambda ratio, low, high: (0.0, 2 * ratio / low),
    "both": lambda ratio, low, high: (2 * ratio * low * high / (low + high), 2 * ratio / (low + high)),
}
"""Damping over mass and over stiffness that gives the lower of two modes a ratio."""


def modes(motion):
    """Angular frequencies [rad/s], ascending, and shapes of unit inertia, in columns."""
    root = 1 / np.sqrt(motion.mass)
    squares, shapes = np.linalg.eigh(motion.stiffness_matrix.toarray() * np.outer(root, root))
    return np.sqrt(squares), shapes * root[:, None]


@pytest.mark.parametrize("linear", [True, False])
@pytest.mark.parametrize("damping, number", [("mass", 0), ("springs", 0), ("both", 3)])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_free_decay_of_a_mode(integrator, damping, number, linear):
    """A mode let go at a damping ratio of 0.2, after one period 2 pi / (omega sqrt(1 - xi^2)).

    It is then smaller by the logarithmic decrement 2 pi xi / sqrt(1 - xi^2), and stands still; both are missed by no
    more than the scheme's order allows. Dampers along springs lag in all explicit schemes: these are then first order.
    """
    xi = 0.2
    motion = beam(size=0.01, length=0.04, force=0.0, linear=linear)
    omegas, shapes = modes(motion)
    alpha, beta = DAMPED[damping](xi, omegas[0], omegas[3])
    motion = with_(motion, load=None, mass_damping=alpha, dampers=beta * motion.network.stiffness if beta else None)
    omega, shape = omegas[number], shapes[:, number]
    start = motion.network.expand(1e-7 * shape / np.abs(shape).max())
    period = 2 * np.pi / (omega * np.sqrt(1 - xi**2))

    def missed(steps):
        found = motion.run(integrator, period / steps, steps, start)
        fields = start, found.displacements, found.velocities
        before, after, speed = ((motion.mass * shape) @ motion.network.reduce(field) for field in fields)
        decrement = np.log(before / after) - 2 * np.pi * xi / np.sqrt(1 - xi**2)
        return np.abs([decrement, speed / (omega * after)])

    # Explicit steps are short enough for the highest mode, which dampers along springs narrow most.
    coarse = 2048 if integrator in EXPLICIT else 128
    errors = np.array([missed(coarse), missed(2 * coarse)])
    second = integrator == "implicit-midpoint" or (integrator, damping) == ("central-difference", "mass")
    order = 2 if second else 1
    assert np.log2(errors[0] / errors[1]) == pytest.approx([order, order], abs=0.1)
    assert (errors[1] <= {1: 30, 2: 60}[order] / (2 * coarse) ** order).all()


@cache
def spinning():
    """A body with dampers along its springs, its velocities, and where it is when it has turned by a radian."""
    mesh = lattice(3, 2)
    network = Network(mesh, np.zeros(mesh.points.shape, dtype=bool), uniform(mesh))
    motion = Motion(network, np.ones(len(mesh.points)), dampers=2.0 * uniform(mesh))
    radius = mesh.points - mesh.points.mean(axis=0)
    velocities = 0.05 * radius[:, ::-1] * [-1, 1]
    return motion, velocities, motion.run("implicit-midpoint", 20 / 2048, 2048, velocities=velocities).displacements


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_dampers_turn_with_their_springs(integrator):
    """A body that spins is not slowed by dampers along its springs; schemes agree to their order."""
    motion, velocities, exact = spinning()
    errors = []
    for steps in (200, 400):
        found = motion.run(integrator, 20 / steps, steps, velocities=velocities)
        errors.append(np.abs(found.displacements - exact).max())
    order = 2 if integrator == "implicit-midpoint" else 1
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.1)
    assert errors[1] <= 0.05 * np.abs(exact).max()


@pytest.mark.parametrize("integrator", ["symplectic-euler", "central-difference", "implicit-midpoint"])
def test_symplectic_schemes_conserve_energy(integrator):
    """Half the limit, 1e5 explicit steps: the mean energy of the last tenth is that of the first to 1e-3."""
    motion = beam(size=0.01)
    start = StaticProblem(motion.network, weights(motion.network.mesh, AXIAL)).nonlinear(motion.load.sum())
    free = with_(motion, load=None)
    step = 0.5 * free.step_limit("central-difference")
    steps = 100_000 if integrator in EXPLICIT else 3_000
    found = free.run(integrator, step, steps, start.displacements, sample=10)
    energy = found.samples[:, 1]
    tenth = len(energy) // 10
    assert abs(energy[-tenth:].mean() / energy[:tenth].mean() - 1) <= 1e-3
    # Nor does it wander: all of it stays in a band that narrows with the step.
    most = {"symplectic-euler": 0.5, "central-difference": 0.05, "implicit-midpoint": 0.02}[integrator]
    assert np.ptp(energy) <= most * energy.mean()


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_free_body_keeps_its_momentum(integrator):
    mesh = lattice(6, 4)
    network = Network(mesh, np.zeros(mesh.points.shape, dtype=bool), uniform(mesh))
    motion = Motion(network, np.ones(len(mesh.points)), dampers=0.1 * uniform(mesh))
    random = np.random.default_rng(3)
    velocities = 0.01 * random.standard_normal(mesh.points.shape)
    found = motion.run(integrator, 0.3, 400, velocities=velocities, sample=50)
    momentum = found.samples[:, 2:]
    # Newton's method of the midpoint rule ends at 1e-12 of the forces.
    assert np.abs(momentum - momentum[0]).max() <= 1e-9


def test_time_to_rest_is_shortest_near_critical_damping():
    motion = beam(linear=True)
    omega = motion.loaded_frequency
    step = 0.9 * motion.step_limit("central-difference")
    steps = {
        ratio: with_(motion, mass_damping=2 * ratio * omega).run("central-difference", step, 40_000, rest=1e-3).steps
        for ratio in (0.25, 0.5, 1.0, 2.0, 4.0)
    }
    assert min(steps, key=steps.get) == 1.0


def test_truncated_conjugate_gradients_stop_short_and_say_so():
    """Few iterations a step: after the steps in which the direct solver is at rest, they are not."""
    motion = beam(size=1e-3, linear=True)
    step = 0.01
    direct = motion.run("backward-euler", step, 60, rest=1e-6)
    cut = motion.run(BackwardEuler(iterations=10), step, 60, rest=1e-6)
    assert direct.status == "rest"
    assert cut.status == "moving" and "not at rest" in cut.message and cut.residual > 1e-3


def chain(count, **options):
    """Particles on a line between two held ones, on springs of 1 and with masses of 1: the strip beside it is held."""
    x = np.arange(count + 1.0)
    points = np.concatenate([np.stack([x, 0 * x], 1), np.stack([x, 0 * x + 1], 1)])
    i = np.arange(count)
    cells = np.concatenate([np.stack([i, i + 1, i + count + 2], 1), np.stack([i, i + count + 2, i + count + 1], 1)])
    directions = np.ones(points.shape, dtype=bool)
    directions[1:count, 0] = False
    mesh = st.Mesh(points, cells)
    stiffness = (mesh.edges[:, 1] == mesh.edges[:, 0] + 1) & (mesh.edges[:, 1] <= count)
    return Motion(Network(mesh, directions, stiffness.astype(float)), np.ones(len(points)), **options)


@pytest.mark.parametrize("linear", [True, False])
@pytest.mark.parametrize(("precision", "error"), [("float64", 1e-9), ("float32", 1e-4)])
def test_a_standing_wave_on_a_chain_has_its_closed_form(linear, precision, error):
    """Central differences swing as ``cos(m theta)``, ``sin(theta / 2) = h omega / 2``, to rounding.

    Springs are of small strain, 1e-7, whose squares are within the error, and of which single precision loses no digit
    since displacements, not positions, are kept.
    """
    count, mode, step, steps = 60, 3, 0.5, 2000
    shape = np.zeros((2 * (count + 1), 2))
    shape[: count + 1, 0] = 1e-7 * np.sin(np.pi * mode * np.arange(count + 1) / count)
    omega = 2 * np.sin(np.pi * mode / (2 * count))
    swing = np.cos(2 * steps * np.arcsin(0.5 * step * omega))
    found = chain(count, linear=linear).run("central-difference", step, steps, shape, precision=precision)
    # The longitudinal waves of springs that keep their length law are linear: the line stays one.
    assert np.abs(found.displacements - swing * shape).max() <= error * 1e-7


threaded = cache(partial(beam, mesh_type="free", size=6e-4))
"""A beam whose springs are enough for three threads."""


@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize("damped", [False, True])
@pytest.mark.parametrize("linear", [False, True])
def test_the_numbers_are_the_same_for_any_number_of_threads(linear, damped, precision):
    motion = with_(threaded(), linear=linear, mass_damping=20.0)
    step = 1 / motion.particle_bound
    assert len(motion.network.mesh.edges) >= 3 * stepping.LEAST_ENTRIES_A_THREAD
    if damped:
        motion = with_(motion, dampers=0.05 * step * motion.network.stiffness)
    run = partial(motion.run, "central-difference", step, 101, sample=33, precision=precision)
    runs = [run(threads=count) for count in (1, 2, 3)]
    for run in runs[1:]:
        assert (run.displacements == runs[0].displacements).all() and (run.velocities == runs[0].velocities).all()
        assert (run.samples == runs[0].samples).all()
    assert np.abs(runs[0].displacements).max() > 0


@pytest.mark.parametrize("damped", [False, True])
@pytest.mark.parametrize("linear", [False, True])
def test_steps_that_follow_each_other_along_a_network_are_those_of_the_whole(linear, damped):
    """Blocks that are some steps ahead of others take the steps that one pass over all particles a step takes."""
    motion = beam(mesh_type="alternating", size=7e-4, linear=linear, mass_damping=20.0)
    step, steps, network = 1 / motion.particle_bound, 45, motion.network
    if damped:
        motion = with_(motion, dampers=0.05 * step * network.stiffness)
    inverse = np.where(network.held, 0.0, 1 / motion.inertia)
    u, v = np.zeros((2, *motion.load.shape))
    for _ in range(steps):
        force = motion.missing(u)
        if damped:
            force = force - motion.damper_tangent(u) @ network.reduce(v)
        v = v + step * (inverse * network.expand(force) - motion.mass_damping * v)
        u = u + step * v
    found = motion.run("symplectic-euler", step, steps)
    # Rounding alone: sums of a dozen forces, taken in another order at each of the steps.
    assert np.abs(found.displacements - u).max() <= 1e-9 * np.abs(u).max()
    assert np.abs(found.velocities - v).max() <= 1e-9 * np.abs(v).max()


@pytest.mark.parametrize("broken", [0, 1])
def test_a_thread_that_fails_ends_the_others(broken):
    motion = beam(size=7e-4)
    assert len(motion.network.mesh.edges) >= 2 * stepping.LEAST_ENTRIES_A_THREAD
    stepper = stepping.make_stepper(motion, "central-difference", 1e-9, threads=2)
    stepper.begin(np.zeros(motion.load.shape), np.zeros(motion.load.shape))
    taken = stepper.function

    def function(thread, *arguments):
        if thread == broken:
            raise MemoryError("no room")
        taken(thread, *arguments)

    stepper.function = function
    with pytest.raises(MemoryError, match="no room"):
        stepper.advance(10)
    stepper.close()


def test_an_explicit_run_to_rest_factorizes_once():
    motion = beam(network_type=CountedNetwork)
    for integrator in EXPLICIT:
        assert motion.run(integrator, 0.9 * motion.step_limit(integrator), 200).status == "moving"
    assert motion.network.taken == 0
    assert relax(motion.network, motion.load).status == "rest"
    assert motion.network.taken == 1
    found = damped(motion)
    before = motion.network.taken
    step = 0.8 * motion.step_limit("central-difference")
    assert found.run("central-difference", step, 100_000, rest=1e-6).status == "rest"
    assert found.network is motion.network and motion.network.taken == before + 1


# -- where a run comes to rest -----------------------------------------------------------------------------------------


def column(share, sideways=0.0, linear=False):
    """A column of squares with both diagonals, so alike on both sides that it stays straight; its buckling load.

    Pressed by a share of that load, and pushed sideways by a share of the pressing force.
    """
    mesh = st.MESH_TYPES["braced"](0.1, 0.01, 5e-3)
    springs = st.DEFINITIONS["lattice"].springs(mesh, STEEL, THICKNESS)
    network = Network(mesh, held_directions(mesh, AXIAL), springs.relative)
    euler = np.pi**2 * STEEL.young_modulus * THICKNESS * 0.01**3 / 12 / (4 * 0.1**2)
    along, across = weights(mesh, AXIAL), weights(mesh, BENDING)
    critical = buckling(StaticProblem(network, along), -euler / springs.reference)[0]
    load = share * critical * (along + sideways * across)
    return Motion(network, masses(mesh, DENSITY, THICKNESS) / springs.reference, load, linear=linear)


def to_rest(motion, way):
    """Brought to rest by relaxation or an integrator."""
    if way == "relax":
        return relax(motion.network, motion.load, linear=motion.linear)
    motion = damped(motion)
    step = 0.8 * motion.step_limit("symplectic-euler") if way in EXPLICIT else 0.1 / motion.loaded_frequency
    return motion.run(way, step, 20_000, rest=1e-4)


@pytest.mark.parametrize("way", ["relax", *INTEGRATORS])
@pytest.mark.parametrize("share, linear", [(0.99, False), (1.01, False), (2.0, False), (2.0, True)])
def test_rest_on_an_unstable_equilibrium_is_told(share, linear, way):
    """Above its buckling load a straight column is in balance; nothing but noise would move it. Linear ones stay."""
    found = to_rest(column(share, linear=linear), way)
    assert np.abs(found.displacements[:, 1]).max() < 1e-4  # straight but for Poisson's effect
    if share < 1 or linear:
        assert (found.status, found.message) == ("rest", "")
    else:
        assert found.status == "unstable"
        assert "1 negative pivot" in found.message and "sideways" in found.message


def test_large_steps_of_backward_euler_stay_on_an_unstable_equilibrium():
    """A mode that grows as exp(r t) grows in steps h below 2 / r only: its factor is 1 / (1 - r h)."""
    motion = column(1.3, sideways=1e-3)
    found = motion.run("backward-euler", 1e-2, 1000, rest=1e-6)
    assert found.status == "unstable" and "smaller steps" in found.message


@pytest.mark.parametrize("way", ["relax", "backward-euler"])
def test_a_column_pushed_sideways_rests_bent(way):
    """The remedy of the message: it then finds the bent equilibrium, which is stable."""
    motion = column(1.3, sideways=1e-3)
    if way == "relax":
        found = relax(motion.network, motion.load)
    else:
        found = motion.run(way, 1e-4, 20_000, rest=1e-6)
    assert (found.status, found.message) == ("rest", "")
    assert np.abs(found.displacements[:, 1]).max() > 0.02
    assert motion.network.factorize_tangent(found.displacements).negative_pivots == 0


def test_rest_on_a_singular_tangent_is_unstable():
    """Two springs in a line: nothing holds the particle between them sideways, as at a limit point."""
    mesh = st.Mesh(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 1.0]]), np.array([[0, 1, 3], [1, 2, 3]]))
    directions = np.ones((4, 2), dtype=bool)
    directions[1] = False
    level = (mesh.points[mesh.edges][:, :, 1] == 0).all(axis=1)
    motion = Motion(Network(mesh, directions, 1.0 * level), np.ones(4), mass_damping=1.0)
    found = motion.run("central-difference", 0.5, 100, rest=1e-6)
    assert found.status == "unstable" and "singular" in found.message


def test_a_body_that_floats_is_not_judged():
    """Its rigid motions cost nothing: pivots are zero but for rounding, and say nothing."""
    mesh = lattice(6, 4)
    network = Network(mesh, np.zeros(mesh.points.shape, dtype=bool), uniform(mesh))
    pull = np.zeros(mesh.points.shape)
    for particles, sign in zip(ends(mesh), (-1, 1)):
        pull[particles, 0] = sign * 1e-3 / len(particles)
    pull -= pull.mean(axis=0)
    motion = Motion(network, np.ones(len(mesh.points)), pull, mass_damping=0.5)
    found = motion.run("central-difference", 0.3, 20_000, rest=1e-6)
    assert found.status == "rest" and "free to move as a whole" in found.message


@pytest.mark.parametrize("rest, status", [(0.49, "moving"), (0.51, "rest")])
def test_neither_balance_nor_a_turning_point_is_rest_if_much_energy_is_left(rest, status):
    """One particle let go: at a residual r its energy (1 - r^2) f^2 / 2k is at most r^2 f u from r = 1/2 on."""
    motion = oscillator(load=np.array([[0.0, 0.0], [0.1, 0.0], [0.0, 0.0]]))
    assert motion.run("central-difference", 1e-4, 70_000, rest=rest).status == status


def test_a_run_through_inverted_triangles_is_reported():
    """Pushed far beyond what springs carry, they pass through each other and come to rest: no answer."""
    motion = damped(beam(force=-2e6, size=0.01))
    found = motion.run("central-difference", 0.3 * motion.step_limit("central-difference"), 20_000, rest=1e-6)
    assert found.status in ("inverted", "diverged") and found.message

"""Springs, areas, angles and squared lengths: exact forces and tangents, and what they stand for."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy.sparse import csc_array

import springtune as st
from springtune.linalg.factors import SingularError, SuperLUFactor
from springtune.mechanics import energies
from springtune.mechanics.network import FollowerPressure, Network
from springtune.mechanics.newton import MOST_MODES
from springtune.mechanics.statics import FAR_STRETCH
from springtune.problem.boundary import measured_weights
from springtune.problem.loads import FACE
from springtune.reference.small_strain import solve_small_strain
from springtune.scene.mesh_cache import MeshCache

from problems import beam_problem, free_network

RATIOS = {"neo-Hooke": 0.3, "neo-Hooke, nearly incompressible": 0.4999}
TYPES = ["structured", "free"]
USUAL = "area of triangles, area of quads, angles, angles of corners, tensile, coupled, Yeoh, stable neo-Hooke"
KINDS = (*USUAL.split(", "), *RATIOS)


def energy_of(kind, seed):
    """An energy of random moduli on a small mesh, which is returned, too."""
    generator = np.random.default_rng(seed)
    mesh = st.MESH_TYPES["braced" if "quads" in kind else "free"](0.02, 0.01, 5e-3)
    corners = mesh.quads if "quads" in kind else mesh.triangles
    modulus = generator.uniform(-0.5, 1.0, len(corners))
    if kind == "Yeoh":
        coefficients = generator.uniform([0.1, -0.01, 0.0], [1, 0.05, 0.01], (len(corners), 3))
        return mesh, energies.YeohEnergy(mesh.points, corners, coefficients)
    if kind == "stable neo-Hooke":
        return mesh, energies.StableNeoHookeEnergy(mesh.points, corners, 1.0 + modulus, 0.5 + modulus**2)
    if kind in RATIOS:
        shear, nu = 1.0 + modulus, RATIOS[kind]
        return mesh, energies.NeoHookeEnergy(mesh.points, corners, shear, shear * 2 * (1 + nu) / (3 * (1 - 2 * nu)))
    if "area" in kind:
        return mesh, energies.AreaEnergy(mesh.points, corners, modulus)
    if "angles" in kind:
        shape = (len(corners), 3) if "corners" in kind else len(corners)
        return mesh, energies.AngleEnergy(mesh.points, corners, 25e-6 * generator.uniform(-0.5, 1.0, shape))
    tensile, coupling = 1e6 * generator.uniform(-0.5, 1.0, (2, len(corners), 3))
    return mesh, energies.BiquadraticEnergy(mesh.points, corners, tensile, coupling if kind == "coupled" else None)


def scattered(mesh, seed, amplitude):
    return amplitude * np.random.default_rng(seed).standard_normal(mesh.points.shape)


def assembled(mesh, corners, forces):
    total = np.zeros(mesh.points.shape)
    np.add.at(total, corners, forces)
    return total


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=15)
@given(seed=some.integers(0, 2**31), amplitude=some.floats(1e-6, 4e-4))
def test_forces_are_the_derivative_of_the_energy_and_the_tangent_theirs(kind, seed, amplitude):
    mesh, energy = energy_of(kind, seed)
    here, direction = scattered(mesh, seed + 1, amplitude), scattered(mesh, seed + 2, 1.0)
    # A step of 1/5000 of an edge: the central difference leaves its square, 4e-8 of the third derivative, which many
    # cells may add up to.
    step = 1e-6
    difference = (energy.value(here + step * direction) - energy.value(here - step * direction)) / (2 * step)
    forces = assembled(mesh, energy.corners, energy.forces(here))
    scale = np.abs(energy.tangent(here)).max() * 5e-3  # forces of a displacement of an edge
    assert abs(difference - (forces * direction).sum()) <= 1e-5 * scale * np.linalg.norm(direction)
    step = 1e-7
    difference = (energy.forces(here + step * direction) - energy.forces(here - step * direction)) / (2 * step)
    moved = direction[energy.corners].reshape(len(energy.corners), -1)
    exact = np.einsum("nij,nj->ni", energy.tangent(here), moved).reshape(difference.shape)
    # step / edge = 2e-5, squared, and rounding of 1e-16 over it.
    assert np.abs(difference - exact).max() <= 1e-6 * np.abs(energy.tangent(here)).max() * np.abs(direction).max()


@pytest.mark.parametrize("kind", KINDS)
def test_tangent_is_symmetric_and_that_at_rest_is_the_limit(kind):
    mesh, energy = energy_of(kind, 3)
    tangent = energy.tangent(scattered(mesh, 4, 3e-4))
    assert np.abs(tangent - tangent.transpose(0, 2, 1)).max() <= 1e-9 * np.abs(tangent).max()
    rest = energy.tangent()
    assert np.abs(energy.tangent(scattered(mesh, 4, 1e-12)) - rest).max() <= 1e-8 * np.abs(rest).max()


@pytest.mark.parametrize("kind", KINDS)
@given(angle=some.floats(-3.1, 3.1), shift=some.floats(-1, 1))
@settings(max_examples=15)
def test_rigid_motion_costs_nothing(kind, angle, shift):
    mesh, energy = energy_of(kind, 5)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    moved = mesh.points @ turn.T + shift - mesh.points
    # Coordinates of size 1 are rounded to 1e-16, edges are 5 mm: strains of 1e-13 are left.
    assert np.abs(energy.forces(moved)).max() <= 1e-9 * np.abs(energy.tangent()).max() * 5e-3


@pytest.mark.parametrize("kind", KINDS)
def test_small_strain_keeps_its_digits(kind):
    mesh, energy = energy_of(kind, 6)
    direction = scattered(mesh, 7, 1.0)
    linear = np.einsum("nij,nj->ni", energy.tangent(), direction[energy.corners].reshape(len(energy.corners), -1))
    forces = energy.forces(1e-15 * direction).reshape(linear.shape) / 1e-15
    # A displacement of 1e-15 m over edges of 5 mm: the law is linear to 1e-12.
    assert np.abs(forces - linear).max() <= 1e-9 * np.abs(linear).max()


@pytest.mark.parametrize("kind", KINDS)
def test_a_common_motion_costs_no_digits(kind):
    """Strains of 1e-9, moved by 1 m as a whole: changes are taken from differences of displacements."""
    mesh, energy = energy_of(kind, 8)
    # Multiples of 2^-50 m: one added to them is exact.
    moved = np.round(scattered(mesh, 9, 5e-12) * 2**50) / 2**50
    forces = energy.forces(moved)
    # Positions, which directions are taken from, are rounded to 1e-16 m, over 5 mm.
    assert np.abs(energy.forces(moved + 1.0) - forces).max() <= 1e-9 * np.abs(forces).max()


@pytest.mark.parametrize("kind", KINDS)
def test_a_place_far_from_the_origin_costs_no_digits(kind):
    """A kilometre away: areas and sides at rest are taken from differences of positions, too."""
    mesh, energy = energy_of(kind, 8)
    # Multiples of 2^-40 m: 1,024 m added to them are exact.
    points = np.round(mesh.points * 2**40) / 2**40
    moved = np.round(scattered(mesh, 9, 1e-5) * 2**40) / 2**40
    here, away = (replace(energy, points=points + offset).forces(moved) for offset in (0.0, 1024.0))
    assert np.abs(away - here).max() <= 1e-9 * np.abs(here).max()


@pytest.mark.parametrize("kind", KINDS)
def test_a_network_computed_some_cells_at_a_time_is_the_same(kind, monkeypatch):
    mesh, energy = energy_of(kind, 6)
    here, held = scattered(mesh, 7, 1e-4), np.zeros(mesh.points.shape, dtype=bool)
    held[:3], held[5, 1] = True, True

    def computed():
        network = Network(mesh, held, np.ones(len(mesh.edges)), [replace(energy)])
        sums = np.asarray(abs(network.tangent()).sum(axis=1)).ravel()
        assert network.reduce(network.local_stiffness) == pytest.approx(sums, rel=1e-9)
        return network.forces_over_k(here), network.tangent(here).data

    at_once = computed()
    monkeypatch.setattr(energies, "CELLS_AT_ONCE", 3)
    for one, other in zip(at_once, computed()):
        assert np.abs(one - other).max() <= 1e-9 * np.abs(one).max()


def test_one_modulus_a_triangle_is_that_modulus_at_each_corner():
    mesh, energy = energy_of("angles", 2)
    same = replace(energy, modulus=np.repeat(energy.modulus[:, None], 3, axis=1))
    here = scattered(mesh, 3, 3e-4)
    assert same.value(here) == pytest.approx(energy.value(here), rel=1e-9)
    for part in ("forces", "tangent"):
        mine, theirs = (getattr(one, part)(here) for one in (same, energy))
        assert np.abs(mine - theirs).max() <= 1e-9 * np.abs(theirs).max()


ENERGIES = {
    energies.AreaEnergy: {"modulus": (16,)},
    energies.AngleEnergy: {"modulus": (16,)},
    energies.BiquadraticEnergy: {"tensile": (16, 3), "coupling": (16, 3)},
    energies.YeohEnergy: {"coefficients": (16, 2), "largest": (16,)},
    energies.NeoHookeEnergy: {"shear": (16,), "bulk": (16,)},
    energies.StableNeoHookeEnergy: {"shear": (16,), "first": (16,)},
}


@pytest.mark.parametrize(("kind", "shapes"), ENERGIES.items(), ids=lambda one: getattr(one, "__name__", ""))
def test_keys_tell_energies_apart_by_their_cells_and_by_each_modulus(kind, shapes):
    """What a network is recognised by: of two with one key the tangent at rest is factorized once."""
    points = np.random.default_rng(0).uniform(size=(18, 2))
    corners = np.arange(16)[:, None] + [0, 1, 2]
    moduli = {name: np.ones(shape) for name, shape in shapes.items()}
    known = kind(points, corners, **moduli).key
    assert kind(points, corners.copy(), **{name: one.copy() for name, one in moduli.items()}).key == known
    others = [kind(points, corners[:, ::-1], **moduli)]
    for name, one in moduli.items():
        changed = one.copy()
        changed.flat[-1] = 2.0
        others.append(kind(points, corners, **moduli | {name: changed}))
    if kind is energies.BiquadraticEnergy:
        others.append(kind(points, corners, moduli["tensile"]))
        others.append(kind(points, corners, 2 * moduli["tensile"]))
    assert len({known, *(one.key for one in others)}) == 1 + len(others)


WITH_ENERGIES = "area angular delingette neo-hooke patch-area flechon normal-shear ielsm many-body".split()


@pytest.mark.parametrize("name", WITH_ENERGIES)
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_free_networks_have_three_rigid_motions_and_no_other(name, nu):
    definition = st.DEFINITIONS[name]
    mesh = st.MESH_TYPES["free" if 3 in definition.cells else "braced"](0.03, 0.01, 2.5e-3)
    springs = definition.springs(mesh, st.Material(1.0, nu, name="unit"), 1.0)
    network = free_network(mesh, springs)
    eigenvalues = np.linalg.eigvalsh(network.tangent().toarray())
    assert np.abs(eigenvalues[:3]).max() <= 1e-9 * eigenvalues[-1]
    assert eigenvalues[3] >= 1e-5 * eigenvalues[-1]


def bent(problem, seed, amplitude):
    """Displacements of the size of a tenth of an edge, held particles at rest."""
    generator = np.random.default_rng(seed)
    displacements = amplitude * generator.standard_normal(problem.network.held.shape)
    return np.where(problem.network.held, 0.0, displacements)


@settings(max_examples=20)
@given(
    seed=some.integers(0, 2**31), amplitude=some.floats(1e-6, 5e-4), mesh_type=some.sampled_from(["structured", "free"])
)
def test_tangent_is_the_derivative_of_the_resistance(seed, amplitude, mesh_type):
    problem, _ = beam_problem(mesh_type)
    network = problem.network
    here = bent(problem, seed, amplitude)
    direction = network.reduce(bent(problem, seed + 1, 1.0))
    step = 1e-6 * amplitude
    moved = step * network.expand(direction)
    difference = (network.free_forces_over_k(here + moved) - network.free_forces_over_k(here - moved)) / (2 * step)
    exact = network.tangent(here) @ direction
    # Central differences leave step^2 (here 1e-12 of the bend) and rounding of forces over the step.
    assert np.linalg.norm(difference - exact) <= 1e-7 * np.linalg.norm(exact)


@settings(max_examples=20)
@given(seed=some.integers(0, 2**31), amplitude=some.floats(1e-5, 5e-4))
def test_resistance_is_the_derivative_of_the_energy(seed, amplitude):
    problem, _ = beam_problem("free")
    network = problem.network
    here, direction = bent(problem, seed, amplitude), bent(problem, seed + 1, amplitude)
    step = 1e-4
    difference = network.energy_over_k(here + step * direction) - network.energy_over_k(here - step * direction)
    work = network.free_forces_over_k(here) @ network.reduce(direction)
    scale = np.linalg.norm(network.free_forces_over_k(here)) * np.linalg.norm(direction)
    assert abs(difference / (2 * step) - work) <= 1e-6 * scale


@given(angle=some.floats(-3.1, 3.1), shift=some.tuples(some.floats(-1, 1), some.floats(-1, 1)))
@settings(max_examples=30)
def test_rigid_motion_meets_no_resistance(angle, shift):
    problem, _ = beam_problem()
    points = problem.network.mesh.points
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    displacements = points @ turn.T + np.array(shift) - points
    # Coordinates of size 1 are rounded to 1e-16, over springs of 5 mm.
    assert np.abs(problem.network.free_forces_over_k(displacements)).max() <= 1e-9 * 5e-3
    assert problem.network.energy_over_k(displacements) <= (1e-9 * 5e-3) ** 2


def test_pivots_beside_the_diagonal_are_not_counted():
    """Eigenvalues 1 and -1, no pivot on the diagonal: both signs of the factor are positive, and say nothing."""
    matrix = csc_array(np.array([[0.0, 1.0], [1.0, 0.0]]))
    factor = SuperLUFactor(matrix, np.arange(2))
    assert factor.solve(np.array([1.0, 2.0])).tolist() == [2.0, 1.0]
    with pytest.raises(SingularError, match="zero pivot"):
        factor.negative_pivots  # noqa: B018


BLOCK = st.Beam(0.2, 0.04, 1e-3, "200x40")
FORCE = -20.0  # .1 MPa on 200 x 1 mm


def pressed(definition, length, height, size, nu=0.3, stiffness=None, mesh_type="structured", follower=False):
    """A sheet that stands on its lower side pressed from above, its mesh, and its reference stiffness."""
    mesh = st.MESH_TYPES[mesh_type](length, height, size)
    springs = st.DEFINITIONS[definition].springs(mesh, st.Material(1e6, nu, name="rubber"), 1e-3, stiffness)
    return MeshCache(mesh, 1e-3).problem(FACE, springs, follower), mesh, springs.reference


def block(definition, nu=0.5, size=2e-3, **options):
    problem, mesh, reference = pressed(definition, 0.2, 0.04, size, nu, **options)
    return problem, FORCE / reference, measured_weights(mesh, FACE)


def column(definition, length, height, size, follower, mesh_type="structured"):
    """A sheet that stands on its lower side, and the force over stiffness that would strain it by 1."""
    problem, _, reference = pressed(definition, length, height, size, mesh_type=mesh_type, follower=follower)
    return problem, -1e6 * 1e-3 * length / reference


def middle(found, field):
    return float(np.tensordot(found.displacements, field, axes=2))


@pytest.mark.parametrize("nu", [0.3, 0.49, 0.5])
@pytest.mark.parametrize("definition", ["area", "delingette"])
def test_one_set_of_parameters_serves_the_block_too(definition, nu):
    problem, s, field = block(definition, nu)
    reference = solve_small_strain(BLOCK, st.Material(1e6, nu, name="rubber"), FORCE, kind=FACE)
    assert middle(problem.linear(s), field) == pytest.approx(reference.displacement, rel=0.01)


def test_uniform_network_of_the_paper():
    """K = 1000 N/m: 3.20 mm by an independent program on the same network."""
    problem, s, field = block("paper", stiffness=1000.0)
    found = problem.nonlinear(s)
    assert found.converged
    assert middle(found, field) == pytest.approx(-3.20e-3, abs=0.01e-3)


def test_softer_network_snaps_at_its_corners_and_keeps_the_last_good_step():
    """K = 800 N/m: just before the whole load triangles at the upper corners turn inside out."""
    problem, s, field = block("paper", stiffness=800.0)
    found = problem.nonlinear(s)
    assert not found.converged
    assert 0.97 < found.load_share < 1.0
    assert f"{100 * found.load_share:.3g} % of the load" in found.reason
    last = float(np.tensordot(found.last, field, axes=2))
    assert last / found.load_share == pytest.approx(-4.03e-3, rel=0.01)  # by the independent program, corners inverted
    assert not problem.network.inverted(found.last)


@settings(max_examples=15)
@given(seed=some.integers(0, 2**31), axis=some.integers(0, 1))
def test_follower_pressure_has_its_derivative(seed, axis):
    mesh = st.MESH_TYPES["free"](0.02, 0.01, 2.5e-3)
    edges = mesh.outline_edges(1 - axis, mesh.points[:, 1 - axis].max())
    load = FollowerPressure.of_side(mesh, edges, axis)
    generator = np.random.default_rng(seed)
    here, direction = 1e-3 * generator.standard_normal((2, *mesh.points.shape))
    # Linear in the displacements: differences are exact but for rounding.
    difference = load.forces(here + direction) - load.forces(here)
    exact = np.zeros(mesh.points.shape)
    moved = direction[load.edges].reshape(len(edges), 4)
    np.add.at(exact, load.edges, np.einsum("nij,nj->ni", load.derivative, moved).reshape(-1, 2, 2))
    assert np.abs(difference - exact).max() <= 1e-9 * np.abs(exact).max()
    total = load.forces(np.zeros(mesh.points.shape)).sum(axis=0)
    assert total == pytest.approx([0, 1] if axis == 0 else [1, 0], abs=1e-9)


def test_follower_pressure_turns_with_the_face():
    problem, s, _ = block("area", 0.3, follower=True)
    found = problem.nonlinear(s)
    assert found.converged
    # Balance: the forces at rest plus what the turned ones differ must meet the resistance.
    load = problem.network.reduce(problem.follower.forces(found.displacements))
    missing = s * load - problem.network.free_forces_over_k(found.displacements)
    assert np.linalg.norm(missing) <= 1e-9 * abs(s) * problem.load_norm
    # Turned by a right angle with its sheet, a pressure is turned, too.
    mesh = problem.network.mesh
    turned = mesh.points @ np.array([[0.0, 1.0], [-1.0, 0.0]]) - mesh.points
    assert problem.follower.forces(turned).sum(axis=0) == pytest.approx([-1, 0], abs=1e-9)


def test_load_steps_under_a_follower_pressure_are_stable_where_its_own_share_of_it_is():
    """A block that is pulled far, in steps: each is judged under the load there, of which many times more flutter."""
    problem, s, _ = block("paper", stiffness=300.0, size=0.02, follower=True)
    found = problem.nonlinear(-s)
    assert problem.network.largest_change(found.displacements) > FAR_STRETCH
    assert found.converged and np.isnan(found.unstable_share)
    assert problem.judge(-s, found)[0] is st.Status.SOLVED


def frequencies(problem, s, displacements):
    """Squares of all frequencies over stiffness and mass, by dense linear algebra, the lowest first."""
    network = problem.network
    mass = network.reduce(np.repeat(network.mesh.particle_areas[:, None], 2, axis=1)) / network.mesh.area
    tangent = network.tangent(displacements, problem.follower and (s, problem.follower)).toarray()
    values = np.linalg.eigvals(tangent / mass[:, None])
    return values[np.argsort(np.abs(values))]


@pytest.mark.parametrize(
    "definition, mesh_type", [("delingette", "structured"), ("lattice", "free"), ("area", "right")]
)
@pytest.mark.parametrize("strain", [0.02, 0.04, 0.05, 0.06, 0.065, 0.08])
def test_a_tall_sheet_under_a_follower_pressure_is_solved_only_where_it_does_not_flutter(definition, mesh_type, strain):
    problem, unit = column(definition, 0.02, 0.1, 5e-3, follower=True, mesh_type=mesh_type)
    found = problem.nonlinear(strain * unit)
    status, message, pivots = problem.judge(strain * unit, found)
    assert found.converged and pivots == 0  # inertia has nothing to say
    lowest = frequencies(problem, strain * unit, found.displacements)[:MOST_MODES]
    flutters = (np.abs(lowest.imag) > 1e-6 * np.abs(lowest)).any()
    assert status == (st.Status.UNSTABLE if flutters else st.Status.SOLVED)
    assert ("flutters" in message) == flutters
    modes = problem.modes(strain * unit, found.displacements, found.factor)
    assert np.sort(np.abs(modes)) == pytest.approx(np.abs(lowest), rel=1e-6)


def test_a_slender_column_flutters_at_becks_load():
    """20.05 EI/L^2 where a dead load buckles it at pi^2/4 EI/L^2, whatever its bending stiffness."""

    def critical(follower, low, high):
        problem, unit = column("delingette", 0.01, 0.2, 2.5e-3, follower)
        assert problem.judge(low * unit, problem.nonlinear(low * unit))[0] is st.Status.SOLVED
        assert problem.judge(high * unit, problem.nonlinear(high * unit))[0] is st.Status.UNSTABLE
        while high - low > 2e-3 * high:
            middle = 0.5 * (low + high)
            stable = problem.judge(middle * unit, problem.nonlinear(middle * unit))[0] is st.Status.SOLVED
            low, high = (middle, high) if stable else (low, middle)
        return high

    euler = np.pi**2 / 4 / 12 * 0.05**2  # strain
    # The sheet is a twentieth as wide as high: shear and strain count some percent.
    ratio = critical(True, 6 * euler, 11 * euler) / critical(False, 0.9 * euler, 1.4 * euler)
    assert ratio == pytest.approx(20.05 / (np.pi**2 / 4), rel=0.04)

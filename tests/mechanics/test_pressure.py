"""Pressure on a face: follower loads, the block, and what becomes of networks that cannot carry it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import springtune as st
from springtune.mechanics.network import FollowerPressure
from springtune.mechanics.newton import MOST_MODES
from springtune.mechanics.statics import FAR_STRETCH
from springtune.problem.boundary import measured
from springtune.problem.loads import FACE
from springtune.reference.small_strain import solve_small_strain
from springtune.scene.mesh_cache import MeshCache

BLOCK = st.Beam(0.2, 0.04, 1e-3, "200x40")
FORCE = -20.0  # .1 MPa on 200 x 1 mm


def pressed(definition, length, height, size, nu=0.3, stiffness=None, mesh_type="structured", follower=False):
    """A sheet that stands on its lower side pressed from above, its mesh, and its reference stiffness."""
    mesh = st.MESH_TYPES[mesh_type](length, height, size)
    springs = st.DEFINITIONS[definition].springs(mesh, st.Material(1e6, nu, name="rubber"), 1e-3, stiffness)
    return MeshCache(mesh, 1e-3).problem(FACE, springs, follower), mesh, springs.reference


def block(definition, nu=0.5, size=2e-3, **options):
    problem, mesh, reference = pressed(definition, 0.2, 0.04, size, nu, **options)
    return problem, FORCE / reference, measured(mesh, FACE)


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
    assert (
        np.linalg.norm(s * load - problem.network.free_forces_over_k(found.displacements))
        <= 1e-9 * abs(s) * problem.load_norm
    )
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
    assert critical(True, 6 * euler, 11 * euler) / critical(False, 0.9 * euler, 1.4 * euler) == pytest.approx(
        20.05 / (np.pi**2 / 4), rel=0.04
    )

"""Limit points, buckling, and numbers that would be wrong without a word."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import springtune as st
from springtune.mechanics.continuation import _limit_load, buckling, follow, smallest_share
from springtune.mechanics.network import Network
from springtune.mechanics.statics import StaticProblem
from springtune.problem.boundary import weights
from springtune.problem.loads import AXIAL, BENDING, FACE, SHEAR
from springtune.reference.answers import elastica
from springtune.scene.mesh_cache import MeshCache

from problems import arch
from tables import beside, cases, evaluated

HEIGHT = 0.02


def scene(definition, kind, mesh_type, aspect, strain, nu, rows):
    """A small beam under a load of about a strain, and that load over the reference stiffness."""
    length = aspect * HEIGHT
    mesh = st.MESH_TYPES[mesh_type](length, HEIGHT, HEIGHT / rows)
    springs = st.DEFINITIONS[definition].springs(mesh, st.Material(1e6, nu, name="sheet"), 1e-3)
    side = {AXIAL: HEIGHT, BENDING: HEIGHT**2 / length / 6, FACE: length, SHEAR: length}[kind]
    return MeshCache(mesh, 1e-3).problem(kind, springs), strain * 1e6 * 1e-3 * side / springs.reference


def test_a_path_goes_through_a_limit_point():
    """F(w) = 2 k (l - L)/l (h + w): its largest value is where l^3 = b^2 L, and the tangent changes sign there."""
    rise = 0.2
    path = follow(arch(rise=rise), -1.0, increment=0.01, limit=0.19)
    w = path.displacements[:, 2, 1]
    rest = np.hypot(1.0, rise)
    length = np.hypot(1.0, rise + w)
    assert np.abs(2 * (length - rest) / length * (rise + w) - path.loads).max() <= 1e-9 * np.abs(path.loads).max()
    at_limit = np.sqrt(rest ** (2 / 3) - 1) - rise
    assert (path.negative_pivots == (w < at_limit)).all()
    assert path.negative_pivots[-1] == 1 and abs(path.loads[-1]) < abs(path.loads).max()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_limit_load_is_the_top_of_the_parabola_through_three_points(sign):
    way = np.array([0.0, 1.0, 1.8, 2.5])
    loads = [*(sign * (3 - (way - 2) ** 2))]
    assert _limit_load([*way], loads) == pytest.approx(sign * 3, rel=1e-9)
    assert _limit_load([1.8, 2.5], loads) == loads[-2]


@pytest.mark.parametrize("definition", ["delingette", "patch"])
def test_a_slender_column_buckles_at_eulers_load(definition):
    """Clamped-free, 200 x 10 mm in ten rows: linear triangles are 1 % too stiff in bending."""
    mesh = st.MESH_TYPES["structured"](0.2, 0.01, 1e-3)
    springs = st.DEFINITIONS[definition].springs(mesh, st.Material(210e9, 0.3, name="steel"), 1e-3)
    euler = np.pi**2 * 210e9 * 1e-3 * 0.01**3 / 12 / (4 * 0.2**2)
    found, restriction = buckling(MeshCache(mesh, 1e-3).problem(AXIAL, springs), -euler / springs.reference)
    assert found * springs.reference == pytest.approx(-euler, rel=0.02) and not restriction


@cases
def test_only_a_path_that_bifurcates_is_said_to(mesh_type, definition, rows, bifurcates):
    """Meshes that are no mirror image bend: the path, followed to a deflection of 3 heights, never loses stability."""
    problem, euler = scene(definition, AXIAL, mesh_type, 20.0, -(np.pi**2) / 48 / 20**2, 0.3, rows)
    found, restriction = buckling(problem, euler)
    assert ("nothing bifurcates" in restriction) == (not bifurcates)
    length = 0.1 * np.linalg.norm(found * problem.slope)
    path = follow(problem, 1.3 * found, increment=length, most_points=40)
    unstable = path.loads[path.negative_pivots > 0] / found
    if bifurcates:
        assert not path.negative_pivots[path.loads / found < 1].any() and unstable.min() < 1.15
    else:
        assert not len(unstable)
    # The load of the straight column: below half of it the bend is small, and the tangent falls in proportion to the
    # load but for strains, here 5e-4, and the square of the bend.
    below = problem.newton(0.3 * found, 0.3 * found * problem.slope).displacements
    assert smallest_share(problem.network, None, below) * 0.3 == pytest.approx(1.0, abs=6e-3)


def test_what_is_only_pulled_does_not_buckle():
    problem, s = scene("lattice", AXIAL, "structured", 3.0, 0.01, 0.3, 4)
    load, why = buckling(problem, s)
    assert np.isnan(load) and "no buckling load" in why


SNAPPED = evaluated(beside(__file__)["SNAPPED"], globals())


@pytest.mark.parametrize("case", SNAPPED)
def test_an_equilibrium_behind_a_snap_is_not_called_solved(case):
    problem, s = scene(*case)
    found = problem.nonlinear(s)
    direct = problem.newton(s, s * problem.slope, 40)
    assert direct.converged and problem.stability(s, direct.displacements, direct.factor)[0] == 0  # nothing local tells
    assert not found.converged or found.unstable_share < 1


@settings(max_examples=25)
@given(
    some.sampled_from(["uniform", "lattice", "area", "delingette"]),
    some.sampled_from([AXIAL, BENDING, FACE, SHEAR]),
    some.sampled_from(["structured", "free", "right", "alternating"]),
    some.floats(1.0, 12.0),
    some.floats(-2.0, 0.5).flatmap(lambda size: some.sampled_from([-(10**size), 10**size])),
    some.sampled_from([0.0, 0.3, 0.49, 0.5]),
    some.integers(2, 4),
)
def test_what_is_solved_lies_on_the_stable_path_from_rest(definition, kind, mesh_type, aspect, strain, nu, rows):
    """Whatever the load: in balance, stable, not inverted, and where arc length arrives in small steps."""
    problem, s = scene(definition, kind, mesh_type, aspect, strain, nu, rows)
    found = problem.nonlinear(s)
    if not found.converged:
        assert found.reason and found.load_share < 1
        return
    if found.unstable_share < 1 or problem.stability(s, found.displacements, found.factor)[0]:
        return
    assert not problem.network.inverted(found.displacements)
    size = np.linalg.norm(found.displacements)
    path = follow(problem, s, increment=size / 15, most_points=400)
    before = int(np.flatnonzero(path.loads / s < 1)[-1])
    assert before >= len(path.loads) - 2, "the path from rest does not reach the load"
    assert not path.negative_pivots[: before + 1].any() and (np.diff(path.loads / s) > 0).all()
    near = problem.newton(s, path.displacements[before], 40)
    if near.converged:
        assert np.linalg.norm(near.displacements - found.displacements) <= 1e-6 * size


@pytest.mark.parametrize("contrast", [1e3, 1e6, 1e9, 1e12, 1e15])
@pytest.mark.parametrize("kind", [AXIAL, BENDING])
def test_stiffness_contrast_is_solved_or_reported(contrast, kind):
    """Up to 1e12: nearly the digits that a number has are left then."""
    mesh = st.MESH_TYPES["structured"](0.1, 0.02, 5e-3)
    middle = mesh.points[mesh.edges].mean(axis=1)[:, 0]
    stiffness = 0.5 * mesh.cells_per_edge * np.where(middle // 0.02 % 2 == 0, 1.0, contrast)
    problem = MeshCache(mesh, 1.0).problem(kind, st.Springs(1.0, stiffness))
    found = problem.linear(1e-6)
    assert found.converged == (contrast <= 1e12)
    if found.converged:
        assert relative_error(problem, 1e-6, found) <= 2 * max(found.error_estimate, 1e-9)
    else:
        assert "ill-conditioned" in found.reason


def relative_error(problem, s, found):
    true = exact(problem, s, found.displacements)
    return np.abs(found.displacements - true).max() / np.abs(true).max()


def exact(problem, s, displacements):
    """Linear solution by iterative refinement, residuals spring by spring in extended precision.

    Not by the assembled matrix: its entries are rounded, and where it is ill-conditioned it is another network's.
    """
    mesh = problem.network.mesh
    (first, second), points = mesh.edges.T, mesh.points.astype(np.longdouble)
    normals = points[second] - points[first]
    normals /= np.sqrt((normals**2).sum(axis=1))[:, None]
    moved, load = displacements.astype(np.longdouble), np.zeros(points.shape, dtype=np.longdouble)
    load[~problem.network.held] = s * problem.load
    for _ in range(20):
        missing = load.copy()
        apart = (normals * (moved[second] - moved[first])).sum(axis=1)
        pulls = (problem.network.stiffness * apart)[:, None] * normals
        np.add.at(missing, first, pulls)
        np.subtract.at(missing, second, pulls)
        step = problem.network.rest_factor.solve(problem.network.reduce(missing).astype(float))
        moved = moved + problem.network.expand(step)
    assert np.abs(step).max() <= 1e-9 * np.abs(moved).max()
    return moved


@pytest.mark.parametrize("mesh_type, aspect, rows", [("braced", 4.0, 4), ("braced", 8.0, 4), ("structured", 6.0, 5)])
@pytest.mark.parametrize("above", [1e-5, 1e-4, 5e-4])
def test_just_above_the_critical_load_nothing_is_solved_that_is_unstable(mesh_type, aspect, rows, above):
    """Symmetric columns (the lattice has six rows); the critical load by bisection on the smallest eigenvalue."""
    problem, s = scene("lattice", AXIAL, mesh_type, aspect, -0.01, 0.3, rows)

    def smallest(load, start):
        found = problem.newton(load, start)
        tangent = problem.network.tangent(found.displacements).toarray()
        return np.linalg.eigvalsh(tangent)[0] if found.converged else -1.0

    low, high = 0.0, s
    while smallest(high, high * problem.slope) > 0:
        high *= 2
    while abs(high - low) > 1e-8 * abs(high):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if smallest(middle, middle * problem.slope) > 0 else (low, middle)
    for load, stable in ((low * (1 + above), False), (low * (1 - above), True)):
        found = problem.nonlinear(load)
        status, message, pivots = problem.judge(load, found)
        if found.converged:
            assert (np.linalg.eigvalsh(problem.network.tangent(found.displacements).toarray())[0] > 0) == (pivots == 0)
        assert (status is st.Status.SOLVED) == stable


@pytest.mark.parametrize("definition", ["delingette", "lattice"])
@pytest.mark.parametrize("slenderness, ratio", [(50, 1.0), (50, 2.0), (50, 5.0), (300, 2.0)])
def test_a_slender_cantilever_is_an_elastica(definition, slenderness, ratio):
    """Dead load across its end, F L^2 / EI of 1 to 5, against the exact deflection of a rod that does not stretch.

    The network's own bending stiffness is taken from its linear answer: what is left is the law of large rotations.
    """
    height = 0.02
    length = slenderness * height
    mesh = st.MESH_TYPES["structured"](length, height, height / 4)
    springs = st.DEFINITIONS[definition].springs(mesh, st.Material(1e6, 0.3, name="sheet"), 1e-3)
    pattern = weights(mesh, BENDING)
    problem = MeshCache(mesh, 1e-3).problem(BENDING, springs)
    linear = float(np.tensordot(problem.slope, pattern, axes=2))
    s = ratio * length / (3 * linear)  # deflection F L^3 / 3 EI
    found = problem.nonlinear(s)
    assert problem.judge(s, found)[0] is st.Status.SOLVED and found.error_estimate <= 1e-6
    assert found.iterations <= 30 * (1 + ratio)  # 21 to 103; twice as many would be steps that do not foresee the bend
    deflection = float(np.tensordot(found.displacements, pattern, axes=2)) / length
    # Shear and stretch are of the order of (H / L)^2, strains of up to ratio H / 2 L of their square.
    assert deflection == pytest.approx(elastica(ratio), rel=(5 + ratio**2) / slenderness**2)


def test_what_snaps_has_a_limit_point_and_no_buckling_load():
    """A shallow arch of a strip of triangles, clamped at both ends, dead load on its crown."""
    angle = np.linspace(-0.2, 0.2, 13)
    inner = np.stack([np.sin(angle), np.cos(angle)], axis=1)
    cells = [corners for i in range(12) for corners in ([i, i + 14, i + 13], [i, i + 1, i + 14])]
    mesh = st.Mesh(np.concatenate([inner, 1.02 * inner]), np.array(cells))
    clamped = np.zeros((26, 2), dtype=bool)
    clamped[[0, 12, 13, 25]] = True
    crown = np.zeros((26, 2))
    crown[19, 1] = 1.0
    problem = StaticProblem(Network(mesh, clamped, np.ones(len(mesh.edges))), crown)
    assert problem.judge(-1.0, problem.nonlinear(-1.0))[0] is st.Status.UNSTABLE
    assert np.isnan(buckling(problem, -1e-2)[0])

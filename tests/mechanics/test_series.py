"""Whole sensitivity curves against separate solves."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

import springtune as st
from springtune.mechanics.continuation import follow, smallest_share
from springtune.mechanics.series import StablePath
from springtune.mechanics.statics import SERIES_ORDER, Expansion, StaticProblem
from springtune.problem.boundary import held_directions, measured_weights, weights
from springtune.problem.compare import best_stiffness
from springtune.problem.loads import AXIAL, BENDING, FACE, SHEAR
from springtune.reference.small_strain import solve_small_strain
from springtune.scene.mesh_cache import MeshCache
from springtune.springs.lattice import COEFFICIENT, uniform

from problems import CountedNetwork, beam_problem
from tables import cases

K = 181.87e6
RATIOS = np.linspace(0.4, 1.6, 61)


@cases
def test_curve_agrees_with_separate_solves(mesh_type, length, height, size, force):
    problem, weights = beam_problem(mesh_type, length, height, size)
    targets = force / (RATIOS * K)
    values, stable = (path := StablePath(problem, weights, targets)).values, path.stable
    assert np.isfinite(values).all() and stable.all()
    for place in range(0, 61, 12):
        found = problem.newton(targets[place], targets[place] * problem.slope)
        assert found.converged
        assert values[place] == pytest.approx(np.tensordot(found.displacements, weights, axes=2), rel=1e-7)


def on_the_path(problem, weights, s):
    """Weighted displacement of the stable equilibrium on the path from rest, NaN where there is none.

    A separate solve; where that finds an equilibrium that the beam leaves, by arc length.
    """
    found = problem.nonlinear(s)
    if problem.judge(s, found)[0] is st.Status.SOLVED:
        return float(np.tensordot(found.displacements, weights, axes=2))
    for length in (0.02, 0.2):  # short of the turn, long of the way beyond it
        increment = length * abs(s) * np.linalg.norm(problem.slope)
        path = follow(problem, 1.0001 * s, increment=increment, most_points=400)
        carried = np.maximum.accumulate(np.abs(path.loads)) == np.abs(path.loads)
        count = int(np.argmin(np.append(carried & (path.negative_pivots == 0), False)))  # stable, under growing loads
        place = int(np.searchsorted(np.abs(path.loads[:count]), abs(s)))
        if place < count:
            before, load = path.loads[place - 1 : place + 1]
            share = (s - before) / (load - before)
            guess = path.displacements[place - 1] * (1 - share) + path.displacements[place] * share
            found = problem.newton(s, guess)
            good = found.converged and problem.network.factorize_tangent(found.displacements).negative_pivots == 0
            return float(np.tensordot(found.displacements, weights, axes=2)) if good else np.nan
    return np.nan


def random_curve(seed):
    """A problem of at most 400 particles and loads around buckling, or in tension up to large strains."""
    random = np.random.default_rng(seed)
    while True:
        mesh_type = random.choice(["structured", "free", "right", "alternating", "braced"])
        height = random.uniform(5e-3, 30e-3)
        size, length = height / random.uniform(1.5, 8), height * random.uniform(1, 12)
        if 15 < length * height / size**2 < 300:
            mesh = st.MESH_TYPES[mesh_type](length, height, size)
            if len(mesh.points) <= 400:
                break
    kind = random.choice([AXIAL, AXIAL, AXIAL, BENDING, SHEAR, FACE])
    problem = MeshCache(mesh, 1.0).problem(kind, st.Springs(1.0, uniform(mesh)))
    sign, s = random.choice([-1, 1]), height * 10 ** random.uniform(-2, 0.3)
    if kind != AXIAL or sign < 0:
        small = 1e-6 * sign * height
        critical = smallest_share(problem.network, None, small * problem.slope) * abs(small)
        s = critical * random.uniform(0.3, 1.8) if kind == AXIAL else min(0.3 * s, critical)
    return problem, measured_weights(mesh, kind), sign * min(s, 2 * height) / RATIOS


def check(seed):
    """What a curve says is stable is, to 1e-6, and what it has not is not on the stable path."""
    problem, weights, targets = random_curve(seed)
    values, stable = (path := StablePath(problem, weights, targets)).values, path.stable
    assert np.isfinite(values[stable]).all()
    last = np.argmax(np.abs(targets * stable))  # the nearest to where stability ends
    for place in {0, 10, 25, 40, 60, int(last)}:
        if stable[place]:
            expected = on_the_path(problem, weights, targets[place])
            linear = targets[place] * np.tensordot(problem.slope, weights, axes=2)
            if np.isnan(expected) and abs(values[place]) > 3 * abs(linear):
                continue  # bent so far beyond buckling that the points by arc length do not suffice
            assert values[place] == pytest.approx(expected, rel=1e-6), place


@pytest.mark.parametrize("seed", range(24))
def test_random_curves_are_of_the_stable_path(seed):
    check(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 500))
def test_many_random_curves_are_of_the_stable_path(seed):
    check(seed)


def test_curve_next_to_buckling_is_followed_where_the_beam_bends():
    """60x20 of rows that are no mirror image bends before it buckles; the path turns at k = 798, a limit point."""
    problem, weights = beam_problem("structured", 0.06, 0.02, 2.5e-3)
    stiffness = RATIOS * COEFFICIENT * 1e3
    values, stable = (path := StablePath(problem, weights, -0.548311 / stiffness)).values, path.stable
    assert (stable == (stiffness > 798.3)).all()
    for place in np.flatnonzero(stable)[:4]:
        assert values[place] == pytest.approx(on_the_path(problem, weights, -0.548311 / stiffness[place]), rel=1e-6)
    last = StablePath(problem, weights, -0.548311 / stiffness[stable][:1])  # which no series about rest serves
    assert last.values == pytest.approx(values[stable][:1], rel=1e-6)


@pytest.mark.parametrize(("mesh_type", "best"), [("structured", 848.40), ("alternating", None)])
def test_best_stiffness_is_of_a_stable_equilibrium(mesh_type, best):
    problem, weights = beam_problem(mesh_type, 0.06, 0.02, 2.5e-3)
    force, stiffness = -0.548311, RATIOS * COEFFICIENT * 1e3
    path = StablePath(problem, weights, force / stiffness)
    beam, rubber = st.Beam(0.06, 0.02, 1e-3, "60x20"), st.Material(1e6, 0.5, name="rubber")
    reference = solve_small_strain(beam, rubber, force).displacement
    solve = lambda stiffness: path.value(force / stiffness)  # noqa: E731
    found = best_stiffness(stiffness, path.values, path.stable, reference, solve)
    if best is None:
        assert (found.status, path.end) == (st.Status.UNSTABLE, "unstable") and np.isnan(found.stiffness)
        return
    assert found.status is st.Status.SOLVED and found.stiffness == pytest.approx(best, abs=5e-3)
    assert on_the_path(problem, weights, force / found.stiffness) == pytest.approx(reference, rel=1e-6)


def test_series_error_falls_with_the_order():
    """The error of a truncated series about rest is of the order cut off: slope order + 1 in the load."""
    problem, weights = beam_problem("structured", 0.2, 0.04, 5e-3)
    loads = np.array([2e-5, 4e-5])
    for order in (1, 2, 3):
        series = Expansion(problem.network, problem.load, 0.0, None, problem.network.rest_factor, order=order)
        series_errors = []
        for s in loads:
            found = problem.newton(s, s * problem.slope)
            approximate = np.tensordot(s ** np.arange(order + 1.0), series.coefficients, axes=1)
            series_errors.append(np.linalg.norm(approximate - found.displacements))
        rate = np.log2(series_errors[1] / series_errors[0])
        assert rate == pytest.approx(order + 1, abs=0.1)


@settings(max_examples=10)
@given(share=some.floats(0.05, 1.0))
def test_series_about_a_loaded_point_meets_that_about_rest(share):
    problem, weights = beam_problem("free", 0.1, 0.02, 5e-3)
    s = share * 20e3 / K
    found = problem.newton(s, s * problem.slope)
    factor = problem.network.factorize_tangent(found.displacements)
    local = Expansion(problem.network, problem.load, s, found.displacements, factor)
    targets = np.array([0.5 * s, s, 1.2 * s])
    near, _ = local.measure(weights, targets)
    rest, _ = problem.rest.measure(weights, targets)
    assert near == pytest.approx(rest, rel=1e-9)
    assert local.order == SERIES_ORDER


@pytest.mark.parametrize(("length", "force"), [(0.1, 2e4), (0.2, 4e5)])  # the second needs two series
def test_one_path_is_many_solves_worth(length, force):
    """Two hundred stiffnesses on one path take no more factorizations than one of them solved by itself."""
    mesh, kind = st.MESH_TYPES["structured"](length, length / 5, 5e-3), st.LOADS["traction"].kind
    pattern = weights(mesh, kind)

    def problem():
        return StaticProblem(CountedNetwork(mesh, held_directions(mesh, kind), np.ones(len(mesh.edges))), pattern)

    loads = force / (0.866 * 2.1e8 * np.linspace(0.4, 1.6, 201))
    together, apart = problem(), [problem() for _ in loads[::50]]
    values, stable = (path := StablePath(together, pattern, loads)).values, path.stable
    found = [one.nonlinear(load) for one, load in zip(apart, loads[::50])]
    assert stable.all()
    np.testing.assert_allclose(values[::50], [np.tensordot(one.displacements, pattern, axes=2) for one in found],
                               rtol=1e-9)  # fmt: skip
    assert 1 <= together.network.taken <= min(one.network.taken for one in apart)

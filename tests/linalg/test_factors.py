"""Factorizations by Cholesky's method and by SuperLU: the same answers, and nothing lost where there is but one."""

import re
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy.sparse import csc_array, csr_array

import springtune as st
from springtune.linalg import factors, kernels
from springtune.linalg.factors import Analysis, SingularError, factorize, factorize_pinned, spread_particles
from springtune.linalg.kernels import Blocks, row_pointers
from springtune.linalg.multigrid import IndefiniteError, Multigrid, as_dense, cut_rows, first_grid, galerkin, next_grid
from springtune.mechanics.continuation import follow
from springtune.mechanics.network import PINS_FROM_UNKNOWNS, FollowerPressure, Network, successor
from springtune.mechanics.statics import StaticProblem
from springtune.problem.boundary import held_directions, weights
from springtune.problem.loads import AXIAL
from springtune.springs.lattice import half_weight

from tables import beside, cases

FORCE_OVER_STIFFNESS = 2e-4


def problem_on(mesh, stiffness=None, solver=None):
    stiffness = half_weight(mesh) if stiffness is None else stiffness
    return StaticProblem(Network(mesh, held_directions(mesh, AXIAL), stiffness, solver=solver), weights(mesh, AXIAL))


def both(function):
    """What a function of a solver's name gives with either factorization."""
    return [function(solver) for solver in ("Cholesky", "SuperLU")]


@pytest.mark.parametrize("mesh_type", st.MESH_TYPES)
def test_scenes_have_the_same_answer(mesh_type):
    mesh = st.MESH_TYPES[mesh_type](0.05, 0.02, 2.5e-3)

    def solve(solver):
        problem = problem_on(mesh, solver=solver)
        found = [problem.linear(FORCE_OVER_STIFFNESS), problem.nonlinear(FORCE_OVER_STIFFNESS)]
        assert all(problem.judge(FORCE_OVER_STIFFNESS, one)[0] is st.Status.SOLVED for one in found)
        return found

    ours, theirs = both(solve)
    assert ours[0].factor.name == "Cholesky" and theirs[0].factor.name == "SuperLU"
    for one, other in zip(ours, theirs):
        # Condition numbers are some 1e4.
        assert np.abs(one.displacements - other.displacements).max() <= 1e-9 * np.abs(other.displacements).max()


def test_a_singular_tangent_is_reported_by_either():
    mesh = st.MESH_TYPES["structured"](0.05, 0.02, 5e-3)
    stiffness = half_weight(mesh)
    loose = mesh.edges == len(mesh.points) - 1
    stiffness[loose.any(axis=1)] = 0.0  # a particle without springs

    for solver in ("Cholesky", "SuperLU"):
        with pytest.raises(SingularError):
            problem_on(mesh, stiffness, solver).network.factorize_tangent().negative_pivots  # noqa: B018


def test_factors_of_one_mesh_do_not_overwrite_each_other():
    """One symbolic factorization serves them all, each numeric one takes its place: it must be given back unused."""
    mesh = st.MESH_TYPES["structured"](0.05, 0.02, 5e-3)
    tangent = problem_on(mesh).network.tangent()
    analysis = Analysis(tangent.indices, tangent.indptr)
    right = np.arange(1.0, tangent.shape[0] + 1)
    first, second = analysis.factorize(tangent.data), analysis.factorize(3.0 * tangent.data)
    solution = first.solve(right)
    assert np.allclose(second.solve(right), solution / 3, rtol=1e-9)
    del second
    for _ in range(5):
        assert np.allclose(analysis.factorize(3.0 * tangent.data).solve(right), solution / 3, rtol=1e-9)
        assert np.array_equal(first.solve(right), solution)
    del first
    assert len(analysis.spare) == 2  # used again, not made again


def test_many_right_hand_sides_at_once():
    network = problem_on(st.MESH_TYPES["structured"](0.05, 0.02, 5e-3)).network
    right = np.random.default_rng(0).standard_normal((network.unknowns, 3))
    together = network.rest_factor.solve(right)
    for column in range(3):
        assert np.allclose(together[:, column], network.rest_factor.solve(right[:, column].copy()), rtol=1e-9)


def test_a_matrix_of_any_sparsity_is_factorized():
    generator = np.random.default_rng(1)
    dense = generator.standard_normal((30, 30)) * (generator.random((30, 30)) < 0.2)
    definite = csc_array(dense @ dense.T + 10 * np.eye(30))
    right = generator.standard_normal(30)

    def solve(solver):
        factor = factorize(definite, solver)
        indefinite = factorize(definite - 12 * csc_array(np.eye(30)), solver)
        return factor.name, factor.solve(right), indefinite.negative_pivots

    ours, theirs = both(solve)
    assert (ours[0], theirs[0]) == ("Cholesky", "SuperLU")
    expected = np.linalg.solve(definite.toarray(), right)
    assert np.allclose(ours[1], expected, rtol=1e-9) and np.allclose(theirs[1], expected, rtol=1e-9)
    below = (np.linalg.eigvalsh(definite.toarray()) < 12).sum()
    assert ours[2] == theirs[2] == below > 0


# -- indefinite matrices -----------------------------------------------------------------------------------------------


@settings(max_examples=50, deadline=None)
@given(size=some.integers(2, 40), below=some.integers(0, 6), pins=some.integers(1, 8), seed=some.integers(0, 2**32 - 1))
def test_pins_count_negative_eigenvalues_and_solve(size, below, pins, seed):
    """Inertia and solution of dense matrices of a known spectrum, as those of eigenvalues and of LAPACK's LU."""
    generator = np.random.default_rng(seed)
    modes, _ = np.linalg.qr(generator.standard_normal((size, size)))
    values = np.exp(generator.uniform(-9, 0, size))
    values[: min(below, size)] *= -1
    dense = (modes * values) @ modes.T
    matrix = csc_array(0.5 * (dense + dense.T))
    places = generator.permutation(size)[:pins]
    factor = factorize_pinned(matrix, Analysis(matrix.indices, matrix.indptr), [places])
    if factor is None:  # pins too few to hold it, or the least eigenvalue too near to zero: never a wrong number
        return
    assert factor.negative_pivots == (values < 0).sum()
    right = generator.standard_normal((size, 2))
    missing = right - matrix @ factor.solve(right)
    # Backward stable: a residual as rounding of the solution makes one.
    assert np.abs(missing).max() <= 1e-9 * np.abs(factor.solve(right)).max()


def test_pins_at_every_unknown_hold_all_that_is_no_stiffer_than_they_are():
    matrix = csc_array(np.diag([-1.0, 2.0, -3.0, 4.0]) + 0.1)
    factor = factorize_pinned(matrix, Analysis(matrix.indices, matrix.indptr), [np.arange(0), np.arange(4)])
    assert factor.name == "pinned Cholesky" and factor.negative_pivots == 2
    assert np.allclose(factor.solve(np.ones(4)), np.linalg.solve(matrix.toarray(), np.ones(4)), rtol=1e-9)


def test_pins_count_nothing_in_a_singular_matrix():
    singular = np.array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    for shift in (0.0, 1e-15, -1e-15):
        matrix = csc_array(singular + shift * np.eye(3))
        assert factorize_pinned(matrix, Analysis(matrix.indices, matrix.indptr), [np.array([0])]) is None


def pinned_mesh(mesh_type="structured"):
    """A slender beam, of just so many unknowns that an unstable one gets pins."""
    mesh = st.MESH_TYPES[mesh_type](0.2, 0.02, 1.2e-3)
    assert 2 * len(mesh.points) > 1.02 * PINS_FROM_UNKNOWNS
    return mesh


@pytest.mark.parametrize("mesh_type", ["structured", "free", "braced"])
def test_an_unstable_path_is_the_same_with_pins_and_by_superlu(mesh_type):
    mesh = pinned_mesh(mesh_type)

    def path(solver):
        problem = problem_on(mesh, solver=solver)
        found = follow(problem, -2e-4, increment=2e-3 * problem.network.unknowns**0.5, most_points=8)
        return found, problem.network.factorize_tangent(found.displacements[-1]).name

    (ours, name), (theirs, other) = both(path)
    assert (name, other) == ("pinned Cholesky", "SuperLU")
    assert ours.negative_pivots.tolist() == theirs.negative_pivots.tolist() and ours.negative_pivots.max() > 0
    assert np.allclose(ours.loads, theirs.loads, rtol=1e-9)
    assert np.abs(ours.displacements - theirs.displacements).max() <= 1e-9 * np.abs(theirs.displacements).max()


def test_what_pins_do_not_hold_goes_to_superlu():
    mesh = pinned_mesh()
    network = problem_on(mesh, -half_weight(mesh), "Cholesky").network
    factor = network.factorize_tangent()
    assert (factor.name, factor.negative_pivots) == ("SuperLU", network.unknowns)


def test_a_stable_tangent_after_an_unstable_one_has_the_factor_that_it_always_has():
    mesh = pinned_mesh()
    fresh, used = (problem_on(mesh, solver="Cholesky") for _ in range(2))
    bent = -5e-3 * used.slope / np.abs(used.slope).max()
    assert used.network.factorize_tangent(bent).name == "pinned Cholesky"
    ours, theirs = (problem.network.factorize_tangent(1e-6 * bent) for problem in (fresh, used))
    assert ours.name == theirs.name == "Cholesky"
    assert np.array_equal(ours.solve(fresh.load), theirs.solve(used.load))


def test_particles_that_are_spread_are_far_from_each_other():
    mesh = st.MESH_TYPES["free"](0.2, 0.04, 4e-3)
    points = mesh.points[spread_particles(mesh.points, 16)]
    apart = np.linalg.norm(points[:, None] - points, axis=2) + np.eye(len(points))
    assert len(points) == 16 and apart.min() > 0.5 * (mesh.area / 16) ** 0.5
    assert len(spread_particles(points[:3], 8)) == 2


# -- multigrid ---------------------------------------------------------------------------------------------------------


def iterative(network, displacements=None, otherwise=None):
    return Multigrid(partial(network.blocks, displacements), network.mesh.points, network.held, otherwise)


def interpolation(grid):
    """Matrix from the displacements of a grid's nodes to those of its points."""
    count, nodes = len(grid.cells), grid.shape[0] * grid.shape[1]
    empty = Blocks(np.zeros(count + 1, int), np.zeros(0, int), np.zeros((0, 4)), np.zeros((count, 3)))
    columns, rows = [], cut_rows(empty)
    for node in range(2 * nodes):
        coarse, fine = np.zeros((nodes, 2), np.float32), np.zeros((count, 2), np.float32)
        coarse.ravel()[node] = 1
        kernels.prolong(0, 1, rows, grid, coarse, fine, fine.copy())
        columns.append(fine.ravel())
    return np.array(columns, float).T


def scattered_blocks(generator, count):
    """Points, pairs of any of them joined by springs, and the matrix, in blocks and as a full one."""
    points = generator.uniform(0, [1.0, 0.3], (count, 2))
    first, second = np.nonzero(np.triu(generator.uniform(size=(count, count)) < 0.2, 1))
    forms = generator.standard_normal((len(first), 2, 2))
    blocks = -(forms @ forms.swapaxes(1, 2))
    own = np.zeros((count, 2, 2)) + np.eye(2)
    np.subtract.at(own, first, blocks)
    np.subtract.at(own, second, blocks)
    matrix = Blocks(
        row_pointers(first, count), second.astype(np.int32), blocks.reshape(-1, 4), own[:, [0, 0, 1], [0, 1, 1]]
    )
    full = np.zeros((count, 2, count, 2))
    full[first, :, second, :], full[second, :, first, :] = blocks, blocks.swapaxes(1, 2)
    full[np.arange(count), :, np.arange(count), :] = own
    return points, matrix, full.reshape(2 * count, 2 * count)


@settings(max_examples=30, deadline=None)
@given(seed=some.integers(0, 2**32 - 1), coarsening=some.floats(0.3, 8.0))
def test_grids_hold_rigid_motions_and_even_strains(seed, coarsening):
    """Bilinear interpolation of a linear field is the field, wherever particles are, and from grid to grid."""
    generator = np.random.default_rng(seed)
    points = generator.uniform(0, [1.0, 0.3], (40, 2))
    grid = first_grid(points, coarsening)
    linear = interpolation(grid) @ np.stack(np.indices(grid.shape), axis=-1).reshape(-1)
    spacing = np.ptp(points, axis=0) / (np.array(grid.shape) - 1)
    assert linear.reshape(-1, 2) == pytest.approx((points - points.min(axis=0)) / spacing, abs=1e-5)  # single precision
    coarser = next_grid(grid.shape)
    linear = (interpolation(coarser) @ np.stack(np.indices(coarser.shape), axis=-1).reshape(-1)).reshape(-1, 2)
    twice = np.where(np.array(grid.shape) > 2, 2, 1)
    assert np.array_equal(linear * twice, np.stack(np.indices(grid.shape), axis=-1).reshape(-1, 2))


@settings(max_examples=30, deadline=None)
@given(seed=some.integers(0, 2**32 - 1), coarsening=some.floats(0.5, 8.0))
def test_coarse_matrices_are_galerkins(seed, coarsening):
    """Whatever points are joined: neighbours, or those with several cells between them."""
    points, matrix, full = scattered_blocks(np.random.default_rng(seed), 24)
    grid = first_grid(points, coarsening)
    prolong = interpolation(grid)
    coarse, expected = as_dense(galerkin(matrix, grid)), prolong.T @ full @ prolong
    assert as_dense(matrix) == pytest.approx(full, rel=1e-9)
    assert np.abs(coarse - expected).max() <= 1e-6 * np.abs(expected).max()


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_chunks_of_rows_multiply_and_precondition_the_same_with_any_number_of_threads(monkeypatch, threads):
    monkeypatch.setattr("springtune.linalg.multigrid.ROWS_PER_CHUNK", 1)
    monkeypatch.setattr("springtune.linalg.multigrid.THREADS", threads)
    points, matrix, full = scattered_blocks(np.random.default_rng(0), 300)
    factor = Multigrid(lambda: matrix, points, np.zeros(points.shape, dtype=bool))
    right = np.random.default_rng(1).standard_normal(600)
    solution = factor.solve(right)
    assert np.linalg.norm(full @ solution - right) <= 1e-9 * np.linalg.norm(right)
    cycles = np.array([factor.cycle(0, unit.reshape(-1, 2))[0].flatten() for unit in np.eye(600, dtype=np.float32)])
    assert np.abs(cycles - cycles.T).max() <= 1e-4 * np.abs(cycles).max()
    assert np.linalg.eigvalsh(cycles + cycles.T).min() > 0
    monkeypatch.setattr("springtune.linalg.multigrid.THREADS", 3)
    other = Multigrid(lambda: matrix, points, np.zeros(points.shape, dtype=bool))
    assert np.array_equal(solution, other.solve(right))


@pytest.mark.parametrize("mesh_type", st.MESH_TYPES)
def test_multigrid_gives_what_a_factorization_gives(mesh_type):
    mesh = st.MESH_TYPES[mesh_type](0.1, 0.04, 1.8e-3)
    problem = problem_on(mesh)
    factor = iterative(problem.network)
    solution, exact = factor.solve(problem.load), problem.network.rest_factor.solve(problem.load)
    assert np.abs(solution - exact).max() <= 1e-9 * np.abs(exact).max()
    assert (factor.name, factor.negative_pivots) == ("multigrid", 0)


def test_multigrid_meets_what_is_unstable_without_being_shown_where():
    """The load stretches the beam and does not bend it; yet the random residual besides finds that it buckles."""
    mesh = st.MESH_TYPES["structured"](0.2, 0.01, 1.2e-3)
    problem = problem_on(mesh)
    pressed = -5e-3 * problem.slope / np.abs(problem.slope).max()
    exact = problem.network.factorize_tangent(pressed)
    assert exact.negative_pivots > 0
    with pytest.raises(IndefiniteError):
        iterative(problem.network, pressed).solve(problem.load)
    assert iterative(problem.network, pressed).negative_pivots == 1
    taken_over = iterative(problem.network, pressed, lambda: exact)
    assert np.array_equal(taken_over.solve(problem.load), exact.solve(problem.load))
    assert (taken_over.name, taken_over.negative_pivots) == (exact.name, exact.negative_pivots)


@pytest.mark.parametrize("factor", [-1.0, -1e-3])
def test_multigrid_tells_of_a_particle_that_is_pushed_away(factor):
    """A smoother that divides by a diagonal that is not positive would make conjugate gradients blind to it."""
    mesh = st.MESH_TYPES["structured"](0.1, 0.04, 1.8e-3)
    stiffness = half_weight(mesh)
    middle = np.linalg.norm(mesh.points - [0.05, 0.02], axis=1).argmin()
    stiffness[(mesh.edges == middle).any(axis=1)] *= factor
    network = problem_on(mesh, stiffness, "multigrid").network
    with pytest.raises(IndefiniteError):
        network.rest_factor.solve(np.ones(network.unknowns))
    assert network.rest_factor.negative_pivots == 1


LOOSE = beside(__file__)["LOOSE"]


def loose(what):
    """Mesh, what is held, and springs with a motion without stiffness."""
    mesh = st.MESH_TYPES["right"](0.1, 0.04, 1.8e-3)
    stiffness, fixed = half_weight(mesh), held_directions(mesh, AXIAL)
    middle = np.linalg.norm(mesh.points - [0.05, 0.02], axis=1).argmin()
    ends = mesh.points[mesh.edges]
    if what == "springs in one line":
        rising = (np.diff(ends, axis=1)[:, 0] > 0).all(axis=1)
        stiffness[(mesh.edges == middle).any(axis=1) & ~rising] = 0.0
    elif what == "particle":
        stiffness[(mesh.edges == middle).any(axis=1)] = 0.0
    else:
        inside = (abs(mesh.points - [0.05, 0.02]) < 0.008).all(axis=1)
        stiffness[inside[mesh.edges].sum(axis=1) == 1] = 0.0
        fixed[middle] = what == "island on a pin"
    return mesh, fixed, stiffness


@pytest.mark.parametrize("what", LOOSE)
def test_multigrid_refuses_what_bears_no_load_and_moves_without_stiffness(what):
    """Neither the load nor what is random, which is a force of the network's own, has a share of such motions."""
    mesh, fixed, stiffness = loose(what)
    network = Network(mesh, fixed, stiffness, solver="multigrid")
    load = network.reduce(weights(mesh, AXIAL))

    with pytest.raises(SingularError, match=re.escape(LOOSE[what])):
        network.rest_factor.solve(load)
    with pytest.raises(SingularError, match=re.escape(LOOSE[what])):
        network.rest_factor.negative_pivots  # noqa: B018
    assert not network.is_stable(0 * mesh.points)


PLIES = {"ply that is slack": (0.1, 0.05), "ply": (1.0, 0.5)}
"""Modulus across fibres at 30 degrees, of 2 along them, and for shear: the first has parts that are loose."""


@pytest.mark.parametrize("solver", ["Cholesky", "SuperLU"])
@pytest.mark.parametrize("what", [*LOOSE, *PLIES])
def test_no_mechanism_hangs_on_rounding(what, solver):
    """Neither on noise in stiffness, nor on the order of particles."""
    if what in LOOSE:
        mesh, fixed, stiffness = loose(what)
    else:
        corners = ((0, 0), (0.06, 0), (0.06, 0.02), (0.02, 0.02), (0.02, 0.06), (0, 0.06))
        mesh = st.mesh_shape(st.Shape("L", 1e-3, list(map(st.Segment, corners))), 4e-3).mesh
        across, shear = PLIES[what]
        ply = st.AnisotropicMaterial.orthotropic(2.0, across, 0.3, shear, np.pi / 6)
        stiffness = st.DEFINITIONS["element-fit"].springs(mesh, ply, 1e-3).relative
        fixed = np.repeat(mesh.points[:, 1:] > 0.06 - 1e-9, 2, axis=1)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        order = rng.permutation(len(mesh.points)) if seed else np.arange(len(mesh.points))
        other = st.Mesh(mesh.points[order], np.argsort(order)[mesh.triangles])
        places = {tuple(sorted(pair)): row for row, pair in enumerate(np.argsort(order)[mesh.edges].tolist())}
        springs = stiffness[[places[tuple(pair)] for pair in other.edges.tolist()]]
        springs = springs + 1e-15 * seed * springs.max() * rng.standard_normal(len(springs))
        network = Network(other, fixed[order], springs, solver=solver)
        if what == "ply":
            assert network.rest_factor.negative_pivots == 0
            continue
        with pytest.raises(SingularError, match="a part moves without resistance: .* springs have no stiffness; take"):
            network.rest_factor  # noqa: B018


@cases
def test_what_takes_over_from_multigrid(solver, unknowns, symmetric, cholesky, found):
    assert successor(solver, unknowns, symmetric, cholesky) == found


def test_an_unsymmetric_tangent_that_gradients_do_not_solve_goes_to_superlu():
    mesh = st.MESH_TYPES["structured"](0.1, 0.04, 1.8e-3)
    top = mesh.edges[(mesh.points[mesh.edges][:, :, 1] >= mesh.points[:, 1].max()).all(axis=1)]
    pressed = 0 * mesh.points, (0.05, FollowerPressure.of_side(mesh, top, 0))
    network, exact = problem_on(mesh).network, problem_on(mesh, solver="SuperLU").network
    tangent, right = network.tangent(*pressed), np.ones(network.unknowns)
    turned = (tangent - network.tangent(pressed[0])).tocoo()
    places = np.flatnonzero(~network.held)
    besides = csr_array((turned.data, (places[turned.row], places[turned.col])), shape=(network.held.size,) * 2)
    blocks, otherwise = network.blocks(), partial(exact.factorize_tangent, *pressed)
    factor = Multigrid(lambda: blocks, mesh.points, network.held, otherwise, besides=besides)
    assert np.abs(tangent @ factor.solve(right) - right).max() <= 1e-8


def test_newton_goes_on_in_steps_where_multigrid_meets_an_unstable_tangent():
    mesh = st.MESH_TYPES["structured"](0.2, 0.01, 1.2e-3)
    problem = problem_on(mesh, solver="multigrid")
    found = problem.nonlinear(-1e-5)  # it buckles at two thirds of that
    assert not found.converged and "unstable beyond" in found.reason and 0.5 < found.load_share < 0.7


@pytest.mark.slow
def test_a_million_particles_take_2_gigabytes():
    """The memory of the scene's process is the same in every run; seconds depend on the machine."""
    from runpy import run_path

    found = run_path("tools/million.py")["apart"]("scene", "delingette", "linear", "4 MN", 1e6)
    assert found["status"] == "solved" and found["solver"] == "multigrid" and found["error"] <= 1e-9
    assert found["memory"] <= 2.0


# -- order of elimination ----------------------------------------------------------------------------------------------


def sheet(mesh_type, size):
    """A square sheet, the least favourable extents: no order along it has a narrow band."""
    mesh = st.MESH_TYPES[mesh_type](0.1, 0.1, size)
    return problem_on(mesh, solver="SuperLU").network


@pytest.mark.parametrize("mesh_type", st.MESH_TYPES)
def test_the_order_is_of_all_particles_once(mesh_type):
    mesh = sheet(mesh_type, 4e-3).mesh
    assert sorted(factors.nested_dissection(mesh.points, mesh.edges).tolist()) == list(range(len(mesh.points)))


@pytest.mark.parametrize("mesh_type", ["structured", "braced", "isosceles-0.3"])
def test_a_large_network_fills_in_less_than_in_an_order_of_minimum_degree(mesh_type):
    network = sheet(mesh_type, 1e-3)  # squares with one diagonal have to be larger still
    assert network.rest_factor.lu.L.nnz < factors.SuperLUFactor(network.tangent()).lu.L.nnz

"""Factorizations by Cholesky's method and by SuperLU: the same answers, and nothing lost where there is but one."""

import numpy as np
import pytest
from scipy.sparse import csc_array
from scipy.sparse.csgraph import reverse_cuthill_mckee

from springtune.linalg.factors import Analysis, SingularError, SuperLUFactor, factorize
from springtune.linalg.ordering import nested_dissection
from springtune.mechanics.network import Network
from springtune.mechanics.series import trace
from springtune.mechanics.statics import StaticProblem
from springtune.mesh import MESH_TYPES
from springtune.problem.boundary import held, measured, weights
from springtune.problem.loads import AXIAL
from springtune.problem.status import Status
from springtune.springs.lattice import half_weight

FORCE_OVER_STIFFNESS = 2e-4


def problem_on(mesh, stiffness=None, solver=None):
    stiffness = half_weight(mesh) if stiffness is None else stiffness
    return StaticProblem(Network(mesh, held(mesh, AXIAL), stiffness, solver=solver), weights(mesh, AXIAL))


def both(function):
    """What a function of a solver's name gives with either factorization."""
    return [function(solver) for solver in ("Cholesky", "SuperLU")]


@pytest.mark.parametrize("mesh_type", MESH_TYPES)
def test_scenes_have_the_same_answer(mesh_type):
    mesh = MESH_TYPES[mesh_type](0.05, 0.02, 2.5e-3)

    def solve(solver):
        problem = problem_on(mesh, solver=solver)
        found = [problem.linear(FORCE_OVER_STIFFNESS), problem.nonlinear(FORCE_OVER_STIFFNESS)]
        assert all(problem.judge(FORCE_OVER_STIFFNESS, one)[0] is Status.SOLVED for one in found)
        return found

    ours, theirs = both(solve)
    assert ours[0].factor.name == "Cholesky" and theirs[0].factor.name == "SuperLU"
    for one, other in zip(ours, theirs):
        # Condition numbers are some 1e4.
        assert np.abs(one.displacements - other.displacements).max() <= 1e-10 * np.abs(other.displacements).max()


def test_curves_have_the_same_answer():
    mesh = MESH_TYPES["structured"](0.1, 0.02, 4e-3)
    targets = FORCE_OVER_STIFFNESS / np.linspace(0.4, 1.6, 31)
    ours, theirs = both(lambda solver: trace(problem_on(mesh, solver=solver), measured(mesh, AXIAL), targets)[0])
    assert np.abs(ours / theirs - 1).max() <= 1e-8  # the curves' own tolerance is 1e-7


def test_negative_pivots_are_counted_where_there_is_no_cholesky_factor():
    mesh = MESH_TYPES["structured"](0.2, 0.01, 2.5e-3)

    def pivots(solver):
        problem = problem_on(mesh, solver=solver)
        bent = -5e-3 * problem.slope / np.abs(problem.slope).max()
        factor = problem.network.factorize_tangent(bent)
        right = np.ones(problem.network.unknowns)
        residual = problem.network.tangent(bent) @ factor.solve(right) - right
        return factor.name, factor.negative_pivots, np.abs(residual).max()

    ours, theirs = both(pivots)
    assert ours[:2] == theirs[:2] == ("SuperLU", ours[1]) and ours[1] > 0
    assert max(ours[2], theirs[2]) <= 1e-8


def test_a_singular_tangent_is_reported_by_either():
    mesh = MESH_TYPES["structured"](0.05, 0.02, 5e-3)
    stiffness = half_weight(mesh)
    loose = mesh.edges == len(mesh.points) - 1
    stiffness[loose.any(axis=1)] = 0.0  # a particle without springs

    for solver in ("Cholesky", "SuperLU"):
        with pytest.raises(SingularError):
            problem_on(mesh, stiffness, solver).network.factorize_tangent().negative_pivots  # noqa: B018


def test_factors_of_one_mesh_do_not_overwrite_each_other():
    """One symbolic factorization serves them all, each numeric one takes its place: it must be given back unused."""
    mesh = MESH_TYPES["structured"](0.05, 0.02, 5e-3)
    tangent = problem_on(mesh).network.tangent()
    analysis = Analysis(tangent.indices, tangent.indptr)
    right = np.arange(1.0, tangent.shape[0] + 1)
    first, second = analysis.factorize(tangent.data), analysis.factorize(3.0 * tangent.data)
    solution = first.solve(right)
    assert np.allclose(second.solve(right), solution / 3, rtol=1e-10)
    del second
    for _ in range(5):
        assert np.allclose(analysis.factorize(3.0 * tangent.data).solve(right), solution / 3, rtol=1e-10)
        assert np.array_equal(first.solve(right), solution)
    assert analysis.symbolic_factors == 2  # used again, not made again


def test_a_solver_that_there_is_not_is_refused():
    with pytest.raises(ValueError, match="known: Cholesky, SuperLU, multigrid"):
        problem_on(MESH_TYPES["structured"](0.05, 0.02, 5e-3), solver="LU")


def test_many_right_hand_sides_at_once():
    network = problem_on(MESH_TYPES["structured"](0.05, 0.02, 5e-3)).network
    right = np.random.default_rng(0).standard_normal((network.unknowns, 3))
    together = network.rest_factor.solve(right)
    for column in range(3):
        assert np.allclose(together[:, column], network.rest_factor.solve(right[:, column].copy()), rtol=1e-10)


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
    assert np.allclose(ours[1], expected, rtol=1e-10) and np.allclose(theirs[1], expected, rtol=1e-10)
    below = (np.linalg.eigvalsh(definite.toarray()) < 12).sum()
    assert ours[2] == theirs[2] == below > 0


# -- order of elimination ----------------------------------------------------------------------------------------------


def sheet(mesh_type, size):
    """A square sheet, the least favourable extents: no order along it has a narrow band."""
    mesh = MESH_TYPES[mesh_type](0.1, 0.1, size)
    return problem_on(mesh, solver="SuperLU").network


@pytest.mark.parametrize("mesh_type", MESH_TYPES)
def test_the_order_is_of_all_particles_once(mesh_type):
    mesh = sheet(mesh_type, 4e-3).mesh
    assert sorted(nested_dissection(mesh.points, mesh.edges).tolist()) == list(range(len(mesh.points)))


@pytest.mark.parametrize("mesh_type", MESH_TYPES)
def test_a_network_fills_in_less_than_in_orders_of_narrow_bands(mesh_type):
    network = sheet(mesh_type, 2.5e-3)
    tangent = network.tangent()
    for order in (np.arange(network.unknowns), reverse_cuthill_mckee(tangent.tocsr(), symmetric_mode=True)):
        banded = csc_array(tangent[order][:, order])
        banded.sort_indices()
        assert network.rest_factor.fill < 0.9 * SuperLUFactor(banded, order).fill


@pytest.mark.parametrize("mesh_type", ["structured", "free", "braced", "isosceles-0.3"])
def test_a_large_network_fills_in_less_than_in_an_order_of_minimum_degree(mesh_type):
    network = sheet(mesh_type, 1e-3)  # squares with one diagonal have to be larger still
    assert network.rest_factor.fill < SuperLUFactor(network.tangent()).fill

"""Equilibria against independent solutions, and what is said when there are none."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.optimize import root

import springtune as st
from springtune.linalg.factors import SingularError
from springtune.mechanics.network import Network
from springtune.mechanics.newton import TOLERANCE
from springtune.mechanics.statics import SMALLEST_STEP, StaticProblem

from problems import arch, beam_problem
from tables import cases

STRONG = 400e3 / 181.87e6  # F/k of the paper's heaviest load [m]


@pytest.mark.parametrize("mesh_type", ["structured", "free"])
@pytest.mark.parametrize("s", [STRONG / 2, -STRONG / 100])
def test_nonlinear_equals_an_independent_solver(mesh_type, s):
    """MINPACK on forces written out here: it shares no assembly, tangent or elongation formula with the library."""
    problem, _ = beam_problem(mesh_type, length=0.05, height=0.02)
    mesh, free = problem.network.mesh, ~problem.network.held
    first, second = mesh.edges.T
    rest = np.hypot(*(mesh.points[second] - mesh.points[first]).T)
    load = np.zeros(mesh.points.shape)
    load[free] = s * problem.load
    size = np.abs(problem.linear(s).displacements).max()

    def out_of_balance(scaled):
        points = mesh.points.copy()
        points[free] += size * scaled
        vectors = points[second] - points[first]
        lengths = np.hypot(*vectors.T)
        pulls = ((lengths - rest) / lengths)[:, None] * vectors
        forces = load.copy()
        np.add.at(forces, first, pulls)
        np.add.at(forces, second, -pulls)
        return forces[free] / abs(s)

    best = root(out_of_balance, problem.linear(s).displacements[free] / size, tol=1e-13)
    found = problem.nonlinear(s)
    assert np.abs(best.fun).max() <= 1e-9
    assert found.converged and found.residual <= TOLERANCE
    assert np.abs(found.displacements[free] - size * best.x).max() <= 1e-8 * size


@pytest.mark.parametrize("beyond", [1.02, 1.3, 4.0])
@pytest.mark.parametrize("stiffness", [1.0, 50.0])
def test_an_arch_carries_its_closed_form_and_no_more(stiffness, beyond):
    """At height y its springs push 2 (L0 / L - 1) y, at most where L^3 = L0; it is told as a share of the load."""
    problem = arch(stiffness)
    rest = np.hypot(1.0, 0.1)
    length = rest ** (1 / 3)
    largest = 2 * stiffness * (rest / length - 1) * np.sqrt(length**2 - 1)
    assert problem.nonlinear(-0.98 * largest).converged
    s = -beyond * largest
    found = problem.nonlinear(s)
    assert not found.converged
    # Points of the path lie close to its top, where it is flat; the last equilibrium is a load step below.
    assert found.limit_share * beyond == pytest.approx(1, abs=2e-3)
    assert 1 / beyond - SMALLEST_STEP <= found.load_share <= 1 / beyond
    assert f"beyond {100 * found.load_share:.3g} % of the load" in found.reason
    status, message, pivots = problem.judge(s, found)
    assert status is st.Status.UNSTABLE and np.isnan(pivots)
    assert f"turns back and becomes unstable at {100 * found.limit_share:.3g} % of the load" in message


class Starts(StaticProblem):
    """Notes the first guesses of Newton's method, and at which loads."""

    guesses = ()

    def newton(self, s, start, *arguments):
        self.guesses += ((s, start),)
        return super().newton(s, start, *arguments)


def propped_arch(prop, rise=0.3):
    """An arch whose particle hangs on a third spring, straight above it: its springs' law, and the problem."""
    mesh = st.Mesh(np.array([[-1.0, 0.0], [1.0, 0.0], [0.0, rise], [0.0, 5.0]]), np.array([[0, 2, 3], [2, 1, 3]]))
    held = np.array([[True, True], [True, True], [True, False], [True, True]])
    own = np.where((mesh.edges != 3).all(axis=1), 1.0, 0.0)
    stiffness = np.where((mesh.edges == [2, 3]).all(axis=1), prop, own)
    problem = Starts(Network(mesh, held, stiffness), np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 1.0], [0.0, 0.0]]))
    return problem, lambda y: 2 * (1 - np.hypot(1, rise) / np.hypot(1, y)) * y + prop * (y - rise)


@pytest.mark.parametrize("beyond", [1.2, 1.5])
def test_an_arch_that_snaps_is_not_taken_to_its_other_side(beyond):
    """Newton's method leads there from load steps below the largest load: far from where the path pointed."""
    problem, force = propped_arch(0.06)
    largest = -force(np.linspace(0.0, 0.3, 10001)).min()
    found = problem.nonlinear(-beyond * largest)
    assert not found.converged
    assert found.limit_share * beyond == pytest.approx(1, abs=2e-3)


def test_an_arch_that_is_held_goes_over_in_steps():
    """A prop that is stiff enough leaves no snap, only particles that move fast: the other side is on the path."""
    problem, force = propped_arch(0.12)
    found = problem.nonlinear(force(-0.3))
    assert found.converged and np.isnan(found.unstable_share)
    assert found.displacements[2, 1] == pytest.approx(-0.6, rel=1e-9)
    assert len(problem.guesses) > 4


def test_a_load_step_is_no_smaller_than_said():
    """A load that no step reaches: they are halved down to a 64th of the load and no further."""
    network, pattern = arch().network, np.array([[0.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    problem, s = Starts(network, pattern), -0.1  # a hundred times what it carries
    found = problem.nonlinear(s)
    tried = [one / s for one, _ in problem.guesses]
    assert min(tried) == 1 / 64
    assert found.load_share == 0 and np.isnan(found.limit_share) and "beyond 0 % of the load" in found.reason


@pytest.mark.parametrize("snap", [0.0, 0.3])
def test_where_springs_snap_is_found_to_the_shortest_load_step(snap):
    """A particle jumps by 0.4 m at a share of the load, whatever the step: that is no turning in short steps."""

    class Snapping(Starts):
        def newton(self, s, start, *arguments):
            found, jump = super().newton(s, start, *arguments), np.zeros(start.shape)
            jump[2, 1] = -0.4 * (s < -0.4 * snap)
            return replace(found, displacements=found.displacements + jump)

    problem, _ = propped_arch(1.0)
    problem = Snapping(problem.network, problem.network.expand(problem.load))
    found = problem.nonlinear(-0.4)
    assert found.converged and snap - 1 / 2048 <= found.unstable_share <= snap
    if not snap:
        assert min(-s / 0.4 for s, _ in problem.guesses) == 1 / 2048


def test_a_prescribed_end_moves_a_chain_by_its_closed_form():
    """Two springs in a row, one of twice the stiffness: between them two thirds of the end's displacement and load."""
    mesh = st.Mesh(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [1.0, 1.0]]), np.array([[0, 1, 3], [1, 2, 3]]))
    held = np.array([[True, True], [False, True], [True, True], [True, True]])
    stiffness = np.where((mesh.edges == [0, 1]).all(axis=1), 1.0, 0.0) + 2 * (mesh.edges == [1, 2]).all(axis=1)
    given = np.zeros((4, 2))
    given[2, 0] = 0.03
    pattern = np.zeros((4, 2))
    pattern[1, 0] = 0.06
    problem = Starts(Network(mesh, held, stiffness), pattern, given=given)
    middle = (2 * 0.03 + 0.06) / 3
    pulls = np.array([-middle, 2 * (0.03 - middle)])  # of the network on its supports
    assert problem.load_norm == pytest.approx(np.sqrt(0.06**2 + (pulls**2).sum()), rel=1e-9)
    for found in (problem.linear(2.0), problem.nonlinear(2.0)):
        assert found.converged
        np.testing.assert_allclose(found.displacements[:, 0], [0, 2 * middle, 0.06, 0], atol=1e-9 * 0.06)
    ((_, start),) = problem.guesses
    np.testing.assert_array_equal(start, 2.0 * problem.slope)


@cases
def test_a_path_is_unstable_from_its_first_negative_or_singular_tangent_on(told, share):
    """Flutter on the way is no matter of where the path leads."""

    class Turning(StaticProblem):
        def stability(self, s, displacements, factor):
            if told is None:
                raise SingularError("singular")
            return told

    problem, _ = propped_arch(1.0)
    found = Turning(problem.network, problem.network.expand(problem.load)).nonlinear(-0.4)
    assert found.converged
    np.testing.assert_equal(found.unstable_share, share)


def test_newton_starts_from_the_series_about_rest():
    """Its order is 3: of half the load the error of the guess is a sixteenth, and that of the linear one a quarter."""
    problem = arch()
    errors, linear = [], []
    for s in (-4e-6, -2e-6):
        watched = Starts(problem.network, problem.network.expand(problem.load))
        found = watched.nonlinear(s)
        ((_, start),) = watched.guesses
        errors.append(np.abs(start - found.displacements).max())
        linear.append(np.abs(s * problem.slope - found.displacements).max())
    assert errors[0] / errors[1] == pytest.approx(16, rel=0.1)
    assert linear[0] / linear[1] == pytest.approx(4, rel=0.1)
    assert errors[0] < 1e-2 * linear[0]


@pytest.mark.parametrize(("stretch", "in_steps"), [(0.14, False), (0.16, True), (0.4, True)])
def test_springs_stretched_far_are_solved_in_load_steps(stretch, in_steps):
    """A spring between a clamp and a roller is stretched by the force over its stiffness; far is beyond 15 %."""
    mesh = st.Mesh(np.array([[0.0, 0.0], [1.0, 0.0], [0.5, 1.0]]), np.array([[0, 1, 2]]))
    held = np.array([[True, True], [False, True], [True, True]])
    network = Network(mesh, held, (mesh.edges == [0, 1]).all(axis=1).astype(float))
    problem = Starts(network, np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]]))
    found = problem.nonlinear(stretch)
    assert found.converged and found.displacements[1, 0] == pytest.approx(stretch, rel=1e-9)
    loads = [s for s, _ in problem.guesses]
    assert (len(set(loads)) > 1) is in_steps
    assert loads.count(stretch) == 1 + in_steps  # what is far is not sought from another first guess


@pytest.mark.parametrize(("turn", "in_steps"), [(0.29, False), (0.31, True)])
def test_springs_turned_far_are_solved_in_load_steps(turn, in_steps):
    """A rod turns about its clamp, which a long spring across hinders: far is a chord of 0.3 of its length."""
    mesh = st.Mesh(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, -10.0]]), np.array([[0, 2, 1]]))
    held = np.array([[True, True], [False, False], [True, True]])
    network = Network(mesh, held, np.where((mesh.edges == [0, 1]).all(axis=1), 10.0, 1.0))
    angle = 2 * np.arcsin(turn / 2)
    displacements = np.array([[0.0, 0.0], [np.cos(angle) - 1, np.sin(angle)], [0.0, 0.0]])
    pattern = np.zeros((3, 2))
    pattern[1] = network.free_forces_over_k(displacements)
    problem = Starts(network, pattern)
    found = problem.nonlinear(1.0)
    assert found.converged
    np.testing.assert_allclose(found.displacements, displacements, atol=1e-9)
    assert (len({s for s, _ in problem.guesses}) > 1) is in_steps


class Singular:
    """A factor of a tangent that is none."""

    @property
    def negative_pivots(self):
        raise SingularError("singular")


def pivots(count):
    return SimpleNamespace(negative_pivots=count)


@cases
def test_an_equilibrium_is_worth_what_its_flaws_leave(changes, status, message, negative):
    problem, s = arch(), -1e-4
    found = replace(problem.nonlinear(s), **changes)
    got, told, pivots = problem.judge(s, found)
    assert got is status and (message in told if message else not told)
    np.testing.assert_equal(pivots, negative)

"""Networks against closed forms, and their forces and tangents against each other."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import csc_array

from springtune.linalg.factors import SingularError, SuperLUFactor

from problems import beam_problem


def bent(problem, seed, amplitude):
    """Displacements of the size of a tenth of an edge, held particles at rest."""
    generator = np.random.default_rng(seed)
    displacements = amplitude * generator.standard_normal(problem.network.held.shape)
    return np.where(problem.network.held, 0.0, displacements)


@settings(max_examples=20)
@given(seed=st.integers(0, 2**31), amplitude=st.floats(1e-6, 5e-4), mesh_type=st.sampled_from(["structured", "free"]))
def test_tangent_is_the_derivative_of_the_resistance(seed, amplitude, mesh_type):
    problem, _ = beam_problem(mesh_type)
    network = problem.network
    here = bent(problem, seed, amplitude)
    direction = network.reduce(bent(problem, seed + 1, 1.0))
    step = 1e-6 * amplitude
    moved = step * network.expand(direction)
    difference = (network.resistance(here + moved) - network.resistance(here - moved)) / (2 * step)
    exact = network.tangent(here) @ direction
    # Central differences leave step^2 (here 1e-12 of the bend) and rounding of forces over the step.
    assert np.linalg.norm(difference - exact) <= 1e-7 * np.linalg.norm(exact)


@settings(max_examples=20)
@given(seed=st.integers(0, 2**31), amplitude=st.floats(1e-5, 5e-4))
def test_resistance_is_the_derivative_of_the_energy(seed, amplitude):
    problem, _ = beam_problem("free")
    network = problem.network
    here, direction = bent(problem, seed, amplitude), bent(problem, seed + 1, amplitude)
    step = 1e-4
    difference = network.energy(here + step * direction) - network.energy(here - step * direction)
    work = network.resistance(here) @ network.reduce(direction)
    scale = np.linalg.norm(network.resistance(here)) * np.linalg.norm(direction)
    assert abs(difference / (2 * step) - work) <= 1e-6 * scale


@given(angle=st.floats(-3.1, 3.1), shift=st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
@settings(max_examples=30)
def test_rigid_motion_meets_no_resistance(angle, shift):
    problem, _ = beam_problem()
    points = problem.network.mesh.points
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    displacements = points @ turn.T + np.array(shift) - points
    # Coordinates of size 1 are rounded to 1e-16, over springs of 5 mm.
    assert np.abs(problem.network.resistance(displacements)).max() <= 1e-14
    assert problem.network.energy(displacements) <= 1e-25


def test_pivots_beside_the_diagonal_are_not_counted():
    """Eigenvalues 1 and -1, no pivot on the diagonal: both signs of the factor are positive, and say nothing."""
    matrix = csc_array(np.array([[0.0, 1.0], [1.0, 0.0]]))
    factor = SuperLUFactor(matrix, np.arange(2))
    assert factor.solve(np.array([1.0, 2.0])).tolist() == [2.0, 1.0]
    with pytest.raises(SingularError, match="zero pivot"):
        factor.negative_pivots  # noqa: B018

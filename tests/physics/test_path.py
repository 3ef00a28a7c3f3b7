"""Whole sensitivity curves against separate solves."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from springtune.path import ORDER, Expansion, stable_until, trace

from problems import beam_problem

K = 181.87e6
RATIOS = np.linspace(0.4, 1.6, 61)


@pytest.mark.parametrize(
    ("mesh_type", "length", "height", "size", "force"),
    [
        ("structured", 0.2, 0.04, 5e-3, 400e3),
        ("structured", 0.2, 0.03, 2e-3, 300e3),
        ("free", 0.2, 0.04, 5e-3, 400e3),
        ("free", 0.1, 0.02, 2e-3, 20e3),
        ("structured", 0.1, 0.02, 5e-3, -20e3),
    ],
)
def test_curve_agrees_with_separate_solves(mesh_type, length, height, size, force):
    problem, weights = beam_problem(mesh_type, length, height, size)
    targets = force / (RATIOS * K)
    values, errors = trace(problem, weights, targets)
    for place in range(0, 61, 12):
        found = problem.newton(targets[place], targets[place] * problem.slope)
        assert found.converged
        assert values[place] == pytest.approx(np.tensordot(found.displacements, weights, axes=2), rel=1e-6)
    assert (errors <= 1e-6).all()


def test_next_to_buckling_the_curve_has_a_hole_or_the_truth():
    """200x30 under 30 kN crosses its buckling load; what the curve gives there is an equilibrium, the rest is NaN."""
    problem, weights = beam_problem("free", 0.2, 0.03, 5e-3)
    targets = -30e3 / (RATIOS * K)
    values, _ = trace(problem, weights, targets)
    assert np.isnan(values).sum() <= 6
    for place in range(0, 61, 4):
        if np.isnan(values[place]):
            continue
        found = problem.newton(targets[place], problem.start.predict(targets[place]))
        if found.converged:
            assert values[place] == pytest.approx(np.tensordot(found.displacements, weights, axes=2), rel=1e-6)


def test_stable_part_of_a_curve_ends_at_the_buckling_load():
    problem, _ = beam_problem("structured", 0.2, 0.03, 5e-3)
    targets = -30e3 / (RATIOS * K)
    stable = stable_until(problem, targets)
    assert stable[-1] and not stable[0]
    assert (np.diff(stable.astype(int)) >= 0).all()  # stiffer is more stable
    for place in (stable.argmax() - 2, stable.argmax() + 1):
        pivots = problem.newton(targets[place], targets[place] * problem.slope).factor.negative_pivots
        assert (pivots == 0) == stable[place]


def test_series_error_falls_with_the_order():
    """The error of a truncated series about rest is of the order cut off: slope order + 1 in the load."""
    problem, weights = beam_problem("structured", 0.2, 0.04, 5e-3)
    loads = np.array([2e-5, 4e-5])
    for order in (1, 2, 3):
        series = Expansion(problem.network, problem.load, 0.0, None, problem.rest_factor, order=order)
        series_errors = []
        for s in loads:
            found = problem.newton(s, s * problem.slope)
            approximate = np.tensordot(s ** np.arange(order + 1.0), series.coefficients, axes=1)
            series_errors.append(np.linalg.norm(approximate - found.displacements))
        rate = np.log2(series_errors[1] / series_errors[0])
        assert rate == pytest.approx(order + 1, abs=0.1)


@settings(max_examples=10, deadline=None)
@given(share=st.floats(0.05, 1.0))
def test_series_about_a_loaded_point_meets_that_about_rest(share):
    problem, weights = beam_problem("free", 0.1, 0.02, 5e-3)
    s = share * 20e3 / K
    found = problem.newton(s, s * problem.slope)
    factor = problem.network.factorize(found.displacements)
    local = Expansion(problem.network, problem.load, s, found.displacements, factor)
    targets = np.array([0.5 * s, s, 1.2 * s])
    near, _ = local.measure(weights, targets)
    rest, _ = problem.rest.measure(weights, targets)
    assert near == pytest.approx(rest, rel=1e-9)
    assert local.order == ORDER

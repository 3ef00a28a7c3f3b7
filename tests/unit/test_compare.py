"""Errors and best stiffness against their definitions."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from springtune.compare import best_stiffness, deformation_error
from springtune.geometry import Beam
from springtune.materials import Material
from springtune.springs.calibrated import calibrate
from springtune.springs.lattice import predicted_stiffness


def test_deformation_error_is_signed_by_direction():
    assert deformation_error([1.1, 0.9, -1.1, -0.9], [1.0, 1.0, -1.0, -1.0]) == pytest.approx([0.1, -0.1, -0.1, 0.1])


@example(best=1.5, bend=0.03, sign=-1.0)  # the root falls on a sample, between two pieces of the spline
@given(best=st.floats(0.5, 1.5), bend=st.floats(-0.3, 0.3), sign=st.sampled_from([-1.0, 1.0]))
def test_best_stiffness_of_a_known_curve(best, bend, sign):
    """U = 1/k + bend/k^2 meets its own value at k = best."""
    stiffness = np.linspace(0.4, 1.6, 61)
    displacement = sign * (1 / stiffness + bend / stiffness**2)
    reference = sign * (1 / best + bend / best**2)
    if bend < 0 and -2 * bend / best > 0.9:
        return  # the curve turns back and meets the value twice
    assert best_stiffness(stiffness, displacement, reference) == pytest.approx(best, rel=1e-9)


def test_best_stiffness_is_nan_where_there_is_none():
    stiffness = np.linspace(0.4, 1.6, 61)
    assert np.isnan(best_stiffness(stiffness, 1 / stiffness, 100.0))
    assert np.isnan(best_stiffness(stiffness, 1 / stiffness, np.nan))
    assert np.isnan(best_stiffness(stiffness, np.full(61, np.nan), 1.0))


def test_holes_of_a_curve_do_not_spoil_its_best_stiffness():
    stiffness = np.linspace(0.4, 1.6, 61)
    displacement = 1 / stiffness
    displacement[:20] = np.nan
    assert best_stiffness(stiffness, displacement, 1.0) == pytest.approx(1.0, rel=1e-9)


def test_calibration_is_the_mean_and_refuses_a_missing_curve():
    assert calibrate([1.0, 2.0, 6.0]) == 3.0
    for bad in ([], [1.0, float("nan")]):
        with pytest.raises(ValueError, match="sensitivity"):
            calibrate(bad)


@pytest.mark.parametrize(("size", "expected"), [(1e-3, 176.8e6), (2e-3, 171.9e6), (5e-3, 158.9e6)])
def test_predicted_stiffness_of_the_calibration_beam(size, expected):
    steel, beam = Material("steel", 210e9, 0.3), Beam("200x30", 0.2, 0.03, 1e-3)
    assert predicted_stiffness(steel, beam, size) == pytest.approx(expected, rel=5e-4)

"""Errors and best stiffness against their definitions."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as some

import springtune as st
from springtune.problem.compare import best_stiffness, deformation_error, sign_sentence, sign_word
from springtune.springs.calibrated import calibrate


def test_deformation_error_is_signed_by_direction():
    assert deformation_error([1.1, 0.9, -1.1, -0.9], [1.0, 1.0, -1.0, -1.0]) == pytest.approx([0.1, -0.1, -0.1, 0.1])


def test_the_word_of_a_sign_turns_with_the_reference():
    assert [sign_word(error, 1e-3) for error in (0.1, -0.1, 0.0, np.nan)] == ["too soft", "too stiff", "", ""]
    assert [sign_word(error, -1e-3) for error in (0.1, -0.1)] == ["too stiff", "too soft"]
    assert sign_word(0.1, np.nan) == "" and sign_word(-0.1, -2e6, "stress") == "too large"


def test_the_sentence_of_signs_is_true_for_all_loads():
    assert sign_sentence({"traction": 2.0, "shear": 1.0}) == sign_sentence({}) == "positive: too soft"
    assert sign_sentence({"pressure": -2.0, "compression": -1.0}) == "negative: too soft"
    mixed = sign_sentence({"pressure": -2.0, "traction": 1.0, "compression": -1.0})
    assert mixed.startswith("positive: too soft; under pressure and compression, where") and "negative is" in mixed


STIFFNESS = np.linspace(0.4, 1.6, 61)


def found(curve, reference, first_stable=0.0):
    """Best stiffness of a curve given as a function, stable from a stiffness on."""
    stable = STIFFNESS >= first_stable

    def solve(stiffness):
        return curve(stiffness) if stiffness >= first_stable else np.nan

    return best_stiffness(STIFFNESS, curve(STIFFNESS), stable, reference, solve)


@example(best=1.5, bend=0.03, sign=-1.0)  # the root falls on a sample
@given(best=some.floats(0.5, 1.5), bend=some.floats(-0.3, 0.3), sign=some.sampled_from([-1.0, 1.0]))
def test_best_stiffness_of_a_known_curve(best, bend, sign):
    """U = 1/k + bend/k^2 meets its own value at k = best."""
    if bend < 0 and -2 * bend / best > 0.9:
        return  # the curve turns back and meets the value twice
    met = found(lambda k: sign * (1 / k + bend / k**2), sign * (1 / best + bend / best**2))
    assert (met.status, met.message) == (st.Status.SOLVED, "")
    assert met.stiffness == pytest.approx(best, rel=1e-9)


@example(place=0.713, first_stable=0.7)  # between two samples of which one is stable
@example(place=0.707, first_stable=0.711)
@given(place=some.floats(0.45, 1.55), first_stable=some.floats(0.42, 1.5))
def test_best_stiffness_is_of_a_stable_point(place, first_stable):
    met = found(lambda k: 1 / k, 1 / place, first_stable)
    if abs(place / first_stable - 1) < 1e-4:
        return  # the search ends before the very end of the stable part
    assert met.status == (st.Status.SOLVED if place > first_stable else st.Status.UNSTABLE)
    assert met.stiffness == pytest.approx(place if place > first_stable else np.nan, rel=1e-9, nan_ok=True)


def test_best_stiffness_in_a_gap_is_solved_for_or_missing_with_a_reason():
    """The curve turns at .711 and is not known to .781; its own root there is not where its samples point."""

    def solve(stiffness):
        return 1 / stiffness + 1e-3 / (stiffness - 0.711) if stiffness > 0.711 else np.nan

    displacement = np.array([solve(stiffness) for stiffness in STIFFNESS])
    displacement[STIFFNESS < 0.781] = np.nan
    displacement[STIFFNESS < 0.6] = 1 / STIFFNESS[STIFFNESS < 0.6]
    stable = STIFFNESS >= 0.781
    met = best_stiffness(STIFFNESS, displacement, stable, solve(0.777), solve)
    assert met.status == st.Status.SOLVED and met.stiffness == pytest.approx(0.777, rel=1e-9)
    nothing = best_stiffness(STIFFNESS, displacement, stable, solve(0.777), lambda stiffness: np.nan)
    assert np.isnan(nothing.stiffness) and nothing.status == st.Status.NOT_CONVERGED and "gap" in nothing.message


def test_best_stiffness_is_nan_where_there_is_none():
    for reference in (100.0, np.nan):
        met = found(lambda k: 1 / k, reference)
        assert np.isnan(met.stiffness) and met.status == st.Status.FAILED and met.message
    empty = best_stiffness(STIFFNESS, np.full(61, np.nan), np.zeros(61, dtype=bool), 1.0, lambda k: np.nan)
    assert np.isnan(empty.stiffness) and empty.status == st.Status.NOT_CONVERGED


def test_holes_of_a_curve_do_not_spoil_its_best_stiffness():
    displacement = 1 / STIFFNESS
    displacement[:20] = np.nan
    met = best_stiffness(STIFFNESS, displacement, np.isfinite(displacement), 1.0, lambda k: 1 / k)
    assert met.stiffness == pytest.approx(1.0, rel=1e-9)


def test_calibration_is_the_mean_and_refuses_a_missing_curve():
    assert calibrate([("a", 1.0, ""), ("b", 2.0, ""), ("c", 6.0, "")]) == 3.0
    with pytest.raises(ValueError, match="no sensitivity curve"):
        calibrate([])
    with pytest.raises(ValueError, match="curve of fine has no best stiffness: it is unstable there"):
        calibrate([("coarse", 1.0, ""), ("fine", np.nan, "it is unstable there")])

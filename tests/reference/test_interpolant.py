"""Interpolants of the unit problem: against solves, closed forms and their own estimates."""

from functools import cache

import numpy as np
import pytest

from springtune.problem.loads import AXIAL, BENDING, FACE, SHEAR
from springtune.reference import interpolant
from springtune.reference.interpolant import TOLERANCE, Interpolant, chebyshev_points, lagrange_values
from springtune.reference.small_strain import solve_unit
from springtune.studies.runs import store

from tables import slow_but

BOXES = {
    AXIAL: ((1.0, 12.0), (0.0, 0.5)),
    BENDING: ((3.0, 7.0), (0.2, 0.4)),
    SHEAR: ((0.5, 1.0), (-0.1, 0.2)),
    FACE: ((2.0, 3.0), (0.25, 0.45)),
}


@cache
def built(kind):
    return Interpolant.build(kind, *BOXES[kind])


def points(box, count, seed):
    """Random points of a box, and points on its edges."""
    (first, last), nus = box
    random = np.random.default_rng(seed)
    aspects = np.exp(random.uniform(np.log(first), np.log(last), count))
    ratios = random.uniform(*nus, count)
    aspects[:2], ratios[2:4] = (first, last), nus
    return aspects, ratios


def errors(found, kind, aspects, ratios):
    """Relative errors of the four answers against solves whose own error is a tenth of what is measured."""
    solved = [solve_unit(aspect, nu, kind, TOLERANCE / 10) for aspect, nu in zip(aspects, ratios)]
    answers = found.evaluate(aspects, ratios)
    exact = {name: np.array([getattr(one, name) for one in solved]) for name in interpolant.ANSWER_NAMES}
    scale = exact | {"rotation": exact["rotation"] + exact["strain"]}  # what decides is the larger one
    return {name: np.abs(getattr(answers, name) - exact[name]) / scale[name] for name in interpolant.ANSWER_NAMES}


@pytest.mark.parametrize("kind", slow_but([FACE], (FACE, AXIAL, BENDING, SHEAR)), ids=str)
def test_errors_are_below_the_estimate(kind):
    found = built(kind)
    difference = errors(found, kind, *points(BOXES[kind], 5, seed=1))
    assert found.error_estimate <= TOLERANCE
    assert max(difference["displacement"].max(), difference["mean_displacement"].max()) < found.error_estimate
    assert max(difference["rotation"].max(), difference["strain"].max()) < interpolant.LIMITS_TOLERANCE


@pytest.mark.slow
@pytest.mark.parametrize("kind", BOXES, ids=str)
@pytest.mark.parametrize("box", [((1.0, 12.0), (0.0, 0.5)), ((0.1, 40.0), (-0.3, 0.5))], ids=["usual", "wide"])
def test_errors_are_below_the_estimate_in_any_box(kind, box):
    found = Interpolant.build(kind, *box)
    difference = errors(found, kind, *points(box, 24, seed=np.random.SeedSequence().entropy))
    assert difference["displacement"].max() < found.error_estimate <= TOLERANCE


def test_a_beam_that_does_not_contract_is_a_bar():
    aspects = np.geomspace(1, 12, 7)
    np.testing.assert_allclose(built(AXIAL).evaluate(aspects, 0.0).displacement, 2 * aspects, rtol=TOLERANCE)


@pytest.mark.slow
def test_long_beams_are_as_beam_theory_has_them():
    # What the clamp adds does not grow with the length, and falls to 1/2500 of it.
    slender = Interpolant.build(AXIAL, (20, 40), (0.3, 0.3)).evaluate([20, 40], 0.3).displacement
    np.testing.assert_allclose(slender[1] - slender[0], 2 * 20, rtol=4 * TOLERANCE)  # of a difference: 40/20 of both
    # Timoshenko, shear correction 5/6: what the clamp adds is of the order of the height over the length, squared.
    aspect = np.array([30, 45, 60])
    bent = Interpolant.build(BENDING, (30, 60), (0.3, 0.3)).evaluate(aspect, 0.3).displacement
    np.testing.assert_allclose(bent, 8 * aspect**3 + 4.8 * 1.3 * aspect, rtol=2 / aspect.min() ** 2)
    # A long block sheared between plates: the shear modulus alone, but for its two ends.
    sheared = Interpolant.build(SHEAR, (30, 60), (0.3, 0.3)).evaluate(aspect, 0.3).displacement
    np.testing.assert_allclose(sheared, 4 * 1.3, rtol=0.5 / aspect.min())


def test_a_narrow_box_needs_fewer_nodes():
    narrow = Interpolant.build(AXIAL, (4, 5), (0.3, 0.35))
    assert narrow.values[0].size < built(AXIAL).values[0].size


def test_a_box_without_a_width():
    along = Interpolant.build(AXIAL, (2, 3), (0.3, 0.3))
    assert along.values.shape[2] == 1
    one = Interpolant.build(AXIAL, (2.5, 2.5), (0.3, 0.3))
    assert one.solves == 1
    exact = solve_unit(2.5, 0.3, AXIAL, TOLERANCE / 10).displacement
    for found in (along, one):
        assert found.evaluate(2.5, 0.3).displacement == pytest.approx(exact, rel=found.error_estimate)
    with pytest.raises(ValueError, match=r"with nu = 0.31 is outside .* 0.3 to 0.3"):
        along.evaluate(2.5, 0.31)


def test_points_outside_are_refused():
    with pytest.raises(ValueError, match=r"aspect ratio 13 with nu = 0.3 is outside the interpolant of 'axial'"):
        built(AXIAL).evaluate([2.0, 13.0], 0.3)
    # The twelve digits of an aspect ratio may round an end of the box outwards. It is clipped: equal bits.
    outside = 12 * (1 + 1e-12)
    assert built(AXIAL).evaluate(outside, 0.5).displacement == built(AXIAL).evaluate(12, 0.5).displacement


def test_what_cannot_be_certified_is_said():
    says = "'axial' over aspect ratios 1 to 12 .*: .* the last one, the tolerance is 5.0e-13"
    with pytest.raises(interpolant.NotCertifiedError, match=says):
        Interpolant.build(AXIAL, *BOXES[AXIAL], tolerance=1e-12)


def test_a_rough_answer_is_not_certified(monkeypatch):
    """A step in Poisson's ratio, as no nodes can resolve it: the checks find it."""

    def stepped(aspect, nu, kind, tolerance):
        return solve_unit(aspect, nu, kind, tolerance).scaled(1.001 if nu > 0.31 else 1.0)

    monkeypatch.setattr("springtune.reference.small_strain.solve_unit", stepped)
    with pytest.raises(interpolant.NotCertifiedError, match=r"error estimate \d\.\de-0\d with"):
        Interpolant.build(AXIAL, (2, 2), (0.3, 0.33))


def test_an_interpolant_goes_through_a_file(tmp_path):
    found = built(FACE)
    store.add(tmp_path / "one.h5", {"one": found.arrays()})
    again = Interpolant.from_arrays(FACE, store.read_one(tmp_path, "one", ("aspect_range", "nu_range", "values")))
    at = points(BOXES[FACE], 50, seed=3)
    np.testing.assert_array_equal(again.evaluate(*at).displacement, found.evaluate(*at).displacement)
    assert again.error_estimate == found.error_estimate


def test_nodes_of_twice_as_many_intervals_hold_those_before():
    for count in (3, 5, 9, 17, 33):
        np.testing.assert_array_equal(chebyshev_points(2 * count - 1)[::2], chebyshev_points(count))


def test_weights_are_exact_for_polynomials():
    # Of degree 8 with 9 nodes, at nodes, too; the Lebesgue constant is 2.4.
    places, series = np.linspace(-1, 1, 41), np.random.default_rng(5).normal(size=9)
    values = np.polynomial.chebyshev.chebval(chebyshev_points(9), series)
    exact = np.polynomial.chebyshev.chebval(places, series)
    np.testing.assert_allclose(lagrange_values(places, 9) @ values, exact, atol=1e-9 * 9 * np.abs(series).max())

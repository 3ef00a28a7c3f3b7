"""Refinements: which values they take, what they find, and what a stopped run leaves."""

import math
import shutil

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from springtune.studies.kinds.refinement.batches import Rule, crossings, refine
from springtune.studies.kinds.refinement.collect import groups, write
from springtune.studies.runs import driver, store
from springtune.studies.runs.plan import plan

from campaigns import do_stages, load_text
from tables import STUDIES, study_text


@pytest.fixture
def load(tmp_path):
    return lambda *changes: load_text(tmp_path, study_text("refinement", *changes))


UNITS = {"mesh_size": "m", "force": "N", "thickness": "m", "young_modulus": "Pa", "poisson_ratio": "1"}


def solved(folder):
    """How many values are stored."""
    return sum(len(store.stored(path)) for path in (folder / "refinement").glob("*.h5"))


def run(study, folder):
    """Run the stage; the number of values that were solved."""
    before = solved(folder)
    do_stages(study, folder, "refinement")
    return solved(folder) - before


def collected(study, folder):
    return groups(study, folder)["/refinement"]


# -- the rule ----------------------------------------------------------------------------------------------------------


@given(
    st.floats(0.02, 0.98), st.integers(2, 9), st.integers(12, 60), st.booleans(), st.sampled_from([0.11, 0.013, 0.0017])
)
@settings(max_examples=50)
def test_a_root_is_enclosed_as_narrowly_as_asked(root, points, most, logarithmic, resolution):
    rule = Rule(1.0, 10.0, points, logarithmic, 10.0, resolution, most)
    at = rule.value(root)
    places, batches, errors = refine(rule, lambda values: [value - at for value in values])
    assert len(set(places)) == len(places) <= most and set(batches) == set(range(max(batches) + 1))
    assert batches == sorted(batches)
    (found,) = crossings(rule, places, errors)
    assert found.level == 0 and abs(found.value - at) <= found.width
    # One value a batch halves the interval that has the root.
    halvings = min(most - points, max(0, math.ceil(math.log2(1 / (points - 1) / resolution))))
    enclosing = np.diff(sorted(places))[np.searchsorted(sorted(places), root, side="left") - 1]
    assert enclosing == pytest.approx(1 / (points - 1) / 2**halvings)


def test_the_tolerance_is_found_on_either_side():
    rule = Rule(0.0, 1.0, 5, False, 0.25, 1e-3, 200)
    places, _, errors = refine(rule, lambda values: [math.cos(math.pi * value) for value in values])
    found = crossings(rule, places, errors)
    assert [one.level for one in found] == [0.25, 0.0, -0.25]
    np.testing.assert_allclose([one.value for one in found], np.arccos([0.25, 0.0, -0.25]) / math.pi, atol=1e-3)


def test_where_nothing_is_crossed_nothing_is_added():
    rule = Rule(0.0, 1.0, 4, False, 0.1, 1e-3, 100)
    for error in (0.5, -0.02, math.nan):
        assert len(refine(rule, lambda values, error=error: [error] * len(values))[0]) == 4


def test_rounding_about_zero_is_no_root():
    """The error of an exact definition is rounding, another one on another processor."""
    rule, noise = Rule(0.0, 2.0, 5, False, 1e-3, 0.02, 40), np.random.default_rng(1)
    places, _, errors = refine(rule, lambda values: noise.uniform(-1e-12, 1e-12, len(values)))
    assert len(places) == 5 and not crossings(rule, places, errors)


def test_a_jump_is_enclosed_and_told_from_a_root():
    rule = Rule(0.0, 1.0, 3, False, 0.1, 1e-3, 100)
    places, _, errors = refine(rule, lambda values: [0.3 if value < 0.4 else -0.3 for value in values])
    assert [one.change for one in crossings(rule, places, errors)] == pytest.approx([-0.6] * 3)


@given(st.integers(5, 40), st.integers(0, 40))
def test_more_values_hold_those_before(most, more):
    def errors(values):
        return [math.sin(20 * value) for value in values]

    few, many = (refine(Rule(0.0, 1.0, 5, False, 0.3, 1e-4, count), errors) for count in (most, most + more))
    for before, after in zip(few, many):
        assert before == after[: len(before)] and len(after) <= most + more


# -- a study -----------------------------------------------------------------------------------------------------------


def test_the_stiffness_without_an_error_is_that_of_linear_springs(load, tmp_path):
    study = load()
    run(study, tmp_path)
    data = collected(study, tmp_path).sel(refinement="scale")
    for definition in ("lattice", "uniform"):
        one = data.sel(definition=definition)
        count = int(one.value_count)
        scale, error = one.refined_stiffness_scale.values[:count], one.deformation_error.values[:count]
        assert 5 < count <= 24 and (np.diff(one.batch[:count]) >= 0).all()
        assert np.isnan(one.refined_stiffness_scale[count:]).all()
        # In linear kinematics the displacement goes with one over the stiffness.
        best = scale[0] * (1 + error[0])
        np.testing.assert_allclose((1 + error) * scale, best, rtol=1e-9)
        levels = one.crossing_level.values[:3]
        np.testing.assert_array_equal(levels, [0.02, 0.0, -0.02])
        within = one.crossing_stiffness_scale_width.values[:3]
        assert (np.abs(one.crossing_stiffness_scale.values[:3] - best / (1 + levels)) < within).all()
        assert set(one.batch.values[:count]) == set(range(int(one.halved) + 1))
    assert data.refined_stiffness_scale.dims == ("definition", "point") and "batch" in data.coords
    names = write(xr.DataTree.from_dict({"/refinement": collected(study, tmp_path)}), tmp_path)
    rows = [(tmp_path / name).read_text().splitlines() for name in names]
    assert len(rows[0]) == 1 + int(data.value_count.sum()) and len(rows[1]) == 1 + 6


def test_raising_most_computes_what_is_new_and_nothing_else(load, tmp_path):
    assert run(load(("most: 24", "most: 10")), tmp_path) == 2 * 10
    few = collected(load(("most: 24", "most: 10")), tmp_path)
    more = load()
    added = run(more, tmp_path)
    data = collected(more, tmp_path)
    assert added == int(data.value_count.sum()) - 2 * 10
    assert run(more, tmp_path) == 0
    # The same as at once.
    shutil.rmtree(tmp_path / "refinement")
    run(more, tmp_path)
    np.testing.assert_array_equal(collected(more, tmp_path).deformation_error, data.deformation_error)
    shared = few.sizes["point"]
    np.testing.assert_array_equal(few.refined_stiffness_scale, data.refined_stiffness_scale[..., :shared])


def test_a_value_beyond_its_limits_is_a_hole_and_the_others_are_not(load, tmp_path):
    study = load()
    (job,) = [job for job in plan(study, tmp_path, 1).jobs.values() if job.stage.name == "refinement"]
    for task in job.content["files"]:
        driver.gone(job.stage.module, job.content, f"{task['name']} 0.875", "too slow", "")  # as there are none here
    run(study, tmp_path)
    data = collected(study, tmp_path)
    lost = data.refined_stiffness_scale == 0.875
    assert set(data.message.values[lost.values]) == {"too slow"} and np.isnan(data.deformation_error.values[lost]).all()
    assert (data.status.values[(data.batch >= 0).values & ~lost.values] == 1).all()


@pytest.mark.parametrize(
    ("parameter", "first", "last", "others"),
    [
        ("mesh_size", "2 mm", "5 mm", "    force: 1 kN\n"),
        ("force", "1 N", "1 kN", "    mesh_size: 5 mm\n"),
        ("thickness", "1 mm", "5 mm", "    mesh_size: 5 mm\n    force: 1 kN\n"),
        ("young_modulus", "1 GPa", "210 GPa", "    mesh_size: 5 mm\n    force: 1 kN\n"),
        ("poisson_ratio", "0", "0.5", "    mesh_size: 5 mm\n    force: 1 kN\n"),
    ],
)
def test_every_parameter_is_that_of_the_scene(load, tmp_path, parameter, first, last, others):
    import springtune as sp

    study = load(
        ("    force: 10 kN\n    mesh_size: 5 mm\n", others),
        ("[lattice, uniform]", "patch"),
        ("stiffness_scale", parameter),
        ("from: 0.5", f"from: {first}"),
        ("to: 2\n", f"to: {last}\n    points: 3\n"),
        ("most: 24", "most: 3"),
    )
    run(study, tmp_path)
    one = collected(study, tmp_path).isel(refinement=0).sel(definition="patch")
    value = float(one[f"refined_{parameter}"][2])
    assert one[f"refined_{parameter}"].attrs["units"] == UNITS[parameter]
    given = {"thickness": 1e-3, "young_modulus": 210e9, "poisson_ratio": 0.3, "mesh_size": 5e-3, "force": 1e3}
    given |= {parameter: value}
    beam = sp.Beam(0.1, 0.02, given["thickness"])
    material = sp.Material(given["young_modulus"], given["poisson_ratio"])
    mesh = sp.make_mesh(beam, "structured", given["mesh_size"])
    result = sp.Scene(beam, mesh, material, "traction", given["force"], definition="patch", kinematics="linear").solve()
    assert float(one.displacement[2]) == pytest.approx(result.displacement, rel=1e-9)
    assert float(one.deformation_error[2]) == pytest.approx(result.error, abs=1e-9)


@pytest.mark.parametrize("start", ["0", "-0.3"])
def test_a_logarithm_of_no_positive_number_is_refused(refusal, start):
    spacing = ("to: 2", "to: 0.5\n    spacing: logarithmic")
    text = study_text("refinement", ("stiffness_scale", "poisson_ratio"), ("from: 0.5", f"from: {start}"), spacing)
    assert f"refine.scale.from: {start} has no logarithm; give a larger one, or spac" in refusal(text)


def test_an_output_without_a_section_is_refused(refusal):
    head, _, rest = STUDIES["refinement"].partition("refine:")
    message = refusal(head + rest[rest.index("grids:") :])
    assert "'refinement' shows refinements and" in message and "none; add a section 'refine'" in message

"""Studies of which one sweeps what the other one states once: their scenes are matched by it."""

import itertools

import numpy as np
import pytest
import xarray as xr

import springtune as st
from springtune.studies.output.comparison import compare
from test_diff import made, written

FORCES = [1e3, 2e3]


def stated(force):
    """A study of one force; compression is one of its loads, whose force is below zero."""
    tree = made(load=("traction", "compression"))
    tree["force"].values[...] = force * np.array([1, -1])
    tree["displacement"].values[...] *= force
    return tree


def swept(*forces):
    """The same of several forces, as a study of them is written: the force is a dimension, and no variable."""
    parts = [stated(force).map_over_datasets(_without_force) for force in forces]
    groups = {}
    for path in ("/", "/sensitivity"):
        data = [part[path].to_dataset() for part in parts]
        over = [name for name in data[0].data_vars if "load" in data[0][name].dims]
        found = xr.concat([one[over] for one in data], xr.DataArray([*forces], dims="force", name="force"))
        groups[path] = xr.merge([found, data[0].drop_vars(over)], compat="equals", join="exact")
        groups[path]["force"].attrs["units"] = "N"
    tree = xr.DataTree.from_dict(groups)
    tree.attrs = made().attrs
    return tree


def _without_force(data):
    return data.drop_vars("force", errors="ignore")


def test_a_study_of_one_force_is_compared_at_its_label():
    for force in FORCES:
        found = compare(swept(*FORCES), stated(force * (1 + 1e-12)))
        (root, curves) = found.groups
        (other,) = set(FORCES) - {force}
        assert root.labels == {"force": ([other], [])} and root.cells[0].count == 32 == root.both
        assert not root.unlike and not any(root.variables) and not found.changes
        assert curves.both == 16


def test_what_changed_at_that_label_is_told():
    other = stated(2e3)
    other["displacement"].values[0, 0, 0, 0, 0, 0, 0] *= 2
    for pair in ((swept(*FORCES), other), (other, swept(*FORCES))):
        (row,) = compare(*pair).changes
        assert row.labels["force"] == 2e3 and row.labels["load"] == "traction"


def test_studies_with_and_without_a_sweep_merge():
    both = st.merge([stated(3e3), swept(*FORCES), stated(1e3)])
    assert both["force"].values.tolist() == [1e3, 2e3, 3e3] and both["status"].dtype == np.int8
    assert (both["status"] == st.Status.SOLVED).all()
    for force in both["force"].values:
        xr.testing.assert_allclose(
            both["displacement"].sel(force=force, drop=True), stated(force)["displacement"], rtol=1e-12
        )
    assert "force" not in both.data_vars and both["beam_length"].dims == ("beam",)


def test_any_order_of_studies_merges():
    """The first study that sweeps need not have every group, nor the second."""
    lacking = xr.DataTree(swept(3e3)["/"].to_dataset())
    trees = {"a": lacking, "b": swept(*FORCES), "c": stated(4e3)}
    merged = [st.merge([trees[name] for name in names]) for names in itertools.permutations(trees)]
    for both in merged:
        assert both["force"].values.tolist() == [1e3, 2e3, 3e3, 4e3]
        assert "force" in both["sensitivity/message"].dims and (both["status"] == st.Status.SOLVED).all()
        assert not compare(merged[0], both).different
        xr.testing.assert_equal(
            both["sensitivity/displacement"].sel(force=4e3, drop=True), stated(4e3)["sensitivity/displacement"]
        )


@pytest.mark.parametrize(
    ("name", "variable", "values"),
    [("thickness", "beam_thickness", [1e-3, 2e-3]), ("young_modulus", "material_young_modulus", [2e11, 2e11])],
)
def test_bodies_are_at_the_label_of_their_own(name, variable, values):
    """A thickness of each beam: its scenes are at that one, and nowhere else."""
    one = made(material=("steel",))
    one[variable].values[...] = values[: one[variable].size]
    (dimension,) = one[variable].dims
    every = np.unique(values)
    other = one.to_dataset()
    over = [each for each in other.data_vars if "load" in other[each].dims or each == variable]
    other = xr.merge([other[over].expand_dims({name: every}), other.drop_vars(over)]).copy(deep=True)
    found = st.merge([one, xr.DataTree(other.isel(beam=[0]))])
    for label, value in zip(found[dimension].values, values):
        here = found["status"].sel({dimension: label, name: value}) == st.Status.SOLVED
        assert here.all()
    if dimension == "beam":
        assert (found["status"].sel(beam="100x20", thickness=1e-3) == st.Status.NOT_REQUESTED).all()


def test_a_stiffness_that_is_not_scaled_has_the_scale_one():
    one = made().to_dataset()
    over = [name for name in one.data_vars if "definition" in one[name].dims]
    scaled = xr.merge([one[over].expand_dims(stiffness_scale=[0.5, 1.0]), one.drop_vars(over)])
    root = compare(xr.DataTree(scaled), made(), groups=["/"]).groups[0]
    assert root.labels == {"stiffness_scale": ([0.5], [])} and root.both == 32 and not root.unlike


def test_files_are_compared_alike(tmp_path):
    from click.testing import CliRunner

    from springtune.cli import main

    paths = written(swept(*FORCES), tmp_path / "swept.nc"), written(stated(2e3), tmp_path / "stated.nc")
    result = CliRunner().invoke(main, ["diff", *map(str, paths)])
    assert result.exit_code == 1 and "  force only before: 1 kN" in result.stdout
    assert "values that changed" not in result.stdout

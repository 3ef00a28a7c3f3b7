"""What changed from one dataset to another, and that nothing else is said to."""

import json

import numpy as np
import pytest
import xarray as xr

import springtune as st
from springtune.studies.output.comparison import Tolerance, compare

import synthetic
from synthetic import small as made
from synthetic import written
from tables import run

SCENE = {
    "beam": "100x20", "mesh_type": "free", "mesh_size": 5e-3, "material": "steel", "load": "bending",
    "definition": "patch", "kinematics": "linear",
}  # fmt: skip
CURVE = {name: label for name, label in SCENE.items() if name != "definition"}


def rows(found, name):
    return [row for row in found.changes if row.variable == name]


class TestSame:
    def test_labels_in_another_order_are_the_same(self, tmp_path):
        one = written(made(), tmp_path / "one.nc")
        other = made().map_over_datasets(lambda data: data.isel({name: slice(None, None, -1) for name in data.dims}))
        result = run("diff", one, written(other, tmp_path / "other.nc"))
        assert result.exit_code == 0 and "the same: " in result.stdout, result.output

    def test_every_kind_of_study_is_the_same_as_itself(self):
        tree = synthetic.dataset()
        found = compare(tree, tree.copy(deep=True))
        assert not found.different and {group.name for group in found.groups} == {node.path for node in tree.subtree}

    def test_seconds_and_what_solved_are_not_compared(self):
        other = made()
        for name, value in (("solve_seconds", 3), ("solver", "another"), ("sensitivity/curve_seconds", 3)):
            other[name].values[...] = value
        other.attrs |= {"created": "today"}
        found = compare(made(), other)
        assert not found.different and not found.attributes

    def test_flags_are_compared_as_words(self):
        other = made()
        status = other["status"]
        meanings = status.attrs["flag_meanings"].split()
        status.values[...] = meanings[::-1].index("solved")
        status.attrs["flag_meanings"] = " ".join(meanings[::-1])
        assert not compare(made(), other, groups=["/"]).different

    @pytest.mark.parametrize("name", ["displacement", "deformation_error", "force"])
    def test_the_tolerance_is_where_it_says(self, name):
        """Of the larger number where it has a unit, and as it is where it has none."""
        for factor, different in ((0.99, False), (1.01, True)):
            other = made()
            value = other[name].values[(0,) * other[name].ndim]
            change = 1e-4 * factor * (1.0 if name == "deformation_error" else value / (1 - 1e-4 * factor))
            other[name].values[(0,) * other[name].ndim] += change
            for pair in ((made(), other), (other, made())):
                assert compare(*pair, Tolerance(1e-4), ["/"]).different == different
        assert not compare(made(), other, Tolerance(0.0, 1.02 * change), ["/"]).different
        assert compare(made(), other, Tolerance(0.0, 0.98 * change), ["/"]).different


class TestChanges:
    def test_a_scene_that_changed_is_named(self):
        other = made()
        other["displacement"].loc[SCENE] *= 1.5
        (row,) = compare(made(), other).changes
        assert row.variable == "displacement" and row.labels == SCENE
        assert row.after == pytest.approx(1.5 * row.before)
        assert row.excess == pytest.approx(1e6 / 3)  # half of the smaller is a third of the larger

    def test_the_largest_is_first_and_the_others_are_counted(self, tmp_path):
        other = made()
        other["displacement"].values[...] *= 1.001
        other["displacement"].loc[SCENE] *= 2
        paths = written(made(), tmp_path / "one.nc"), written(other, tmp_path / "other.nc")
        result = run("diff", *paths, "--rows", 3)
        assert result.exit_code == 1
        lines = result.stdout.splitlines()
        first = lines.index("the largest changes, measured by the tolerance") + 2
        assert lines[first].endswith("100x20, free, 5 mm, bending, patch")  # labels that leave a choice
        assert lines[first + 3] == "  and 29 more; --rows shows them"
        assert "and 29 more" not in run("diff", *paths, "--rows", 32).stdout
        assert ["displacement", "32", "32"] in [line.split()[:3] for line in lines]

    def test_what_fails_is_a_status_and_its_values_are_gone(self):
        other = made()
        other["status"].loc[SCENE] = st.Status.FAILED
        other["displacement"].loc[SCENE] = np.nan
        other["message"].loc[SCENE] = "springs gone"
        found = compare(made(), other)
        (status,) = [one for one in found.groups[0].flags if one.changed]
        assert (status.rows[0].before, status.rows[0].after, status.rows[0].labels) == ("solved", "failed", SCENE)
        assert {row.variable for row in found.changes} == {"displacement", "message"}
        assert all(row.excess == np.inf for row in found.changes)

    def test_a_scene_that_is_not_asked_for_is_told_once(self):
        """Neither its values nor its status are changes."""
        other = made()
        for array in other["/"].data_vars.values():
            if "definition" in array.dims:
                array.loc[SCENE] = {"f": np.nan, "i": 0, "O": ""}[array.dtype.kind]
        found = compare(made(), other)
        assert found.groups[0].cells == ([SCENE], [])
        assert found.different and not found.changes and not any(one.changed for one in found.groups[0].flags)

    def test_labels_of_one_side_are_told_and_the_rest_is_compared(self, tmp_path):
        other = made(mesh_size=(1e-3, 5e-3))
        other["displacement"].values[...] = 1.0
        found = compare(made(), other, groups=["/"])
        assert found.groups[0].labels == {"mesh_size": ([2e-3], [1e-3])}
        assert [len(alone) for alone in found.groups[0].cells] == [16, 16]
        assert {row.labels["mesh_size"] for row in found.changes} == {5e-3}
        result = run("diff", written(made(), tmp_path / "a.nc"), written(other, tmp_path / "b.nc"), "--group", "/")
        assert "  mesh_size only after: 1 mm" in result.stdout.splitlines()

    def test_a_curve_is_one_row_at_its_largest_change(self):
        """Its smallest numbers are compared by its largest."""
        other = made()
        curve = other["sensitivity/displacement"].sel(CURVE)
        other["sensitivity/displacement"].loc[CURVE | {"stiffness_ratio": 1.0}] += 2e-3
        other["sensitivity/displacement"].loc[CURVE | {"stiffness_ratio": 1.5}] += 1e-3
        (row,) = compare(made(), other).changes
        assert row.labels == CURVE | {"stiffness_ratio": 1.0}
        assert row.excess == pytest.approx(2e-3 / (1e-6 * (float(curve.max()))))
        slight = made()
        slight["sensitivity/displacement"].loc[CURVE | {"stiffness_ratio": 0.5}] += 0.9e-6 * float(curve.max())
        assert not compare(made(), slight).different

    def test_groups_and_variables_of_one_side(self):
        other = xr.DataTree.from_dict({"/": made().to_dataset().drop_vars("stiffness"), "/block": xr.Dataset()})
        found = compare(made(), other)
        assert found.only_groups == (["/sensitivity"], ["/block"]) and found.groups[0].variables == (["stiffness"], [])
        assert not compare(made(), other, groups=["/"], ignored=["stiff*"]).different


class TestCommand:
    def test_attributes_are_told_and_make_no_difference(self, tmp_path):
        other = made()
        other.attrs |= {"springtune_version": "1", "inputs": json.dumps({"small.yaml": "2"})}
        other.attrs |= {"software": json.dumps({"numpy": "3.0"})}
        paths = written(made(), tmp_path / "one.nc"), written(other, tmp_path / "other.nc")
        result = run("diff", *paths)
        assert result.exit_code == 0
        said = [" ".join(line.split()) for line in result.stdout.splitlines()]
        assert {"springtune_version 0 -> 1", "numpy none -> 3.0"} <= set(said)

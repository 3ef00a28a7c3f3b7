"""Datasets of two studies in one, also where one sweeps what the other states once."""

import itertools
import warnings

import numpy as np
import pytest
import xarray as xr

import springtune as st
from springtune.studies.output.comparison import compare
from test_diff import AXES, SCENE, made, written

import synthetic


def named(tree, name):
    tree.attrs = tree.attrs | {"study": name, "title": name, "config": f"title: {name}"}
    return tree


def emptied(tree, **labels):
    """The study without scenes of these labels, which it does not ask for then."""
    tree = tree.copy(deep=True)
    for array in tree["/"].data_vars.values():
        if set(labels) <= set(array.dims) and "definition" in array.dims:
            array.loc[labels] = {"f": np.nan, "i": 0, "O": ""}[array.dtype.kind]
    return tree


def sized(tree, first=0):
    """The study with bodies that differ: a beam is as long as its place among all labels says."""
    for name in ("beam_length", "beam_height", "beam_thickness"):
        tree[name].values[...] = [0.1 * (number + first + 1) for number in range(tree.sizes["beam"])]
    return tree


def two():
    """Studies of other beams, that share a mesh size and a definition."""
    one = sized(made())
    other = sized(made(beam=("50x10",), mesh_size=(5e-3 * (1 - 3e-16), 1e-2), definition=("patch", "area")), 5)
    other["solve_seconds"].values[...] = 99.0
    return named(one, "one"), named(other, "other")


class TestXarray:
    """What the dataset promises to those who know xarray."""

    def test_studies_of_other_beams_merge(self):
        """Force and size of every beam are variables, so nothing is lost; flags become numbers with holes."""
        one, other = (tree.to_dataset() for tree in two())
        other["mesh_size"] = [5e-3, 1e-2]  # by the digit: xarray knows no tolerance here
        other["material_young_modulus"] = one.material_young_modulus
        both = xr.merge([one, other], join="outer", compat="no_conflicts", combine_attrs="drop_conflicts")
        assert dict(both.sizes) | {"kinematics": 1} == {
            "beam": 3, "mesh_type": 2, "mesh_size": 3, "material": 1, "load": 2, "definition": 3, "kinematics": 1,
        }  # fmt: skip
        for data in (one, other):
            for name in ("displacement", "force", "beam_length", "beam_thickness", "status"):
                part = both[name].sel({dim: data[dim] for dim in data[name].dims})
                np.testing.assert_array_equal(part.values, data[name].values)
        assert both.status.dtype.kind == "f" and bool(both.status.isnull().any())
        flags = both.fillna({"status": st.Status.NOT_REQUESTED}).status.astype("int8")
        merged = st.merge([*two()])["status"]
        np.testing.assert_array_equal(flags.sel({name: merged[name] for name in flags.dims}), merged.values)


class TestMerge:
    def test_every_cell_of_each_is_there_and_no_other(self):
        one, other = two()
        both = st.merge([one, other])
        assert both["beam"].values.tolist() == ["200x40", "100x20", "50x10"]
        assert both["mesh_size"].values.tolist() == [2e-3, 5e-3, 1e-2]  # the first of what is one number
        assert both["status"].dtype == np.int8 and both["message"].dtype == object
        assert int((both["status"] == st.Status.SOLVED).sum()) == 32 + 16
        assert int((both["status"] == st.Status.NOT_REQUESTED).sum()) == 3 * 2 * 3 * 2 * 3 - 48
        assert both["status"].attrs == one["status"].attrs
        for tree in (one, other):
            found = compare(tree, both)
            assert not found.changes and not any(one.changed for group in found.groups for one in group.flags)
            assert all(group.cells[0].count == 0 for group in found.groups)
        assert both["sensitivity"].to_dataset().sizes["mesh_size"] == 3

    def test_the_order_matters_for_labels_alone(self):
        one, other = two()
        assert not compare(st.merge([one, other]), st.merge([other, one]), ignored=["*_seconds"]).different

    def test_merging_with_itself_or_a_part_of_it_changes_nothing(self):
        tree = synthetic.dataset()
        part = tree.map_over_datasets(lambda data: data.isel(beam=[1]) if "beam" in data.dims else data)
        for pair in ([tree], [tree, part], [part, tree]):
            both = st.merge(pair)
            assert not compare(tree, both).different
            assert [node.path for node in both.subtree] == [node.path for node in tree.subtree]

    def test_holes_are_filled_by_whoever_has_them(self):
        whole = made()
        parts = [emptied(whole, definition=name) for name in AXES["definition"]]
        assert not compare(whole, st.merge(parts)).different

    def test_a_value_of_any_dataset_is_held_against_others(self):
        """Beyond as many as fit eight bits, too."""
        data = xr.Dataset({"beam_length": ("beam", [1.0], {"units": "m"})})
        trees = [named(xr.DataTree(data.assign_coords(beam=[f"{n:03}"])), f"{n:03}") for n in range(130)]
        assert st.merge([*trees, trees[-1]]).sizes["beam"] == 130
        other = named(trees[-1].copy(deep=True) * 7.0, "other")
        with pytest.raises(ValueError, match="beam '129' is two things: beam_length is 1000 mm in 129 and 7000 mm in"):
            st.merge([*trees, other])

    def test_last_digits_of_what_is_shared_do_not_matter(self):
        one, other = made(), made()
        other["reference_displacement"].values[...] *= 1 + 1e-12
        other["solver"].values[...] = "SuperLU"
        other["iterations"].values[...] += 1
        both = st.merge([one, other])
        assert both["reference_displacement"].identical(one["reference_displacement"])
        assert both["iterations"].identical(one["iterations"])

    def test_numbers_of_cells_of_other_meshes_are_padded(self):
        """Dimensions without labels are as long as the longest."""

        def field(beam, count):
            data = xr.Dataset({"x": (("beam", "particle"), np.arange(1.0, count + 1)[None])}, {"beam": [beam]})
            return xr.DataTree.from_dict({"/": xr.Dataset(coords={"beam": [beam]}), "/fields": data})

        both = st.merge([field("a", 2), field("b", 3)])["fields/x"]
        np.testing.assert_array_equal(both.values, [[1, 2, np.nan], [1, 2, 3]])

    def test_groups_of_one_study_have_the_labels_of_both(self):
        one, other = two()
        other = xr.DataTree(other.to_dataset())
        both = st.merge([one, other])
        assert both["sensitivity"].to_dataset().beam.values.tolist() == ["200x40", "100x20", "50x10"]
        assert not compare(one, both, groups=["sensitivity"]).changes

    def test_what_is_swept_is_a_dimension_like_any_other(self):
        def swept(*forces):
            data = made()["/"].to_dataset().drop_vars("force")
            parts = [data.assign(displacement=force * data.displacement).expand_dims(force=[force]) for force in forces]
            return xr.DataTree(xr.concat(parts, "force"))

        both = st.merge([swept(1e3, 3e3), swept(2e3, 3e3 * (1 + 1e-12))])
        assert both["force"].values.tolist() == [1e3, 2e3, 3e3]
        np.testing.assert_allclose(both.displacement.sel(force=2e3), 2e3 * made().displacement)

    def test_it_says_where_it_comes_from_and_is_a_dataset_to_open(self, tmp_path):
        both = st.merge([*two()])
        assert both.attrs["study"] == "one + other" and both.attrs["springtune_version"] == "0"
        assert both.attrs["config"] == "# one\ntitle: one\n---\n# other\ntitle: other"
        assert both.attrs["history"].endswith("merged from one, other")
        both.to_netcdf(tmp_path / "both.nc")
        with st.open(tmp_path / "both.nc") as tree, warnings.catch_warnings():
            assert not compare(both, tree).different
            assert tree.status.dtype == np.int8


class TestRefusals:
    @pytest.mark.parametrize(
        ("change", "said"),
        [
            (
                lambda tree: tree["beam_length"].values.__setitem__(1, 0.7),
                r"beam '100x20' is two things: beam_length is 200 mm in one and 700 mm in other; give one of",
            ),
            (
                lambda tree: tree["material_young_modulus"].values.__setitem__(0, 2e11),
                r"material 'steel' is two things: material_young_modulus is 0.001 Pa in one and 2e\+11 Pa in other",
            ),
            (
                lambda tree: tree["force"].values.__setitem__((0, 0, 1), 7.0),
                r"force of 200x40, steel, bending is 0.002 N in one and 7 N in other; give what differs another label",
            ),
            (
                lambda tree: tree["status"].loc.__setitem__(SCENE, int(st.Status.FAILED)),
                r"status of 100x20, free, 5 mm, steel, bending, patch, linear is solved in one and failed in other",
            ),
            (
                lambda tree: tree["displacement"].attrs.__setitem__("units", "mm"),
                r"displacement has the unit \(m\) in one and \(mm\) in other",
            ),
        ],
    )
    def test_a_label_that_means_two_things_is_named(self, change, said):
        one, other = (named(sized(made()), name) for name in ("one", "other"))
        change(other)
        with pytest.raises(ValueError, match=said):
            st.merge([one, other])

    def test_what_was_swept_in_one_study_alone_is_told(self):
        data = made()["/"].to_dataset().drop_vars("force")
        one, other = named(xr.DataTree(data), "one"), named(xr.DataTree(data.expand_dims(force=[1e3])), "other")
        with pytest.raises(ValueError, match=r"has the dimensions \(material\) in one and \(force, material\) in"):
            st.merge([one, other])

    def test_flags_and_texts_without_dimensions_are_merged_and_compared(self):
        status = xr.Variable(
            (), np.int8(1), {"flag_values": np.arange(2, dtype="int8"), "flag_meanings": "not_requested solved"}
        )
        tree = xr.DataTree.from_dict(
            {"/": sized(made()).to_dataset(), "/one": xr.Dataset({"status": status, "message": "m"})}
        )
        both = st.merge([named(tree, "one"), named(tree, "other")])
        assert int(both["one/status"]) == 1 and str(both["one/message"].values) == "m"
        assert not compare(tree, both, groups=["one"]).different

    def test_studies_of_one_name_are_told_apart(self):
        one, other = sized(made()), sized(made(), 3)
        with pytest.raises(ValueError, match=r"beam_length is 100 mm in small \(number 1\) and 400 mm in small"):
            st.merge([one, other])

    def test_other_things_than_datasets_are_refused(self):
        with pytest.raises(ValueError, match="Dataset is no dataset; give what springtune.open returns"):
            st.merge([made().to_dataset()])
        with pytest.raises(ValueError, match="there are none"):
            st.merge([])

    def test_what_fits_no_memory_is_refused_at_once(self):
        def many(start):
            labels = {name: [f"{start}{number}" for number in range(300)] for name in "abc"}
            return xr.DataTree(xr.Dataset({"x": (tuple("abc"), np.broadcast_to(1.0, (300,) * 3))}, labels))

        with pytest.raises(ValueError, match=r"x: 5.83 GB over all labels together \(a 900, b 900, c 900\); sel"):
            st.merge([many("p"), many("q"), many("r")])


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
            both["displacement"].sel(force=force, drop=True), stated(force)["displacement"], rtol=1e-9
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

"""Datasets of two studies in one: what xarray does with them, and what `springtune.merge` does."""

import warnings

import numpy as np
import pytest
import xarray as xr

import springtune as st
from springtune.studies.output.comparison import compare
from test_diff import AXES, SCENE, made

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

    def test_a_cell_that_one_study_asks_for_alone_is_a_conflict_of_flags(self):
        one, other = made().to_dataset(), emptied(made(), definition="patch").to_dataset()
        with pytest.raises(xr.MergeError, match="conflicting values for variable 'status'"):
            xr.merge([one, other], join="outer", compat="no_conflicts")
        assert not compare(made(), st.merge([made(), emptied(made(), definition="patch")])).different


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
        for pair in ([tree], [tree, tree], [tree, part], [part, tree]):
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

    def test_scenes_that_were_solved(self):
        both = st.merge([_solved("thin", "1 mm", "10 kN"), _solved("thick", "2 mm", "30 kN")])
        thin, thick = both.displacement.values.ravel()
        # A sheet of twice the thickness yields half as much to a force.
        assert thick / thin == pytest.approx(3 / 2, rel=1e-9)
        assert both.beam_thickness.values.tolist() == [1e-3, 2e-3] and both.force.values.ravel().tolist() == [1e4, 3e4]


def _solved(name, thickness, force):
    """Dataset of one scene of a beam, solved by the library."""
    from springtune.studies.kinds.scenes.variables import ROOT

    beam, steel = st.Beam("60 mm", "12 mm", thickness=thickness), st.Material("210 GPa", 0.3)
    scene = st.Scene(
        beam, st.make_mesh(beam, "structured", "6 mm"), steel, "traction", force, definition="lattice",
        kinematics="linear",
    )  # fmt: skip
    result = scene.solve()
    axes = {
        "beam": (name,), "mesh_type": ("structured",), "mesh_size": (6e-3,), "material": ("steel",),
        "load": ("traction",), "definition": ("lattice",), "kinematics": ("linear",),
    }  # fmt: skip
    root = ROOT.empty(axes)
    for key, value in (
        ("displacement", result.displacement), ("deformation_error", result.error), ("status", int(result.status)),
        ("force", scene.force), ("beam_thickness", beam.thickness), ("beam_length", beam.length),
    ):  # fmt: skip
        root[key].values[...] = value
    return named(xr.DataTree(root), name)


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

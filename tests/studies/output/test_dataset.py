"""The dataset's form: dimensions, units, holes, what CF checkers say, and that a file is there whole or not at all."""

import subprocess

import h5py
import numpy as np
import pytest
import xarray as xr

import springtune as st
from cf import complaints
from springtune.registry import import_name
from springtune.studies.config.model import modules
from springtune.studies.kinds.bodies.collect import ROOT, SENSITIVITY
from springtune.studies.output import dataset
from springtune.studies.output.dataset import CHUNK_BYTES, Group
from springtune.studies.runs import keys
from springtune.studies.runs.source import clone, workflow_folder

from tables import STUDIES, beside, slow_but

AXES = beside(__file__)["dataset AXES"]

VERSION = {"springtune_version": "0"}

GROUPS = {
    f"{name.split('.')[2]}{group.name}": group
    for name in modules("collect")
    for group in vars(import_name(name)).values()
    if isinstance(group, Group)
}


def test_rows_fill_the_cells_of_their_labels_and_no_others():
    variables = {"error": (("load", "mesh_size"), "1", "error", np.nan), "status": (("load",), "1", "status", 0),
                 "seconds": ((), "s", "time", np.nan), "face": (("load", "point"), "m", "face", np.nan)}  # fmt: skip
    group, axes = Group("/rows", variables), {"load": ("traction", "shear"), "mesh_size": (1e-3, 2e-3), "point": (0, 1)}
    rows = [{"load": "shear", "status": 3}, {"load": "shear", "mesh_size": 2e-3, "error": 0.5}, {"seconds": 4.0}]
    rows += [{"load": "traction", "face": np.array([5.0])}, {"load": "shear", "status": None}]
    found = group.of_rows(axes, rows)
    np.testing.assert_array_equal(found.error, [[np.nan, np.nan], [np.nan, 0.5]])
    np.testing.assert_array_equal(found.face, [[5.0, np.nan], [np.nan, np.nan]])  # shorter than its dimension
    assert found.status.values.tolist() == [0, 3] and found.status.dtype == np.int8 and found.seconds == 4
    with pytest.raises(KeyError):
        group.of_rows(axes, [{"load": "bending", "status": 1}])


def test_written_dataset_opens_as_a_tree(tmp_path):
    path = tmp_path / "dataset.nc"
    root = ROOT.empty(AXES)
    root["displacement"].loc[{"beam": "b", "mesh_size": 2e-3}] = 1.5e-3
    root["message"].loc[{"beam": "a"}] = "why"
    curves = SENSITIVITY.empty(AXES)
    attributes = {"title": "t", "Conventions": "CF-1.11", "springtune_version": "0", "config": "x" * 200_000}
    dataset.write(path, {"/": root, "/sensitivity": curves}, attributes)
    for opened in (xr.open_datatree(path, engine="h5netcdf"), st.open(path)):
        with opened as tree:
            assert tree.attrs["title"] == "t" and len(tree.attrs["config"]) == 200_000
            assert float(tree.displacement.sel(beam="b", mesh_size=2e-3).max()) == 1.5e-3
            assert np.isnan(tree.displacement.sel(beam="a")).all()
            assert tree.message.sel(beam="a").values.ravel()[0] == "why"
            assert "best_stiffness" in tree["sensitivity"]
    assert [file.name for file in tmp_path.iterdir()] == ["dataset.nc"]


def test_arrays_are_read_when_needed_and_by_chunks(tmp_path):
    sizes = AXES | {"beam": tuple("abcdefgh"), "stiffness_ratio": tuple(np.linspace(0.4, 1.6, 5000))}
    curves = SENSITIVITY.empty(sizes)
    curves["displacement"].values[:] = np.random.default_rng(1).random(curves.displacement.shape)
    dataset.write(tmp_path / "dataset.nc", {"/": curves}, VERSION)
    with h5py.File(tmp_path / "dataset.nc") as file:
        chunk = file["displacement"].chunks
        assert chunk[-1] == 5000 and CHUNK_BYTES / 4 <= 8 * np.prod(chunk) <= CHUNK_BYTES
        assert file["best_stiffness"].chunks is None  # small
    with st.open(tmp_path) as tree:
        assert "..." in repr(tree.displacement.variable) or "values with dtype" in repr(tree.displacement.variable)
        assert tree.displacement.sel(beam="c").equals(curves.displacement.sel(beam="c"))


class TestConventions:
    """CF 1.11, as the checker of IOOS reads it; it looks at root groups alone, so each group is made one."""

    @pytest.mark.parametrize("name", slow_but({"bodies/"}, GROUPS))
    def test_every_group_of_every_kind_passes(self, tmp_path, name):
        group = GROUPS[name]
        dimensions = {dimension for row in group.variables.values() for dimension in row[0]}
        numbers = {"mesh_size", "stiffness_ratio", "face_position", "poisson_ratio", "friction", "strain"}
        axes = {one: (1.0, 2.0) if one in numbers else ("one", "two") for one in dimensions}
        study = st.load_study(small(tmp_path))
        attributes = keys.origin(study)
        dataset.write(tmp_path / "dataset.nc", {"/": group.empty(axes)}, attributes)
        assert complaints(tmp_path / "dataset.nc") == []

    def test_what_is_wrong_is_found(self, tmp_path):
        wrong = xr.Dataset({"a": ("x", [1.0], {"units": "fathom per banana"})}, {"x": ("x", [0.5])})
        wrong.to_netcdf(tmp_path / "dataset.nc", engine="h5netcdf")  # with _FillValue on a coordinate
        said = " ".join(complaints(tmp_path / "dataset.nc"))
        assert "_FillValue" in said and "fathom" in said and "history" in said


def small(folder):
    """Path of a small study in a folder."""
    (folder / "small.yaml").write_text(STUDIES["small_dataset"])
    return folder / "small.yaml"


def committed(folder, message="a"):
    """Make a clone of a folder, and return how git is called in it."""
    git = ["git", "-C", folder, "-c", "user.name=a", "-c", "user.email=a@b.c"]
    for command in (["init", "-q"], ["add", "."], ["commit", "-q", "-m", message]):
        subprocess.run([*git, *command], check=True)
    return git


def library(folder):
    """Files of a library in a folder; its package."""
    for name in ("Snakefile", "workflow/rules/common.smk", "src/springtune/one.py"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("")
    return folder / "src/springtune"


class TestProvenance:
    def test_a_changed_checkout_is_told(self, tmp_path):
        package, path = library(tmp_path), small(tmp_path)
        committed(tmp_path)
        clean = keys.origin(st.load_study(path), package)
        assert len(clean["git_commit"]) == 40
        path.write_text(path.read_text().replace("Small", "Smaller"))
        dirty = keys.origin(st.load_study(path), package)
        assert dirty["git_commit"] == clean["git_commit"] + "+changes"

    def test_a_built_package_has_the_commit_that_it_was_built_from(self, tmp_path):
        """And not that of a folder above, such as of a project whose environment it is in."""
        package = tmp_path / ".venv/springtune"
        (package / "workflow/config").mkdir(parents=True)
        path = small(package / "workflow/config")
        committed(tmp_path)
        assert workflow_folder(package) == package / "workflow" and clone(package) is None
        unknown = keys.origin(st.load_study(path), package)
        assert unknown["git_commit"] == ""
        (package / "commit.txt").write_text("f00d\n")
        known = keys.origin(st.load_study(path), package)
        assert known["git_commit"] == "f00d"


def test_an_unfinished_file_is_no_dataset(tmp_path):
    """Kills wherever a file is renamed, and full disks of a whole run, are tests/reruns/test_faults.py's."""
    dataset.write(tmp_path / "dataset.nc", {"/": SENSITIVITY.empty(AXES)}, VERSION)
    whole = (tmp_path / "dataset.nc").read_bytes()
    (tmp_path / "dataset.nc").rename(tmp_path / "dataset.nc.99999999.unfinished")
    with pytest.raises(FileNotFoundError, match="there is no such dataset"):
        st.open(tmp_path)
    for share in (0.0, 0.1, 0.5, 0.999):
        (tmp_path / "cut.nc").write_bytes(whole[: int(share * len(whole))])
        with pytest.raises(ValueError, match="cannot be read"):
            st.open(tmp_path / "cut.nc")

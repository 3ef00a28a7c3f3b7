"""What is told of a dataset, what it is exported to, and what studies leave behind."""

import csv
import json
import os
import platform
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

import springtune as st
from springtune.cli import main
from springtune.studies.kinds import load_study
from springtune.studies.kinds.scenes.outputs import write_paraview
from springtune.studies.kinds.scenes.variables import FIELDS, ROOT, SENSITIVITY
from springtune.studies.output import dataset, present
from springtune.studies.runs import checked_json, locks
from springtune.studies.runs.rerun import orphans

from tables import STUDIES, refused_calls

AXES = {
    "beam": ("200x40", "100x20"),
    "mesh_type": ("structured", "free"),
    "mesh_size": (2e-3, 5e-3),
    "material": ("steel",),
    "load": ("traction", "bending"),
    "definition": ("lattice", "patch"),
    "kinematics": ("linear",),
    "stiffness_ratio": (0.5, 1.0, 1.5),
}


def run(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def refused(result, *said, code=1):
    assert result.exit_code == code and len(result.stderr.splitlines()) == 1, result.stderr
    for one in said:
        assert one in result.stderr


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """Dataset of 8 scenes of one beam: six solved, one failed, one not converged; and of two curves."""
    root = ROOT.empty(AXES)
    root["reference_applies"].values[...] = 1
    place = {"beam": "200x40", "mesh_size": 5e-3}
    for name, value in (("status", 1), ("deformation_error", 0.01), ("displacement", 1e-3), ("solver", "Cholesky")):
        root[name].loc[place] = value
    root["particles"].loc[place] = 100
    root["reference_displacement"].values[...] = 1e-3
    root["beam_length"].values[:] = [0.2, 0.1]
    for mesh_type, status, message in (("free", 3, "last residual 2.5e-01"), ("structured", 5, "springs gone")):
        cell = place | {"mesh_type": mesh_type, "load": "bending", "definition": "patch"}
        root["status"].loc[cell], root["message"].loc[cell] = status, message
        root["deformation_error"].loc[cell] = root["displacement"].loc[cell] = np.nan
    worst = place | {"mesh_type": "free", "load": "traction", "definition": "lattice"}
    root["deformation_error"].loc[worst] = -0.2
    curves = SENSITIVITY.empty(AXES)
    place = {"beam": "200x40", "mesh_size": 5e-3, "load": "traction"}
    curves["status"].loc[place], curves["displacement"].loc[place] = 1, 1.0
    curves["best_stiffness"].loc[place] = 170e6
    folder = tmp_path_factory.mktemp("results") / "small"
    attributes = {"title": "A small one", "study": "small", "springtune_version": st.__version__}
    attributes |= {"git_commit": "f00d+changes", "git_diff": "diff --git a/b a/b\n-1\n+2\n", "host": "here"}
    attributes |= {"inputs": json.dumps({"config/small.yaml": "5" * 64}), "software": json.dumps({"numpy": "2.0"})}
    dataset.write(folder / "dataset.nc", {"/": root, "/sensitivity": curves}, attributes)
    return folder


FORGED = "\x1b[2K\n0 faults\r\x07\u202e"
"""What would forge a line on a terminal."""


@pytest.fixture(scope="module")
def forged(tmp_path_factory):
    """Datasets as somebody else may have written them: what forges lines wherever a text stands."""
    root, curves = ROOT.empty(AXES), SENSITIVITY.empty(AXES)
    root["reference_applies"].values[...] = 1
    root["status"].values[...], root["deformation_error"].values[...] = 1, 0.01
    root["status"].values.flat[0], root["message"].values.flat[0] = 5, FORGED
    names = {name: [f"{label}{FORGED}" for label in root[name].values] for name in ("beam", "material", "definition")}
    root, curves = root.assign_coords(names), curves.assign_coords({key: names[key] for key in ("beam", "material")})
    root["residual"].attrs["long_name"] = FORGED
    attributes = {
        "springtune_version": FORGED,
        "study": "forged",
        "title": FORGED,
        "git_commit": FORGED,
        "host": FORGED,
    }
    attributes |= {"created": FORGED, "software": json.dumps({FORGED: FORGED}), "inputs": json.dumps({FORGED: FORGED})}
    folder = tmp_path_factory.mktemp("datasets")
    for name in ("forged", "other", "named"):
        (folder / name).mkdir()
        dataset.write(folder / name / "dataset.nc", {"/": root, "/sensitivity": curves}, attributes)
        root["displacement"].values[...] = 7.0
        root["status"].values[...] = 2
    with h5py.File(folder / "named/dataset.nc", "r+") as file:  # netCDF's own library writes no such names
        file.move("solver", f"solver{FORGED}")
        file.move("sensitivity", FORGED)
    return folder


@pytest.mark.parametrize(
    "arguments",
    [
        ["info", "{forged}"],
        ["info", "{named}"],
        ["diff", "{forged}", "{named}"],
        ["diff", "{path}", "{forged}"],
        ["diff", "{forged}", "{path}", "--json"],
        ["diff", "{forged}", "{other}"],
        ["accept", "{forged}", "--to", "{out}.yaml"],
        ["accept", "{forged}", "--to", "{out}.yaml", "--unsolved"],
        ["export", "{forged}", "--to", "{out}.csv"],
        ["export", "{forged}", "--to", "{out}.csv", "--group", "nothing"],
        ["export", "{forged}", "--to", "{out}.csv", "--select", "beam=nothing"],
        ["export", "{forged}", "--to", "{out}.csv", "--variables", "nothing"],
        ["export", "{forged}", "--to", "{out}.vtu", "--select", "beam=nothing"],
        ["browse", "{out}/{forge}"],
        ["verify", "{out}/{forge}.zip"],
        ["verify", "{out}/{forge}"],
        ["merge", "{out}/{forge}.yaml", "a"],
        ["split", "{out}/{forge}.yaml", "--into", "2"],
        ["archive", "{out}/{forge}.yaml"],
        ["scenes", "{out}/{forge}.yaml"],
        ["{forge}"],
    ],
    ids=" ".join,
)
def test_nothing_forges_a_line_on_a_terminal(path, forged, tmp_path, monkeypatch, arguments):
    monkeypatch.chdir(tmp_path)
    places = {"path": path, "out": tmp_path / "out", "forge": FORGED}
    places |= {name: forged / name for name in ("forged", "other", "named")}
    # As on a terminal: elsewhere click leaves out what it takes for colours.
    result = CliRunner().invoke(main, [one.format(**places) for one in arguments], color=True)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exc_info
    assert result.output and not {*result.output} & {*FORGED} - {*"\n0 faults[2K"}, ascii(result.output)
    assert not any(line.startswith("0 faults") for line in result.output.splitlines()), result.output


class TestInfo:
    def test_tells_how_it_ended_and_where_it_comes_from(self, path):
        result = run("info", path)
        assert result.exit_code == 0, result.output
        lines = [" ".join(line.split()) for line in result.stdout.splitlines()]
        assert lines[0] == "A small one" and lines[1].startswith(f"study small: {path}/dataset.nc, ")
        for line in (
            "scenes: 8 asked, 6 solved, 1 not_converged, 1 failed",
            "1 not_converged: last residual 2.5e-01",
            "1 failed: springs gone",
            "/sensitivity: 6 asked, 6 solved",
            "lattice 4 1 % -20 % too stiff 200x40, free, 5 mm, steel, traction",
            "patch 2 1 % +1 % too soft 200x40, structured, 5 mm, steel, traction",
            "commit f00d+changes, 1 changed files in git_diff",
            "numpy 2.0",
            "on here",
            f"sha256 {'5' * 64} config/small.yaml",
        ):
            assert line in lines, line
        assert any(line.startswith("/sensitivity 10 beam 2, mesh_type 2") for line in lines)

    def test_a_dataset_of_all_kinds_is_told(self, tmp_path):
        from synthetic import dataset as every

        tree = every()
        tree.attrs = {"springtune_version": "0"}
        tree.to_netcdf(tmp_path / "dataset.nc", engine="netcdf4")
        result = run("info", tmp_path)
        assert result.exit_code == 0 and "  /benchmark " in result.stdout
        tree.attrs["title"] = "<i>"
        tree.to_netcdf(tmp_path / "other.nc", engine="netcdf4")
        found = st.info(tmp_path / "other.nc")
        assert repr(found) == str(found) and str(found).startswith("<i>\nstudy unknown")
        assert found._repr_html_().startswith("<pre>&lt;i&gt;\nstudy unknown")

    def test_what_is_no_dataset_is_told_in_one_line(self, tmp_path):
        refused(run("info", tmp_path / "none"), "there is no such dataset")
        (tmp_path / "text.nc").write_text("text")
        refused(run("info", tmp_path / "text.nc"), "cannot be read")

    def test_nothing_heavy_is_imported(self, path):
        code = "import sys; from springtune.cli import main; main(standalone_mode=False); "
        code += (
            "print([m for m in ('scipy.sparse', 'matplotlib', 'bokeh', 'pydantic', 'snakemake') if m in sys.modules])"
        )
        done = subprocess.run([sys.executable, "-c", code, "info", path], capture_output=True, text=True, check=True)
        assert done.stdout.splitlines()[-1] == "[]"


class TestExport:
    def test_one_row_a_cell_that_was_asked_for(self, path, tmp_path):
        assert run("export", path, "--to", tmp_path / "cells.csv").exit_code == 0
        rows = list(csv.DictReader((tmp_path / "cells.csv").read_text().splitlines()))
        assert len(rows) == 8
        assert {row["status"] for row in rows} == {"solved", "not_converged", "failed"}
        first = rows[0]
        assert (first["beam"], first["mesh_size [m]"], first["displacement [m]"]) == ("200x40", "0.005", "0.001")
        assert first["particles"] == "100.0" and first["beam_length [m]"] == "0.2" and first["stiffness [N/m]"] == ""
        failed = next(row for row in rows if row["status"] == "failed")
        assert failed["displacement [m]"] == "" and failed["message"] == "springs gone"

    def test_texts_and_single_numbers_are_exported_from_a_file(self, path, tmp_path):
        """Xarray reads texts from a file as numpy's own, not as objects."""
        assert run("export", path, "--variables", "message", "--to", tmp_path / "why.csv").exit_code == 0
        rows = list(csv.DictReader((tmp_path / "why.csv").read_text().splitlines()))
        assert "springs gone" in {row["message"] for row in rows}
        tree = xr.DataTree.from_dict({"/": xr.Dataset(attrs={"springtune_version": "0"}), "/benchmark": xr.Dataset()})
        tree["benchmark"]["explicit_steps"] = xr.DataArray(3.0, attrs={"units": "s-1"})
        tree.to_netcdf(tmp_path / "one.nc")
        choice = ("--group", "benchmark", "--variables", "explicit_steps")
        assert run("export", tmp_path / "one.nc", "--to", tmp_path / "one.csv", *choice).exit_code == 0
        assert (tmp_path / "one.csv").read_text().split() == ["explicit_steps", "[s-1]", "3.0"]

    def test_chosen_variables_of_a_group_and_labels_with_units(self, path, tmp_path):
        choice = ("--group", "sensitivity", "--variables", "displacement,best_stiffness")
        choice += ("--select", "mesh_type=free,mesh_size=5 mm", "--select", "beam=200x40")
        assert run("export", path, "--to", tmp_path / "curves.csv", *choice).exit_code == 0
        rows = list(csv.DictReader((tmp_path / "curves.csv").read_text().splitlines()))
        assert [row["stiffness_ratio"] for row in rows] == ["0.5", "1.0", "1.5"]
        assert {row["best_stiffness [N/m]"] for row in rows} == {"170000000.0"}
        assert list(rows[0])[-2:] == ["displacement [m]", "best_stiffness [N/m]"]

    @pytest.mark.parametrize("ending", ["csv", "parquet"])
    def test_parameters_come_along(self, tmp_path, ending):
        """Those of samples and refinements are coordinates besides the dimensions, not variables."""
        error = xr.DataArray([[0.1, 0.2], [0.3, np.nan]], dims=("sample", "load"), coords={"load": ["a", "b"]})
        height = xr.DataArray([0.02, 0.03], dims="sample", attrs={"units": "m"})
        group = xr.Dataset(
            {"error": error, "count": ("sample", [1, 2])}, {"height": height, "role": ("load", ["x", "y"])}
        )
        tree = xr.DataTree.from_dict({"/": xr.Dataset(attrs={"springtune_version": "0"}), "/samples": group})
        tree.to_netcdf(tmp_path / "all.nc")

        def rows(*choice):
            import pyarrow.parquet

            target = tmp_path / f"one.{ending}"
            result = run("export", tmp_path / "all.nc", "--group", "samples", "--to", target, "--force", *choice)
            assert result.exit_code == 0, result.stderr
            if ending == "parquet":
                return pyarrow.parquet.read_table(target).to_pylist()
            return list(csv.DictReader(target.read_text().replace(" [m]", "").splitlines()))

        found = rows()
        assert list(found[0]) == ["sample", "load", "height", "role", "error", "count"]
        assert [[float(row[name]) for name in ("height", "error")] for row in found] == [
            [0.02, 0.1], [0.02, 0.2], [0.03, 0.3],
        ]  # fmt: skip
        assert [row["role"] for row in found] == ["x", "y", "x"]
        assert list(rows("--variables", "error")[0]) == ["sample", "load", "height", "role", "error"]
        # Of fewer dimensions, those that these have; and one that is asked for is there once.
        assert list(rows("--variables", "count")[0]) == ["sample", "height", "count"]
        assert list(rows("--variables", "count,height")[0]) == ["sample", "count", "height"]

    def test_parquet_has_units_with_its_columns(self, path, tmp_path):
        import pyarrow.parquet

        assert run("export", path, "--to", tmp_path / "cells.parquet").exit_code == 0
        table = pyarrow.parquet.read_table(tmp_path / "cells.parquet")
        assert table.num_rows == 8 and table.schema.metadata[b"title"] == b"A small one"
        assert table.schema.field("displacement").metadata[b"units"] == b"m"
        assert table.column("displacement").null_count == 2  # no numbers are no NaN
        assert set(table.column("status").to_pylist()) == {"solved", "not_converged", "failed"}

    def test_zarr_is_the_whole_dataset(self, path, tmp_path):
        store = tmp_path / "all.zarr"
        assert run("export", path, "--to", store).exit_code == 0
        refused(run("export", path, "--to", store), "is there already", "--force")
        assert run("export", path, "--to", store, "--force").exit_code == 0
        with st.open(path) as ours, xr.open_datatree(store, engine="zarr", consolidated=True) as theirs:
            xr.testing.assert_equal(ours.load(), theirs.load())
            assert theirs.attrs["title"] == "A small one" and theirs.displacement.attrs["units"] == "m"
        assert os.listdir(tmp_path) == ["all.zarr"]

    def test_a_folder_that_is_no_store_is_never_replaced(self, path, tmp_path):
        (tmp_path / "mine.zarr").mkdir()
        (tmp_path / "mine.zarr/thesis.txt").write_text("all of it")
        refused(run("export", path, "--to", tmp_path / "mine.zarr", "--force"), "no Zarr store")
        assert (tmp_path / "mine.zarr/thesis.txt").exists()

    @pytest.fixture
    def fields(self, tmp_path):
        """Dataset of two scenes of a triangle that have fields."""
        axes = AXES | {name: tuple(range(4)) for name in ("particle", "spring", "cell_corner", "outline_point")}
        fields, root = FIELDS.empty(axes | {"spring_end": (0, 1), "cell": (0,)}), ROOT.empty(AXES)
        place = {"beam": "200x40", "mesh_type": "free", "mesh_size": 5e-3}
        fields["x"].loc[place], fields["y"].loc[place] = [0.0, 1.0, 0.0, np.nan], [0.0, 0.0, 1.0, np.nan]
        fields["spring_nodes"].loc[place] = np.array([[0, 1], [0, 2], [1, 2], [-1, -1]])
        fields["cell_nodes"].loc[place] = np.array([[0, 1, 2, -1]])
        load = place | {"material": "steel", "load": "bending"}
        for number, axis in enumerate("xy"):
            fields[f"particle_reference_{axis}"].loc[load] = [0.0, 0.5, 0.25 * number, np.nan]
            for shift, definition in enumerate(("lattice", "patch")):
                cell = load | {"definition": definition, "kinematics": "linear"}
                fields[f"displacement_{axis}"].loc[cell] = [0.0, 0.75 + shift, 0.0, np.nan]
                fields["stiffness"].loc[cell], fields["spring_force"].loc[cell] = [1, 2, 3, np.nan], [4, 5, 6, np.nan]
                root["deformation_error"].loc[cell] = 0.125
        dataset.write(tmp_path / "dataset.nc", {"/": root, "/fields": fields}, {"springtune_version": "0"})
        return tmp_path

    def test_a_scene_is_written_for_paraview(self, fields):
        result = run("export", fields, "--to", fields / "net.vtu", "--select", "definition=lattice")
        assert result.exit_code == 0, result.stderr
        net = meshio.read(fields / "net.vtu")
        assert {block.type: block.data.tolist() for block in net.cells} == {
            "line": [[0, 1], [0, 2], [1, 2]],
            "triangle": [[0, 1, 2]],
        }
        assert net.point_data["displacement"].tolist() == [[0, 0, 0], [0.75, 0.75, 0], [0, 0, 0]]
        assert net.point_data["error"].tolist() == [[0, 0, 0], [0.25, 0.25, 0], [0, -0.25, 0]]
        assert net.cell_data["stiffness"][0].tolist() == [1, 2, 3] and net.cell_data["force"][0].tolist() == [4, 5, 6]
        assert net.field_data["deformation_error"] == [0.125]

    def test_scenes_are_a_collection(self, fields):
        for _ in range(2):  # a second time in the place of the first
            result = run("export", fields, "--to", fields / "all.pvd", "--force")
            assert result.exit_code == 0, result.stderr
        rows = ElementTree.parse(fields / "all.pvd").getroot().findall("Collection/DataSet")
        names = [f"all/200x40_free_5mm_steel_bending_{definition}_linear.vtu" for definition in ("lattice", "patch")]
        assert [row.get("file") for row in rows] == names
        moved = [meshio.read(fields / name).point_data["displacement"][1, 0] for name in names]
        assert moved == [0.75, 1.75]
        run("export", fields, "--to", fields / "all.pvd", "--force", "--select", "definition=patch")
        assert os.listdir(fields / "all") == [Path(names[1]).name]

    def test_a_scene_has_the_numbers_of_the_force_whose_fields_are_kept(self, fields):
        """Where a study sweeps the force, which then is a dimension by the name that springs' forces once had."""
        with st.open(fields) as tree:
            tree.load()
        root = tree.to_dataset().drop_vars("force")
        weaker = xr.DataArray([0.5, 0.0], {"force": [1e3, 2e3]}, "force")
        root["deformation_error"] = root.deformation_error - weaker
        root["status"] = root.status.where(root.deformation_error.isnull(), 1)
        group, place = tree["fields"].to_dataset(inherit=False), ("beam", "mesh_type", "material", "load")
        group["shown_force"] = place, np.full([root.sizes[name] for name in place], 2e3)
        dataset.write(fields / "dataset.nc", {"/": root, "/fields": group}, tree.attrs)
        assert run("export", fields, "--to", fields / "net.vtu", "--select", "definition=lattice").exit_code == 0
        net = meshio.read(fields / "net.vtu")
        assert net.cell_data["force"][0].tolist() == [4, 5, 6]
        assert net.field_data["deformation_error"] == [0.125] and net.field_data["force_of_the_load"] == [2e3]

    def test_the_output_of_a_study_is_the_same_collection(self, fields):
        made = present.run(fields / "dataset.nc", fields, "paraview")
        names = [f"scenes/200x40_free_5mm_steel_bending_{definition}_linear.vtu" for definition in ("lattice", "patch")]
        assert made == [fields / "paraview" / name for name in ("scenes.pvd", *names)]
        run("export", fields, "--to", fields / "scenes.pvd")
        for name in ("scenes.pvd", *names):
            assert (fields / name).read_bytes() == (fields / "paraview" / name).read_bytes()

    def test_where_nothing_is_solved_the_collection_is_empty(self, fields):
        with st.open(fields) as tree:
            tree.load()
        tree["fields"]["displacement_x"].values[...] = np.nan
        assert write_paraview(tree, fields / "none") == [Path("scenes.pvd")]
        assert [path.name for path in (fields / "none").iterdir()] == ["scenes.pvd"]

    @pytest.mark.parametrize("ending", ["csv", "parquet", "zarr", "nc", "vtu", "pvd"])
    def test_a_folder_is_not_made(self, fields, ending):
        target = fields / f"none/data.{ending}"
        refused(run("export", fields, "--to", target), f"folder {target.parent} does not exist; make it first")
        assert not target.parent.exists()

    def test_what_paraview_does_not_get(self, path, fields):
        before = sorted(os.listdir(fields))
        refused(run("export", fields, "--to", fields / "net.vtu"), "2 scenes", "--select one definition", ".pvd")
        refused(run("export", fields, "--to", fields / "net.vtu", "--select", "load=traction"), "no solved scene")
        refused(run("export", fields, "--to", fields / "net.pvd", "--group", "moduli"), "leave --group", code=2)
        refused(run("export", path, "--to", fields / "net.pvd"), "no group '/fields'; add 'deformed' or 'paraview'")
        assert sorted(os.listdir(fields)) == before

    def test_one_network_is_written_as_a_mesh(self, tmp_path):
        axes = AXES | {name: tuple(range(3)) for name in ("particle", "spring", "cell_corner", "outline_point")}
        fields = FIELDS.empty(axes | {"spring_end": (0, 1), "cell": (0,)})
        place = {"beam": "200x40", "mesh_type": "free", "mesh_size": 5e-3}
        fields["x"].loc[place], fields["y"].loc[place] = [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]
        fields["spring_nodes"].loc[place] = np.array([[0, 1], [0, 2], [1, 2]])
        fields["cell_nodes"].loc[place] = np.array([[0, 1, 2]])
        dataset.write(tmp_path / "dataset.nc", {"/": ROOT.empty(AXES), "/fields": fields}, {"springtune_version": "0"})
        result = run("export", tmp_path, "--to", tmp_path / "net.nc", "--group", "fields", "--select", "load=bending")
        assert result.exit_code == 0, result.stderr
        with xr.open_dataset(tmp_path / "net.nc", decode_cf=False) as net:
            assert net.mesh.attrs["cf_role"] == "mesh_topology" and "UGRID-1.0" in net.attrs["Conventions"]
            assert net.cell_nodes.values.tolist() == [[0, 1, 2]] and net.cell_nodes.attrs["start_index"] == 0
            assert net.cell_nodes.dtype == np.int32 and net.displacement_x.dims[-1] == "particle"
            assert "load" not in net.displacement_x.dims
        refused(run("export", tmp_path, "--to", tmp_path / "no.nc"), "--group fields")

    @pytest.mark.parametrize(("arguments", "said"), refused_calls("export"))
    def test_refusals_name_what_there_is_and_leave_nothing(self, path, tmp_path, monkeypatch, arguments, said):
        monkeypatch.chdir(tmp_path)
        # What is asked for in a wrong way is told apart from what cannot be written.
        refused(run("export", path, *arguments), *said, code=1 if said[0].startswith("folder") else 2)
        assert not os.listdir(tmp_path)

    @pytest.mark.parametrize(("name", "ending"), [("pyarrow", "parquet"), ("zarr", "zarr")])
    def test_what_is_not_installed_is_told_with_the_extra(self, path, tmp_path, monkeypatch, name, ending):
        monkeypatch.setitem(sys.modules, name, None)
        refused(run("export", path, "--to", tmp_path / f"x.{ending}"), name, "in a clone `pip install '.[export]'`")
        assert not os.listdir(tmp_path)


class TestField:
    def test_refusals_say_what_there_is(self, path):
        from synthetic import dataset as every

        tree = every()
        with pytest.raises(ValueError, match="choose one mesh_size"):
            st.field(tree, beam="200x40", mesh_type="free")
        with pytest.raises(ValueError, match="nothing has beam '1x1'; there is '100x20', '200x40'"):
            st.field(tree, beam="1x1", mesh_type="free", mesh_size=5e-3)
        with pytest.raises(ValueError, match="nothing has load 'none'; there is 'traction'"):
            st.field(tree, beam="200x40", mesh_type="free", mesh_size=5e-3, load="none")
        with pytest.raises(ValueError, match="no dimension 'particle' to choose of|no dimension 'loads'"):
            st.field(tree, loads="none")
        with (
            st.open(path) as without,
            pytest.raises(ValueError, match="no group '/fields'; add 'deformed' or 'paraview'"),
        ):
            st.field(without)


STUDY = STUDIES["results_commands"]


class TestClean:
    @pytest.fixture
    def left(self, tmp_path, monkeypatch):
        """Folder of a study from which values were taken out, and what else may lie there."""
        monkeypatch.chdir(tmp_path)
        Path("config").mkdir()
        Path("config/two.yaml").write_text(STUDY.replace("SIZE", "2.5 mm").replace("LOAD", "[traction, bending]"))
        files = ["dataset.nc", "browse.html", "meshes/20x10_right_5mm.vtu", "meshes/20x10_right_5mm.json",
                 "logs/collect.log", "solutions/20x10_right_5mm.h5", "figures/size_right_m_traction.png",
                 "tables/index.html", "notes/mine.txt", "notes/mine.h5",
                 "tasks/bundles.json", "tasks/mesh_0.json", "done/mesh_0.json", "logs/snakemake.log"]  # fmt: skip
        stale = ["meshes/20x10_right_2.5mm.vtu", "meshes/20x10_right_2.5mm.json", "solutions/20x10_right_2.5mm.h5",
                 "figures/size_right_m_bending.png", "paraview/scenes.pvd",
                 "paraview/scenes/20x10.vtu", "tables/table_9.csv", "references/0123456789.h5",
                 "moduli/patch.h5", "tasks/solve_7.json", "logs/solve_7.log", "dataset.nc.99999999.unfinished",
                 "meshes/20x10_right_5mm.vtu.99999999.unfinished"]  # fmt: skip
        for name in files + stale:
            path = Path("results/two") / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text('{"cores": 0}' if name.endswith("bundles.json") else "x" * 100)
        Path("config/two.yaml").write_text(STUDY.replace("SIZE", "4 mm").replace("LOAD", "traction"))
        return set(stale)

    @staticmethod
    def there():
        return {path.relative_to("results/two").as_posix() for path in Path("results/two").rglob("*") if path.is_file()}

    def test_lists_what_is_not_asked_for_and_removes_nothing(self, left):
        before = self.there()
        found = {
            str(path.relative_to("results/two")) for path in orphans(load_study("config/two.yaml"), Path("results/two"))
        }
        assert found == left
        for given in ([], ["config/two.yaml"], ["results/two"]):
            result = run("clean", *given)
            assert result.exit_code == 0, result.stderr
            assert "results/two: 13 files, 1.3 kB" in result.stdout
            assert "  solutions/20x10_right_2.5mm.h5  100 B" in result.stdout
        assert self.there() == before

    def test_removes_it_on_request_and_nothing_else(self, left):
        before = self.there()
        result = run("clean", "config/two.yaml", "--remove")
        assert result.exit_code == 0 and "removed 13 files, 1.3 kB" in result.stdout
        assert self.there() == before - left
        assert not Path("results/two/moduli").exists() and Path("results/two/meshes").exists()
        assert "results/two: nothing to remove" in run("clean", "results/two").stdout

    def test_links_lead_nowhere(self, left, tmp_path):
        outside = tmp_path / "elsewhere"
        outside.mkdir()
        (outside / "precious.h5").write_text("x")
        os.symlink(outside, "results/two/linked")
        os.symlink(outside / "precious.h5", "results/two/curves.h5")
        assert run("clean", "config/two.yaml", "--remove").exit_code == 0
        assert (outside / "precious.h5").exists()

    def test_nothing_is_removed_under_a_run_or_with_a_faulty_study(self, left):
        before = self.there()
        locks.begin([Path("results/two")])
        told = "results/two: process", "on this machine computes it since", "nothing is removed"
        refused(run("clean", "config/two.yaml", "--remove"), *told)
        locks.end()
        Path("config/two.yaml").write_text("title: none\n")
        assert run("clean", "config/two.yaml", "--remove").exit_code == 1
        assert self.there() == before

    def test_notes_of_runs_that_are_gone_do_not_pile_up(self, left):
        gone = subprocess.Popen([sys.executable, "-c", "pass"])
        gone.wait()
        note = {"host": platform.node(), "pid": gone.pid, "start": 1.0, "command": "", "folders": ["results/two"]}
        checked_json.write(locks.RUNS / "gone.json", note)
        locks.begin([Path("results/two")])
        assert len(list(locks.RUNS.iterdir())) == 1 and not (locks.RUNS / "gone.json").exists()
        locks.end()

    def test_a_folder_without_its_study_is_left_alone(self, left):
        Path("config/two.yaml").unlink()
        refused(run("clean", "results/two"), "there is no config/two.yaml; give the study's YAML file")
        result = run("clean", "--remove")
        assert result.exit_code == 0 and "results/two: left alone" in result.stdout

    def test_where_nothing_was_run_says_so(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        refused(run("clean"), "results: there is no such folder")
        Path("two.yaml").write_text(STUDY.replace("SIZE", "4 mm").replace("LOAD", "traction"))
        refused(run("clean", "two.yaml"), "results/two: there is no such folder")

"""What is told of a dataset, and what it is exported to."""

import csv
import json
import os
import sys

import h5py
import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner

import springtune as st
from springtune.cli import main
from springtune.studies.kinds.bodies.collect import ROOT, SENSITIVITY
from springtune.studies.output import dataset, export

from synthetic import SMALL_AXES as AXES
from synthetic import dataset as every
from synthetic import filled
from tables import beside, cases, run


def refused(result, *said, code=1):
    assert result.exit_code == code and len(result.stderr.splitlines()) == 1, result.stderr
    for one in said:
        assert one in result.stderr


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """Dataset of 8 scenes of one beam: six solved, one failed, one not converged; and of two curves."""
    told = beside(__file__)["path"]
    groups = {group.name: filled(group.empty(AXES), told[group.name]) for group in (ROOT, SENSITIVITY)}
    folder = tmp_path_factory.mktemp("results") / "small"
    attributes = {"springtune_version": st.__version__, "inputs": json.dumps({"config/small.yaml": "5" * 64})}
    dataset.write(folder / "dataset.nc", groups, told["attributes"] | attributes)
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
    attributes = {"springtune_version": FORGED, "study": "forged", "title": FORGED, "git_commit": FORGED}
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


@cases
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
            "scenes 8 6 solved, 1 not converged, 1 failed",
            "200x40, free, 5 mm, steel, bending, patch, linear: last residual 2.5e-01",
            "200x40, structured, 5 mm, steel, bending, patch, linear: springs gone",
            "lattice linear 4 1 % -20 % too stiff 200x40, free, 5 mm, steel, traction",
            "patch linear 2 1 % +1 % too soft 200x40, structured, 5 mm, steel, traction",
            "commit f00d+changes",
            "numpy 2.0",
            f"sha256 {'5' * 64} config/small.yaml",
        ):
            assert line in lines, line
        assert any(line.startswith("/sensitivity 10 beam 2, mesh_type 2") for line in lines)


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

    @pytest.mark.parametrize("ending", ["csv", "parquet"])
    def test_parameters_come_along(self, tmp_path, ending):
        """Those of samples are coordinates besides the dimensions, not variables."""
        error = xr.DataArray([[0.1, 0.2], [0.3, np.nan]], dims=("sample", "load"), coords={"load": ["a", "b"]})
        height = xr.DataArray([0.02, 0.03], dims="sample", attrs={"units": "m"})
        variables = {"error": error, "count": ("sample", [1, 2])}
        group = xr.Dataset(variables, {"height": height, "role": ("load", ["x", "y"])})
        tree = xr.DataTree.from_dict({"/": xr.Dataset(attrs={"springtune_version": "0"}), "/samples": group})
        tree.to_netcdf(tmp_path / "all.nc")

        def rows(*choice):
            import pyarrow.parquet

            target = tmp_path / f"one.{ending}"
            result = run("export", tmp_path / "all.nc", "--group", "samples", "--to", target, "--force", *choice)
            assert result.exit_code == 0, result.stderr
            if ending == "parquet":
                table = pyarrow.parquet.read_table(target)
                return table.rename_columns([name.removesuffix(" [m]") for name in table.column_names]).to_pylist()
            return list(csv.DictReader(target.read_text().replace(" [m]", "").splitlines()))

        found = rows()
        assert list(found[0]) == ["sample", "load", "error", "count", "height", "role"]
        assert found.pop()["error"] in ("", None)  # no number is none; without a status every cell is a row
        assert [[float(row[name]) for name in ("height", "error")] for row in found] == [
            [0.02, 0.1], [0.02, 0.2], [0.03, 0.3],
        ]  # fmt: skip
        assert [row["role"] for row in found] == ["x", "y", "x"]

    def test_a_file_that_is_there_is_kept_unless_forced(self, path, tmp_path):
        (tmp_path / "cells.csv").write_text("mine")
        refused(run("export", path, "--to", tmp_path / "cells.csv"), "is there already", "--force")
        assert (tmp_path / "cells.csv").read_text() == "mine"
        assert run("export", path, "--to", tmp_path / "cells.csv", "--force").exit_code == 0
        assert len((tmp_path / "cells.csv").read_text().splitlines()) == 9

    def test_what_is_not_installed_is_told_with_the_extra(self, path, tmp_path, monkeypatch):
        monkeypatch.setitem(sys.modules, "pyarrow", None)
        refused(run("export", path, "--to", tmp_path / "x.parquet"), "pyarrow", "in a clone `pip install '.[export]'`")
        assert not os.listdir(tmp_path)


def test_where_nothing_is_solved_the_table_of_scenes_is_empty(tmp_path):
    """Numbers of scenes that are solved: tests/workflow/test_quick.py."""
    tree = every()
    tree["fields"]["displacement_x"].values[...] = np.nan
    (tmp_path / "former.vtu").touch()
    export.write_scenes(tree, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["scenes.csv"]
    assert len((tmp_path / "scenes.csv").read_text().splitlines()) == 1

"""The page to browse: its bytes, and the command that opens it; `tests/browser` looks at it in a browser."""

import base64
import json
import re
import zlib

import h5netcdf
import pytest
import xarray as xr
from click.testing import CliRunner
from test_dataset import GROUPS

import springtune as st
from springtune.cli import main
from springtune.studies.config.kind import kinds
from springtune.studies.kinds.collect import group_of
from springtune.studies.kinds.samples.designs import PARAMETERS
from springtune.studies.output.browse.page import packed, page, views

from synthetic import dataset

TITLE = "<script>alert('&')</script>"


def write(folder, *groups):
    """Write the dataset of a study, and a group that nobody knows."""
    tree = dataset(*groups)
    tree["weather"] = xr.DataTree(xr.Dataset({"rain": (("town", "day"), [[1.0, 2.0]])}, {"town": ["here"]}))
    tree.attrs = {"springtune_version": st.__version__, "study": "mine", "title": TITLE, "note": float("nan")}
    tree.to_netcdf(folder / "dataset.nc", engine="h5netcdf")
    return folder / "dataset.nc"


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A dataset of two groups, and what was made of it."""
    folder = tmp_path_factory.mktemp("mine")
    for name in ("figures/one.png", "figures/one.txt", "tables/index.html", "secret.txt"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text(name)
    (folder / "figures/link.png").symlink_to(folder / "secret.txt")
    return write(folder, "fields", "moduli")


def content(text):
    """What a page says of its dataset."""
    block = re.search(r'id="content">([^<]*)<', text)[1]
    return json.loads(zlib.decompress(base64.b64decode(block)))


@pytest.fixture(scope="module")
def text(path):
    return page(path)


class TestPage:
    def test_texts_of_the_dataset_are_no_markup(self, path):
        text = page(path, ["figures/<img src=x>.png"])
        assert "alert('" not in text and "<img src=x>" not in text
        assert "<title>&lt;script&gt;alert(&#39;&amp;&#39;)&lt;/script&gt;</title>" in text

    def test_policy_names_every_script_and_forbids_to_load(self, text):
        policy = re.search(r'Policy" content="([^"]*)"', text)[1].replace("&#39;", "'")
        assert policy.startswith("default-src 'none'; script-src 'sha256-")
        assert "unsafe-inline" not in policy.partition("script-src")[2].partition(";")[0]
        assert not re.search(r"(src|href)=\"?(https?:)?//", text)

    def test_every_group_and_variable_is_in_it(self, tmp_path):
        path = write(tmp_path)
        groups = {group["path"]: group for group in content(page(path))["groups"]}
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            for node in tree.subtree:
                held = {row["name"] for row in groups[node.path]["variables"]}
                data = node.to_dataset(inherit=False)
                assert held == set(map(str, data.variables)) - set(map(str, data.dims)), node.path
        assert groups["/weather"]["dims"][0] == {"name": "town", "size": 1, "labels": ["here"]}
        assert "labels" not in groups["/weather"]["dims"][1]  # a dimension without labels

    def test_what_is_too_large_is_named(self, path):
        with h5netcdf.File(path, decode_vlen_strings=True) as file:
            whole = packed(file)
            room = sum(len(row["data"]) for group in whole for row in group["variables"]) // 2
            some = packed(file, room)
        assert 0 < sum(len(row["data"]) for group in some for row in group["variables"]) <= room
        for group, less in zip(whole, some):
            names = [[row["name"] for row in one["variables"]] for one in (group, less)]
            assert sorted(names[0]) == sorted(names[1] + less["left_out"]) and not group["left_out"]

    def test_views_name_variables_that_studies_have(self):
        """A plot whose variable is misspelt would be left out silently."""
        of_rows = [group_of(kind) for kind in kinds() if kind.name in ("moduli", "benchmark", "laying", "stability")]
        known = {group.name: group for group in (*GROUPS.values(), *of_rows)}
        coordinates = {"/samples": {*PARAMETERS, "sample_mesh_size"}}
        for view in views().values():
            variables = known[view.group].variables
            dimensions = {name for row in variables.values() for name in row[0]} | coordinates.get(view.group, set())
            assert set(view.columns) <= set(variables)
            for plot in view.plots:
                beside = {name for row in plot.beside for name in row[:2]}
                assert {plot.value, plot.x, *beside} <= set(variables) | dimensions, plot.title
                assert {plot.by, plot.along} - {""} <= dimensions, plot.title
                assert set(plot.selection) <= dimensions, plot.title


class TestCommand:
    def test_the_page_of_a_study_is_opened_and_its_path_printed(self, tmp_path, monkeypatch):
        opened = []
        monkeypatch.setattr("click.launch", opened.append)
        (tmp_path / "index.html").write_text("page")
        for given in (tmp_path, tmp_path / "dataset.nc"):
            result = CliRunner().invoke(main, ["browse", str(given)])
            assert (result.exit_code, result.stdout) == (0, f"{tmp_path}/index.html\n")
        assert opened == [f"{tmp_path}/index.html"] * 2

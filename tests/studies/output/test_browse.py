"""The page to browse: its bytes, and the command that opens it; `tests/browser` looks at it in a browser."""

import base64
import json
import re
import zlib

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from test_dataset import GROUPS

import springtune as st
from springtune.cli import main
from springtune.problem.quantities import Status
from springtune.studies.config.model import kinds
from springtune.studies.kinds.bodies.collect import ROOT
from springtune.studies.kinds.collect import group_of
from springtune.studies.kinds.samples import PARAMETERS
from springtune.studies.output.browse import overview, packed, page, views

from synthetic import dataset
from tables import beside

TITLE = "<script>alert('&')</script>"


def write(folder, *groups):
    """Write the dataset of a study, and a group that nobody knows."""
    tree = dataset(*groups)
    tree["weather"] = xr.DataTree(xr.Dataset({"rain": (("town", "day"), [[1.0, 2.0]])}, {"town": ["here"]}))
    tree.attrs = {"springtune_version": st.__version__, "study": "mine", "title": TITLE, "note": float("nan")}
    tree.attrs["software"] = json.dumps({"numpy": "2.1", "meshio": "5.3 <b>"})
    tree.to_netcdf(folder / "dataset.nc", engine="h5netcdf")
    return folder / "dataset.nc"


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A dataset of two groups."""
    return write(tmp_path_factory.mktemp("mine"), "fields", "moduli")


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
        assert '<th scope="row">software</th><td class="small">numpy 2.1, meshio 5.3 &lt;b&gt;</td>' in text

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
        with st.open(path) as tree:
            whole = packed(tree)
            room = sum(len(row["data"]) for group in whole for row in group["variables"]) // 2
            some = packed(tree, room)
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


class TestOverview:
    """What the page says first, without a script."""

    AXES, REFERENCE, PRINTED = (beside(__file__)[name] for name in ("overview", "overview reference", "overview print"))

    def said(self, tmp_path, rows):
        """Text of the overview of scenes on one beam."""
        known = {name: labels[0] for name, labels in self.AXES.items() if name != "stiffness_ratio"}
        references = [self.REFERENCE | {"load": load} for load in self.AXES["load"]]
        tree = xr.DataTree(ROOT.of_rows(self.AXES, [*references, *(known | row for row in rows)]))
        tree.attrs = {"springtune_version": st.__version__, "study": "mine", "title": TITLE}
        tree.to_netcdf(tmp_path / "dataset.nc", engine="h5netcdf")
        text = page(tmp_path / "dataset.nc")
        found = re.search(r'<section id="overview".*?</section>\n<noscript>', text, re.DOTALL)[0]
        return " ".join(re.sub(r"<[^>]*>", "", re.sub("</(span|td|th)>", " ", found)).split())

    def solved(self, definition, error, inside, outline, **more):
        """Row of a solved scene."""
        stiffnesses = {"stiffness_inside": inside, "stiffness_outline": outline}
        seconds = {"solve_seconds": 0.01, "definition_seconds": 0.002}
        known = {"definition": definition, "status": Status.SOLVED, "deformation_error": error}
        return known | stiffnesses | seconds | more

    def test_what_to_type_is_of_the_finest_mesh_and_the_best_springs(self, tmp_path):
        said = self.said(tmp_path, [
            self.solved("paper", -0.2, 1.7e8, 1.7e8, stiffness=1.7e8), self.solved("patch", 1e-3, 1.78e8, 8.9e7),
            self.solved("patch", 2e-3, 1.78e8, 8.9e7, load="shear"),
            # A coarser mesh, energies without a spring, one load alone, and all loads but one have smaller errors.
            self.solved("patch", 0.0, 1.6e8, 8e7, mesh_size=5e-3),
            self.solved("neo-hooke", 1e-5, 0.0, 0.0), self.solved("lattice", 0.0, 1.7e8, 8e7),
            self.solved("area", 0.0, 1.7e8, 8e7), self.solved("area", 0.5, 1.7e8, 8e7, load="shear"),
            self.solved("delingette", 1e-4, 1.8e8, 9e7, stiffness=1.8e8, further_energies=1, stiffness_alike=0),
        ])  # fmt: skip
        answer = (
            "For 100x20, free 1 mm, steel: patch 1.78e8 N/m inside (0.89 E t), 8.9e7 N/m on the outline, "
            "worst error +0.20 %; best uniform stiffness 1.7e8 N/m (paper), error −20 %; with energies besides springs "
            "delingette, each spring its own: springtune springs writes them, error +0.01 %. "
        )
        assert said.startswith(answer)
        assert "patch, linear 0.1 %; +0.20 %" in said and "paper, linear 20 %; −20 %" in said
        assert "Medians of each mesh size; a line joins them. Run time: deriving" in said
        assert "Predicted" not in said and "The paper's tables" not in said  # no curve, nothing printed

    def test_the_papers_table_stands_beside_ours(self, tmp_path):
        rows = [self.solved("paper", 0.05, 1.7e8, 1.7e8, stiffness=1.7e8), self.solved("patch", 1e-3, 1.78e8, 8.9e7)]
        said = self.said(tmp_path, [self.PRINTED, *rows])
        table = said[said.index("Table 2") :]
        assert table.startswith("Table 2: traction, free, steel") and "paper, linear" in table
        assert "100x20 1 0.950 1.10 15.79* 1.000 +5.00 +0.10" in table
        assert "* marks where the print contradicts itself" in table

    def test_where_nothing_is_solved_it_says_so(self, tmp_path):
        failed = {"status": Status.FAILED, "message": "refuses the mesh", "stiffness_inside": 1.7e8}
        assert self.said(tmp_path, [failed]).startswith("No error of scenes is known: none is solved with a reference")

    def test_legends_have_what_is_drawn_in_the_colours_of_all(self):
        tree = dataset("sensitivity")
        tree["deformation_error"][{"load": 0}] = np.nan
        tree["sensitivity"].deformation_error[{"mesh_size": 0}] = 0.9  # beyond the chart
        for name in ("best_stiffness", "predicted_stiffness"):
            tree["sensitivity"][name][{"mesh_size": 0}] = np.nan
        found = overview(tree)
        assert found["sources"][0]["errors"].names == {"compression": 1, "pressure": 2}
        assert found["curves"]["names"] == {"2 mm": 1, "5 mm": 2}


class TestCommand:
    def test_the_page_of_a_study_is_opened_and_its_path_printed(self, tmp_path, monkeypatch):
        opened = []
        monkeypatch.setattr("click.launch", opened.append)
        for name in ("index.html", "dataset.nc"):
            (tmp_path / name).touch()
        for given in (tmp_path, tmp_path / "dataset.nc"):
            result = CliRunner().invoke(main, ["browse", str(given)])
            assert (result.exit_code, result.stdout) == (0, f"{tmp_path}/index.html\n")
        assert opened == [f"{tmp_path}/index.html"] * 2

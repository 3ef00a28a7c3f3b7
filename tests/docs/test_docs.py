"""The pages: links lead somewhere, what they tell to type runs, and what they show is what a reader gets."""

import importlib.util
import io
import json
import os
import re
import shutil
import tomllib
from contextlib import redirect_stdout
from pathlib import Path
from runpy import run_path

import matplotlib
import mujoco
import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from packaging.requirements import Requirement

import springtune as st
from springtune.cli import main
from springtune.mesh.formats import write_mesh
from springtune.studies.config.model import outputs

from campaigns import Campaign
from pages import blocks as blocks_of
from pages import check_command, claims, follow, typed
from synthetic import dataset
from tables import slow_but

REPOSITORY = Path(__file__).parents[2]
FOLDERS = [REPOSITORY / name for name in ("docs", "docs/gallery", "docs/reference")]
SITE = sorted(page for folder in FOLDERS for page in folder.glob("*.md") if "```{" in page.read_text())
"""Pages with directives, of the site alone: other pages do not lead to them. What the site generates has none."""
PLACES = ("*.md", "config/*.md", "docs/*.md", "docs/how-to/*.md", "workflow/profiles/*.md")
PAGES = sorted(path for pattern in PLACES for path in REPOSITORY.glob(pattern) if path not in SITE)


def called(path):
    """Name of a page in a test's."""
    return str(path.relative_to(REPOSITORY))


def blocks(language):
    """Fenced blocks of the README in a language."""
    return re.findall(rf"^```{language}\n(.*?)^```", (REPOSITORY / "README.md").read_text(), re.DOTALL | re.MULTILINE)


def anchors(page):
    """Anchors that GitHub gives a page's headings: lower case, no punctuation, hyphens for spaces."""
    text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", [*PAGES, *SITE], ids=called)
def test_relative_links_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        if "://" in link:
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path) if path else page
        assert target.exists(), f"{page.name}: {link}"
        if anchor:
            assert anchor in anchors(target), f"{page.name}: {link}"


def test_the_study_of_the_readme_asks_for_what_its_table_claims():
    study = st.load_study(REPOSITORY / "config/paper.yaml")
    asked = {
        (one.definition, one.mesh.beam.name, one.mesh.mesh_type, one.mesh.mesh_size, one.material.name, one.load)
        for one in study.scenes
        if one.kinematics == "linear"
    }
    cells = [(one.beam, one.mesh_type, one.mesh_size, one.material, one.load) for one in study.printed]
    assert len(cells) == 45 and {*claims(REPOSITORY / "README.md")} == {"patch", "delingette"}
    assert {(name, *cell) for name in claims(REPOSITORY / "README.md") for cell in cells} <= asked


def test_every_page_is_reached_from_the_readme():
    reached, ahead = set(), [REPOSITORY / "README.md"]
    while ahead:
        page = ahead.pop().resolve()
        if page in reached:
            continue
        reached.add(page)
        links = re.findall(r"\]\(([^)\s#]+\.md)", page.read_text())
        ahead += [page.parent / link for link in links if "://" not in link]
    assert {page.resolve() for page in PAGES} <= reached


@pytest.fixture(scope="module")
def catalogue():
    """Program that writes docs/catalogue.md, and the tables that stand there."""
    tool = run_path(str(REPOSITORY / "tools/catalogue.py"))
    return tool, tool["written"](tool["PAGE"].read_text())


def test_catalogue_has_every_definition(catalogue):
    """Sources as docstrings have them, numbers as the CSV file has them, of all definitions: else `make docs`."""
    tool, tables = catalogue
    numbers = tool["stored"]()
    assert tables == {"Sources": tool["sources"](), "Numbers": tool["summary"](numbers)}
    labels = [
        (label, one, kind) for label, one, _ in tool["rows"]() for kind in ("equilateral", "right", "braced", "free")
    ]
    asked = [(label, kind, ratio) for label, _, kind in labels for ratio in ("0.3", "1/3")]
    assert [(row["definition"], row["mesh"], row["poisson_ratio_asked"]) for row in numbers] == asked
    assert all(row["young_modulus_error_percent"] for row in numbers)
    loaded = [(row["definition"], row["mesh"]) for row in numbers if row["traction_error_percent"]]
    corners, never = {"free": 3, "braced": 4}, {("axis-exact", "free"), ("paper", "braced"), ("calibrated", "braced")}
    supported = [(label, kind) for label, one, kind in labels if corners.get(kind) in one.cells]
    assert loaded == [pair for pair in supported if pair not in never]  # on rows made for it alone; none is printed


@pytest.mark.slow
def test_numbers_of_the_catalogue_are_those_of_the_code(catalogue):
    """To the digit that rounding leaves; searches end elsewhere on other machines."""
    tool, _ = catalogue
    for old, new in zip(tool["stored"](), tool["measured"](), strict=True):
        if old["definition"] in ("annealed", "evolved", "adjoint", "best-springs"):
            continue
        for name, cell in old.items():
            before, now = (re.split(r"([+-]?\d+\.?\d*)", text) for text in (cell, new[name]))
            assert before[::2] == now[::2], new
            for a, b in zip(before[1::2], now[1::2]):
                digits = len(a.partition(".")[2])
                assert abs(float(a) - float(b)) <= 1.5 * 10**-digits, new


def test_python_of_the_readme_prints_what_it_says():
    (code,) = blocks("python")
    assert len(code.replace("\n\n", "\n").splitlines()) == 6
    with redirect_stdout(io.StringIO()) as printed:
        exec(code, {})
    assert printed.getvalue() == blocks("text")[0]


def test_commands_of_the_readme_bring_springs_into_mujoco(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write, view = (words for words in typed(REPOSITORY / "README.md") if {"springs", "mujoco.viewer"} & {*words})
    written = CliRunner().invoke(main, write[1:])
    assert written.exit_code == 0, written.output
    assert mujoco.MjModel.from_xml_path(view[-1].removeprefix("--mjcf=")).nsite == 252


# -- what pages tell to type -------------------------------------------------------------------------------------------

ELSEWHERE = {REPOSITORY / "README.md", REPOSITORY / "CONTRIBUTING.md", REPOSITORY / "docs/tutorial.md"}
"""Pages that are followed below, by tests/test_places.py and by tests/workflow/test_tutorial.py."""

FOLLOWED = [page for page in PAGES if page not in ELSEWHERE and any(blocks_of(page))]


def _of_the_paper(data):
    """A group with the labels of the paper's study, whose fields are those of the coarsest mesh and of each spring."""
    data = data.assign_coords(beam=["200x40", "200x30"]) if "beam" in data else data
    if "displacement_x" not in data or "case" in data.dims:
        return data
    return data.assign(
        x=data.x.where(data.mesh_size == data.mesh_size.max()), spring_force=data.spring_nodes.isel(spring_end=0)
    )


@pytest.fixture(scope="module")
def repository(tmp_path_factory):
    """What a reader has who is past the tutorial: studies, meshes of a mesher, results of three studies."""
    folder = tmp_path_factory.mktemp("reader")
    shutil.copytree(REPOSITORY / "config", folder / "config")
    (folder / "config/meshes").mkdir()
    for size in (2, 3):
        mesh = st.make_mesh(st.Beam("60 mm", "12 mm"), "free", f"{size} mm")
        write_mesh(folder / f"config/meshes/plate_{size}mm.vtu", mesh)
    mine = dataset()
    meanings = " ".join(map(str, st.Status))
    mine["status"].attrs |= {"flag_values": np.arange(len(st.Status), dtype="int8"), "flag_meanings": meanings}
    mine.coords["mesh_size"].attrs["units"] = "m"
    mine["message"] = mine.status.astype(str).where(mine.status > 1, "")
    mine.attrs = {"springtune_version": st.__version__, "config": (REPOSITORY / "config/quick.yaml").read_text()}
    paper = mine.map_over_datasets(_of_the_paper)
    for name, tree in {"mine": mine, "sobol": dataset("samples", "sobol"), "paper": paper}.items():
        tree.attrs |= mine.attrs
        tree.attrs["study"] = name
        (folder / f"results/{name}").mkdir(parents=True)
        tree.to_netcdf(folder / f"results/{name}/dataset.nc", engine="h5netcdf")
    return folder


SLOW = {"tune-an-engine.md", "take-results-elsewhere.md", "choose-a-mesh.md", "compare-studies.md", "fit-rubber.md",
        "identify-a-sheet.md", "sweep-parameters.md", "read-the-dataset.md"}  # fmt: skip
"""Of these, which take some seconds each."""


@pytest.mark.parametrize("page", slow_but([page for page in FOLLOWED if page.name not in SLOW], FOLLOWED), ids=called)
def test_a_page_can_be_followed(page, repository, monkeypatch):
    from matplotlib import pyplot

    monkeypatch.chdir(repository)
    known = set(st.ENGINES)
    with matplotlib.rc_context():
        pyplot.switch_backend("agg")
        assert list(follow(page, repository, run=_run if page.name == "sweep-parameters.md" else None))
    pyplot.close("all")
    for name in set(st.ENGINES) - known:
        st.ENGINES.discard(name)


def _run(study):
    Campaign(study).finish()


@pytest.mark.parametrize("page", [page for page in PAGES if typed(page)], ids=called)
def test_commands_are_commands(page, tmp_path):
    """Of pages as a whole, the commands in running text included; studies of one's own are those of the repository."""
    shutil.copytree(REPOSITORY / "config", tmp_path / "config")
    for name in ("mine", "theirs", "coarse_to_fine", "columns", "sweep", "plate", "outlined"):
        shutil.copy(tmp_path / "config/quick.yaml", tmp_path / f"config/{name}.yaml")
    for name in ("mine.yaml", "paper_tables.csv"):
        shutil.copy(tmp_path / "config" / name, tmp_path)  # outside of a clone
    for words in typed(page):
        check_command(words, tmp_path)


# -- the site ----------------------------------------------------------------------------------------------------------


def test_every_public_name_is_on_the_site():
    api = (REPOSITORY / "docs/reference/api.md").read_text()
    listed = re.findall(r"^   (\w+)$", api, re.MULTILINE) + re.findall(r"\[`([A-Z_]+)`\]", api)
    assert sorted([*listed, "__version__"]) == sorted(st.__all__)


def test_every_module_of_the_rooms_shown_is_on_the_site():
    text = (REPOSITORY / "docs/reference/library.md").read_text()
    listed = set(re.findall(r"^   springtune\.(\w+)\.(\w+)$", text, re.MULTILINE))
    package = Path(st.__file__).parent
    rooms = {room for room, _ in listed}
    assert rooms
    assert listed == {(room, path.stem) for room in rooms for path in (package / room).glob("[a-z]*.py")}


def test_every_picture_is_of_a_study_or_an_example():
    """`make pictures` copies what docs/figures.yaml names, and each of it is a figure that its study makes."""
    pictures = yaml.safe_load((REPOSITORY / "docs/figures.yaml").read_text())
    assert set(pictures) == {path.name for path in (REPOSITORY / "docs").glob("*.png")}
    for picture in pictures.values():
        if "example" in picture:
            assert "plt.subplots" in (REPOSITORY / f"examples/{picture['example']}.py").read_text()
            continue
        study = st.load_study(REPOSITORY / f"config/{picture['study']}.yaml")
        assert picture["figure"] in {stem for one in study.outputs for stem in outputs()[one].figures(study)}, picture


REPOSITORY = Path(__file__).parents[2]
PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]

CONDA = {"matplotlib": "matplotlib-base", "snakemake": "snakemake-minimal"}
"""Packages of other names in conda-forge and bioconda; netgen-mesher is in neither, and comes by pip."""


def environment(path):
    """Packages of a conda environment, and those that pip installs in it."""
    *packages, pip = yaml.safe_load((REPOSITORY / path).read_text())["dependencies"]
    return packages, pip["pip"]


def test_conda_environments_have_what_the_package_needs():
    needed = [Requirement(one) for one in PROJECT["dependencies"]]
    by_pip = [str(one) for one in needed if one.name == "netgen-mesher"]
    by_conda = [f"{CONDA.get(one.name, one.name)} {one.specifier}" for one in needed if str(one) not in by_pip]
    packages, pip = environment("environment.yml")
    assert sorted(packages) == sorted([f"python {PROJECT['requires-python']}", "pip", *by_conda])
    assert pip == [*by_pip, "--editable ."]


def test_hosted_ci_runs_ours_with_pinned_actions():
    found = yaml.safe_load((REPOSITORY / ".github/workflows/ci.yml").read_text())
    assert set(found) == {"name", True, "permissions", "jobs"} and found["permissions"] == {
        "contents": "read"
    }  # on: True
    for job in found["jobs"].values():
        assert {"runs-on", "timeout-minutes", "steps"} <= set(job)
        assert all(("run" in step) != ("uses" in step) for step in job["steps"])
        assert job["steps"][-1]["run"] == "bash .ci/run" and os.access(REPOSITORY / ".ci/run", os.X_OK)
        for used in (step["uses"] for step in job["steps"] if "uses" in step):
            assert re.fullmatch(r"[\w-]+/[\w-]+@[0-9a-f]{40}", used), f"{used}: pin a commit"


ARTICLE = (REPOSITORY / "article/paper.md").read_text()
_, HEAD, BODY = ARTICLE.split("---\n", 2)
TEXT = re.sub(r"<!--.*?-->", "", BODY, flags=re.DOTALL)


def test_numbers_of_the_software_paper_are_those_of_make_paper():
    """By their names; where the long paper was made here, they are compared with it."""
    folder = REPOSITORY / "workflow/paper"
    declared = yaml.safe_load((folder / "numbers.yaml").read_text())["numbers"]
    declared |= yaml.safe_load((folder / "printed.yaml").read_text())
    stated = dict(re.findall(r"(\w+): ([\d.]+)", re.search(r"<!-- Numbers(.*?)-->", BODY, re.DOTALL)[1]))
    assert set(stated) <= set(declared)
    assert set(re.findall(r"(?<![\w.-])\d+(?:\.\d+)?(?=e6\b|\b(?!-D))", TEXT)) == set(stated.values())
    readme = (REPOSITORY / "README.md").read_text()
    rows = [line for line in TEXT.splitlines() if line.startswith("| `")]
    assert rows and all(row in readme for row in rows)
    made = REPOSITORY / "results/paper/paper/numbers.json"
    if made.exists():
        found = json.loads(made.read_text())["numbers"]
        assert stated == {name: found[name]["text"] for name in stated}


PROGRAM = Path(__file__).parents[2] / "tools/licences.py"


@pytest.fixture(scope="module")
def licences():
    spec = importlib.util.spec_from_file_location("licences", PROGRAM)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_table_is_what_the_lock_files_ask_for(licences):
    licences.main(check=True)


def test_the_gpl_comes_with_one_extra_only(licences):
    parts = licences.parts()
    assert parts["cholesky"] == {"cvxopt"}
    under_it = {one: {name for name in names if licences.licence_of(name).startswith(("GPL", "AGPL"))}
                for one, names in parts.items()}  # fmt: skip
    assert {name for one, names in under_it.items() if one != "test" for name in names} == {"cvxopt"}


REPOSITORY = Path(__file__).parents[2]
CITATION = yaml.safe_load((REPOSITORY / "CITATION.cff").read_text())
VERSION, DATE = re.search(r"^## (\S+) \((.*)\)$", (REPOSITORY / "CHANGELOG.md").read_text(), re.MULTILINE).groups()
"""Of the newest entry of the changelog."""


def test_version_of_citation_and_changelog():
    assert CITATION["version"] == VERSION == st.__version__
    assert re.fullmatch(r"\d+\.\d+\.\d+", VERSION)

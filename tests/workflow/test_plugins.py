"""Definitions, loads, mesh types and engines of other packages, by entry points."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import xarray as xr
import yaml

from tables import cases

REPOSITORY = Path(__file__).parents[2]
PLUGIN = REPOSITORY / "examples/plugin"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """Folder that has the example package, as pip installs it."""
    folder = tmp_path_factory.mktemp("site")
    source = shutil.copytree(PLUGIN, tmp_path_factory.mktemp("source") / "plugin")
    options = ("--quiet", "--no-deps", "--no-build-isolation", "--no-index", "--disable-pip-version-check")
    subprocess.run([sys.executable, "-m", "pip", "install", *options, "--target", folder, source], check=True)
    return folder


@pytest.fixture(scope="module")
def run(tmp_path_factory, site):
    """Folder in which the jobs of a study that uses all of the example package have run, by one process."""
    folder = tmp_path_factory.mktemp("run")
    (folder / "config").mkdir()
    shutil.copy(PLUGIN / "even.yaml", folder / "config")
    python(folder, site, "-c", "from campaigns import Campaign; Campaign('config/even.yaml').finish()")
    return folder


def python(folder, *arguments, code=0):
    """Call Python in a folder, with what is installed in a site; return what it prints."""
    site, *arguments = arguments
    places = (REPOSITORY / "src", REPOSITORY / "tests/support", site)
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, places))}
    environment["SPRINGTUNE_PLUGINS"] = "all"
    command = [sys.executable, *map(str, arguments)]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


def test_a_study_uses_all_that_a_package_declares(run):
    with xr.open_datatree(run / "results/even/dataset.nc", engine="h5netcdf") as tree:
        root = tree.to_dataset()
        assert {"even", "lift", "left"} <= {*root["definition"].values, *root["load"].values, *root["mesh_type"].values}
        assert (root.status == 1).all() and root.deformation_error.notnull().all()
        assert json.loads(root.attrs["software"])["springtune-example"] == "1.0"
    assert (run / "results/even/figures/size_left_steel_lift.png").stat().st_size


IN_ENGINE = """
import springtune as st
beam, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
scene = st.Scene(beam, st.make_mesh(beam, "structured", "20 mm"), rubber, "traction", "0.2 N", definition="patch")
found = st.in_engine(scene, "explicit", dt="1/60", substeps=100)
print(found.status, abs(found.solver_error) < 1e-6)
"""


def test_a_scene_moves_in_an_engine_of_a_package(run, site):
    assert python(run, site, "-c", IN_ENGINE) == "rest True\n"
    page = (REPOSITORY / "docs/how-to/add-an-engine.md").read_text()
    assert (PLUGIN / "springtune_example/engines.py").read_text() in page and len(page.splitlines()) <= 40


JOBS = """
from pathlib import Path
from springtune.studies.kinds import load_study
from springtune.studies.runs import plan
study = load_study("config/even.yaml")
jobs = plan.jobs(study, Path("results/even"))
print(*[name.partition("_")[0] for name, job in jobs.items() if plan.rerun_reason(job)])
"""

SPRINGS, METADATA = "springtune_example/springs.py", "springtune_example-1.0.dist-info/METADATA"


@cases
def test_changes_of_a_package_compute_again_what_uses_it(run, site, tmp_path, file, before, after, again):
    changed = shutil.copytree(site, tmp_path / "site", ignore=shutil.ignore_patterns("__pycache__"))
    text = (changed / file).read_text()
    (changed / file).write_text(text.replace(before, after, 1))
    assert {*python(run, changed, "-c", JOBS).split()} == {*again.split()}


BAD = yaml.safe_load(Path(__file__).with_name("bad_plugin.yaml").read_text())


@pytest.fixture
def bad(tmp_path):
    """Folder with a package in which nothing is right."""
    (tmp_path / "bad").mkdir()
    for name, text in BAD["modules"].items():
        (tmp_path / f"bad/{name}.py").write_text(text)
    about = tmp_path / "bad-2.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: bad\nVersion: 2.0\n")
    lines = []
    for group, names in BAD["declared"].items():
        lines += [f"[springtune.{group}]", *(f"{name} = {value}" for name, value in names.items())]
    (about / "entry_points.txt").write_text("\n".join(lines))
    return tmp_path


def test_what_is_broken_is_left_out_by_name_and_nothing_else(bad):
    told = python(REPOSITORY, bad, "-m", "springtune", "scenes", "config/quick.yaml")
    assert re.search(r"^scenes +[0-9]+", told, re.MULTILINE)
    assert not [why for why in BAD["said"] if why not in told], told

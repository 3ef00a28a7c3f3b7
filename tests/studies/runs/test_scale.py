"""What grows with the number of scenes, and what does not: counted, not timed."""

import importlib.util
import json
import sys
from functools import partial
from pathlib import Path

import pytest
import xarray as xr

import springtune as st
from counting import counted
from springtune.studies.kinds import collect
from springtune.studies.kinds.bodies import kind as bodies
from springtune.studies.output import present
from springtune.studies.runs import plan, store

REPOSITORY = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def tool():
    spec = importlib.util.spec_from_file_location("scale", REPOSITORY / "tools/scale.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def study_of(tool, tmp_path, monkeypatch):
    """Study of 16 scenes for each force, on two meshes."""
    monkeypatch.chdir(tmp_path)

    def make(forces):
        Path(f"n{forces}.yaml").write_text(tool.study(2, 1, 1, forces))
        return f"n{forces}.yaml"

    return make


def planned(config):
    study = st.load_study(config)
    return study, plan.jobs(study, Path("results") / study.name)


def calls(function):
    """Calls of Python functions that a call takes."""
    count = 0

    def profile(frame, event, argument):
        nonlocal count
        count += event == "call"

    sys.setprofile(profile)
    try:
        function()
    finally:
        sys.setprofile(None)
    return count


def test_a_plan_takes_as_many_calls_a_scene_whatever_their_number(study_of):
    planned(study_of(2))  # what is found once a process
    counts = [calls(partial(planned, study_of(forces))) for forces in (10, 20, 40)]
    # Twice the scenes added take twice the calls, and some more of a few further bundles.
    assert (counts[2] - counts[1]) / (counts[1] - counts[0]) == pytest.approx(2, rel=0.1)
    assert (counts[2] - counts[1]) / (16 * 20) < 60


def test_a_key_is_made_once_a_scene_and_a_file_opened_once_a_mesh(tool, study_of):
    opened = {}
    for forces in (2, 6):
        config = study_of(forces)
        study, jobs = planned(config)
        for job in jobs.values():
            job.write()
        noted = {name: [job.stage.name, job.digest] for name, job in jobs.items() if job.stage}
        Path("plan.json").write_text(json.dumps({"stages": noted}))
        tool.do_stages(config, "invent")
        with counted(bodies.hash_of, store.read) as count:
            study = planned(config)[0]
            groups = collect.groups_of_study(study, jobs["collect"].folder)
        # One a scene; there are half as many curves, which are hashed twice, and some references.
        assert len(study.scenes) == 16 * forces and count["hash_of"] < 3 * len(study.scenes)
        assert int((groups["/"].status == 1).sum()) == len(study.scenes)
        opened[forces] = count["read"]
    assert len(study.meshes) == 2 and opened[2] == opened[6] <= 4 * len(study.meshes)


def test_the_page_of_tables_shows_so_many_rows_and_says_so():
    rows = [{"name": f"row {number}", "error_percent": 0.5} for number in range(present.MOST_ROWS + 1)]
    tree = xr.DataTree(xr.Dataset(attrs={"study": "many"}))
    many, few = (present.html([{"stem": "many", "title": "Many", "rows": found}], tree) for found in (rows, rows[:-1]))
    assert many.count("<tr") == few.count("<tr") == present.MOST_ROWS + 1
    assert "The first 1000 of 1001 rows; the file has all of them: " in many and "The first" not in few

"""What runs again when something changes: exactly these jobs, exactly these results, and the dataset of a fresh run."""

import contextlib
import hashlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import driver
import pytest
from rows import CODE, STORED, STUDY

import springtune as st
from springtune.studies.runs import plan
from springtune.studies.runs.source import read_note

ROWS = STUDY | STORED


@pytest.fixture(scope="session")
def complete(tmp_path_factory):
    """The study, complete."""
    os.environ["MPLBACKEND"] = "Agg"
    folder = tmp_path_factory.mktemp("complete") / "study"
    driver.prepare(folder)
    with contextlib.chdir(folder):
        driver.Run().finish()
    return folder


@pytest.fixture
def changed(complete, tmp_path, monkeypatch, request):
    """A copy of the complete study with a change, as the working directory; the row of the change."""
    shutil.copytree(complete, tmp_path / "study")  # times, too
    monkeypatch.chdir(tmp_path / "study")
    row = ROWS[request.param]
    row.change()
    return row


@pytest.fixture
def planned(complete, tmp_path, monkeypatch, request):
    """The same for what is only planned: results are those of the complete study."""
    row = STUDY[request.param]
    shutil.copytree(complete, tmp_path / "study", ignore=shutil.ignore_patterns("results"))
    (tmp_path / "study/results").symlink_to(complete / "results")
    monkeypatch.chdir(tmp_path / "study")
    row.change()
    return row


@pytest.fixture(scope="session")
def fresh(tmp_path_factory, complete):
    """The dataset of a study that is run in a new folder, by its text."""
    known = {}

    def of():
        read = [path for ending in ("yaml", "csv", "inp") for path in sorted(Path().rglob(f"*.{ending}"))]
        files = {path: path.read_bytes() for path in read if "results" not in path.parts}
        mark = repr(sorted(files.items()))
        if mark not in known:
            folder = tmp_path_factory.mktemp("fresh")
            for path, content in files.items():
                (folder / path).parent.mkdir(parents=True, exist_ok=True)
                (folder / path).write_bytes(content)
            with contextlib.chdir(folder):
                driver.Run().finish()
            known[mark] = driver.dataset(folder)
        return known[mark]

    return of


def scenes(job, content):
    """Scenes of a job by all that its digest has of them."""
    tasks = (task for file in content["files"] for task in file["tasks"])
    return {(task["key"], *map(task.get, job.stage.unkeyed)): task for task in tasks}


@pytest.mark.parametrize("planned", [name for name, row in STUDY.items() if not row.computes], indirect=True)
def test_exactly_these_jobs_are_to_run(planned, complete):
    """A digest has all that a change changes: scenes that are the same to it are the same before and after."""
    run = driver.Run()
    assert {run.called(name) for name in run.due()} == planned.jobs
    job = run.jobs["solve_0"]
    before = scenes(job, read_note(complete / job.tasks)["content"])
    now = scenes(job, json.loads(json.dumps(job.content)))
    assert all(now[mark] == before[mark] for mark in before.keys() & now.keys())


@pytest.mark.parametrize("changed", STORED, indirect=True)
def test_springtune_run_makes_missing_what_snakemake_cannot_see(changed):
    """Snakemake runs jobs whose record is missing or was of another digest, and those that come after them."""
    run = driver.Run()
    due = run.due()
    for record in plan.outdated_records(run.study, run.folder) or ():
        record.unlink()
    seen = [name for name, job in run.jobs.items() if read_note(job.record).get("digest") != job.digest]
    after = set(seen)
    for name in run.jobs:
        after |= {name} if run.before(name) & after else set()
    assert after == set(due)


@pytest.mark.parametrize("changed", ["study and printed table commented"], indirect=True)
def test_a_dataset_has_the_files_that_are_there(changed):
    """Comments, too; nothing is computed for them."""
    jobs, solved = driver.Run().finish()
    found = driver.dataset(Path())["/"]
    assert found["config"] == driver.CONFIG.read_text()
    files = {name: hashlib.sha256(Path(name).read_bytes()).hexdigest() for name in json.loads(found["inputs"])}
    assert json.loads(found["inputs"]) == files and {"small.yaml", "printed.csv", "own.inp"} <= files.keys()
    assert found["config_sha256"] == files["small.yaml"]
    assert jobs == changed.jobs and solved == {}


@pytest.mark.slow
@pytest.mark.parametrize("changed", ROWS, indirect=True)
def test_exactly_these_results_are_computed_and_the_dataset_is_that_of_a_fresh_run(changed, fresh):
    jobs, solved = driver.Run().finish()
    assert solved == changed.solved
    assert driver.dataset(Path()) == fresh()
    assert driver.Run().due() == []


# -- code --------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def package(tmp_path_factory):
    """A copy of the package, to be edited."""
    folder = tmp_path_factory.mktemp("package") / "springtune"
    shutil.copytree(Path(st.__file__).parent, folder)  # with what is compiled, and its times
    return folder


@pytest.fixture
def edited(package, request):
    """The copy with an edit, and what it changes."""
    place, change, row = CODE[request.param]
    path = package / place
    before = path.read_text()
    if change is None:
        path.write_text(f"{before}\nEDITED = True\n")
    elif change:
        assert change[0] in before
        path.write_text(before.replace(*change, 1))
    yield package.parent, row.jobs, row.solved
    path.write_text(before)


def driven(command, package, folder):
    """What the driver says with the package of another folder."""
    environment = os.environ | {"PYTHONPATH": str(package), "MPLBACKEND": "Agg", "PYTHONDONTWRITEBYTECODE": "1"}
    arguments = [sys.executable, driver.__file__, command, folder]
    done = subprocess.run(list(map(str, arguments)), env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.slow
@pytest.mark.parametrize("edited", CODE, indirect=True)
def test_an_edit_computes_again_what_it_computes(edited, complete, tmp_path):
    package, jobs, solved = edited
    shutil.copytree(complete, tmp_path / "study")
    found = driven("finish", package, tmp_path / "study")
    assert (set(found[0]), found[1]) == (jobs, solved)
    assert driver.dataset(tmp_path / "study") == driver.dataset(complete)  # the edits change no number
    assert driven("due", package, tmp_path / "study") == []


EDITS = "docstring of a stage", "stage of curves", "definition of one scene"


@pytest.mark.parametrize("edited", EDITS, indirect=True)
def test_an_edit_runs_what_it_concerns(edited, complete):
    package, jobs, _ = edited
    assert set(driven("due", package, complete)) == jobs

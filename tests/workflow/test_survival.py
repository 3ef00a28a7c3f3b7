"""What a run survives, and what it says: other runs, kills, broken programs."""

import contextlib
import fcntl
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
import xarray as xr

import springtune
from springtune.studies.runs import store

from campaigns import Campaign
from tables import STUDIES

STUDY = STUDIES["survival"]


def everything(folder):
    """All that is in a folder, Snakemake's own aside: of each file its content and its time."""
    return {
        path.relative_to(folder): (path.read_bytes(), path.stat().st_mtime_ns)
        for path in folder.rglob("*")
        if path.is_file() and ".snakemake" not in path.parts
    }


@pytest.fixture(scope="module")
def finished(run):
    """By its jobs in this process."""
    run.write("survival.yaml", STUDY)
    with contextlib.chdir(run.folder):
        Campaign("survival.yaml").finish()
    return run


def test_who_only_looks_changes_nothing(finished):
    """All such options read the Snakefile, and Snakemake does the rest."""
    before = everything(finished.folder)
    code, output = finished.snakemake("survival.yaml", "-n")
    assert code == 0, output
    assert everything(finished.folder) == before


def test_the_lock_of_a_run_that_was_killed_is_removed_with_a_word(finished):
    """As Snakemake writes locks, of the study's collect; others are in tests/studies/runs/test_locks.py."""
    locks = finished.folder / ".snakemake/locks"
    locks.mkdir(parents=True, exist_ok=True)
    (locks / "0.output.lock").write_text(f"{finished.folder}/results/survival/dataset.nc\n")
    (finished.folder / "results/survival/index.html").unlink()
    (finished.folder / "results/survival/tasks/run.json").write_text("{}")
    code, output = finished.springtune("survival.yaml")
    assert code == 0 and "was killed and left its lock; the lock is removed" in output, output
    assert (finished.folder / "results/survival/index.html").exists()


def test_a_study_that_another_process_computes_is_left_to_it(finished):
    with (finished.folder / "results/survival/tasks/run.json").open("a+") as note:
        fcntl.flock(note, fcntl.LOCK_EX)
        code, output = finished.springtune("survival.yaml")
    assert code == 1 and "Traceback" not in output
    assert "results/survival: another process computes it" in output


def test_a_run_that_is_killed_goes_on_by_the_same_command(finished):
    """Wherever it is: the kill comes when the first mesh is there."""
    run = finished
    run.write("killed.yaml", STUDY)
    repository = Path(__file__).parents[2]
    command = ["snakemake", "--snakefile", repository / "Snakefile", "--cores", "2", "--configfile", "killed.yaml",
               "--workflow-profile", repository / "workflow/profiles/default", "--until", "collect"]  # fmt: skip
    job = subprocess.Popen(list(map(str, command)), cwd=run.folder, start_new_session=True, stderr=subprocess.DEVNULL)
    while not list(run.folder.glob("results/killed/meshes/*.h5")):
        assert job.poll() is None
        time.sleep(0.01)
    children = psutil.Process(job.pid).children(recursive=True)
    os.killpg(job.pid, signal.SIGKILL)
    job.wait()
    psutil.wait_procs(children)
    code, output = run.springtune("killed.yaml", "--until", "collect")
    assert code == 0, output
    with (
        xr.open_dataset(run.folder / "results/killed/dataset.nc") as one,
        xr.open_dataset(run.folder / "results/survival/dataset.nc") as other,
    ):
        assert one.displacement.equals(other.displacement) and one.stiffness.equals(other.stiffness)
    assert not list(run.folder.rglob("*.unfinished"))


def test_a_broken_program_ends_the_run_when_the_other_scenes_are_stored(run, tmp_path):
    """The package in a copy, with an error that scenes in traction run into."""
    line = "        problem, first = sheet.problem(self.loading, springs), self.case.quantities[0]\n"
    shutil.copytree(Path(springtune.__file__).parent, tmp_path / "springtune")
    path = tmp_path / "springtune/scene/statements.py"
    assert path.read_text().count(line) == 1
    path.write_text(path.read_text().replace(line, f"{line}        None if self.force < 0 else None + self.force\n"))
    run.write("broken.yaml", STUDY)
    code, output = run.snakemake("broken.yaml", package=tmp_path)
    assert code == 1 and "Traceback" not in output
    broken = re.findall(r"\n  (\d) of this job's tasks could not be done: TypeError: unsupported op", output)
    assert sum(map(int, broken)) == 4, output
    assert "Traceback" in (run.folder / "results/broken/logs/solve_0.log").read_text()
    assert not (run.folder / "results/broken/dataset.nc").exists()
    assert len(store.stored(run.folder / "results/broken/solutions/50x20_structured_5mm.h5")) == 2


def test_a_study_that_is_edited_during_its_run_makes_no_dataset_of_another_one(run):
    """Its jobs did what was asked for when the run began; the dataset would be of what is asked for now."""
    run.write("edited.yaml", STUDY)
    with contextlib.chdir(run.folder):
        Campaign("edited.yaml").finish("solve_0")
    told = ["springtune.studies.kinds.collect", "edited.yaml", "results/edited", "dataset.nc", "d.json", "of before"]
    done = subprocess.run([sys.executable, "-m", *told], cwd=run.folder, capture_output=True, text=True)
    assert done.returncode == 1 and "edited.yaml was changed while the study ran; call the same" in done.stderr
    assert not (run.folder / "dataset.nc").exists()

"""Locks of runs: whose they are, and whether that process lives."""

import os
import platform
import re
from pathlib import Path

import psutil
import pytest

from springtune.campaign import locks
from springtune.jobs import sealed
from springtune.jobs.processes import this_host

STUDY = Path("results/mine")


@pytest.fixture(autouse=True)
def lock(tmp_path, monkeypatch):
    """A lock as Snakemake writes it, in the folder that runs are called in."""
    monkeypatch.chdir(tmp_path)
    locks.LOCKS.mkdir(parents=True)
    path = locks.LOCKS / "0.output.lock"
    path.write_text("results/mine/dataset.nc\n")
    return path


def note(**changed):
    """A run of this process, or another one."""
    process = psutil.Process()
    known = {"host": this_host(), "pid": process.pid, "start": process.create_time(), "command": "snakemake",
             "folders": [str(STUDY)]}  # fmt: skip
    sealed.write(locks.RUNS / "of_a_test.json", known | changed)


def test_without_locks_and_runs_nothing_is_held_or_removed(lock):
    lock.unlink()
    assert not locks.is_held(STUDY) and locks.release(STUDY) == ""


@pytest.mark.parametrize("changed", [{"start": 1.0}, {"pid": 2**22 + 1}], ids=["its number is another's", "gone"])
def test_that_of_a_process_that_is_gone_is_removed(lock, changed):
    note(**changed)
    assert locks.is_held(STUDY)
    assert "left its lock" in locks.release(STUDY)
    assert not lock.exists() and not list(locks.RUNS.iterdir())


def test_one_that_nobody_noted_is_removed_where_nobody_runs(lock):
    assert "left its lock" in locks.release(STUDY) and not lock.exists()


def test_a_note_that_is_damaged_is_none(lock):
    note()
    (locks.RUNS / "of_a_test.json").write_text("cut")
    assert "left its lock" in locks.release(STUDY)


def test_that_of_a_living_process_stays_and_is_told_with_the_remedy(lock):
    note()
    told = rf"results/mine: process {os.getpid()} on this machine computes it since .* \(snakemake\); wait .* kill \d+"
    with pytest.raises(locks.LockedError, match=told):
        locks.release(STUDY)
    assert lock.exists()


def test_a_living_process_needs_no_lock(lock):
    """Snakemake removes the locks of all runs in a folder at the end of one."""
    lock.unlink()
    note()
    with pytest.raises(locks.LockedError):
        locks.is_held(STUDY)


def test_that_of_another_machine_stays_and_is_told_with_a_remedy_that_works(lock):
    note(host="elsewhere", start=1.0)
    with pytest.raises(locks.LockedError, match="on elsewhere, .*: rm -r .snakemake/locks") as caught:
        locks.release(STUDY)
    assert lock.exists()
    lock.unlink()
    assert re.search("rm -r", str(caught.value)) and locks.release(STUDY) == ""


def test_those_of_other_studies_are_nobodys_business(lock):
    lock.write_text("results/mine_too/dataset.nc\n")
    note(folders=["results/mine_too"])
    assert locks.release(STUDY) == "" and lock.exists()


def test_a_run_notes_itself_until_its_end(lock):
    locks.begin([STUDY])
    with pytest.raises(locks.LockedError, match=f"process {os.getpid()}"):
        locks.is_held(STUDY)
    locks.end()
    assert locks.is_held(STUDY) and not list(locks.RUNS.iterdir())


def test_processes_of_two_machines_with_one_number_have_notes_of_their_own(lock, monkeypatch):
    locks.begin([STUDY])
    monkeypatch.setattr(platform, "node", lambda: "login.cluster")
    locks.begin([Path("results/other")])
    assert len(list(locks.RUNS.iterdir())) == 2

"""Locks of runs: whose they are, and whether that process lives."""

import os
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from springtune.cli import main
from springtune.studies.runs import locks

from tables import STUDIES

STUDY = Path("results/mine")

SMALL = STUDIES["locks_small"]


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    """The folder that runs are called in."""
    monkeypatch.chdir(tmp_path)


def test_without_a_note_nobody_computes():
    assert not locks.check_idle(STUDY)


def test_a_run_locks_its_study_until_its_end_and_is_named_with_the_remedy():
    locks.lock([STUDY])
    told = rf"results/mine: process {os.getpid()} on .* computes it since .* \(.*\); wait for its end, or .* kill \d+"
    with pytest.raises(locks.LockedError, match=told):
        locks.check_idle(STUDY)
    assert not locks.check_idle(Path("results/mine_too"))
    locks.unlock()
    assert not locks.check_idle(STUDY)


@pytest.mark.parametrize("note", ['{"pid": 1}', "cut"])
def test_a_process_that_is_gone_was_killed_which_is_said_once(note):
    (STUDY / "tasks").mkdir(parents=True)
    (STUDY / locks.RUN_FILE).write_text(note)
    assert locks.check_idle(STUDY) and not locks.check_idle(STUDY)


class TestClaims:
    """A folder of results belongs to one config; here `w/mine.yaml` is the file of the run before."""

    @pytest.fixture(autouse=True)
    def configs(self):
        for folder in ("w", "config"):
            Path(folder).mkdir()
            Path(folder, "mine.yaml").write_text(f"title: {folder}\n")
        locks.claim(STUDY, Path("w/mine.yaml"))

    def test_another_study_of_the_same_name_is_refused_with_the_remedy(self):
        with pytest.raises(locks.LockedError) as caught:
            locks.check_claim(STUDY, Path("config/mine.yaml"))
        assert str(caught.value) == (
            "results/mine: holds the results of w/mine.yaml, another study of the same name; rename one of the two, or "
            "call: springtune run config/mine.yaml --results FOLDER"
        )

    @pytest.mark.parametrize("how", ["by its path", "./", "from the root", "by a link", "the same content", "moved"])
    def test_the_same_study_is_not(self, how):
        here, other = Path("w/mine.yaml"), Path("config/mine.yaml")
        Path("link.yaml").symlink_to(here)
        if how == "the same content":
            other.write_bytes(here.read_bytes())
        elif how == "moved":
            here.replace(other)
        else:
            here.write_text("title: edited\n")
        given = {"by its path": here, "./": "./w/mine.yaml", "from the root": here.absolute(), "by a link": "link.yaml"}
        locks.check_claim(STUDY, Path(given.get(how, other)))

    def test_commands_know_the_study_of_a_folder(self):
        (STUDY / "dataset.nc").touch()
        Path("config/mine.yaml").write_text(SMALL)
        told = CliRunner().invoke(main, ["archive", "results/mine"])
        assert told.exit_code == 1 and re.search(r"w/mine.yaml: .* is missing", told.output)

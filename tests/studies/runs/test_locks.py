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

    @pytest.mark.parametrize("given", ["w/mine.yaml", "./w/mine.yaml", "{here}/w/mine.yaml", "link.yaml"])
    def test_the_same_study_by_another_path_is_not(self, given):
        Path("link.yaml").symlink_to("w/mine.yaml")
        Path("w/mine.yaml").write_text("title: edited\n")
        locks.check_claim(STUDY, Path(given.format(here=Path.cwd())))

    def test_the_same_content_elsewhere_is_not(self):
        Path("config/mine.yaml").write_bytes(Path("w/mine.yaml").read_bytes())
        locks.check_claim(STUDY, Path("config/mine.yaml"))

    def test_a_config_that_was_moved_is_not(self):
        Path("w/mine.yaml").replace("config/mine.yaml")
        locks.check_claim(STUDY, Path("config/mine.yaml"))

    def test_commands_know_the_study_of_a_folder(self):
        (STUDY / "dataset.nc").touch()
        Path("config/mine.yaml").write_text(SMALL)
        told = CliRunner().invoke(main, ["archive", "results/mine"])
        assert told.exit_code == 1 and re.search(r"w/mine.yaml: .* is missing", told.output)

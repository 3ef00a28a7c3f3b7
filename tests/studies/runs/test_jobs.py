"""Jobs: what is stored is read right or refused, a task that fails leaves the others; and a folder is one run's."""

import faulthandler
import hashlib
import json
import os
import re
import signal
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from click.testing import CliRunner

from springtune.cli import main
from springtune.studies.runs import job, locks, store
from springtune.studies.runs.source import hash_of
from springtune.studies.runs.store import DamagedError

from tables import STUDIES, cases

RESULTS = {
    "one": {"displacement": 1.25e-3, "message": "µ", "iterations": 3, "field": np.arange(30.0).reshape(10, 3)},
    "two": {"displacement": float("nan"), "empty": np.zeros((0, 2)), "field": np.ones(5, np.float32)},
}


def same(found, wanted):
    """Whether stored results are those that were given, arrays included."""
    return found.keys() == wanted.keys() and all(
        found[key].keys() == one.keys()
        and all(np.array_equal(found[key][name], one[name], equal_nan=name != "message") for name in one)
        for key, one in wanted.items()
    )


@pytest.fixture
def path(tmp_path):
    """A file of two results, written one after the other."""
    for key, result in RESULTS.items():
        store.add(tmp_path / "folder/results.h5", {key: result})
    return tmp_path / "folder/results.h5"


def test_results_come_back_as_they_went(path):
    assert store.stored_keys(path) == RESULTS.keys()
    assert same(store.read(path, RESULTS, ["field", "empty"]), RESULTS)
    assert "field" not in store.read(path, ["one"])["one"]
    with pytest.raises(DamagedError, match="lacks 1 of 1 results; delete it"):
        store.read(path, ["three"])


def test_no_flipped_bit_gives_a_wrong_number(path):
    """Each byte of a file once: HDF5's checksums find it, or nothing reads it."""
    content, generator, caught = path.read_bytes(), np.random.default_rng(3), 0
    for place in range(len(content)):
        damaged = bytearray(content)
        damaged[place] ^= 1 << int(generator.integers(8))
        path.write_bytes(damaged)
        try:
            assert same(store.read(path, RESULTS, ["field", "empty"]), RESULTS), place
        except DamagedError as error:
            assert str(path) in str(error) and "delete it, and call the same command again" in str(error)
            caught += 1
    assert caught > len(content) / 2


@pytest.mark.parametrize("content", [b"", b"no results", None, "cut"], ids=str)
def test_a_file_that_is_none_is_one_sentence(path, content):
    whole = path.read_bytes()
    path.unlink()
    if content is not None:
        path.write_bytes(whole[:-100] if content == "cut" else content)
        with pytest.raises(DamagedError, match="is damaged"):
            store.stored_keys(path)
    with pytest.raises(DamagedError, match="damaged|missing"):
        store.read(path, RESULTS)


def test_a_file_of_another_version_is_written_anew(path, monkeypatch):
    monkeypatch.setattr(store, "LAYOUT", store.LAYOUT + 1)
    assert store.stored_keys(path) == set()
    with pytest.raises(store.DamagedError, match="another version of springtune wrote it; delete it"):
        store.read_all(path)
    store.add(path, {"new": {"displacement": 1.0}})
    assert store.read_all(path) == {"new": {"displacement": 1.0}}


def test_a_file_of_another_name_is_not_read(path):
    """Such as two blocks of samples, whose results have the same keys."""
    other = path.rename(path.with_name("other.h5"))
    with pytest.raises(DamagedError, match="other.h5: it is damaged .it is results.h5.; delete it"):
        store.read(other, RESULTS)


# -- jobs --------------------------------------------------------------------------------------------------------------


@pytest.fixture
def stage(tmp_path, monkeypatch):
    """A job of four tasks: what it does with each is for the test to say."""
    acts, module = {}, ModuleType("springtune.tested_stage")
    module.solve = lambda task: acts.get(task["key"], lambda: {"displacement": 1.0, "message": ""})()
    monkeypatch.setitem(sys.modules, module.__name__, module)
    files = [{"name": name, "tasks": [{"key": f"{name}{n}"} for n in (1, 2)]} for name in ("a", "b")]
    content = {"folder": str(tmp_path / "tested"), "files": files}
    note = dict.fromkeys(("digest", "checksum"), hash_of("tested_stage", content))
    note |= {"module": "tested_stage", "content": content}
    note["products"] = [str(tmp_path / f"tested/{name}.h5") for name in ("a", "b")]
    (tmp_path / "tasks").mkdir()
    (tmp_path / "tasks/tested_0.json").write_text(json.dumps(note))

    def run(digest=note["digest"]):
        job.main(str(tmp_path / "tasks/tested_0.json"), str(tmp_path / "done/tested_0.json"), digest, "study.yaml")
        return json.loads((tmp_path / "done/tested_0.json").read_text())["computed"]

    def read():
        return {key: one for name in ("a", "b") for key, one in store.read_all(tmp_path / f"tested/{name}.h5").items()}

    return acts, run, read, tmp_path


@pytest.mark.parametrize("how", [signal.SIGSEGV, signal.SIGKILL])
def test_a_task_whose_process_dies_is_a_hole_and_the_others_are_done(stage, how):
    acts, run, read, _ = stage
    acts["a1"] = acts["b2"] = lambda: (faulthandler.disable(), os.kill(os.getpid(), how))
    run()
    found = read()
    assert {key for key, one in found.items() if "process" in one["message"]} == {"a1", "b2"}
    assert found["a2"]["displacement"] == found["b1"]["displacement"] == 1.0


@cases
def test_a_task_that_fails_for_its_own_reasons_is_a_hole(stage, error):
    acts, run, read, _ = stage

    def fail():
        raise error

    acts["a1"] = fail
    assert run() == 4 and [key for key, one in read().items() if one["message"]] == ["a1"]


@pytest.mark.parametrize("error", [TypeError(), KeyError("x"), ValueError("shapes"), AssertionError()])
def test_a_broken_program_ends_the_job_when_the_others_are_done(stage, error):
    acts, run, read, folder = stage

    def fail():
        raise error

    acts["a1"] = fail
    with pytest.raises(SystemExit, match="1 of this job's tasks could not be done"):
        run()
    assert read().keys() == {"a2", "b1", "b2"} and not (folder / "done").exists()


# -- keys --------------------------------------------------------------------------------------------------------------


def test_keys_are_those_that_results_were_stored_under():
    """Another key of the same would compute everything again: 24 digits of the SHA-256 of JSON without spaces."""
    assert hash_of({"b": [2, "x"], "a": 0.1}, None) == hashlib.sha256(b'[{"a":0.1,"b":[2,"x"]},null]').hexdigest()[:24]
    assert len(hash_of()) == 24


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

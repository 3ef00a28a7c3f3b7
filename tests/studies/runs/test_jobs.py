"""Jobs: what is stored is read right or refused, and a task that fails leaves the others."""

import faulthandler
import hashlib
import json
import os
import signal
import sys
from types import ModuleType

import numpy as np
import pytest

from springtune.studies.runs import job, store
from springtune.studies.runs.source import hash_of
from springtune.studies.runs.store import DamagedError

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
    note = {"digest": hash_of("tested_stage", content), "module": "tested_stage", "content": content}
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


@pytest.mark.parametrize(
    "error", [ZeroDivisionError("by zero"), np.linalg.LinAlgError("singular"), RuntimeError("no end"), MemoryError()]
)
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

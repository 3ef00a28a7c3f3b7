"""Notes, results, records and keys: what was not written is not read."""

import hashlib
import json
import os
import re
import sys
from types import ModuleType, SimpleNamespace

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from springtune.studies.kinds.scenes import stored
from springtune.studies.runs import checked_json, driver, records, run_tasks, store
from springtune.studies.runs import keys as code
from springtune.studies.runs.checked_json import ASIDE, DamagedError, hash_of
from springtune.studies.runs.task_costs import TaskCosts, Watch

JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**53), 2**53) | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


def flipped(content, place, bit):
    """Bytes of which one bit is another."""
    changed = bytearray(content)
    changed[place % len(content)] ^= 1 << bit
    return bytes(changed)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("notes")


class TestSealed:
    @settings(max_examples=40)
    @given(content=st.dictionaries(st.text(), JSON, max_size=4))
    def test_what_goes_in_comes_out(self, folder, content):
        checked_json.write(folder / "note.json", content)
        assert checked_json.read(folder / "note.json") == content == checked_json.demand(folder / "note.json")
        assert json.loads((folder / "note.json").read_text())["content"] == content

    @given(place=st.integers(0, 10**6), bit=st.integers(0, 7))
    def test_no_flipped_bit_is_read(self, folder, place, bit):
        path = folder / "flipped.json"
        checked_json.write(path, {"seconds": 0.25, "names": ["a", "b"]})
        path.write_bytes(flipped(path.read_bytes(), place, bit))
        assert checked_json.read(path) is None
        with pytest.raises(DamagedError, match="checksum"):
            checked_json.demand(path)

    @pytest.mark.parametrize("content", [b"", b"{}", b"null", b"\xff\xfe", b'{"seal": "'], ids=repr)
    def test_other_files_are_none(self, tmp_path, content):
        (tmp_path / "note.json").write_bytes(content)
        assert checked_json.read(tmp_path / "note.json") is None

    def test_a_missing_one_is_none(self, tmp_path):
        assert checked_json.read(tmp_path / "note.json") is None
        with pytest.raises(DamagedError, match="missing"):
            checked_json.demand(tmp_path / "note.json")


class TestStore:
    RESULT = {"displacement": 1.25e-3, "field": np.arange(6.0).reshape(3, 2)}

    @given(place=st.integers(0, 10**6), bit=st.integers(0, 7))
    def test_no_flipped_bit_is_read(self, folder, place, bit):
        path = folder / "flipped.h5"
        path.unlink(missing_ok=True)
        store.add(path, {"one": self.RESULT})
        path.write_bytes(flipped(path.read_bytes(), place, bit))
        with pytest.raises(DamagedError):
            store.read(path, ["one"])
        assert store.stored(path) == set()

    @given(length=st.integers(0, 10**6))
    def test_no_truncated_file_is_read(self, folder, length):
        path = folder / "short.h5"
        path.unlink(missing_ok=True)
        store.add(path, {"one": self.RESULT})
        content = path.read_bytes()
        path.write_bytes(content[: length % len(content)])
        with pytest.raises(DamagedError):
            store.read(path, ["one"])

    def test_a_damaged_file_is_set_aside_with_a_warning_and_its_results_are_stored_anew(self, tmp_path, capsys):
        path = tmp_path / "results.h5"
        store.add(path, {"one": self.RESULT})
        damaged = flipped(path.read_bytes(), 1000, 3)
        path.write_bytes(damaged)
        assert store.stored(path) == set() and not path.exists()
        aside = path.with_name(path.name + ASIDE)
        assert aside.read_bytes() == damaged
        assert re.fullmatch(rf"{path}: its checksum .*; set aside as {aside.name}, .*\n", capsys.readouterr().err)
        store.add(path, {"one": self.RESULT})
        assert store.stored(path) == {"one"}

    def test_a_file_of_another_name_is_not_read(self, tmp_path, capsys):
        """Such as two blocks of samples, whose results have the same keys."""
        for name in ("a", "b"):
            store.add(tmp_path / f"{name}.h5", {"one": self.RESULT})
        (tmp_path / "a.h5").rename(tmp_path / "c.h5")
        (tmp_path / "b.h5").rename(tmp_path / "a.h5")
        (tmp_path / "c.h5").rename(tmp_path / "b.h5")
        with pytest.raises(DamagedError, match=r"a\.h5: its name is not that of its content"):
            store.read_one(tmp_path, "a")
        assert store.stored(tmp_path / "b.h5") == set()
        assert "its name is not that of its content; set aside as b.h5.damaged, and" in capsys.readouterr().err
        stored.refuse(tmp_path, "a", "key", {"message": "too large"})
        (tmp_path / "a.json").rename(tmp_path / "b.json")
        with pytest.raises(DamagedError, match=r"b\.json: its name is not that of its content"):
            stored.read(tmp_path, "b")
        assert not stored.is_stored(tmp_path, "b", "key", "")

    def test_the_file_of_another_mesh_keeps_what_it_has_and_lacks_what_is_asked_for(self, tmp_path):
        path = tmp_path / "results.h5"
        store.add(path, {"other": self.RESULT})
        with pytest.raises(DamagedError, match="lacks 1 of 1 results") as caught:
            store.read(path, ["one"])
        assert caught.value.whole
        store.add(path, {"one": self.RESULT})
        assert store.stored(path) == {"one", "other"}

    def test_what_is_computed_is_stored_whatever_comes(self, tmp_path):
        with pytest.raises(ZeroDivisionError), store.Keeper(tmp_path / "results.h5") as keeper:
            keeper["one"] = self.RESULT
            keeper["two"] = {"displacement": 1 / 0}
        assert store.stored(tmp_path / "results.h5") == {"one"}

    def test_files_without_checksum_are_set_aside(self, tmp_path, capsys):
        path = tmp_path / "results.h5"
        with h5py.File(path, "w") as file:
            file["scalars"] = "{}"
        assert store.stored(path) == set() and not path.exists()
        assert "it is no file of results; set aside as results.h5.damaged" in capsys.readouterr().err
        store.add(path, {"one": self.RESULT})
        assert store.stored(path) == {"one"}

    def test_what_was_lost_to_limits_is_computed_again_when_they_change(self, tmp_path, monkeypatch):
        store.add(tmp_path / "one.h5", {"one": {"message": "not done within 1 s", store.LIMITS: "1 s"}})
        path = tmp_path / "one.h5"
        assert store.stored(path, "1 s") == {"one"} == store.stored(path)
        assert store.stored(path, "2 s") == set()
        assert store.read_one(tmp_path, "one") == {"message": "not done within 1 s"}
        monkeypatch.setitem(sys.modules, "springtune.tested_stage", SimpleNamespace(solve=lambda task: {"message": ""}))
        content = {"folder": tmp_path, "files": [{"name": "one", "tasks": [{"key": "one"}]}]}
        for limits, message in (("1 s", "not done within 1 s"), ("2 s", "")):
            driver.run("tested_stage", content, Limited(limits))
            assert store.read_one(tmp_path, "one") == {"message": message}


class TestRecords:
    @pytest.fixture
    def made(self, tmp_path):
        """A job's record, and what it made."""
        products = [tmp_path / "a.txt", tmp_path / "b.txt"]
        for product in products:
            product.write_text(product.name)
        records.write(tmp_path / "done.json", "digest", products)
        return tmp_path / "done.json", products

    def test_what_is_there_as_it_was_needs_no_job(self, made):
        record, products = made
        assert records.fault(record, "digest", products) == "" == records.fault(record, "digest", products, wholly=True)

    def test_a_file_of_another_time_and_the_same_content_needs_none(self, made):
        record, products = made
        os.utime(products[0], (1, 1))
        assert records.fault(record, "digest", products) == ""

    def test_whatever_differs_needs_one(self, made):
        record, products = made
        assert records.fault(record.with_name("none.json"), "digest", products) == "not done yet"
        assert records.fault(record, "other", products) == "something else is asked for"
        assert "not what this job made" in records.fault(record, "digest", [*products, record])
        state = products[1].stat()
        products[1].write_text("b.txT")
        assert records.fault(record, "digest", products) == f"{products[1]} is damaged"
        # Not even the time tells: only who reads all of it finds out.
        os.utime(products[1], ns=(state.st_atime_ns, state.st_mtime_ns))
        assert records.fault(record, "digest", products) == ""
        assert records.fault(record, "digest", products, wholly=True) == f"{products[1]} is damaged"
        products[0].unlink()
        assert records.fault(record, "digest", products) == f"{products[0]} is missing"
        record.write_bytes(flipped(record.read_bytes(), 200, 1))
        assert records.fault(record, "digest", products) == f"{record} is damaged"

    def test_what_a_job_made_besides_counts_too(self, made):
        record, products = made
        assert records.fault(record, "digest", products[:1]) == ""
        products[1].unlink()
        assert records.fault(record, "digest", products[:1]) == f"{products[1]} is missing"

    def test_what_could_not_be_made_is_not_missing(self, tmp_path):
        record, never = tmp_path / "done.json", tmp_path / "never.vtu"
        records.write(record, "digest", [never])
        assert records.fault(record, "digest", [never]) == ""
        never.write_text("somebody's")
        assert records.fault(record, "digest", [never])


class Limited(TaskCosts):
    """Tasks within limits of these words."""

    def __init__(self, words):
        super().__init__()
        self.words = words

    @property
    def limits(self):
        return self.words


class TestRunTasks:
    """A job of the stage `reference`, whose result another job reads."""

    @pytest.fixture
    def study(self, tmp_path):
        folder = tmp_path / "results/mine"
        task = {"key": "one", "cost": ["reference", 0], "problem": [5.0, 0.3, "axial"]}
        content = {"folder": str(folder / "references"), "files": [{"name": "one", "tasks": [task]}]}
        note = {"digest": "digest", "module": "studies.kinds.scenes.reference", "content": content}
        note |= {"limits": {"seconds": 60, "memory": 4e9}, "products": [str(folder / "references/one.h5")]}
        checked_json.write(folder / "tasks/reference_0.json", note)
        run_tasks.main(str(folder / "tasks/reference_0.json"), str(folder / "done/reference_0.json"), "digest")
        return folder

    def test_a_job_stores_its_results_and_leaves_its_record(self, study):
        assert store.read_one(study / "references", "one")["displacement"] > 0
        record = checked_json.read(study / "done/reference_0.json")
        assert record["digest"] == "digest" and record["work"]["reference"][0] == 1
        assert list(record["products"]) == [str(study / "references/one.h5")]

    def test_tasks_that_are_not_those_of_the_plan_are_not_done(self, study):
        with pytest.raises(SystemExit, match="not what this job is to do"):
            run_tasks.main(str(study / "tasks/reference_0.json"), str(study / "done/reference_0.json"), "other")

    @pytest.mark.parametrize("how", ["flip", "cut", "empty", "lost"])
    def test_what_a_reader_finds_damaged_is_made_again_where_it_stands(self, study, how, capsys):
        path, done = study / "references/one.h5", study / "done/reference_0.json"
        before, time = store.read_one(study / "references", "one"), done.stat().st_mtime_ns
        content = path.read_bytes()
        changed = {"flip": flipped(content, 900, 0), "cut": content[:-1], "empty": b""}
        if how == "lost":
            path.unlink()
        else:
            path.write_bytes(changed[how])
        found = run_tasks.with_repair(lambda: store.read_one(study / "references", "one"), study)
        assert {name: found[name] for name in ("displacement", "strain")} == {
            name: before[name] for name in ("displacement", "strain")
        }
        assert "computed again" in capsys.readouterr().err
        assert path.with_name(path.name + ASIDE).exists() == (how != "lost")
        # What waited for that job has no reason to run again.
        assert done.stat().st_mtime_ns == time
        assert records.fault(done, "digest", [path], wholly=True) == ""

    def test_who_makes_it_again_keeps_limits_and_what_was_lost_to_them(self, study):
        """One that is lost to the same limits stays lost, however its neighbours are mended."""
        tasks, done = study / "tasks/reference_0.json", study / "done/reference_0.json"
        note = checked_json.read(tasks)
        task = {"key": "lost", "cost": ["reference", 0], "problem": [5.0, 0.3, "axial"]}
        note["content"]["files"].append({"name": "lost", "tasks": [task]})
        note["products"].append(str(study / "references/lost.h5"))
        checked_json.write(tasks, note)
        limits = Watch(note["limits"]).words
        failed = {"message": "not done", "seconds": 0.0, store.LIMITS: limits}
        store.add(study / "references/lost.h5", {"lost": failed})
        (study / "references/one.h5").unlink()
        run_tasks.with_repair(lambda: store.read_one(study / "references", "one"), study)
        assert store.read_one(study / "references", "lost")["message"] == "not done"
        assert checked_json.read(done)["work"]["reference"][0] == 1

    def test_an_edit_of_the_program_during_a_run_ends_its_jobs(self, study, monkeypatch):
        """Results would be stored under keys of the code of before."""
        monkeypatch.setenv(run_tasks.STATE, run_tasks.source_state())
        arguments = str(study / "tasks/reference_0.json"), str(study / "done/reference_0.json"), "digest"
        run_tasks.main(*arguments)
        monkeypatch.setenv(run_tasks.STATE, "that of before")
        with pytest.raises(SystemExit, match="was edited while the study ran; call the same command again"):
            run_tasks.main(*arguments)

    def test_what_no_job_makes_ends_the_reader(self, study):
        with pytest.raises(SystemExit, match="no job makes it"):
            run_tasks.with_repair(lambda: store.read_one(study / "references", "other"), study)

    def test_what_stays_damaged_ends_the_reader(self, study):
        with pytest.raises(SystemExit, match="did not help"):
            run_tasks.with_repair(lambda: store.read(study / "references/one.h5", ["another"]), study)


class TestAttempt:
    def attempt(self, error):
        def task():
            raise error

        spent = TaskCosts()
        return spent.attempt("key", task, lambda why: {"message": why}), spent.broken

    @pytest.mark.parametrize(
        "error",
        [ZeroDivisionError("by zero"), np.linalg.LinAlgError("singular"), RuntimeError("no end"), MemoryError()],
    )
    def test_what_fails_for_its_own_reasons_is_a_hole(self, error):
        result, broken = self.attempt(error)
        assert result["message"] and not broken

    @pytest.mark.parametrize(
        "error",
        [TypeError(), KeyError("x"), AttributeError(), ValueError("shapes"), NotImplementedError(), AssertionError()],
    )
    def test_what_a_broken_program_raises_is_none(self, error):
        result, broken = self.attempt(error)
        assert result is None and broken == [error]

    def test_damage_goes_to_who_mends_it(self):
        with pytest.raises(DamagedError):
            self.attempt(DamagedError("path", "why"))


def test_results_come_back_as_they_went(tmp_path):
    path = tmp_path / "a" / "results.h5"
    result = {"displacement": 1.25e-3, "message": "µ", "iterations": 3, "field": np.arange(6.0).reshape(3, 2)}
    store.add(path, {"one": result})
    back = store.read(path, ["one"], ["field"])["one"]
    assert {name: back[name] for name in ("displacement", "message", "iterations")} == {
        name: result[name] for name in ("displacement", "message", "iterations")
    }
    assert (back["field"] == result["field"]).all()
    assert "field" not in store.read(path, ["one"])["one"]


def test_adding_keeps_what_was_there_and_leaves_nothing_half_written(tmp_path):
    path = tmp_path / "results.h5"
    store.add(path, {"one": {"value": 1.0}})
    store.add(path, {"two": {"value": 2.0}})
    assert store.stored(path) == {"one", "two"}
    before = path.read_bytes()
    with pytest.raises(TypeError):
        store.add(path, {"three": {"value": object()}})
    assert path.read_bytes() == before
    store.add(path, {})
    assert path.read_bytes() == before


def test_a_folder_in_the_place_of_a_file_is_set_aside(tmp_path):
    path = tmp_path / "results.h5"
    path.mkdir()
    assert store.stored(path) == set()
    store.add(path, {"one": {"value": 1.0}})
    assert store.stored(path) == {"one"}
    assert (tmp_path / "results.h5.damaged").is_dir()


def test_keys_depend_on_values_not_on_their_order():
    assert hash_of({"a": 1.0, "b": [2]}) == hash_of({"b": [2], "a": 1.0})
    assert hash_of({"a": 1.0}) != hash_of({"a": 1.0000000000000002})


def test_keys_are_those_that_results_were_stored_under():
    """Another key of the same would compute everything again: 24 digits of the SHA-256 of JSON without spaces."""
    assert hash_of({"b": [2, "x"], "a": 0.1}, None) == hashlib.sha256(b'[{"a":0.1,"b":[2,"x"]},null]').hexdigest()[:24]
    assert len(hash_of()) == 24


def test_stages_depend_on_what_they_import_and_on_nothing_else():
    solve, mesh = (
        {path.rpartition("springtune/")[2] for path in code.modules(f"studies.kinds.scenes.{stage}")}
        for stage in ("solve", "mesh")
    )
    assert {"mechanics/network.py", "mechanics/statics.py", "springs/lattice.py", "mesh/cells.py"} <= solve
    assert not {"mesh/free.py", "mesh/rows.py"} & solve  # these count with the meshes that they make
    assert "studies/runs/store.py" in solve
    for outside in (
        "studies/output/style.py",
        "studies/output/dataset.py",
        "studies/config/load.py",
        "reference/small_strain.py",
    ):
        assert outside not in solve
    assert "problem/compare.py" not in solve
    assert "mechanics/statics.py" not in mesh
    # References know the mesh of a network by its type alone, so an edit of a mesh does not solve them again. The sides
    # of outlines are geometry, which load cases are on.
    meshes = {path for path in code.modules("studies.kinds.scenes.reference") if "springtune/mesh/" in path}
    assert {path.rpartition("/")[2] for path in meshes} <= {"sides.py"}
    assert "mechanics/series.py" not in solve  # an edit of curves solves no scenes again


def test_definitions_belong_to_their_own_keys_and_to_no_stage():
    # An edit of one definition is to solve that definition's scenes again and no others.
    digests = {name: code.definition_closure(name).digest for name in ("angular", "delingette", "patch", "lattice")}
    assert len(set(digests.values())) == len(digests)
    assert str(code.PACKAGE / "springs/angular.py") not in code.modules("studies.kinds.scenes.solve")


def test_tasks_are_done_until_their_result_is_stored(tmp_path, monkeypatch):
    done, module = [], ModuleType("springtune.tested_stage")
    module.solve = lambda task: done.append(task["key"]) or {"displacement": 2.0}
    monkeypatch.setitem(sys.modules, module.__name__, module)
    content = {"folder": tmp_path, "files": [{"name": name, "tasks": [{"key": name}]} for name in ("one", "two")]}
    store.add(tmp_path / "one.h5", {"one": {"displacement": 1.0, "field": np.arange(2.0)}})
    (tmp_path / "two.h5").write_text("no results")
    driver.run("tested_stage", content, TaskCosts())
    assert done == ["two"] and store.read_one(tmp_path, "two") == {"displacement": 2.0}
    driver.run("tested_stage", content, TaskCosts())
    assert done == ["two"]
    assert store.read_one(tmp_path, "one") == {"displacement": 1.0}
    assert store.read_one(tmp_path, "one", ["field"])["field"].tolist() == [0.0, 1.0]

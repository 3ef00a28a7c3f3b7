"""The store of results and the digest of code."""

import hashlib
import subprocess
import sys
from types import ModuleType

import h5py
import numpy as np
import pytest

from springtune.studies.runs import driver, store
from springtune.studies.runs import keys as code
from springtune.studies.runs.checked_json import hash_of
from springtune.studies.runs.task_costs import TaskCosts


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


def test_broken_file_holds_nothing_and_is_replaced(tmp_path):
    path = tmp_path / "results.h5"
    path.write_text("not HDF5")
    assert store.stored(path) == set()
    store.add(path, {"one": {"value": 1.0}})
    assert store.stored(path) == {"one"}
    assert h5py.is_hdf5(path)


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


def test_physics_imports_no_workflow_dataset_or_plots():
    """A job of these pays for numpy, scipy.sparse, h5py and its own libraries only."""
    stages = [f"springtune.studies.kinds.scenes.{stage}" for stage in ("mesh", "sensitivity", "solve", "reference")]
    program = f"import sys, {', '.join(stages)}; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.split()
    assert not {"snakemake", "xarray", "matplotlib", "pandas", "pydantic", "pint"} & set(loaded)


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

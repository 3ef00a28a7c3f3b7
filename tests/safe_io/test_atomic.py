"""Files that appear whole or not at all."""

import os
import platform
import subprocess
import sys
import time

import pytest

import springtune as st
from springtune.mesh import write_mesh
from springtune.safe_io import atomic


def test_two_processes_never_write_one_file(tmp_path):
    with atomic.replacing(tmp_path / "note.txt") as unfinished:
        assert unfinished.name == f"note.txt.{os.getpid()}@{platform.node().replace('.', '-')}.unfinished"
        unfinished.write_text("whole")
    assert [path.name for path in tmp_path.iterdir()] == ["note.txt"]


def test_an_error_leaves_what_was_there(tmp_path):
    atomic.write_text(tmp_path / "note.txt", "of before")
    with pytest.raises(ZeroDivisionError), atomic.replacing(tmp_path / "note.txt", synced=True) as unfinished:
        unfinished.write_text("half of")
        _ = 1 / 0
    assert [path.read_text() for path in tmp_path.iterdir()] == ["of before"]


def test_an_unfinished_mesh_leaves_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "replace", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        write_mesh(tmp_path / "mesh.vtu", st.MESH_TYPES["right"](0.05, 0.02, 1e-2))
    assert not list(tmp_path.iterdir())


def test_what_the_dead_left_is_swept_and_what_the_living_write_stays(tmp_path):
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as living:
        kept = tmp_path / "deep" / f"a.h5.{living.pid}.unfinished"
        atomic.write_text(kept, "half of")
        for name in ("deep/a.h5.99999999.unfinished", "b.unfinished", "c.x.unfinished", f"d.{10**30}.unfinished"):
            atomic.write_text(tmp_path / name, "half of")
        atomic.write_text(tmp_path / "deep/unfinished.txt", "whole")
        atomic.remove_unfinished(tmp_path, below=False)
        assert [path.name for path in tmp_path.iterdir()] == ["deep"] and len(list((tmp_path / "deep").iterdir())) == 3
        atomic.remove_unfinished(tmp_path)
        assert {path.name for path in (tmp_path / "deep").iterdir()} == {kept.name, "unfinished.txt"}
        living.communicate(b"\n")
    atomic.remove_unfinished(tmp_path)
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["unfinished.txt"]


def test_what_another_machine_writes_stays_for_an_hour(tmp_path):
    """Its processes are not to be seen, and one of this machine may have the same number."""
    (tmp_path / f"a.h5.{os.getpid()}@elsewhere.unfinished").write_text("half of")
    (tmp_path / "b.h5.99999999@else-where.unfinished").write_text("half of")
    atomic.remove_unfinished(tmp_path)
    assert len(list(tmp_path.iterdir())) == 2
    for path in tmp_path.iterdir():
        os.utime(path, (time.time() - atomic.ABANDONED_SECONDS - 1,) * 2)
    atomic.remove_unfinished(tmp_path)
    assert not list(tmp_path.iterdir())


def test_the_dead_that_nobody_waits_for_write_nothing(tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    os.waitid(os.P_PID, dead.pid, os.WEXITED | os.WNOWAIT)
    atomic.write_text(tmp_path / f"note.txt.{dead.pid}.unfinished", "half of")
    atomic.remove_unfinished(tmp_path)
    assert not list(tmp_path.iterdir())
    dead.wait()

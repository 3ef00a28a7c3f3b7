"""Kills, damaged files and full disks of a small study: the next run makes it good, or names the file to delete."""

import contextlib
import os
import resource
import shutil
import signal
from pathlib import Path

import pytest
import xarray as xr

from springtune.studies.runs import plan

from campaigns import Campaign
from tables import STUDIES, slow_but

FOLDER = Path("results/survival")
KILLS = slow_but([1, 8], [1, 2, 3, 5, 8])
"""Renamings of a finished file at which the run is killed."""


def campaign():
    Campaign("survival.yaml").finish(plan.COLLECT)


def values():
    with xr.open_dataset(FOLDER / plan.DATASET) as dataset:
        return dataset[["displacement", "stiffness"]].load()


def forked(function):
    """Status of a process of its own group that calls a function."""
    child = os.fork()
    if not child:
        os.setsid()
        code = 1
        with contextlib.suppress(BaseException):
            function()
            code = 0
        os._exit(code)
    status = os.waitpid(child, 0)[1]
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    return status


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Folder of the study, done, and its values."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "survival.yaml").write_text(STUDIES["survival"])
    with contextlib.chdir(folder):
        campaign()
        return folder, values()


@pytest.fixture
def started(whole, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(whole[0] / "survival.yaml", tmp_path)


def good(whole):
    """The same command again gives the values of an undisturbed run."""
    campaign()
    assert values().equals(whole[1])
    assert plan.COLLECT not in Campaign("survival.yaml").due()


@pytest.mark.parametrize("number", KILLS)
def test_a_killed_run_goes_on(whole, started, monkeypatch, number):
    real, calls = os.replace, []

    def replace(*paths, **options):
        calls.append(paths)
        if len(calls) == number:
            os.killpg(0, signal.SIGKILL)
        return real(*paths, **options)

    def killed():
        monkeypatch.setattr(os, "replace", replace)
        campaign()

    assert os.WIFSIGNALED(forked(killed))
    assert not (FOLDER / plan.DATASET).exists()
    good(whole)


@pytest.mark.parametrize("size", slow_but([500, 20_000], [500, 3000, 20_000, 60_000]))
def test_a_full_disk_ends_the_run_and_spoils_nothing(whole, started, size):
    def limited():
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
        campaign()

    assert forked(limited)
    good(whole)


@pytest.mark.parametrize("how", slow_but(["flipped"], ["cut", "flipped", "emptied"]))
def test_a_damaged_file_is_named_or_made_again(whole, tmp_path, monkeypatch, how):
    every = sorted((whole[0] / FOLDER).rglob("*"))
    files = {(path.parent, path.suffix): path for path in every if path.suffix in (".h5", ".json")}
    assert len(files) > 2
    for number, original in enumerate(files.values()):
        folder = tmp_path / str(number)
        shutil.copytree(whole[0], folder)
        monkeypatch.chdir(folder)
        path = original.relative_to(whole[0])
        content = bytearray(path.read_bytes())
        middle = len(content) // 2
        if how == "flipped":
            content[middle] ^= 0xFF
        path.write_bytes(content if how == "flipped" else content[: middle if how == "cut" else 0])
        (FOLDER / plan.DATASET).unlink()  # what is stored is read again
        try:
            campaign()
        except SystemExit as error:
            assert str(path) in str(error) and "delete" in str(error), f"{path}: {error}"
            path.unlink()
            campaign()
        assert values().equals(whole[1]), path

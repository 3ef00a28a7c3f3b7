"""Every operation on files of a small study failed once: as SQLite tests itself.

After each failure nothing that is half-written has a final name, and after a plain run the study is what it is without
one: the same bits apart from times, and no file besides.
"""

import os
import re
import resource
import shutil
import signal
from functools import partial
from pathlib import Path

import driven
import pytest
from injection import FAULTS, Faults, operations

STEPS = ["begin", "reference_0", "mesh_0", "sensitivity_0", "calibrate_0", "solve_0", "moduli_0", "laying_0",
         "stability_0", "benchmark_traction", "interpolate_0", "sample_0", "shape_reference_0",
         "shape_mesh_0", "shape_solve_0", "collect", "present_scenes", "browse"]  # fmt: skip

FEW = 97
"""Of so many operations the short form fails one, each with another fault than the one before."""

LIMITS = (0.02, 0.3, 0.6, 0.9, 0.999)
"""Shares of the dataset's size at which the system lets it grow no further."""


@pytest.fixture
def counted(whole, tmp_path):
    """Gives the operations of a step."""

    def count(step):
        if step not in whole.operations:
            folder, notes, log = tmp_path / "counted", tmp_path / "notes", tmp_path / "counting.log"
            shutil.copytree(whole.snapshots / step, folder)
            status = driven.forked(partial(driven.faulty, step, Faults(folder / "results", notes)), folder, log)
            assert not status, log.read_text()
            whole.operations[step] = operations(notes)
            shutil.rmtree(folder)
            notes.unlink()
        return whole.operations[step]

    return count


def fail(whole, tmp_path, step, number, how):
    """Complaints about what a failure leaves, and about what a plain run makes of it."""
    folder, notes, log, report = (tmp_path / f"{step}_{number}_{how}{end}" for end in ("", ".notes", ".log", ".txt"))
    shutil.copytree(whole.snapshots / step, folder)
    faults = Faults(folder / "results", notes, number, how, report)
    status = driven.forked(partial(driven.faulty, step, faults), folder, log)
    complaints = []
    if not report.exists():
        complaints.append("the operation did not come")
    if how == "kill" and os.WTERMSIG(status) != signal.SIGKILL:
        complaints.append(f"it ended with {status}")
    return complaints + judged(whole, folder, log, report, step)


def judged(whole, folder, log, report, step):
    """Complaints about what is in a folder, and about what a plain run makes of it."""
    complaints = []
    left = [path for path in folder.rglob("*.unfinished")]
    for path in left:
        path.rename(path.with_name("aside"))  # the only names that may be of halves
    try:
        found = {
            name: value for name, value in driven.contents(folder / "results").items() if not name.endswith("aside")
        }
        complaints += [f"left changed: {path}" for path in driven.differences(found, whole.wanted, partly=True)]
    except Exception as error:
        complaints.append(f"left: {type(error).__name__}: {error}")
    for path in left:
        path.with_name("aside").rename(path)
    if driven.forked(lambda: driven.Run().finish(step), folder, log):
        complaints.append("a plain run ends with an error")
    else:
        try:
            found = driven.contents(folder / "results")
            complaints += [f"different: {path}" for path in driven.differences(found, whole.after(step))]
        except Exception as error:
            complaints.append(f"made: {type(error).__name__}: {error}")
    if complaints:
        told = report.read_text() if report.exists() else ""
        return [f"{folder.name}: {complaint}" for complaint in complaints] + [told + log.read_text()[-3000:]]
    shutil.rmtree(folder)
    return []


@pytest.mark.slow
@pytest.mark.parametrize("how", FAULTS)
@pytest.mark.parametrize("step", STEPS)
def test_every_operation_fails_once(whole, counted, tmp_path, step, how):
    complaints = []
    for number in range(1, len(counted(step)) + 1):
        complaints += fail(whole, tmp_path, step, number, how)
    assert not complaints, "\n".join(complaints)


def test_some_operations_fail_once(whole, counted, tmp_path):
    """The short form of the test above; it counts all of them, too."""
    assert whole.steps == STEPS
    every = [(step, number) for step in STEPS for number in range(1, len(counted(step)) + 1)]
    print(f"{len(every)} operations in {len(STEPS)} steps: {' '.join(f'{s} {len(counted(s))}' for s in STEPS)}")
    told = re.search(r"some\s(\d+) openings", (Path(__file__).parents[2] / "docs/robustness.md").read_text())
    assert abs(len(every) - int(told[1])) <= 20, f"docs/robustness.md tells of {told[1]} operations: {len(every)}"
    names = {name for step in STEPS for name, _ in counted(step)}
    assert names >= {"open", "write", "fsync", "replace", "mkdir", "library"}, names
    complaints = []
    for place, (step, number) in enumerate(every[::FEW]):
        complaints += fail(whole, tmp_path, step, number, FAULTS[place % len(FAULTS)])
    assert not complaints, "\n".join(complaints)


@pytest.mark.slow
@pytest.mark.parametrize("killed", [False, True])
def test_a_dataset_that_grows_to_a_limit(whole, tmp_path, killed):
    """The library that writes it meets the system's own limit of a file's size: an error, or a signal that kills."""

    def limited(limit):
        if killed:
            signal.signal(signal.SIGXFSZ, signal.SIG_DFL)
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        driven.Run().do("collect")

    size = (whole.snapshots / "browse" / driven.FOLDER / "dataset.nc").stat().st_size
    complaints = []
    for share in LIMITS:
        folder, log = tmp_path / f"{share}", tmp_path / f"{share}.log"
        shutil.copytree(whole.snapshots / "collect", folder)
        status = driven.forked(partial(limited, int(share * size)), folder, log)
        assert status and os.WIFSIGNALED(status) == killed
        if not killed:
            assert "cannot be written" in log.read_text() and not list(folder.rglob("*.unfinished"))
        complaints += judged(whole, folder, log, tmp_path / "none", "collect")
    assert not complaints, "\n".join(complaints)

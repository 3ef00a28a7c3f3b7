"""A job of a stage: ``python -m springtune.studies.runs.run_tasks TASKS DONE DIGEST``.

What is to do is the note ``TASKS``; the module that it names does it, and ``DONE`` records what was done and made. A
stored file that turns out to be damaged is set aside and made again, in the job that needs it. A task that goes beyond
its limits fails, and the others are done; a program that is broken ends the job when all other tasks are done.
"""

import os
import sys
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from springtune.problem.geometry import AssumptionWarning
from springtune.registry import imported

from . import checked_json, driver, records
from .checked_json import DamagedError, hash_of, set_aside
from .task_costs import TaskCosts, Watch, guarded

Made = TypeVar("Made")

TASKS, RECORDS = "tasks", "done"
"""Folders of a study: what each job of a stage is to do, and what each job has done."""

PACKAGE = Path(__file__).parents[2]

STATE = "SPRINGTUNE_SOURCE_STATE"
"""Variable of the environment by which a run tells its jobs the `source_state` that it began with."""

TRIES = 2
"""So often a file is made again that is damaged: another job may set aside what was just made."""

TRACEBACKS = 3
"""Most tracebacks of one job's log; tasks that are alike fail alike."""


def main(tasks: str, done: str, digest: str) -> None:
    """Do what a note says.

    Parameters
    ----------
    tasks : str
        The note: ``digest``, ``limits``, ``module`` of the package and ``content`` for it, see
        `springtune.studies.runs.driver`, and ``products``, files that it makes.
    """
    note = checked_json.read(tasks)
    if note is None or note["digest"] != digest:
        raise SystemExit(
            f"{tasks}: not what this job is to do; call the same command again, it writes it anew (without --no-hooks)"
        )
    began_with = os.environ.get(STATE)
    if began_with and began_with != source_state():
        raise SystemExit(f"{PACKAGE} was edited while the study ran; call the same command again")
    warnings.simplefilter("ignore", AssumptionWarning)  # whoever read the study said it
    _run(note, done, Path(tasks).parents[1])


def source_state() -> str:
    """Sizes and times of all files of the package: results are stored under keys of the code that a run began with."""
    states = [(str(path), path.stat()) for path in sorted(PACKAGE.rglob("*.py"))]
    return hash_of([[name, state.st_size, state.st_mtime_ns] for name, state in states])


def _run(note: dict[str, Any], done: str | Path, folder: Path) -> None:
    """Do the tasks of a note within their limits."""
    imported(note["module"])  # once for all children
    watch = Watch(note["limits"])
    costs = TaskCosts(watch)
    guarded(
        lambda: with_repair(lambda: _do(note, done, costs), folder),
        watch,
        lambda key, why: driver.gone(note["module"], note["content"], key, why, watch.words),
    )


def _do(note: dict[str, Any], done: str | Path, costs: TaskCosts) -> None:
    driver.run(note["module"], note["content"], costs)
    if costs.broken:
        for error in costs.broken[:TRACEBACKS]:
            traceback.print_exception(error)
        first = traceback.format_exception_only(costs.broken[0])[-1].strip()
        raise SystemExit(f"{len(costs.broken)} of this job's tasks could not be done: {first}")
    records.write(done, note["digest"], note["products"], **costs.summary())


def with_repair(function: Callable[[], Made], folder: Path) -> Made:
    """Call a function; stored files that it finds damaged are made again."""
    again: Counter[Path] = Counter()
    while True:
        try:
            return function()
        except DamagedError as error:
            again[error.path] += 1
            if again[error.path] > TRIES:
                raise SystemExit(f"{error}, and making it again did not help") from None
            set_aside(error)
            _make_again(error.path, folder)


def _make_again(product: Path, folder: Path) -> None:
    """Let the job that makes a file make it again."""
    for path in sorted((folder / TASKS).glob("*_*.json")):
        note = checked_json.read(path)
        if note is not None and str(product) in note["products"]:
            done = folder / RECORDS / path.name
            before = done.stat() if done.exists() else None
            _run(note, done, folder)
            if before:  # what waited for it has no reason to run again
                os.utime(done, ns=(before.st_atime_ns, before.st_mtime_ns))
            return
    raise SystemExit(f"{product}: no job makes it; call the same command again")


if __name__ == "__main__":
    main(*sys.argv[1:])

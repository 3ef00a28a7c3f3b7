"""A job of a stage: ``python -m springtune.studies.runs.run_tasks TASKS DONE DIGEST``.

The note ``TASKS`` names the tasks and the module that does them; ``DONE`` becomes the record of the job. A damaged
stored file is set aside and made again by the job that needs it. A task beyond its limits fails, and the others are
done. A broken program ends the job when all other tasks are done.
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
from .source import PACKAGE
from .task_costs import TaskCosts, Watch, run_limited

Made = TypeVar("Made")

TASKS, RECORDS = "tasks", "done"
"""Folders of a study: notes of jobs to do, and records of done jobs."""

STATE = "SPRINGTUNE_SOURCE_STATE"
"""Environment variable with the `source_state` at the begin of a run, for its jobs."""

TRIES = 2
"""Times that a damaged file is made again; another job may set aside the new one."""

TRACEBACKS = 3
"""Most tracebacks in the log of a job; similar tasks fail alike."""


def main(tasks: str, done: str, digest: str) -> None:
    """Do what the note at `tasks` says: the tasks of its `content`, by its `module`, within its `limits`."""
    note = checked_json.read(tasks)
    if note is None or note["digest"] != digest:
        raise SystemExit(
            f"{tasks}: not what this job is to do; call the same command again, it writes it anew, without "
            "--no-hooks. Where springtune is a module, `onstart:` of the workflow has to call springtune.onstart()"
        )
    began_with = os.environ.get(STATE)
    if began_with and began_with != source_state():
        raise SystemExit(f"{PACKAGE} was edited while the study ran; call the same command again")
    warnings.simplefilter("ignore", AssumptionWarning)  # whoever read the study said it
    _run(note, done, Path(tasks).parents[1])


def source_state() -> str:
    """Hash of sizes and times of the package's files; keys of results are those of the code at the begin of a run."""
    states = [(str(path), path.stat()) for path in sorted(PACKAGE.rglob("*.py"))]
    return hash_of([[name, state.st_size, state.st_mtime_ns] for name, state in states])


def _run(note: dict[str, Any], done: str | Path, folder: Path) -> None:
    """Do the tasks of a note within their limits."""
    imported(note["module"])  # once for all children
    watch = Watch(note["limits"])
    costs = TaskCosts(watch)
    run_limited(
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
    """Call a function, and again after making damaged stored files again."""
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
    """Run the job that makes a file."""
    for path in sorted((folder / TASKS).glob("*_*.json")):
        note = checked_json.read(path)
        if note is not None and str(product) in note["products"]:
            done = folder / RECORDS / path.name
            before = done.stat() if done.exists() else None
            _run(note, done, folder)
            if before:  # so that jobs after it need not run again
                os.utime(done, ns=(before.st_atime_ns, before.st_mtime_ns))
            return
    raise SystemExit(f"{product}: no job makes it; call the same command again")


if __name__ == "__main__":
    main(*sys.argv[1:])

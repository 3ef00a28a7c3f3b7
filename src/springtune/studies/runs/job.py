"""A job of a stage, ``python -m springtune.studies.runs.job TASKS DONE DIGEST``: the tasks whose results are missing.

The note ``TASKS`` names the module of the stage and the content of the job: the ``folder`` of the stage and its
``files``. A file has a ``name``, ``tasks``, and values that its tasks share; each task has the ``key`` of its result.
The module of a stage defines:

- ``solve(task)`` returns its result, with ``prepare`` ``solve(task, made)``.
- ``prepare(file, content)`` returns what the tasks of a file share, such as a mesh, or raises `RefusedError`.
- ``failed(task, why)`` returns the result of a failed task; by default a status and a message.
- ``parts(task, result)`` returns the parts of a result by key, if it is stored in several parts.
- ``tasks(file, content)`` returns the tasks of a file, if their keys depend on other results.
- ``order(task)`` is the sort key of tasks.

All but ``solve`` are optional. A module with a loop of its own has ``run(content, attempts)``, and ``crashed(content,
key, why)``, which stores the failed result of a task whose process died.

The tasks are done in a worker process. A task that fails is a result with its reason; so is one whose process dies, and
the worker is started anew for the others. A broken program ends the job when all other tasks are done.
"""

import ctypes
import multiprocessing
import os
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from springtune.problem.geometry import AssumptionWarning
from springtune.problem.status import Status
from springtune.registry import imported
from springtune.safe_io import atomic

from . import store
from .source import PACKAGE, STATE, hash_of, read_note, source_state
from .store import DamagedError

JOB = "studies.runs.job"
"""This module; the keys of all results depend on it."""

TASKS, RECORDS = "tasks", "done"
"""Folders of a study: notes of jobs to do, and records of done jobs."""

TRACEBACKS = 3
"""Most tracebacks in the log of a job; similar tasks fail alike."""

LONGEST_KEY = 4096

Task = Mapping[str, Any]
Result = dict[str, Any]


class RefusedError(Exception):
    """Tasks cannot be prepared."""


def main(tasks: str, done: str, digest: str) -> None:
    """Do the job of a note, and write its record."""
    note = read_note(Path(tasks))
    if hash_of(note.get("module"), note.get("content")) != digest:
        raise SystemExit(
            f"{tasks}: not what this job is to do; call the same command again, it writes it anew, without "
            "--no-hooks. Where springtune is a module, `onstart:` of the workflow has to call springtune.onstart()"
        )
    if os.environ.get(STATE, source_state()) != source_state():
        raise SystemExit(f"{PACKAGE} was edited while the study ran; call the same command again")
    warnings.simplefilter("ignore", AssumptionWarning)  # whoever read the study said it
    try:
        computed = in_worker(note["module"], note["content"])
    except DamagedError as error:
        forget_job_of(error.path, Path(tasks).parents[1])
        raise SystemExit(str(error)) from None
    atomic.write_json(done, {"digest": digest, "computed": computed})


def in_worker(name: str, content: dict[str, Any]) -> int:
    """Do the tasks of a job in a worker process, started anew after each task that ends it; return their number."""
    module, last = imported(name), ""
    with tempfile.TemporaryFile() as under_way:
        while True:
            with ProcessPoolExecutor(1, multiprocessing.get_context("fork"), end_with_parent) as worker:
                try:
                    return worker.submit(do, name, content, under_way.fileno()).result()
                except BrokenProcessPool:
                    key = os.pread(under_way.fileno(), LONGEST_KEY, 0).rstrip(b"\0").decode()
            if not key or key == last:
                raise SystemExit("the process of this job died: is the machine's memory short?")
            last, why = key, "the process that solved it died: a crash, or too little memory"
            getattr(module, "crashed", partial(crashed_of_files, module))(content, key, why)


def end_with_parent() -> None:
    """Let the kernel end this process with its parent, where it can."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


def do(name: str, content: dict[str, Any], under_way: int | None = None) -> int:
    """Do the tasks of a job whose results are missing; return their number."""
    module, attempts = imported(name), Attempts(under_way)
    getattr(module, "run", partial(solve_files, module))(content, attempts)
    for error in attempts.broken[:TRACEBACKS]:
        traceback.print_exception(error)
    if attempts.broken:
        first = traceback.format_exception_only(attempts.broken[0])[-1].strip()
        raise SystemExit(f"{len(attempts.broken)} of this job's tasks could not be done: {first}")
    return attempts.computed


class Attempts:
    """Attempts at the tasks of a job: how many were made, and errors of a broken program."""

    def __init__(self, under_way: int | None = None) -> None:
        self.under_way, self.computed, self.broken = under_way, 0, list[Exception]()

    def attempt(self, key: str, function: Callable[[], Any], failed: Callable[[str], Any]) -> Any:
        """Return the result of a task, a failed result for a reason of the task, or None if the program is broken."""
        self._note(key)
        try:
            return function()
        except MemoryError:
            return failed("not enough memory")
        except DamagedError:
            raise
        except Exception as error:
            why = own_reason(error)
            if not why:
                self.broken.append(error)
                return None
            return failed(why)
        finally:
            self._note("")

    def _note(self, key: str) -> None:
        """Note the task under way, where another process can read it."""
        if self.under_way is not None:
            os.pwrite(self.under_way, key.encode().ljust(LONGEST_KEY, b"\0"), 0)


def own_reason(error: Exception) -> str:
    """Return the reason of a failed task, or an empty string if the program is broken.

    Examples
    --------
    >>> own_reason(ZeroDivisionError("division by zero"))
    'ZeroDivisionError: division by zero'
    >>> own_reason(TypeError("unsupported operand"))
    ''
    """
    # By name: results shall not depend on the code of meshes and definitions for the sake of an exception.
    if {"DefinitionError", "MeshError"} & {one.__name__ for one in type(error).__mro__}:
        return str(error)
    reason = f"{type(error).__name__}: {error}"
    if isinstance(error, RuntimeError):
        return "" if isinstance(error, NotImplementedError | RecursionError) else reason
    # numpy's LinAlgError is a ValueError, and so is what scipy raises for numbers that are not finite.
    named = type(error).__name__ == "LinAlgError" or "infs or NaNs" in str(error)
    return reason if named or isinstance(error, ArithmeticError) else ""


def forget_job_of(product: Path, folder: Path) -> None:
    """Remove the record of the job that makes a file, so that the next run does this job again."""
    for path in (folder / TASKS).glob("*_*.json"):
        if str(product) in read_note(path).get("products", ()):
            (folder / RECORDS / path.name).unlink(missing_ok=True)


# -- the tasks of files ------------------------------------------------------------------------------------------------


def solve_files(module: ModuleType, content: dict[str, Any], attempts: Attempts) -> None:
    """Do the tasks of a job's files whose results are missing."""
    for file in content["files"]:
        _File(module, content, file).solve(attempts)


def crashed_of_files(module: ModuleType, content: dict[str, Any], key: str, why: str) -> None:
    """Store the failed result of a task whose process died, or of all tasks of a file of that name."""
    for one in content["files"]:
        file = _File(module, content, one)
        file.fail([task for task in file.missing if key in (one["name"], task["key"])], why)


class _File:
    """Tasks of a job whose results are in one file."""

    def __init__(self, module: ModuleType, content: dict[str, Any], file: dict[str, Any]) -> None:
        self.module, self.content, self.file = module, content, file
        self.path = Path(content["folder"]) / f"{file['name']}.h5"
        self.failed: Callable[..., Result] = getattr(module, "failed", _failed)
        self.all_parts: Callable[..., dict[str, Result]] = getattr(module, "parts", _one_part)
        tasks = module.tasks(file, content) if hasattr(module, "tasks") else file["tasks"]
        self.present = store.stored(self.path)
        unique = {task["key"]: task for task in tasks}.values()
        self.missing = [task for task in unique if not self.all_parts(task, {}).keys() <= self.present]

    def fail(self, tasks: list[Task], why: str) -> None:
        """Store the failed results of tasks."""
        parts = [self.parts(task, self.failed(task, why)) for task in tasks]
        store.add(self.path, {key: part for one in parts for key, part in one.items()})

    def parts(self, task: Task, result: Result) -> dict[str, Result]:
        """Parts of a result to store; stored numbers stay unchanged."""
        parts = self.all_parts(task, result)
        return {key: part for key, part in parts.items() if key != task["key"] or key not in self.present}

    def solve(self, attempts: Attempts) -> None:
        """Do the missing tasks."""
        if not self.missing:
            return
        shared: tuple[Any, ...] = ()
        if hasattr(self.module, "prepare"):
            made = attempts.attempt(self.file["name"], self._prepared, lambda why: _Refused(f"mesh: {why}"))
            if made is None:
                return
            if isinstance(made, _Refused):
                self.fail(self.missing, made)
                attempts.computed += len(self.missing)
                return
            shared = (made,)
        order = getattr(self.module, "order", None)
        with store.Keeper(self.path) as keeper:
            for task in sorted(self.missing, key=order) if order else self.missing:
                solve = partial(self.module.solve, task, *shared)
                result = attempts.attempt(task["key"], solve, partial(self.failed, task))
                if result is None:
                    continue
                attempts.computed += 1
                for key, part in self.parts(task, result).items():
                    keeper[key] = part

    def _prepared(self) -> Any:
        """What tasks share, or why it cannot be prepared."""
        try:
            return self.module.prepare(self.file, self.content)
        except RefusedError as error:
            return _Refused(str(error))


class _Refused(str):
    """Why the tasks of a file cannot be prepared."""


def _failed(task: Task, why: str) -> Result:
    return {"status": Status.FAILED, "message": why}


def _one_part(task: Task, result: Result) -> dict[str, Result]:
    return {task["key"]: result}


if __name__ == "__main__":
    from springtune.studies.runs import job  # by its name, as stages import `RefusedError`

    job.main(*sys.argv[1:])

"""Solve the tasks of a job whose results are missing, in a worker process.

The module of a stage defines ``solve(task)``, which returns a result, and may define:

- ``prepare(file, content)`` returns what the tasks of a file share, for ``solve(task, made)``, or raises
  `RefusedError`.
- ``failed(task, why)`` returns the result of a failed task; by default a status and a message.
- ``parts(task, result)`` returns the parts of a result by key.
- ``tasks(file, content)`` returns the tasks of a file, if their keys depend on other results.
- ``order(task)`` is the sort key of tasks.
- ``run(content, attempts)`` replaces the loop over files and tasks.

A task fails with its reason, also if its process dies; a broken program ends the job after all other tasks.
"""

import ctypes
import multiprocessing
import os
import signal
import sys
import tempfile
import traceback
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from springtune.problem.quantities import Status
from springtune.registry import import_name

from . import store
from .store import DamagedError

MODULE = "studies.runs.attempts"  # this module; the keys of all results depend on it

TRACEBACKS = 3  # most tracebacks in the log of a job; similar tasks fail alike

LONGEST_KEY = 4096


class RefusedError(Exception):
    """Tasks cannot be prepared, mostly because their mesh failed."""


def do_in_worker(name: str, content: dict[str, Any]) -> int:
    """Do the tasks of a job in a worker process, started anew after each task that ends it; return their number."""
    lost: dict[str, str] = {}
    with tempfile.TemporaryFile() as under_way:
        while True:
            with ProcessPoolExecutor(1, multiprocessing.get_context("fork"), end_with_parent) as worker:
                try:
                    return worker.submit(do_tasks, name, content, lost, under_way.fileno()).result()
                except BrokenProcessPool:
                    key = os.pread(under_way.fileno(), LONGEST_KEY, 0).rstrip(b"\0").decode()
            if not key or key in lost:
                raise SystemExit("the process of this job died: a crash, or too little memory")
            lost[key] = "the process that solved it died: a crash, or too little memory"


def end_with_parent() -> None:
    """Let the kernel end this process with its parent, where it can."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG


def do_tasks(
    name: str, content: dict[str, Any], lost: Mapping[str, str] | None = None, under_way: int | None = None
) -> int:
    """Do the tasks of a job whose results are missing, except `lost` ones with their reasons; return their number."""
    module, attempts = import_name(name), Attempts(lost or {}, under_way)
    getattr(module, "run", partial(solve_files, module))(content, attempts)
    for error in attempts.broken[:TRACEBACKS]:
        traceback.print_exception(error)
    if attempts.broken:
        first = traceback.format_exception_only(attempts.broken[0])[-1].strip()
        raise SystemExit(f"{len(attempts.broken)} of this job's tasks could not be done: {first}")
    return attempts.computed


class Attempts:
    """Attempts at the tasks of a job: number of computed ones, and errors of a broken program."""

    def __init__(self, lost: Mapping[str, str], under_way: int | None = None) -> None:
        self.lost, self.under_way = lost, under_way
        self.computed, self.broken = 0, list[Exception]()

    def attempt(self, key: str, function: Callable[[], Any], failed: Callable[[str], Any]) -> Any:
        """Return the result of a task, a failed result for a reason of the task, or None if the program is broken."""
        if key in self.lost:
            return failed(self.lost[key])
        self._note(key)
        try:
            return function()
        except MemoryError:
            return failed("not enough memory")
        except DamagedError:
            raise
        except Exception as error:
            if why := failure_reason(error):
                return failed(why)
            self.broken.append(error)
            return None
        finally:
            self._note("")

    def _note(self, key: str) -> None:
        """Note the current task, where the parent process can read it."""
        if self.under_way is not None:
            os.pwrite(self.under_way, key.encode().ljust(LONGEST_KEY, b"\0"), 0)


def failure_reason(error: Exception) -> str:
    """Return the reason of a failed task, or an empty string if the program is broken."""
    # By name: results shall not depend on the code of meshes and definitions for the sake of an exception.
    names = {one.__name__ for one in type(error).__mro__}
    if names & {"DefinitionError", "MeshError", "RefusedError"}:
        return str(error)
    # numpy's LinAlgError is a ValueError, and so is what scipy raises for numbers that are not finite.
    own = names & {"ArithmeticError", "LinAlgError", "RuntimeError"} or "infs or NaNs" in str(error)
    broken = names & {"NotImplementedError", "RecursionError"}
    return f"{type(error).__name__}: {error}" if own and not broken else ""


def solve_files(module: ModuleType, content: dict[str, Any], attempts: Attempts) -> None:
    """Do the tasks of a job's files whose results are missing."""
    failed = getattr(module, "failed", lambda task, why: {"status": Status.FAILED, "message": why})
    parts = getattr(module, "parts", lambda task, result: {task["key"]: result})
    for file in content["files"]:
        path = Path(content["folder"]) / f"{file['name']}.h5"
        present = store.stored_keys(path)
        tasks = module.tasks(file, content) if hasattr(module, "tasks") else file["tasks"]
        missing = [task for task in tasks if not parts(task, {}).keys() <= present]
        shared: list[Any] = []
        if missing and hasattr(module, "prepare"):
            shared = [attempts.attempt(file["name"], partial(module.prepare, file, content), RefusedError)]
        if not missing or shared == [None]:
            continue
        with store.ResultBuffer(path) as keeper:
            for task in sorted(missing, key=module.order) if hasattr(module, "order") else missing:
                if shared and isinstance(shared[0], RefusedError):
                    result = failed(task, f"mesh: {shared[0]}")
                else:
                    solve = partial(module.solve, task, *shared)
                    result = attempts.attempt(task["key"], solve, partial(failed, task))
                if result is None:
                    continue
                attempts.computed += 1
                for key, part in parts(task, result).items():
                    if key != task["key"] or key not in present:  # stored numbers stay unchanged
                        keeper[key] = part

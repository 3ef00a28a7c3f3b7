"""The loop over the tasks of a job, the same for all stages.

The content of a job has the ``folder`` of its stage and its ``files``. A file has a ``name``, ``tasks``, and values
that its tasks share; each task has the ``key`` of its result. The module of a stage defines:

- ``solve(task)`` returns its result, with ``prepare`` ``solve(task, made)``.
- ``prepare(file, content)`` returns what the tasks of a file share, such as a mesh, or raises `RefusedError`.
- ``failed(task, why)`` returns the result of a failed task; by default a status and a message.
- ``parts(task, result)`` returns the parts of a result by key, if it is stored in several parts.
- ``tasks(file, content)`` returns the tasks of a file, if their keys depend on other results.
- ``order(task)`` is the sort key of tasks.
- ``cost(task, made, result, seconds)`` yields a name, units and seconds to count; by default the task's ``cost``.

All but ``solve`` are optional. A module with a loop of its own has ``run(content, costs)``, and ``gone(content, key,
why, limits)``, which stores the failed result of a task that went beyond its limits.
"""

import time
from collections.abc import Callable, Mapping
from functools import cached_property, partial
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from springtune.problem.status import Status
from springtune.registry import imported

from . import store

if TYPE_CHECKING:
    from .task_costs import TaskCosts

DRIVER = "studies.runs.driver"
"""This module; the keys of all results depend on it."""

REFUSED = "without mesh"
"""Name under which records count tasks that could not be prepared."""

ONLY_PARTS = "fields"
"""Name under which records count tasks with only further parts missing."""

Task = Mapping[str, Any]
Result = dict[str, Any]


class RefusedError(Exception):
    """Tasks cannot be prepared; ``limited`` if another job's task went beyond its limits."""

    def __init__(self, why: str, limited: bool = False) -> None:
        super().__init__(why)
        self.limited = limited


def run(name: str, content: dict[str, Any], costs: "TaskCosts") -> None:
    """Do the tasks of a job whose results are missing."""
    module = imported(name)
    getattr(module, "run", partial(solve_files, module))(content, costs)


def solve_files(module: ModuleType, content: dict[str, Any], costs: "TaskCosts") -> None:
    """Do the tasks of a job's files whose results are missing."""
    for file in content["files"]:
        _File(module, content, file, costs.limits).solve(costs)


def gone(name: str, content: dict[str, Any], key: str, why: str, limits: str) -> None:
    """Store the failed result of a task that went beyond its limits, or of all tasks of a file of that name."""
    module = imported(name)
    getattr(module, "gone", partial(gone_of_files, module))(content, key, why, limits)


def gone_of_files(module: ModuleType, content: dict[str, Any], key: str, why: str, limits: str) -> bool:
    """`gone` for the files of a job; return whether one of their tasks has the key."""
    found = False
    for one in content["files"]:
        file = _File(module, content, one, limits)
        lost = [task for task in file.tasks if key in (one["name"], task["key"])]
        file.fail([task for task in lost if task in file.missing], why, limits)
        found |= bool(lost)
    return found


class _File:
    """Tasks of a job whose results are in one file."""

    def __init__(self, module: ModuleType, content: dict[str, Any], file: dict[str, Any], limits: str) -> None:
        self.module, self.content, self.file = module, content, file
        self.path = Path(content["folder"]) / f"{file['name']}.h5"
        self.failed: Callable[..., Result] = getattr(module, "failed", _failed)
        self.all_parts: Callable[..., dict[str, Result]] = getattr(module, "parts", _one_part)
        tasks = module.tasks(file, content) if hasattr(module, "tasks") else file["tasks"]
        self.tasks = list({task["key"]: task for task in tasks}.values())
        self.limits = limits

    @cached_property
    def present(self) -> set[str]:
        """Keys of stored results."""
        return store.stored(self.path, self.limits)

    @cached_property
    def missing(self) -> list[Task]:
        """Tasks whose result, or a part of it, is not stored."""
        return [task for task in self.tasks if not self.all_parts(task, {}).keys() <= self.present]

    def fail(self, tasks: list[Task], why: str, limits: str | None = None) -> None:
        """Store the failed results of tasks."""
        noted = {} if limits is None else {store.LIMITS: limits}
        parts = [self.parts(task, self.failed(task, why)) for task in tasks]
        store.add(self.path, {key: part | noted for one in parts for key, part in one.items()})

    def parts(self, task: Task, result: Result) -> dict[str, Result]:
        """Parts of a result to store; stored numbers stay unchanged."""
        parts = self.all_parts(task, result)
        return {key: part for key, part in parts.items() if key != task["key"] or key not in self.present}

    def solve(self, costs: "TaskCosts") -> None:
        """Do the missing tasks."""
        if not self.missing:
            return
        shared: tuple[Any, ...] = ()
        if hasattr(self.module, "prepare"):
            made = costs.attempt(self.file["name"], self._prepared, lambda why: {"message": f"mesh: {why}"})
            if made is None:
                return
            if isinstance(made, dict):
                self.fail(self.missing, made["message"], made.get(store.LIMITS))
                costs.add(REFUSED, 0, 0.0, len(self.missing))
                return
            shared = (made,)
        order, cost = getattr(self.module, "order", None), getattr(self.module, "cost", _cost)
        with store.Keeper(self.path) as keeper:
            for task in sorted(self.missing, key=order) if order else self.missing:
                begin = time.perf_counter()
                result = costs.attempt(
                    task["key"], partial(self.module.solve, task, *shared), partial(self.failed, task)
                )
                if result is None:
                    continue
                for number, row in enumerate(cost(task, *shared, result, time.perf_counter() - begin)):
                    costs.add(ONLY_PARTS if number == 0 and task["key"] in self.present else row[0], *row[1:])
                for key, part in self.parts(task, result).items():
                    keeper[key] = part

    def _prepared(self) -> Any:
        """What tasks share; a dict with a message if it cannot be prepared."""
        try:
            return self.module.prepare(self.file, self.content)
        except RefusedError as error:
            return {"message": str(error)} | ({store.LIMITS: self.limits} if error.limited else {})


def _failed(task: Task, why: str) -> Result:
    return {"status": Status.FAILED, "message": why}


def _one_part(task: Task, result: Result) -> dict[str, Result]:
    return {task["key"]: result}


def _cost(task: Task, *made_and_result: object) -> list[tuple[str, float, object]]:
    """Cost of a task; the last argument is its seconds."""
    return [(*task["cost"], made_and_result[-1])] if "cost" in task else []

"""Stages that follow from their tasks: bundles, contents of jobs, files and results."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..config.kind import Stage
from . import store
from .job import JOB
from .keys import stage_key
from .source import hash_of

if TYPE_CHECKING:
    from ..config.model import Study


@dataclass(frozen=True)
class Task:
    """A task of a stage.

    Attributes
    ----------
    values : dict
        Argument of ``solve``, without labels, so that a new label computes nothing again.
    also : sequence
        Further parts of its key: code that its values choose, by `keys.definition_key` and `keys.mesh_type_key`.
    labels : dict
        Labels of its cell of the dataset; a label may be several.
    of : object
        Object of the study that it comes from.
    seconds : float
        Expected seconds, for bundles of about equal work.
    name : str
        Tasks of one name are in one bundle; by default a hash of its values.
    file : str
        Stem of the file of its result; by default its key.
    shared : dict
        Values that all tasks of that file share.
    key : str
        Key of its result; by default a hash of all inputs.
    """

    values: Mapping[str, Any]
    also: Sequence[object] = ()
    labels: Mapping[str, Any] = field(default_factory=dict)
    of: Any = None
    seconds: float = 0.0
    name: str = ""
    file: str = ""
    shared: Mapping[str, Any] = field(default_factory=dict)
    key: str = ""

    def key_of(self, module: str) -> str:
        """Key of its result, computed by a module."""
        return self.key or hash_of(self.values, stage_key(module, JOB), self.also)


def stage(
    name: str, module: str, message: str, tasks: "Callable[[Study], Iterable[Task]]", folder: str = "", **options: Any
) -> Stage:
    """Stage whose bundles and jobs follow from its tasks; it stores in the folder of its name, or in another one."""
    folder = folder or name

    def members(study: "Study") -> dict[str, tuple[float, list[Task]]]:
        found: dict[str, list[Task]] = {}
        for task in tasks(study):
            called = task.name or hash_of(task.values)
            if task.name or called not in found:  # else it is one task with two labels
                found.setdefault(called, []).append(task)
        return {called: (sum(task.seconds for task in own), own) for called, own in found.items()}

    def content(study: "Study", results: Path, members: list[list[Task]]) -> dict[str, Any]:
        files: dict[str, dict[str, Any]] = {}
        for task in chain.from_iterable(members):
            key = task.key_of(module)
            file = files.setdefault(task.file or key, {"name": task.file or key, **task.shared, "tasks": {}})
            file["tasks"][key] = {"key": key, **task.values}
        return {
            "folder": str(results / folder),
            "files": [file | {"tasks": list(file["tasks"].values())} for file in files.values()],
        }

    return Stage(name, module, message, content, products, members, folder=folder, tasks=tasks, **options)


def products(content: Mapping[str, Any]) -> list[Path]:
    """Files that a job makes."""
    names = dict.fromkeys(file["name"] for file in content["files"])  # beams of one extent share a file
    return [Path(content["folder"]) / f"{name}.h5" for name in names]


def results(
    stage: Stage, study: "Study", folder: Path, fields: Iterable[str] = ()
) -> Iterator[tuple[Task, dict[str, Any]]]:
    """Tasks of a stage and their stored results, in the order of the tasks."""
    assert stage.tasks
    tasks, files = list(stage.tasks(study)), defaultdict(list)
    keys = [task.key_of(stage.module) for task in tasks]
    for task, key in zip(tasks, keys):
        files[task.file or key].append(key)
    fields = list(fields)
    found = {name: store.read(folder / stage.folder / f"{name}.h5", held, fields) for name, held in files.items()}
    for task, key in zip(tasks, keys):
        yield task, dict(found[task.file or key][key])


def rows(stage: Stage, study: "Study", folder: Path) -> Iterator[dict[str, Any]]:
    """Rows of the stored results of a stage, each with the labels of its task."""
    for task, result in results(stage, study, folder):
        for row in result.get("rows", [result]):
            yield {**task.labels, **row}

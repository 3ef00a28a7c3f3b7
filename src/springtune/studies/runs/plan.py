"""Jobs of a study's stages: tasks in jobs of about equal work by numbers of particles, the same on each machine."""

import json
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import log2
from pathlib import Path
from typing import Any

from springtune.safe_io.files import write_bytes

from ..config.kind import Stage, kinds
from ..config.model import Study
from . import attempts, store
from .keys import stage_key
from .source import RECORDS, TASKS, hash_of, read_note

MOST_JOBS = 64
"""Most jobs of a stage."""


@dataclass
class Task:
    """A task of a stage; tasks of one name are in one bundle."""

    values: Mapping[str, Any]  # argument of `solve`, without labels, so that a new label computes nothing again
    also: Sequence[object] = ()  # code that its values choose, by `keys.definition_key` and `keys.mesh_type_key`
    labels: Mapping[str, Any] = field(default_factory=dict)  # of its cell of the dataset; a label may be several
    seconds: float = 0.0  # expected, for bundles of about equal work
    name: str = ""  # by default a hash of its values
    file: str = ""  # stem of the file of its result; by default its key
    shared: Mapping[str, Any] = field(default_factory=dict)  # values that all tasks of that file share
    key: str = ""  # by default a hash of all inputs

    def key_of(self, stage: Stage) -> str:
        """Key of its result."""
        return self.key or hash_of(self.values, stage_key(stage.module, attempts.MODULE), self.also)


@dataclass(frozen=True)
class Job:
    """A job of a run; `digest` is a hash of all that it depends on, without products of other jobs."""

    folder: Path
    name: str
    digest: str
    products: tuple[str, ...]
    reads: tuple[str, ...] = ()  # products of other jobs
    stage: Stage | None = None
    label: str = ""  # of its bundle
    content: Mapping[str, Any] = field(default_factory=dict)  # its tasks

    @property
    def record(self) -> Path:
        """Record of the done job."""
        return self.folder / RECORDS / f"{self.name}.json"

    @property
    def tasks(self) -> Path:
        """Note of its tasks."""
        return self.folder / TASKS / f"{self.name}.json"

    @property
    def results(self) -> set[tuple[str, str]]:
        """File and key of each result that it is to make."""
        return {(file["name"], task["key"]) for file in self.content["files"] for task in file["tasks"]}

    def write(self) -> None:
        """Write the note that a job of a stage reads; an unchanged one stays."""
        if self.stage and read_note(self.tasks).get("digest") != self.digest:
            note = {"digest": self.digest, "module": self.stage.module, "products": self.products}
            write_bytes(self.tasks, json.dumps(note | {"content": self.content}).encode())


def share_out(seconds: Mapping[str, float]) -> dict[str, list[str]]:
    """Share tasks out in bundles of about equal work, the more the longer they take.

    >>> share_out({"coarse": 1.0, "fine": 4.0, "middle": 2.0})
    {'0': ['fine'], '1': ['coarse', 'middle']}
    """
    total = sum(seconds.values())
    # One job for 2 s, 8 for 2 minutes, 64 for 2 hours: against start-up, and for machines of many cores.
    count = min(2 ** round(log2(total / 2) / 2), MOST_JOBS, len(seconds)) if total > 2 else 1
    load = dict.fromkeys(map(str, range(count)), 0.0)
    bundles: dict[str, list[str]] = {}
    for name in sorted(seconds, key=lambda name: (-seconds[name], name)):
        label = min(load, key=lambda label: load[label])
        bundles.setdefault(label, []).append(name)
        load[label] += seconds[name]
    return {label: sorted(names) for label, names in bundles.items()}


def stages() -> tuple[Stage, ...]:
    """Stages of all study kinds."""
    return tuple(stage for kind in kinds() for stage in kind.stages)


def plan(study: Study, folder: Path) -> dict[str, Job]:
    """Plan the jobs of a study's stages by name; nothing is written."""
    jobs: dict[str, Job] = {}
    bundles: dict[str, dict[str, list[str]]] = {}
    tasks: dict[str, dict[str, list[Task]]] = {}
    for kind in kinds():
        for stage in kind.stages if study.parts[kind.name] else ():
            named = tasks[stage.name] = defaultdict(list)
            for task in stage.tasks(study):
                named[task.name or hash_of(task.values)].append(task)
            if not stage.like:
                seconds = {name: sum(task.seconds for task in own) for name, own in named.items()}
                bundles[stage.name] = {name: [name] for name in named} if stage.alone else share_out(seconds)
    for stage in stages():
        for label, names in bundles.get(stage.like or stage.name, {}).items():
            own = [task for name in names for task in tasks[stage.name].get(name, ())]
            if own:
                job = _job(stage, folder, label, own)
                jobs[job.name] = job
    return jobs


def _job(stage: Stage, folder: Path, label: str, tasks: Iterable[Task]) -> Job:
    files: dict[tuple[str, str], dict[str, Any]] = {}
    for task in tasks:
        key = task.key_of(stage)
        name = task.file or key
        file = files.setdefault((name, repr(task.shared)), {"name": name, **task.shared, "tasks": {}})
        file["tasks"][key] = {"key": key, **task.values}
    content = {
        "results": str(folder),
        "folder": str(folder / stage.folder),
        "files": [file | {"tasks": list(file["tasks"].values())} for file in files.values()],
    }
    names = dict.fromkeys(name for name, _ in files)  # beams of one extent share a file
    products = tuple(str(folder / stage.folder / f"{name}{ending}") for name in names for ending in stage.endings)
    digest = hash_of(stage.module, content)
    return Job(folder, f"{stage.name}_{label}", digest, products, stage=stage, label=label, content=content)


def results(stage: Stage, study: Study, folder: Path) -> Iterator[tuple[Task, dict[str, Any]]]:
    """Tasks of a stage and the scalars of their stored results, in the order of the tasks."""
    tasks, files = list(stage.tasks(study)), defaultdict(list)
    keys = [task.key_of(stage) for task in tasks]
    for task, key in zip(tasks, keys):
        files[task.file or key].append(key)
    found = {name: store.read(folder / stage.folder / f"{name}.h5", held) for name, held in files.items()}
    for task, key in zip(tasks, keys):
        yield task, dict(found[task.file or key][key])


def rows(stage: Stage, study: Study, folder: Path) -> Iterator[dict[str, Any]]:
    """Rows of the stored results of a stage, each with the labels of its task."""
    for task, result in results(stage, study, folder):
        for row in result.get("rows", [result]):
            yield {**task.labels, **row}

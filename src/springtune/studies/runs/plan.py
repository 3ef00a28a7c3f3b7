"""From a study to what each Snakemake job is to do: tasks bundled into jobs of about equal work.

One process a scene would be all start-up. The largest tasks are shared out first, by expected seconds that follow from
numbers of particles alone, so that a study has the same jobs each time. A plan is made whenever the Snakefile is read,
and written when a run begins: reading changes nothing.
"""

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING, Any

from springtune.safe_io import atomic

from ..config.kind import kinds
from .job import RECORDS, TASKS
from .source import hash_of, read_note

if TYPE_CHECKING:
    from ..config.kind import Output, Stage
    from ..config.model import Study

CLUSTER_JOBS = 64
"""Jobs of a stage on a cluster."""

LEAST_SECONDS, LEAST_ON_CLUSTER = 1.0, 120.0
"""Expected seconds that a job takes at least, against its start-up; on a cluster it also waits."""

MANY_SECONDS = 10
"""Multiple of these seconds for each job from which a stage gets four times as many, so that all cores end together."""


def share_out(seconds: Mapping[str, float], cores: int, least: float = LEAST_SECONDS) -> dict[str, list[str]]:
    """Share tasks out in bundles of about equal work.

    Examples
    --------
    >>> share_out({"coarse": 1.0, "fine": 4.0, "middle": 2.0}, cores=2)
    {'0': ['fine'], '1': ['coarse', 'middle']}
    """
    total = sum(seconds.values())
    count = 4 * cores if total > MANY_SECONDS * least * cores else min(cores, ceil(total / least))
    load = dict.fromkeys(map(str, range(max(1, min(count, len(seconds))))), 0.0)
    bundles: dict[str, list[str]] = {}
    for name in sorted(seconds, key=lambda name: (-seconds[name], name)):
        label = min(load, key=lambda label: load[label])
        bundles.setdefault(label, []).append(name)
        load[label] += seconds[name]
    return {label: sorted(names) for label, names in bundles.items()}


def stages() -> "tuple[Stage, ...]":
    """Stages of all study kinds."""
    return tuple(stage for kind in kinds() for stage in kind.stages)


def table_files(output: "Output", study: "Study") -> list[str]:
    """Files of an output's tables; for the page, all tables as CSV and the page itself."""
    if not output.page:
        return [*output.tables(study), *output.texts]
    return [*(f"{stem}.csv" for kind in kinds() if kind.tables for stem in kind.tables(study)), "index.html"]


@dataclass(frozen=True)
class Tasks:
    """Tasks of a job of a stage."""

    stage: "Stage"
    label: str
    content: dict[str, Any]
    digest: str
    products: tuple[str, ...]

    @property
    def name(self) -> str:
        """Stem of its files."""
        return f"{self.stage.name}_{self.label}"


@dataclass(frozen=True)
class Plan:
    """Jobs of a study's stages by name."""

    folder: Path
    jobs: dict[str, Tasks]

    def labels(self, stage: str) -> list[str]:
        """Labels of the bundles of a stage."""
        return [job.label for job in self.jobs.values() if job.stage.name == stage]

    def tasks(self, name: str) -> Path:
        """Note of a job's tasks."""
        return self.folder / TASKS / f"{name}.json"

    def record(self, name: str) -> Path:
        """Record of a done job."""
        return self.folder / RECORDS / f"{name}.json"

    def write(self) -> None:
        """Write the notes that jobs read; unchanged files stay."""
        for name, job in self.jobs.items():
            path = self.tasks(name)
            if read_note(path).get("digest") != job.digest:
                content = {"digest": job.digest, "module": job.stage.module, "products": list(job.products)}
                atomic.write_bytes(path, json.dumps(content | {"content": job.content}).encode())


def plan(study: "Study", folder: Path, cores: int | None = None, cluster: bool = False) -> Plan:
    """Plan the jobs of a study's stages for this machine, or for a cluster; nothing is written."""
    cores, least = (CLUSTER_JOBS, LEAST_ON_CLUSTER) if cluster else (cores or os.cpu_count() or 1, LEAST_SECONDS)
    jobs: dict[str, Tasks] = {}
    members: Members = {}
    bundles: dict[str, dict[str, list[str]]] = {}
    for kind in kinds():
        for stage in kind.stages:
            if stage.members:
                found = dict(stage.members(study)) if study.parts[kind.name] else {}
                seconds = {name: expected for name, (expected, _) in found.items()}
                members[stage.name] = found
                bundles[stage.name] = {n: [n] for n in found} if stage.alone else share_out(seconds, cores, least)
    for stage in stages():
        jobs |= {job.name: job for job in _jobs(stage, study, folder, members, bundles)}
    return Plan(folder, jobs)


Members = dict[str, dict[str, tuple[float, Any]]]
"""Seconds and value of what bundles hold, by stage and name."""


def _jobs(
    stage: "Stage", study: "Study", folder: Path, members: Members, bundles: dict[str, dict[str, list[str]]]
) -> Iterator[Tasks]:
    of = stage.like or stage.name
    for label, names in bundles[of].items():
        content = stage.content(study, folder, [members[of][name][1] for name in names])
        if content:
            yield Tasks(stage, label, content, hash_of(stage.module, content), tuple(map(str, stage.products(content))))

"""From a study to the tasks of its stages: what each Snakemake job is to do.

Scenes are put together in bundles of meshes of about equal cost, since one process a scene would be all start-up. A
plan is made whenever the Snakefile is read, and written when a run begins: reading changes nothing.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..config.kind import kinds
from . import bundles, checked_json
from .bundles import Needs
from .hashing import hash_of
from .run_tasks import RECORDS, TASKS

if TYPE_CHECKING:
    from ..config.kind import Output, Stage
    from ..config.model import Study

COSTS_FILE = "costs.json"
"""File beside the studies' folders: what tasks cost on this machine."""

BUNDLES_FILE = f"{TASKS}/bundles.json"
"""File in a study's folder: what each bundle holds."""

LASTING = "seconds"
"""What that file calls the seconds that a job is to last."""


def stages() -> "tuple[Stage, ...]":
    """Stages of all study kinds."""
    return tuple(stage for kind in kinds() for stage in kind.stages)


def table_files(output: "Output", study: "Study") -> list[str]:
    """Files of the tables of an output: where it is the page, each table of all study kinds as CSV, and the page."""
    if not output.page:
        return list(output.tables(study))
    return [*(f"{stem}.csv" for kind in kinds() if kind.tables for stem in kind.tables(study)), "index.html"]


def usual_costs() -> dict[str, tuple[float, float]]:
    """Seconds of tasks before any was measured, see `springtune.studies.runs.bundles.Costs`."""
    return {name: cost for kind in kinds() for name, cost in kind.costs.items()}


@dataclass(frozen=True)
class Tasks:
    """What a job of a stage is to do."""

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
    """What the jobs of a study's stages are to do.

    Attributes
    ----------
    limits : dict
        Of one task, see `springtune.studies.config.model.Study`.
    bundles : dict
        What each bundle holds, by stage and label, and the cores and the seconds of a job that they are made for.
    needs : dict of tuple to springtune.studies.runs.bundles.Needs
        What a job needs, by stage and label; stages that share bundles share their seconds, too.
    """

    folder: Path
    limits: dict[str, float]
    bundles: dict[str, Any]
    jobs: dict[str, Tasks]
    needs: dict[tuple[str, str], Needs]

    def labels(self, stage: str) -> list[str]:
        """Labels of the bundles of a stage."""
        return [job.label for job in self.jobs.values() if job.stage.name == stage]

    def tasks(self, name: str) -> Path:
        """File of what a job is to do."""
        return self.folder / TASKS / f"{name}.json"

    def record(self, name: str) -> Path:
        """File of what a job has done."""
        return self.folder / RECORDS / f"{name}.json"

    def write(self) -> None:
        """Write what jobs and later plans read; a file that says so already stays."""
        notes = {self.folder / BUNDLES_FILE: self.bundles}
        for name, job in self.jobs.items():
            notes[self.tasks(name)] = {
                "digest": job.digest,
                "module": job.stage.module,
                "limits": self.limits,
                "products": list(job.products),
                "content": job.content,
            }
        for path, content in notes.items():
            if checked_json.read(path) != content:
                checked_json.write(path, content)


def plan(study: "Study", folder: Path, cores: int = 1, lasting: float | None = None) -> Plan:
    """Plan the jobs of a study's stages; nothing is written."""
    known: dict[str, Any] = checked_json.read(folder / BUNDLES_FILE, cores=int) or {"cores": 0}
    lasting_before = known.get(LASTING, 0.0)
    lasting = lasting_before if lasting is None else lasting
    costs = bundles.Costs(folder.parent / COSTS_FILE, usual_costs())
    members = {stage.name: dict(stage.members(study, costs)) for stage in stages() if stage.members}
    before = {name: known.get(name, {}) for name in members}
    kept: dict[str, dict[str, list[str]]] = {name: {} for name in members}
    # Other machines want other bundles. What is solved stays solved, whichever bundle it is in, and a bundle that is
    # done stays as it is, so that nothing of it runs again.
    if known["cores"] < cores or lasting_before != lasting:
        before, kept = kept, _done(study, folder, members, before)
    found: dict[str, Any] = {}
    for stage in stages():
        if stage.name in members:
            held = kept[stage.name]
            left = members[stage.name].keys() - {name for names in held.values() for name in names}
            seconds = {name: members[stage.name][name][0] for name in left}
            if stage.alone:
                found[stage.name] = {name: [name] for name in members[stage.name]}
            else:
                shared = bundles.share_out(seconds, cores, costs.start_up, before[stage.name], lasting)
                found[stage.name] = bundles.beside(held, shared)
    jobs = {job.name: job for stage in stages() for job in _jobs(stage, study, folder, members, found)}
    needs = {
        (stage.name, label): Needs(
            sum(members[stage.like or stage.name][name][0] for name in names),
            costs.memory.get(stage.name, 0.0),
            study.limits["memory"],
        )
        for stage in stages()
        for label, names in found[stage.like or stage.name].items()
    }
    known_for = {"cores": max(known["cores"], cores), LASTING: lasting}
    return Plan(folder, study.limits, found | known_for, jobs, needs)


Members = dict[str, dict[str, tuple[float, Any]]]
"""Seconds and value of what bundles hold, by stage and name."""


def _done(study: "Study", folder: Path, members: Members, before: dict[str, Any]) -> dict[str, Any]:
    """Bundles whose jobs have all done what is asked for."""
    held: dict[str, dict[str, list[str]]] = {stage: {} for stage in before}
    for stage, labels in before.items():
        for label, names in labels.items():
            if asked := [name for name in names if name in members[stage]]:
                held[stage][label] = asked
    undone = {
        (job.stage.like or job.stage.name, job.label)
        for one in stages()
        for job in _jobs(one, study, folder, members, held)
        if (checked_json.read(folder / RECORDS / f"{job.name}.json") or {}).get("digest") != job.digest
    }
    return {
        stage: {label: names for label, names in labels.items() if (stage, label) not in undone}
        for stage, labels in held.items()
    }


def _jobs(
    stage: "Stage", study: "Study", folder: Path, members: Members, shared: dict[str, dict[str, list[str]]]
) -> Iterator[Tasks]:
    of = stage.like or stage.name
    for label, names in shared[of].items():
        content = stage.content(study, folder, [members[of][name][1] for name in names])
        if content:
            digest = hash_of(stage.module, content, study.limits)
            yield Tasks(stage, label, content, digest, tuple(map(str, stage.products(content))))

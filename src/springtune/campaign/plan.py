"""From a study to the tasks of its stages: what each Snakemake job is to do.

Scenes are put together in bundles of meshes of about equal cost, since one process a scene would be all start-up. A
plan is made whenever the Snakefile is read, and written when a run begins: reading changes nothing.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..jobs import bundles, sealed
from ..jobs.hashing import hash_of
from ..jobs.run_tasks import RECORDS, TASKS
from ..kinds import kinds

if TYPE_CHECKING:
    from ..kinds.base import Output, Stage
    from ..study.model import Study

COSTS_FILE = "costs.json"
"""File beside the studies' folders: what tasks cost on this machine."""

BUNDLES_FILE = f"{TASKS}/bundles.json"
"""File in a study's folder: what each bundle holds."""


def stages() -> "tuple[Stage, ...]":
    """Stages of all study kinds.

    Returns
    -------
    tuple of Stage
    """
    return tuple(stage for kind in kinds() for stage in kind.stages)


def table_files(output: "Output", study: "Study") -> list[str]:
    """Files of the tables of an output: where it is the page, each table of all study kinds as CSV, and the page.

    Parameters
    ----------
    output : Output
    study : Study

    Returns
    -------
    list of str
    """
    if not output.page:
        return list(output.tables(study))
    return [*(f"{stem}.csv" for kind in kinds() if kind.tables for stem in kind.tables(study)), "index.html"]


def usual_costs() -> dict[str, tuple[float, float]]:
    """Seconds of tasks before any was measured, see `springtune.jobs.bundles.Costs`."""
    return {name: cost for kind in kinds() for name, cost in kind.costs.items()}


@dataclass(frozen=True)
class Tasks:
    """What a job of a stage is to do.

    Attributes
    ----------
    stage : Stage
    label : str
        Of the bundle.
    content : dict
        Tasks, as the stage's module takes them.
    digest : str
        Of all that the job depends on.
    products : tuple of str
        Files that it makes.
    """

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
    folder : Path
        Where the study's results go.
    limits : dict
        Of one task, see `springtune.study.model.Study`.
    bundles : dict
        What each bundle holds, by stage and label, and the cores that they are made for.
    jobs : dict of str to Tasks
        By name, in the order of stages.
    """

    folder: Path
    limits: dict[str, float]
    bundles: dict[str, Any]
    jobs: dict[str, Tasks]

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
            if sealed.read(path) != content:
                sealed.write(path, content)


def plan(study: "Study", folder: Path, cores: int) -> Plan:
    """Plan the jobs of a study's stages; nothing is written.

    Parameters
    ----------
    study : Study
    folder : Path
        Where its results go.
    cores : int
        Bundles are made at least for so many cores.

    Returns
    -------
    Plan
    """
    known: dict[str, Any] = sealed.read(folder / BUNDLES_FILE, cores=int) or {"cores": 0}
    # More cores want more bundles; what is solved stays solved, whichever bundle it is in.
    before: dict[str, Any] = known if known["cores"] >= cores else {"cores": cores}
    costs = bundles.Costs(folder.parent / COSTS_FILE, usual_costs())
    found: dict[str, Any] = {}
    shared: dict[str, dict[str, list[Any]]] = {}
    for stage in stages():
        if stage.members is None:  # it works on another one's bundles
            continue
        members = stage.members(study, costs)
        if stage.alone:
            found[stage.name] = {name: [name] for name in members}
        else:
            seconds = {name: each for name, (each, _) in members.items()}
            kept = before.get(stage.name, {})
            found[stage.name] = bundles.share_out(seconds, cores, costs.start_up, kept) if members else {}
        shared[stage.name] = {label: [members[name][1] for name in names] for label, names in found[stage.name].items()}
    jobs = {
        job.name: job for stage in stages() for job in _jobs(stage, study, folder, shared[stage.like or stage.name])
    }
    return Plan(folder, study.limits, found | {"cores": before["cores"]}, jobs)


def _jobs(stage: "Stage", study: "Study", folder: Path, shared: dict[str, list[Any]]) -> Iterator[Tasks]:
    for label, one in shared.items():
        content = stage.content(study, folder, one)
        if content:
            digest = hash_of(stage.module, content, study.limits)
            yield Tasks(stage, label, content, digest, tuple(map(str, stage.products(content))))

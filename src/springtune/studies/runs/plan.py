"""From a study to what each Snakemake job is to do: tasks of about equal cost are bundled, by costs measured here.

One process a scene would be all start-up, so tasks are bundled until start-up is a small share of a job. A bundle keeps
its tasks while the study requests them; only new tasks are shared out. On a cluster a job lasts for the minutes that
its profile states, and `Needs` requests its time and memory. A plan is made whenever the Snakefile is read, and written
when a run begins: reading changes nothing.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import ceil, inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..config.kind import kinds
from . import checked_json
from .checked_json import hash_of
from .run_tasks import RECORDS, TASKS

if TYPE_CHECKING:
    from ..config.kind import Output, Stage
    from ..config.model import Study

Usual = Mapping[str, tuple[float, float]]
"""Seconds of a task by name: fixed, and per unit."""

START_UP = 0.25
"""Seconds of imports of a job before any is measured."""

SPAWNED = 0.25
"""Seconds of start-up that a job cannot measure: Snakemake, shell and interpreter."""

START_SHARE = 0.05
"""Share of a job's time that start-up may take."""

QUEUED = 300.0
"""Seconds that a cluster job may take besides its work: interpreters start twice, on a shared filesystem."""

TIME_MARGIN, MEMORY_MARGIN = 3.0, 1.5
"""Factors on expected needs: nodes may be slower, meshes finer."""

MEMORY, LEAST_MEMORY = 2e9, 1e9
"""Bytes requested before any are measured, and at least: cores of clusters have that much."""

FORGET = 0.5
"""Share of former memory kept if jobs needed less: one small run must not lower all requests."""

REMEMBERED = 20
"""Weight limit of former jobs, in multiples of the last run's work."""


class Costs:
    """Measured costs of tasks on this machine.

    Examples
    --------
    >>> Costs(Path("no such file"), {"linear": (5e-4, 1e-6)}).of("linear", 1000)
    0.0015
    """

    def __init__(self, path: Path, usual: Usual) -> None:
        self.usual = usual
        known = checked_json.read(path, kinds=dict) or {}  # as good as new where it is damaged
        self.ratios = {
            kind: seconds / expected for kind, (expected, seconds) in known.get("kinds", {}).items() if expected
        }
        self.start_up = known.get("start_up", START_UP) + SPAWNED
        self.memory: dict[str, float] = known.get("memory", {})

    def of(self, kind: str, units: float = 0.0) -> float:
        """Seconds of a task."""
        return self.ratios.get(kind, 1.0) * _usual(self.usual, kind, 1, units) if kind in self.usual else 0.0


@dataclass(frozen=True)
class Needs:
    """Resources that a job requests from a cluster; expected `memory` [byte] is 0 if unmeasured."""

    seconds: float
    memory: float = 0.0
    most_memory: float = inf

    def minutes(self, attempt: int) -> int:
        """Minutes after which the cluster may end the job.

        Examples
        --------
        >>> [Needs(300.0).minutes(attempt) for attempt in (1, 2, 3)]
        [20, 40, 80]
        """
        return ceil((QUEUED + TIME_MARGIN * self.seconds) / 60) * 2 ** (attempt - 1)

    def megabytes(self, attempt: int) -> int:
        """Memory limit of the job [MB].

        Examples
        --------
        >>> [Needs(300.0, 1e9, 4e9).megabytes(attempt) for attempt in (1, 2, 3)]
        [1500, 3000, 5000]
        """
        asked = max(LEAST_MEMORY, MEMORY_MARGIN * self.memory if self.memory else MEMORY) * 2 ** (attempt - 1)
        # What the limits allow comes on top of what a job has before its tasks.
        return ceil(min(asked, self.most_memory + LEAST_MEMORY) / 1e6)


def _usual(usual: Usual, kind: str, count: float, units: float) -> float:
    always, each = usual[kind]
    return always * count + each * units


def remember_costs(path: Path, done: Iterable[Path], usual: Usual) -> None:
    """Add the costs of a run's jobs to those of the machine."""
    known = checked_json.read(path, kinds=dict)
    since = path.stat().st_mtime if known else 0.0
    known = known or {"kinds": {}}
    found = [(file.stem, checked_json.read(file)) for file in done if file.stat().st_mtime > since]
    notes = [note for _, note in found if note]
    sums: dict[str, list[float]] = defaultdict(lambda: [0.0, 0.0])
    for note in notes:
        for kind, (count, units, seconds) in note.get("work", {}).items():
            if kind in usual:
                sums[kind][0] += _usual(usual, kind, count, units)
                sums[kind][1] += seconds
    for kind, (expected, seconds) in sums.items():
        before = known["kinds"].get(kind, [0.0, 0.0])
        fade = min(1.0, REMEMBERED * expected / before[0]) if before[0] else 0.0
        known["kinds"][kind] = [fade * before[0] + expected, fade * before[1] + seconds]
    starts = sorted(note["start_up"] for note in notes if note.get("work"))
    if starts:
        known["start_up"] = starts[len(starts) // 2]
        known["memory"] = _memory(known.get("memory", {}), found)
        checked_json.write(path, known)


def _memory(before: Mapping[str, float], found: Iterable[tuple[str, Any]]) -> dict[str, float]:
    """Largest job memory by stage, over this run and former ones."""
    now: dict[str, float] = {}
    for name, note in found:
        if note and note.get("work"):
            stage = name.rpartition("_")[0]
            now[stage] = max(now.get(stage, 0.0), note.get("memory", 0.0))
    return {**before, **{stage: max(most, FORGET * before.get(stage, 0.0)) for stage, most in now.items()}}


def share_out(
    costs: Mapping[str, float], cores: int, start_up: float, before: Mapping[str, list[str]], lasting: float = 0.0
) -> dict[str, list[str]]:
    """Share tasks out in bundles of about equal cost.

    Examples
    --------
    >>> bundles = share_out({"coarse": 1.0, "fine": 4.0, "middle": 2.0}, 2, 0.5, {})
    >>> bundles
    {'0': ['fine'], '1': ['middle', 'coarse']}
    >>> share_out({"coarse": 1.0, "fine": 4.0, "new": 3.0}, 2, 0.5, bundles)
    {'0': ['fine'], '1': ['coarse', 'new']}
    """
    bundles = {label: [name for name in names if name in costs] for label, names in before.items()}
    bundles = {label: names for label, names in bundles.items() if names}
    new = sorted(costs.keys() - {name for names in bundles.values() for name in names}, key=lambda n: (-costs[n], n))
    if not new:
        return bundles
    size = lasting or start_up / START_SHARE
    load = {label: sum(costs[name] for name in names) for label, names in bundles.items()}
    wanted = _number(sum(costs.values()), size, start_up, cores, len(costs))
    labels = (str(number) for number in range(len(load) + wanted) if str(number) not in load)
    while len(load) < wanted:
        load[next(labels)] = 0.0
    # New tasks go to the cheapest bundles, so that only those run again.
    count = _number(sum(costs[name] for name in new), size, start_up, cores, len(new))
    chosen = sorted(load, key=lambda label: (load[label], int(label)))[:count]
    added = dict.fromkeys(chosen, 0.0)
    for name in new:
        least = min(chosen, key=lambda label: (added[label], load[label], int(label)))
        bundles.setdefault(least, []).append(name)
        added[least] += costs[name]
    return {label: bundles[label] for label in sorted(bundles, key=int)}


def beside(kept: Mapping[str, list[str]], shared: Mapping[str, list[str]]) -> dict[str, list[str]]:
    """Join kept bundles with new ones under free labels.

    Examples
    --------
    >>> beside({"1": ["done"]}, {"0": ["coarse"], "1": ["fine"]})
    {'0': ['coarse'], '1': ['done'], '2': ['fine']}
    """
    free = (str(number) for number in range(len(kept) + len(shared)) if str(number) not in kept)
    found = {**kept, **({next(free): names for names in shared.values()} if kept else shared)}
    return {label: found[label] for label in sorted(found, key=int)}


def _number(seconds: float, size: float, start_up: float, cores: int, most: int) -> int:
    """Number of bundles for some work: a multiple of the cores beyond one each."""
    count = round(seconds / size)
    if count > cores:
        count = cores * ceil(count / cores)
    return max(1, min(max(count, min(cores, ceil(seconds / (2 * start_up)))), most))


COSTS_FILE = "costs.json"
"""File beside the studies' folders: measured costs of tasks on this machine."""

BUNDLES_FILE = f"{TASKS}/bundles.json"
"""File in a study's folder: tasks of each bundle."""

LASTING = "seconds"
"""Key in that file: intended seconds of a job."""


def stages() -> "tuple[Stage, ...]":
    """Stages of all study kinds."""
    return tuple(stage for kind in kinds() for stage in kind.stages)


def table_files(output: "Output", study: "Study") -> list[str]:
    """Files of an output's tables; for the page, all tables as CSV and the page itself."""
    if not output.page:
        return list(output.tables(study))
    return [*(f"{stem}.csv" for kind in kinds() if kind.tables for stem in kind.tables(study)), "index.html"]


def usual_costs() -> dict[str, tuple[float, float]]:
    """Seconds of tasks before any is measured, for `Costs`."""
    return {name: cost for kind in kinds() for name, cost in kind.costs.items()}


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
    """Jobs of a study's stages.

    `limits` are those of one task. `bundles` has the tasks of each bundle by stage and label, and the cores and seconds
    that bundles are made for. `needs` are the resources of a job by stage and label.
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
        """Note of a job's tasks."""
        return self.folder / TASKS / f"{name}.json"

    def record(self, name: str) -> Path:
        """Record of a done job."""
        return self.folder / RECORDS / f"{name}.json"

    def write(self) -> None:
        """Write the notes that jobs and later plans read; unchanged files stay."""
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
    costs = Costs(folder.parent / COSTS_FILE, usual_costs())
    members = {
        stage.name: dict(stage.members(study, costs)) if study.parts[kind.name] else {}
        for kind in kinds()
        for stage in kind.stages
        if stage.members
    }
    before = {name: known.get(name, {}) for name in members}
    kept: dict[str, dict[str, list[str]]] = {name: {} for name in members}
    # Machines with more cores need other bundles. Bundles that are done stay, so that their jobs do not run again;
    # stored results are reused in any bundle.
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
                shared = share_out(seconds, cores, costs.start_up, before[stage.name], lasting)
                found[stage.name] = beside(held, shared)
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
    """Bundles whose jobs have all done the current request."""
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

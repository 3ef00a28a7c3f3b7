"""How much a run has to do: tasks of its jobs, the seconds they are expected to take, and where they have got to."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from springtune.springs import DEFINITIONS

from . import bundles, checked_json
from .plan import COSTS_FILE, Plan, usual_costs

if TYPE_CHECKING:
    from ..config.model import Study

READ: "list[tuple[Study, Plan]]" = []
"""Studies that this process runs: the one that was asked for, and those that the paper reads besides."""

PRESENTED = (1.5, 0.3)
"""Seconds of a job that makes no results of scenes, before one was measured: in any case, and for each of its files."""

AFTER = "Dataset, figures and tables"
"""What jobs after the stages do."""


@dataclass
class Load:
    """What a job has to do.

    Attributes
    ----------
    tasks : int
        Its scenes, references or what else its stage works on.
    seconds : float
        What it is expected to take if nothing of it is stored.
    """

    part: str
    tasks: int
    seconds: float
    threads: int = 1
    products: list[Path] = field(default_factory=list)


def keys_of(content: Any) -> list[str]:
    """Keys of the results that a task file asks for, one a task.

    Examples
    --------
    >>> sorted(keys_of({"folder": "x", "scenes": [{"key": "a", "reference": {"key": "r"}}, {"key": "b"}]}))
    ['a', 'b']
    """
    if isinstance(content, dict):
        if "key" in content:
            return [content["key"]]
        content = list(content.values())
    return [key for part in content for key in keys_of(part)] if isinstance(content, list) else []


def results_of(content: Any, name: str = "") -> set[tuple[str, str]]:
    """Results that a task file asks for: the name of what each is stored for, such as its mesh, and its key.

    Examples
    --------
    Two meshes that are alike are two files:

    >>> sorted(results_of({"meshes": [{"name": "one", "key": "a"}, {"name": "two", "key": "a"}]}))
    [('one', 'a'), ('two', 'a')]
    """
    if isinstance(content, dict):
        name = content["name"] if isinstance(content.get("name"), str) else name
        if "key" in content:
            return {(name, content["key"])}
        content = list(content.values())
    parts = content if isinstance(content, list) else ()
    return {result for part in parts for result in results_of(part, name)}


def computed(done: Path) -> int | None:
    """Number of tasks that a job computed, those left out whose results were there; None where it does not say."""
    work = (checked_json.read(done) or {}).get("work")
    # What definitions cost is told beside the task that they are part of.
    return None if work is None else sum(row[0] for name, row in work.items() if name not in DEFINITIONS)


def loads(study: "Study", plan: Plan, jobs: Iterable[tuple[int, str, int, list[str]]]) -> dict[int, Load]:
    """What each job of a run has to do."""
    folder = plan.folder
    of_bundles = _of_bundles(study, plan)
    order = {stem: place for place, stem in enumerate(of_bundles)}
    found = []
    for number, rule, threads, outputs in jobs:
        if outputs:
            stem = Path(outputs[0]).stem if Path(outputs[0]) == plan.record(Path(outputs[0]).stem) else ""
            load = of_bundles.get(stem) or _presented(folder, rule, outputs)
            load.threads = threads
            found.append((order.get(stem, len(order)), number, load))
    return {number: load for _, number, load in sorted(found, key=lambda row: row[:2])}


def _of_bundles(study: "Study", plan: Plan) -> dict[str, Load]:
    """Loads of all bundles of a study, by the stem of their files."""
    start_up = bundles.Costs(plan.folder.parent / COSTS_FILE, usual_costs()).start_up
    found: dict[str, Load] = {}
    parts: dict[tuple[str, str], list[Load]] = {}
    for name, job in plan.jobs.items():
        products = [Path(path) for path in job.products]
        found[name] = Load(job.stage.message, max(1, len(keys_of(job.content))), 0.0, 1, products)
        parts.setdefault((job.stage.like or job.stage.name, job.label), []).append(found[name])
    # Stages that share bundles share their seconds, too, as they share their tasks: what each takes is not told apart.
    for place, sharing in parts.items():
        tasks = sum(load.tasks for load in sharing)
        for load in sharing:
            load.seconds = plan.needs[place].seconds * load.tasks / tasks + start_up
    return found


def _presented(folder: Path, rule: str, outputs: list[str]) -> Load:
    """Load of a job after the stages: what it took before, if it ran before."""
    return Load(AFTER, len(outputs), _seconds_presented(folder, rule, len(outputs)), products=list(map(Path, outputs)))


def _seconds_presented(folder: Path, rule: str, files: int) -> float:
    try:
        return float((folder / "benchmarks" / f"{rule}.tsv").read_text().splitlines()[1].split("\t")[0])
    except (OSError, IndexError, ValueError):  # never run, or not to its end
        always, each = PRESENTED
        return always + each * files


def presented_needs(folder: Path, rule: str, files: int) -> bundles.Needs:
    """What a job asks a cluster for that makes no results of scenes."""
    return bundles.Needs(_seconds_presented(folder, rule, files))


def told(found: dict[int, Load], cores: int) -> str:
    """What a run has to do, in a line."""
    seconds = sum(load.seconds * min(load.threads, cores) for load in found.values()) / cores
    jobs = f"{len(found)} job{'' if len(found) == 1 else 's'}"
    return f"{jobs}, about {clock(seconds)} on {cores} core{'' if cores == 1 else 's'} if nothing is stored yet"


def clock(seconds: float) -> str:
    """Seconds as people read them.

    Examples
    --------
    >>> clock(3.4), clock(75), clock(7300)
    ('3 s', '1:15 min', '2:01 h')
    """
    seconds = round(seconds)
    if seconds < 60:
        return f"{seconds} s"
    minutes, rest = divmod(seconds, 60)
    return f"{minutes}:{rest:02d} min" if minutes < 60 else f"{minutes // 60}:{minutes % 60:02d} h"

"""What the jobs of a run have to do: tasks and expected seconds; and commands of jobs on other machines.

A job on another machine calls Snakemake, which reads the Snakefile once more, twice with Slurm. What a job needs of it
is its command and the files that it makes: with these noted, its reading costs the same whatever the size of the study.
"""

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from springtune.springs import DEFINITIONS

from . import checked_json
from .plan import COSTS_FILE, Costs, Needs, Plan, usual_costs
from .run_tasks import TASKS

if TYPE_CHECKING:
    from ..config.model import Study

READ: "list[tuple[Study, Plan]]" = []
"""Studies that this process runs: the one that was asked for, and those that the paper reads besides."""

PRESENTED = (1.5, 0.3)
"""Seconds of a job that makes no results of scenes, before one was measured: in any case, and for each of its files."""

AFTER = "Dataset, figures and tables"
"""What jobs after the stages do."""


@dataclass
class Estimate:
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


def estimates(study: "Study", plan: Plan, jobs: Iterable[tuple[int, str, int, list[str]]]) -> dict[int, Estimate]:
    """What each job of a run has to do."""
    folder = plan.folder
    of_bundles = _of_bundles(study, plan)
    order = {stem: place for place, stem in enumerate(of_bundles)}
    found = []
    for number, rule, threads, outputs in jobs:
        if outputs:
            stem = Path(outputs[0]).stem if Path(outputs[0]) == plan.record(Path(outputs[0]).stem) else ""
            estimate = of_bundles.get(stem) or _presented(folder, rule, outputs)
            estimate.threads = threads
            found.append((order.get(stem, len(order)), number, estimate))
    return {number: estimate for _, number, estimate in sorted(found, key=lambda row: row[:2])}


def _of_bundles(study: "Study", plan: Plan) -> dict[str, Estimate]:
    """Estimates of all bundles of a study, by the stem of their files."""
    start_up = Costs(plan.folder.parent / COSTS_FILE, usual_costs()).start_up
    found: dict[str, Estimate] = {}
    parts: dict[tuple[str, str], list[Estimate]] = {}
    for name, job in plan.jobs.items():
        products = [Path(path) for path in job.products]
        found[name] = Estimate(job.stage.message, max(1, len(keys_of(job.content))), 0.0, 1, products)
        parts.setdefault((job.stage.like or job.stage.name, job.label), []).append(found[name])
    # Stages that share bundles share their seconds, too, as they share their tasks: what each takes is not told apart.
    for place, sharing in parts.items():
        tasks = sum(estimate.tasks for estimate in sharing)
        for estimate in sharing:
            estimate.seconds = plan.needs[place].seconds * estimate.tasks / tasks + start_up
    return found


def _presented(folder: Path, rule: str, outputs: list[str]) -> Estimate:
    """Estimate of a job after the stages: what it took before, if it ran before."""
    return Estimate(
        AFTER, len(outputs), _seconds_presented(folder, rule, len(outputs)), products=list(map(Path, outputs))
    )


def _seconds_presented(folder: Path, rule: str, files: int) -> float:
    try:
        return float((folder / "benchmarks" / f"{rule}.tsv").read_text().splitlines()[1].split("\t")[0])
    except (OSError, IndexError, ValueError):  # never run, or not to its end
        always, each = PRESENTED
        return always + each * files


def presented_needs(folder: Path, rule: str, files: int) -> Needs:
    """What a job asks a cluster for that makes no results of scenes."""
    return Needs(_seconds_presented(folder, rule, files))


def told(found: dict[int, Estimate], cores: int) -> str:
    """What a run has to do, in a line."""
    seconds = sum(estimate.seconds * min(estimate.threads, cores) for estimate in found.values()) / cores
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


COMMANDS_FILE = f"{TASKS}/commands.json"
"""File in a study's folder: commands of the jobs of its last run on other machines."""

ON_CLUSTERS = re.compile(r"[\w@+=:,./-]*")
"""Paths that may be part of a command for Slurm."""


def refusal(config: Path, folder: Path, checkout: Path, python: Path, on_cluster: bool) -> str:
    """Why no study can run with some paths.

    Rules quote all that they give to a shell, so most paths are fine. What is refused is what libraries cannot have.

    Examples
    --------
    >>> checkout, python = Path("/srv/springtune"), Path("/usr/bin/python3")
    >>> refusal(Path("config/$(date).yaml"), Path("/home/me/a b"), checkout, python, on_cluster=False)
    ''
    """
    for path in (config, folder, checkout, python):
        try:
            str(path).encode()
        except UnicodeEncodeError:
            return f"{str(path)!r}: not UTF-8, as texts of results are; rename the file or folder"
        if on_cluster and not ON_CLUSTERS.fullmatch(str(path)):
            why = "the plugin for Slurm passes paths to a shell without quotes"
            return f"{str(path)!r}: {why}; use letters, digits and @ + = : , . / _ - in names of files and folders"
    if re.search("</script|<!--|<script", str(config), re.IGNORECASE):
        return f"{str(config)!r}: Snakemake writes it into a report as it is; use no < in names of files and folders"
    if "\\" in str(folder):
        return f"{str(folder)!r}: the netCDF library reads \\ in a path as /; run in a folder without \\ in its name"
    if os.pathsep in str(python.parent):
        return f"{str(python)!r}: {os.pathsep} separates folders on PATH; install Python in a folder without it"
    return ""


def remember_commands(folder: Path, jobs: Iterable[Mapping[str, Any]]) -> None:
    """Note the jobs of a run."""
    checked_json.write(folder / COMMANDS_FILE, list(jobs))


def recall_command(folder: Path, rule: str, wildcards: Mapping[str, str]) -> Any:
    """What is noted of a job.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     remember_commands(Path(folder), [{"rule": "solve", "wildcards": {"bundle": "3"}, "command": "true"}])
    ...     recall_command(Path(folder), "solve", {"bundle": "3"})["command"]
    'true'
    """
    for job in checked_json.read(folder / COMMANDS_FILE) or ():
        if job["rule"] == rule and job["wildcards"] == dict(wildcards):
            return job
    return None

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

from . import checked_json
from .plan import COSTS_FILE, Costs, Needs, Plan, usual_costs
from .run_tasks import TASKS

if TYPE_CHECKING:
    from ..config.model import Study

READ: "list[tuple[Study, Plan]]" = []
"""Studies that this process runs: the requested one, and those that the paper reads."""

BEGUN: list[Path] = []
"""Results of the workflow that began the run; several modules of one workflow share the run."""

PRESENTED = (1.5, 0.3)
"""Seconds of a job after the stages, before any is measured: fixed, and per file."""

SLOWED = 1.25
"""Least slowdown by other programs that is told; a run that has just ended leaves such a load."""

AFTER = "Dataset, figures and tables"
"""Description of the jobs after the stages."""


@dataclass
class Estimate:
    """Expected work of a job: its `tasks`, and `seconds` if nothing is stored yet."""

    part: str
    tasks: int
    seconds: float
    threads: int = 1
    products: list[Path] = field(default_factory=list)


def results_of(content: Any, name: str = "") -> list[tuple[str, str]]:
    """Results that a task file requests, one a task: the name of its file, such as its mesh, and its key.

    Examples
    --------
    Two meshes that are alike are two files:

    >>> results_of({"meshes": [{"name": "one", "key": "a"}, {"name": "two", "key": "a", "reference": {"key": "r"}}]})
    [('one', 'a'), ('two', 'a')]
    """
    if isinstance(content, dict):
        name = content["name"] if isinstance(content.get("name"), str) else name
        if "key" in content:
            return [(name, content["key"])]
        content = list(content.values())
    return [found for part in content for found in results_of(part, name)] if isinstance(content, list) else []


def computed(done: Path) -> int | None:
    """Number of tasks that a job computed, without those whose results were stored; None if unknown."""
    from springtune.springs import DEFINITIONS

    work = (checked_json.read(done) or {}).get("work")
    # Costs of definitions are recorded besides those of their tasks.
    return None if work is None else sum(row[0] for name, row in work.items() if name not in DEFINITIONS)


def estimates(study: "Study", plan: Plan, jobs: Iterable[tuple[int, str, int, list[str]]]) -> dict[int, Estimate]:
    """Expected work of each job of a run."""
    of_bundles = _of_bundles(study, plan)
    order = {stem: place for place, stem in enumerate(of_bundles)}
    found = []
    for number, rule, threads, outputs in jobs:
        if outputs:
            stem = Path(outputs[0]).stem if Path(outputs[0]) == plan.record(Path(outputs[0]).stem) else ""
            seconds, products = _seconds_presented(plan.folder, rule, len(outputs)), [Path(path) for path in outputs]
            estimate = of_bundles.get(stem) or Estimate(AFTER, len(outputs), seconds, products=products)
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
        found[name] = Estimate(job.stage.message, max(1, len(results_of(job.content))), 0.0, 1, products)
        parts.setdefault((job.stage.like or job.stage.name, job.label), []).append(found[name])
    # Stages that share bundles share the bundle's seconds by their numbers of tasks.
    for place, sharing in parts.items():
        tasks = sum(estimate.tasks for estimate in sharing)
        for estimate in sharing:
            estimate.seconds = plan.needs[place].seconds * estimate.tasks / tasks + start_up
    return found


def _seconds_presented(folder: Path, rule: str, files: int) -> float:
    """Seconds of a job after the stages; its former ones if it ran before."""
    try:
        return float((folder / "benchmarks" / f"{rule}.tsv").read_text().splitlines()[1].split("\t")[0])
    except (OSError, IndexError, ValueError):  # never run, or not to its end
        always, each = PRESENTED
        return always + each * files


def presented_needs(folder: Path, rule: str, files: int) -> Needs:
    """Resources of a job after the stages."""
    return Needs(_seconds_presented(folder, rule, files))


def slowdown(cores: int, load: float, machine: int) -> float:
    """How much longer jobs take that share the cores of a machine with a load of other programs.

    Examples
    --------
    >>> slowdown(2, 0.4, 2), slowdown(2, 6.0, 2), slowdown(2, 6.0, 16)
    (1.0, 4.0, 1.0)
    """
    share = (load + min(cores, machine)) / machine
    return share if share > SLOWED else 1.0


def told(found: dict[int, Estimate], cores: int, slower: float = 1.0, load: float = 0.0) -> str:
    """Expected work of a run in one line, with the load that it assumes."""
    seconds = sum(estimate.seconds * min(estimate.threads, cores) for estimate in found.values()) / cores
    jobs = f"{len(found)} job{'' if len(found) == 1 else 's'}"
    busy = f"; the machine is busy now, load {load:.1f}: then about {clock(slower * seconds)}" if slower > 1 else ""
    idle = f"{cores} idle core{'' if cores == 1 else 's'}"
    return f"{jobs}, about {clock(seconds)} on {idle} if nothing is stored yet{busy}"


def clock(seconds: float) -> str:
    """Readable duration.

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
"""File in a study's folder: commands of the last run's jobs on other machines."""

ON_CLUSTERS = re.compile(r"[\w@+=:,./-]*")
"""Paths that a command for Slurm may contain."""


def refusal(config: Path, folder: Path, checkout: Path, python: Path, on_cluster: bool) -> str:
    """Return why a study cannot run with some paths, or an empty string.

    Rules quote all paths for the shell, so only paths that libraries cannot handle are refused.

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
    """Noted command of a job; None if there is none.

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

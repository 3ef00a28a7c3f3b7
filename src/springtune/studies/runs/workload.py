"""What the jobs of a run have to do, for its messages, and paths that a study cannot run with."""

import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ..config.model import Study
    from .plan import Plan

READ: "list[tuple[Study, Plan]]" = []
"""Studies that this process runs: the requested one, and those that the paper reads."""

BEGUN: list[Path] = []
"""Results of the workflow that began the run; several modules of one workflow share the run."""

AFTER = "Dataset, figures and tables"
"""Description of the jobs after the stages."""


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


def results_by_stage(plan: "Plan", jobs: dict[int, list[str]]) -> dict[int, tuple[str, int]]:
    """Description and number of results of each job of a run, given its outputs by number."""
    found = {}
    for number, outputs in jobs.items():
        job = plan.jobs.get(Path(outputs[0]).stem)
        if job and Path(outputs[0]) == plan.record(job.name):
            found[number] = job.stage.message, max(1, len(results_of(job.content)))
        else:
            found[number] = AFTER, len(outputs)
    return found


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

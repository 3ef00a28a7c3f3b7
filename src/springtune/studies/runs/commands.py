"""Commands of a run's jobs: paths that they cannot have, and notes for jobs that start on other machines.

A job on another machine calls Snakemake, which reads the Snakefile once more, twice with Slurm. What a job needs of it
is its command and the files that it makes: with these noted, its reading costs the same whatever the size of the study.
"""

import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from . import checked_json
from .run_tasks import TASKS

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


def remember(folder: Path, jobs: Iterable[Mapping[str, Any]]) -> None:
    """Note the jobs of a run."""
    checked_json.write(folder / COMMANDS_FILE, list(jobs))


def recall(folder: Path, rule: str, wildcards: Mapping[str, str]) -> Any:
    """What is noted of a job.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     remember(Path(folder), [{"rule": "solve", "wildcards": {"bundle": "3"}, "command": "true"}])
    ...     recall(Path(folder), "solve", {"bundle": "3"})["command"]
    'true'
    """
    for job in checked_json.read(folder / COMMANDS_FILE) or ():
        if job["rule"] == rule and job["wildcards"] == dict(wildcards):
            return job
    return None

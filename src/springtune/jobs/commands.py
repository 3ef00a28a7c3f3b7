"""Commands of a run's jobs, noted for those that start on other machines.

Such a job calls Snakemake, which reads the Snakefile once more, twice with Slurm. What a job needs of it is its command
and the files that it makes: with these noted, its reading costs the same whatever the size of the study.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from . import sealed
from .run_tasks import TASKS

COMMANDS_FILE = f"{TASKS}/commands.json"
"""File in a study's folder: commands of the jobs of its last run on other machines."""


def remember(folder: Path, jobs: Iterable[Mapping[str, Any]]) -> None:
    """Note the jobs of a run.

    Parameters
    ----------
    folder : Path
        Of the study that is run.
    jobs : iterable of dict
        Each with its ``rule``, ``wildcards``, ``output``, ``log`` and ``benchmark`` (files of
        the rule), ``threads`` and
        ``command``.
    """
    sealed.write(folder / COMMANDS_FILE, list(jobs))


def recall(folder: Path, rule: str, wildcards: Mapping[str, str]) -> Any:
    """What is noted of a job.

    Parameters
    ----------
    folder : Path
        Of the study that is run.
    rule : str
        Name of its rule.
    wildcards : dict of str to str
        Of the job.

    Returns
    -------
    dict or None
        As of `remember`; None where there is no note of it: a job in a container may not see the folder.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     remember(Path(folder), [{"rule": "solve", "wildcards": {"bundle": "3"}, "command": "true"}])
    ...     recall(Path(folder), "solve", {"bundle": "3"})["command"]
    'true'
    """
    for job in sealed.read(folder / COMMANDS_FILE) or ():
        if job["rule"] == rule and job["wildcards"] == dict(wildcards):
            return job
    return None

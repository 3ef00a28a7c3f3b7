"""Report at the end of a run, around the stored summary of the dataset, see `summing_up.text`."""

import os
import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from springtune.safe_io import aligned, clock

from ..runs.plan import DATASET, PAGE, PAPER_FILE, SUMMARY, Job
from ..runs.source import RECORDS, read_note
from .text import NOT_ALL_SOLVED

if TYPE_CHECKING:
    from ..config.model import Study

Jobs = Mapping[str, Job]


def ending(study: "Study", jobs: Jobs, since: float) -> str:
    """Report at the end of a successful run."""
    took, results = clock(time.time() - since), _result_paths(_folder(jobs))
    told = aligned([["new", _count_new_results(jobs, since)], ["took", took], ["results", results]], 0)
    return f"\n{_stored_summary(study, jobs)}\n{told}\n"


def broken(study: "Study", jobs: Jobs, since: float) -> str:
    """Report at the end of a failed run."""
    logs = "".join(f"  {_last_line(path)}\n    its log: {path}\n" for path in _failed_logs(jobs, since))
    kept = "What is computed is kept: the same command takes up where this one stopped."
    return f"\n{study.name} is not complete: a job failed or was stopped.\n{logs}{kept}\n"


def beside(study: "Study", jobs: Jobs, since: float) -> str:
    """Report on another study that the paper reads."""
    undone = [job.name for job in jobs.values() if job.stage and not job.record.exists()]
    lines = [f"new in {study.name}: {_count_new_results(jobs, since)}"]
    lines += [f"  not complete: {', '.join(undone)}"] if undone else []
    return "\n".join([*lines, *(f"  its log: {path}" for path in _failed_logs(jobs, since))]) + "\n"


def _last_line(log: Path) -> str:
    said = [line for line in log.read_text(errors="replace").splitlines() if line.strip()]
    if said:
        return said[-1].strip()
    room = os.statvfs(log.parent)
    full = room.f_blocks and not room.f_bavail
    return "it could say nothing: the disk is full; make room" if full else "it said nothing"


def _failed_logs(jobs: Jobs, since: float) -> list[Path]:
    """Logs of jobs that failed or were stopped in this run: they wrote no record."""
    folder = _folder(jobs)
    ran = [path for path in sorted((folder / "logs").glob("*.log")) if _modified(path) >= since]
    return [path for path in ran if _modified(folder / RECORDS / f"{path.stem}.json") < since]


def _folder(jobs: Jobs) -> Path:
    return next(iter(jobs.values())).folder


def reminder(folder: Path) -> str:
    """Report if nothing was to do."""
    try:
        lines = (folder / SUMMARY).read_text().splitlines()
    except OSError:
        return ""
    last = [lines[-1], f"{folder / SUMMARY} has the reasons."] if lines[-1].startswith(NOT_ALL_SOLVED) else []
    return "\n".join([*last, _result_paths(folder)]) + "\n"


def _modified(path: Path) -> float:
    return path.stat().st_mtime if path.exists() else float("-inf")


def _stored_summary(study: "Study", jobs: Jobs) -> str:
    """Stored summary, if it is up to date."""
    path = _folder(jobs) / SUMMARY
    if not path.exists():
        return f"{study.title}\n\nThere is no dataset yet.\n"
    if any(job.stage and _modified(job.record) > _modified(path) for job in jobs.values()):
        return f"{study.title}\n\nThe dataset is older than these results.\n"
    return path.read_text()


def _count_new_results(jobs: Jobs, since: float) -> str:
    """Counts of computed and stored results by stage."""
    new, asked = Counter[str](), Counter[str]()
    for job in jobs.values():
        if job.stage and job.record.exists():
            asked[job.stage.name] += len(job.results)
            new[job.stage.name] += read_note(job.record).get("computed", 0) if _modified(job.record) >= since else 0
    counts = [f"{stage} {number} of {asked[stage]}" for stage, number in new.items() if number]
    if counts:
        return ", ".join(counts) + ("" if new == asked else "; the others were stored before")
    ran = [job.name for job in jobs.values() if _modified(job.record) >= since]
    return f"nothing but {', '.join(ran)}" if ran else "nothing: all results were stored before"


def _result_paths(folder: Path) -> str:
    """Existing results, most useful first."""
    tables = "tables/index.html" if (folder / "tables/index.html").exists() else "tables/"
    names = (PAPER_FILE, PAGE, DATASET, tables, "figures/", "paraview/", "meshes/")
    return f"{folder}: {', '.join(name for name in names if (folder / name).exists())}"

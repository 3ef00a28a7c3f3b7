"""Summary of a run: what Snakemake's process adds to the stored summary of the dataset, see `summing_up.text`."""

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING

from springtune.safe_io.tables import aligned

from ..runs import rerun
from ..runs.plan import Plan
from ..runs.source import read_note
from ..runs.workload import clock, results_of
from .text import FILE, HOLES

if TYPE_CHECKING:
    from ..config.model import Study


def ending(study: "Study", plan: Plan, since: float) -> str:
    """Report at the end of a successful run."""
    new, took = _computed(study, plan, since), clock(time.time() - since)
    rows = [["new", new], ["took", took], ["results", _places(plan.folder)]]
    return f"\n{_stored(study, plan)}\n{aligned(rows, 0)}\n"


def broken(study: "Study", plan: Plan, since: float) -> str:
    """Report at the end of a failed run."""
    lines = [f"{study.name} is not complete: a job failed or was stopped."]
    for path in _failed(plan, since):
        lines += [f"  {_last(path)}", f"    its log: {path}"]
    lines += ["What is computed is kept: the same command takes up where this one stopped."]
    return "\n" + "\n".join(lines) + "\n"


def beside(study: "Study", plan: Plan, since: float) -> str:
    """Report on a study that the paper needed."""
    undone = [name for name in plan.jobs if not plan.record(name).exists()]
    lines = [f"new in {study.name}: {_computed(study, plan, since)}"]
    lines += [f"  not complete: {', '.join(undone)}"] if undone else []
    return "\n".join([*lines, *(f"  its log: {path}" for path in _failed(plan, since))]) + "\n"


def _last(log: Path) -> str:
    """Last line of a job's log."""
    said = [line for line in log.read_text(errors="replace").splitlines() if line.strip()]
    if said:
        return said[-1].strip()
    room = os.statvfs(log.parent)
    full = room.f_blocks and not room.f_bavail
    return "it could say nothing: the disk is full; make room" if full else "it said nothing"


def _failed(plan: Plan, since: float) -> list[Path]:
    """Logs of jobs that failed or were stopped in this run, which wrote no record in it."""
    logs = sorted((plan.folder / "logs").glob("*.log"))
    return [path for path in logs if _time(path) >= since and _time(plan.record(path.stem)) < since]


def reminder(folder: Path) -> str:
    """Report if nothing was to do."""
    try:
        lines = (folder / FILE).read_text().splitlines()
    except OSError:
        return ""
    last = [lines[-1], f"{folder / FILE} has the reasons."] if lines[-1].startswith(HOLES) else []
    return "\n".join([*last, _places(folder)]) + "\n"


def _time(path: Path) -> float:
    """Modification time; minus infinity if missing."""
    return path.stat().st_mtime if path.exists() else float("-inf")


def _stored(study: "Study", plan: Plan) -> str:
    """Stored summary, if it is up to date."""
    path = plan.folder / FILE
    if not path.exists():
        return f"{study.title}\n\nThere is no dataset yet.\n"
    if any(_time(plan.record(name)) > _time(path) for name in plan.jobs):
        return f"{study.title}\n\nThe dataset is older than these results.\n"
    return path.read_text()


def _computed(study: "Study", plan: Plan, since: float) -> str:
    """Counts of computed and stored results by stage."""
    new: dict[str, int] = {}
    asked: dict[str, int] = {}
    for name, job in plan.jobs.items():
        record, stage = plan.record(name), job.stage.name
        if record.exists():
            asked[stage] = asked.get(stage, 0) + len(set(results_of(job.content)))
            new[stage] = new.get(stage, 0) + (read_note(record).get("computed", 0) if _time(record) >= since else 0)
    counts = [f"{stage} {number} of {asked[stage]}" for stage, number in new.items() if number]
    if counts:
        return ", ".join(counts) + ("" if new == asked else "; the others were stored before")
    ran = [job.name for job in rerun.jobs(study, plan).values() if _time(job.record) >= since]
    return f"nothing but {', '.join(ran)}" if ran else "nothing: all results were stored before"


def _places(folder: Path) -> str:
    """Existing results, most useful first."""
    files = ("paper.pdf", "index.html", "dataset.nc", "tables/index.html")
    names = [name for name in files if (folder / name).exists()]
    names += [f"{name}/" for name in ("figures", "tables", "paraview", "meshes") if (folder / name).is_dir()]
    if "tables/index.html" in names:
        names.remove("tables/")
    return f"{folder}: {', '.join(names)}"

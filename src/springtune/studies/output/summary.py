"""Summary of a run: solved cells, failures with reasons, worst errors, result paths.

The stage `collect` writes `text` beside the dataset; Snakemake's process adds facts of the run (`ending`, `broken`)
without xarray.
"""

import json
import os
import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from springtune.problem.status import Status
from springtune.safe_io.escapes import shown
from springtune.safe_io.tables import aligned

from ..runs import rerun
from ..runs.plan import Plan
from ..runs.workload import clock, results_of
from .selection import judged, of_own_law
from .text import place_text, sign_text, without_numbers

if TYPE_CHECKING:
    import xarray as xr

    from ..config.model import Study

FILE = "summary.txt"

NAMED = 3
"""Cells named for each status; more if fewer than two would remain."""

WORST = 8
"""Most definitions with a worst error."""

HOLES = "Not everything is solved"

SCENES = "/"


FINITE = "/finite_strain"
"""Group of references for nonlinear kinematics."""


REFERRED = {"status", "reference_displacement", "reference_applies", "reference_message"}
"""Variables of groups that compare scenes with small-strain references."""


def text(groups: "Mapping[str, xr.Dataset]", title: str) -> str:
    """Summarise a study's cells."""
    states = [state for name, data in groups.items() for state in _states(name, data)]
    rows = [[what, str(sum(found.values())), _parts(found)] for what, found, _ in states if found]
    lines = [title, "", aligned(rows, left=2, right=(1,))]
    lines += _worst(groups[SCENES], groups.get(FINITE)) if SCENES in groups else ()
    for name, data in groups.items():
        if REFERRED <= set(data):
            lines += _unreferenced(data, "scenes" if name == SCENES else name.strip("/"))
    holes = [(what, found, lost) for what, found, lost in states if lost]
    for what, found, lost in holes:
        for status, cells in lost.items():
            lines += ["", f"{what}, {_words(status)}: {len(cells)} of {sum(found.values())}", *_named(cells)]
    if holes:
        told = "; ".join(
            f"{sum(map(len, lost.values()))} of {sum(found.values())} {what}" for what, found, lost in holes
        )
        lines += ["", f"{HOLES}: {told}. dataset.nc names each, and why: `status`, `message`."]
    return "\n".join(lines) + "\n"


Cells = list[tuple[str, str]]


def _states(name: str, data: "xr.Dataset") -> Iterator[tuple[str, dict[Status, int], dict[Status, Cells]]]:
    """For each status variable: its subject, counts by flag, and unsolved cells."""
    for variable in data.data_vars.values():
        label = str(variable.name)
        message = label.removesuffix("status") + "message"
        if not label.endswith("status") or message not in data or data[message].dims != variable.dims:
            continue
        flags = variable.values
        found = {status: int((flags == status).sum()) for status in Status if status != Status.NOT_REQUESTED}
        lost: dict[Status, Cells] = {
            status: [
                (place_text(data, variable.dims, place), str(data[message].values[tuple(place)]))
                for place in np.argwhere(flags == status)
            ]
            for status, number in found.items()
            if number and status != Status.SOLVED
        }
        part = label.removesuffix("status").strip("_").replace("_", " ")
        what = "scenes" if name == SCENES else ", ".join(filter(None, (name.strip("/"), part)))
        yield what, {status: number for status, number in found.items() if number}, lost


def _words(status: Status) -> str:
    return str(status).replace("_", " ")


def _parts(found: Mapping[Status, int]) -> str:
    return ", ".join(f"{number} {_words(status)}" for status, number in found.items())


def _named(cells: Cells) -> Iterator[str]:
    """Some cells, first one for each reason, and the number of others."""
    reasons: dict[str, Cells] = {}
    for cell in cells:
        reasons.setdefault(without_numbers(cell[1]), []).append(cell)
    order = [*(alike[0] for alike in reasons.values()), *(cell for alike in reasons.values() for cell in alike[1:])]
    told = order if len(order) <= NAMED + 1 else order[:NAMED]
    for labels, message in told:
        yield f"  {shown(': '.join(filter(None, (labels, message))))}"
    if len(told) < len(order):
        yield f"  and {len(order) - len(told)} more"


def _worst(root: "xr.Dataset", finite: "xr.Dataset | None" = None) -> Iterator[str]:
    """Largest error of each definition over solved scenes with a valid reference."""
    errors = judged(root, finite)
    places = np.argwhere(np.isfinite(errors.values))
    values, axis = errors.values[tuple(places.T)], errors.dims.index("definition")
    found = []
    for number in np.unique(places[:, axis]).tolist():
        own = np.flatnonzero(places[:, axis] == number)
        worst = own[np.argmax(abs(values[own]))]
        others = [dim for dim in errors.dims if dim != "definition"]
        where = place_text(root, others, np.delete(places[worst], axis).tolist())
        error = float(values[worst])
        found.append(
            (error, sign_text(root, error, errors.dims, places[worst]), str(root.definition.values[number]), where)
        )
    found.sort(key=lambda row: -abs(row[0]))
    if found:
        scenes = "the one scene that has one" if len(places) == 1 else f"the {len(places)} scenes that have one"
        head = "worst deformation error, (network - reference) / |reference|, of each definition"
        yield from ("", f"{head}, of {scenes}")
        if finite is not None and of_own_law(finite) is not None:
            yield "  nonlinear networks against finite strain, linear ones against small strain"
        rows = [[name, f"{100 * error:+.2f} %", word, where] for error, word, name, where in found[:WORST]]
        yield aligned(rows, 2, right=(1,))
    if len(found) > WORST:
        yield f"  and of {len(found) - WORST} more at most {100 * abs(found[WORST][0]):.2f} %"


def _unreferenced(root: "xr.Dataset", called: str) -> Iterator[str]:
    """Missing or inapplicable references with their scenes."""
    requested, there = root.status != Status.NOT_REQUESTED, root.reference_displacement.notnull()
    beyond = root.status.isin((Status.SOLVED, Status.UNSTABLE)) & there & (root.reference_applies == 0)
    for scenes, what in (
        (requested & ~there, "without a reference, and so without an error"),
        (beyond, "beyond small strain, so the error is not the network's alone"),
    ):
        if not scenes.any():
            continue
        few = scenes.any([dim for dim in scenes.dims if dim not in root.reference_message.dims])
        few = few.transpose(*root.reference_message.dims)
        messages = root.reference_message.values
        cells = [(place_text(root, few.dims, place), str(messages[tuple(place)])) for place in np.argwhere(few.values)]
        yield from ("", f"{called} {what}: {int(scenes.sum())} of {int(requested.sum())}", *_named(cells))


def ending(study: "Study", plan: Plan, since: float) -> str:
    """Report at the end of a successful run."""
    new, took = _computed(study, plan, since), clock(time.time() - since)
    rows = [["new", new], ["took", took], ["results", _places(plan.folder)]]
    return f"\n{_stored(study, plan)}\n{aligned(rows, 0)}\n"


def broken(study: "Study", plan: Plan, since: float) -> str:
    """Report at the end of a failed run."""
    _, logs = _undone(plan, since)
    lines = [f"{study.name} is not complete: a job failed or was stopped."]
    for path in logs:
        lines += [f"  {_last(path)}", f"    its log: {path}"]
    lines += ["What is computed is kept: the same command takes up where this one stopped."]
    return "\n" + "\n".join(lines) + "\n"


def beside(study: "Study", plan: Plan, since: float) -> str:
    """Report on a study that the paper needed."""
    undone, logs = _undone(plan, since)
    lines = [f"new in {study.name}: {_computed(study, plan, since)}"]
    lines += [f"  not complete: {', '.join(undone)}"] if undone else []
    return "\n".join([*lines, *(f"  its log: {path}" for path in logs)]) + "\n"


def _last(log: Path) -> str:
    """Last line of a job's log."""
    said = [line for line in log.read_text(errors="replace").splitlines() if line.strip()]
    if said:
        return said[-1].strip()
    room = os.statvfs(log.parent)
    full = room.f_blocks and not room.f_bavail
    return "it could say nothing: the disk is full; make room" if full else "it said nothing"


def _undone(plan: Plan, since: float) -> tuple[list[str], list[Path]]:
    """Unfinished bundles, and logs of jobs that failed in this run."""
    folder = plan.folder
    undone = [name for name in plan.jobs if not plan.record(name).exists()]
    missing = set(undone)
    if not (folder / "dataset.nc").exists():
        missing.add("collect")
    after = [path.stem for path in sorted((folder / "logs").glob("present_*.log"))] + ["browse", "paper"]
    # A job after the stages has written its benchmark when it has made all that it is to make.
    missing |= {name for name in after if _time(folder / "benchmarks" / f"{name}.tsv") < since}
    logs = [folder / "logs" / f"{name}.log" for name in [*undone, *sorted(missing - set(undone))]]
    return undone, [path for path in logs if _time(path) >= since]


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
            new[stage] = new.get(stage, 0) + (computed(record) if _time(record) >= since else 0)
    counts = [f"{stage} {number} of {asked[stage]}" for stage, number in new.items() if number]
    if counts:
        return ", ".join(counts) + ("" if new == asked else "; the others were stored before")
    ran = [job.name for job in rerun.jobs(study, plan).values() if _time(job.record) >= since]
    return f"nothing but {', '.join(ran)}" if ran else "nothing: all results were stored before"


def computed(record: Path) -> int:
    """Number of tasks that a job computed, without those whose results were stored."""
    try:
        return int(json.loads(record.read_bytes())["computed"])
    except (OSError, ValueError, LookupError, TypeError):
        return 0


def _places(folder: Path) -> str:
    """Existing results, most useful first."""
    files = ("paper.pdf", "index.html", "dataset.nc", "tables/index.html")
    names = [name for name in files if (folder / name).exists()]
    names += [f"{name}/" for name in ("figures", "tables", "paraview", "meshes") if (folder / name).is_dir()]
    if "tables/index.html" in names:
        names.remove("tables/")
    return f"{folder}: {', '.join(names)}"

"""Dataset as text, for `collect` and `info`: solved cells, failures with reasons, errors, origin; report of a run."""

import os
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from springtune.problem.compare import sign_word
from springtune.problem.quantities import Status
from springtune.safe_io import aligned, clock, shown

from ..runs.plan import DATASET, PAGE, PAPER_FILE, SUMMARY, Job
from ..runs.source import RECORDS, read_note
from . import reading
from .answers import count_statuses, definition_errors, status_words, what_to_type
from .text import NOT_ALL_SOLVED, bytes_text, cell_text, from_json, paragraphs, range_text, without_numbers

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from ..config.model import Study

CELLS_NAMED = 3  # cells named for each status; more if fewer than two would remain

DEFINITIONS_LISTED = 8  # most definitions with a worst error

COMPARED = {"/": ("deformation_error", "reference_displacement"), "/shapes": ("error", "reference_value")}
"""Error and reference of groups whose definitions are compared."""

COMPARED_VARIABLES = {"status", "reference_displacement", "reference_applies", "reference_message"}
"""Variables of groups that compare scenes with small-strain references."""


def text(groups: Mapping[str, "xr.Dataset"], title: str, most: int | None = DEFINITIONS_LISTED) -> str:
    """Summarise a study's cells, with the errors of at most `most` definitions."""
    from .dataset import against_own_laws, requested_cells

    states = [state for name, data in groups.items() for state in _states(name, data)]
    rows = [[what, str(count), statuses] for what, count, statuses, _ in states if count]
    lines = [title, "", aligned(rows, left=2, right=(1,))]
    for name, names in COMPARED.items():
        if name in groups and "definition" in groups[name].get(names[0], groups[name]).dims:
            data = against_own_laws(groups[name], groups.get("/finite_strain") if name == "/" else None)
            cells = requested_cells(data, names[0])
            lines += _errors(cells, data, names, most)
            lines += _stiffness_to_type(cells) if name == "/" else []  # of shapes quantities have errors
    for name, data in groups.items():
        if COMPARED_VARIABLES <= set(data):
            lines += _lines_on_references(data, "scenes" if name == "/" else name.strip("/"))
    holes = []
    for what, count, _, lost in states:
        for status, cells in lost.items():
            lines += ["", f"{what}, {status_words(status)}: {len(cells)} of {count}", *_cell_lines(cells)]
        holes += [f"{sum(map(len, lost.values()))} of {count} {what}"] if lost else []
    if holes:
        lines += ["", f"{NOT_ALL_SOLVED}: {'; '.join(holes)}. dataset.nc names each, and why: `status`, `message`."]
    return "\n".join(lines) + "\n"


Cells = list[tuple[str, str]]


def _states(name: str, data: "xr.Dataset") -> Iterator[tuple[str, int, str, dict[int, Cells]]]:
    """Subject, number of cells, their statuses in words and unsolved cells of each status variable."""
    for variable in data.data_vars.values():
        label = str(variable.name)
        message = label.removesuffix("status") + "message"
        if not label.endswith("status") or message not in data or data[message].dims != variable.dims:
            continue
        flags = variable.values
        unsolved = np.unique(flags[flags > Status.SOLVED]).tolist()
        lost = {status: _cells(data, variable == status, message) for status in unsolved}
        part = label.removesuffix("status").strip("_").replace("_", " ")
        what = "scenes" if name == "/" else ", ".join(filter(None, (name.strip("/"), part)))
        statuses = ", ".join(f"{count} {word}" for word, count in count_statuses(flags).items())
        yield what, int(np.count_nonzero(flags)), statuses, lost


def _cells(data: "xr.Dataset", there: "xr.DataArray", message: str) -> Cells:
    """Labels and messages of some cells."""
    from .dataset import records  # here, since reports of a run do without xarray

    units = {str(name): str(data[name].attrs.get("units", "1")) for name in there.dims}
    rows = [(str(row.pop(message)), row) for row in records(data, there, [message])]
    return [(cell_text(labels, units), why) for why, labels in rows]


def _cell_lines(cells: Cells) -> Iterator[str]:
    """Lines on some cells, one for each reason first, and the number of others."""
    reasons: dict[str, Cells] = {}
    for cell in cells:
        reasons.setdefault(without_numbers(cell[1]), []).append(cell)
    order = [*(alike[0] for alike in reasons.values()), *(cell for alike in reasons.values() for cell in alike[1:])]
    named = len(order) if len(order) <= CELLS_NAMED + 1 else CELLS_NAMED
    yield from (f"  {shown(': '.join(filter(None, cell)))}" for cell in order[:named])
    if named < len(order):
        yield f"  and {len(order) - named} more"


def _errors(cells: "pd.DataFrame", data: "xr.Dataset", names: tuple[str, str], most: int | None) -> Iterator[str]:
    """Median and worst error of definitions over solved scenes with a valid reference, the worst first."""
    error, reference = names
    found = sorted(definition_errors(cells), key=lambda one: -abs(one.worst.valid_error))
    if found:
        what = error.replace("_", " ")
        yield from ("", f"{what}s, (network - reference) / |reference|, of solved scenes within the reference")
        if "finite_strain" in data.attrs:
            yield "  nonlinear networks against finite strain, linear ones against small strain"
        by = [name for name in ("definition", "kinematics") if name in cells]
        others = [str(name) for name in data[error].dims if name not in by]
        units, rows = {name: str(data[name].attrs.get("units", "1")) for name in others}, []
        for one in found[:most]:
            worst = one.worst
            word = sign_word(worst.valid_error, worst[reference], worst.get("quantity_kind", "displacement"))
            numbers = [f"{100 * one.median:.3g} %", f"{100 * worst.valid_error:+.3g} %"]
            rows.append([*one.labels, len(one.cells), *numbers, word, cell_text(dict(worst[others]), units)])
        heads = [*by, "values" if "quantity" in others else "scenes", "median", "worst", "", "at"]
        yield from aligned([heads, *rows], 2, range(len(by), len(by) + 3)).splitlines()
    if most is not None and len(found) > most:
        yield f"  and of {len(found) - most} more at most {100 * abs(found[most].worst.valid_error):.2f} %"


def _stiffness_to_type(cells: "pd.DataFrame") -> Iterator[str]:
    """Stiffnesses to type on the finest mesh of each type and material, of the best definitions."""
    answers = [one for found in what_to_type(cells) for one in found]
    rows = [
        [one.definition + " +" * one.energies, *one.labels, f"{1e3 * one.mesh_size:.4g} mm",
         range_text(one.inside) or "each its own", range_text(one.outline) or "each its own",
         f"{one.ratio:.3g}" if np.isfinite(one.ratio) else "", f"{100 * one.worst_error:+.2g} %"]
        for one in answers
    ]  # fmt: skip
    if rows:
        plus = "; best with energies besides springs (+)" if any(one.energies for one in answers) else ""
        yield from ("", f"what to type [N/m], on the finest mesh: best springs alone; best single stiffness{plus}")
        heads = ["definition", "mesh type", "material", "size", "inside", "outline", "inside / E t", "worst error"]
        yield from aligned([heads, *rows], 2, range(3, 8)).splitlines()


def _lines_on_references(root: "xr.Dataset", called: str) -> Iterator[str]:
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
        cells = _cells(root, few, "reference_message")
        yield from ("", f"{called} {what}: {int(scenes.sum())} of {int(requested.sum())}", *_cell_lines(cells))


# -- of a file ---------------------------------------------------------------------------------------------------------


class Info(str):
    """Text that terminals and notebooks show verbatim."""

    __repr__ = str.__str__

    def _repr_html_(self) -> str:
        return f"<pre>{escape(self)}</pre>"


def info(path: str | os.PathLike[str]) -> Info:
    """Sum up the dataset of a study, as `springtune info` does.

    Parameters
    ----------
    path : str or Path
        ``results/<study>/dataset.nc``, or its folder.

    Returns
    -------
    str

    Raises
    ------
    FileNotFoundError, ValueError
        As of `open`.

    Examples
    --------
    >>> import springtune as st
    >>> said = st.info("results/mine")
    >>> "groups, their variables and dimensions" in said, "springtune" in said
    (True, True)
    """
    with reading.open(path) as tree, reading.guard(path):
        file, study = reading.dataset_file(path), tree.attrs.get("study", "unknown")
        made = f", made {tree.attrs['created']}" if "created" in tree.attrs else ""
        head = [tree.attrs.get("title", study), f"study {study}: {file}, {bytes_text(file.stat().st_size)}{made}"]
        cells = text({node.path: node.to_dataset() for node in tree.subtree}, "", None).strip("\n")
        parts = paragraphs([head]), cells, paragraphs([_groups(tree), _provenance(tree)])
        return Info("\n\n".join(filter(None, parts)))


def _groups(tree: "xr.DataTree") -> list[str]:
    rows = []
    for node in tree.subtree:
        sizes = node.to_dataset().drop_vars(node.coords).sizes.items()  # without inherited dimensions
        rows.append([f"  {node.path}", len(node.data_vars), ", ".join(f"{name} {size}" for name, size in sizes)])
    return ["groups, their variables and dimensions", *aligned(rows, 0, (1,)).splitlines()]


def _provenance(tree: "xr.DataTree") -> list[str]:
    lines = ["made with", f"  springtune {tree.attrs.get('springtune_version', 'unknown')}"]
    lines += [f"  commit {tree.attrs['git_commit']}"] if tree.attrs.get("git_commit") else []
    software = from_json(tree.attrs.get("software")).items()
    versions = ", ".join(f"{name} {version}" for name, version in software if version != "none")
    lines += [f"  {versions}"] if versions else []
    return lines + [f"  sha256 {digest}  {name}" for name, digest in from_json(tree.attrs.get("inputs")).items()]


# -- of a run ----------------------------------------------------------------------------------------------------------

Jobs = Mapping[str, Job]


def success_report(study: "Study", jobs: Jobs, since: float) -> str:
    """Report at the end of a successful run."""
    took, results = clock(time.time() - since), _result_paths(_folder(jobs))
    rows = aligned([["new", _count_new_results(jobs, since)], ["took", took], ["results", results]], 0)
    return f"\n{_stored_summary(study, jobs)}\n{rows}\n"


def failure_report(study: "Study", jobs: Jobs, since: float) -> str:
    """Report at the end of a failed run."""
    logs = "".join(f"  {_last_line(path)}\n    its log: {path}\n" for path in _failed_logs(jobs, since))
    kept = "What is computed is kept: the same command takes up where this one stopped."
    return f"\n{study.name} is not complete: a job failed or was stopped.\n{logs}{kept}\n"


def other_study_report(study: "Study", jobs: Jobs, since: float) -> str:
    """Report on another study, whose results the paper reads, at the end of a run."""
    undone = [job.name for job in jobs.values() if job.stage and not job.record.exists()]
    lines = [f"new in {study.name}: {_count_new_results(jobs, since)}"]
    lines += [f"  not complete: {', '.join(undone)}"] if undone else []
    return "\n".join([*lines, *(f"  its log: {path}" for path in _failed_logs(jobs, since))]) + "\n"


def _last_line(log: Path) -> str:
    if lines := [line for line in log.read_text(errors="replace").splitlines() if line.strip()]:
        return lines[-1].strip()
    room = os.statvfs(log.parent)
    return "the log is empty" + ": the disk is full; make room" * bool(room.f_blocks and not room.f_bavail)


def _failed_logs(jobs: Jobs, since: float) -> list[Path]:
    """Logs of jobs that failed or were stopped in this run: they wrote no record."""
    folder = _folder(jobs)
    ran = [path for path in sorted((folder / "logs").glob("*.log")) if _modified(path) >= since]
    return [path for path in ran if _modified(folder / RECORDS / f"{path.stem}.json") < since]


def _folder(jobs: Jobs) -> Path:
    return next(iter(jobs.values())).folder


def idle_report(folder: Path) -> str:
    """Report of a run without work to do."""
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

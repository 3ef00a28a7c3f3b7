"""The page of the benchmark: every number from the dataset."""

from pathlib import Path

import numpy as np
import xarray as xr

from springtune.problem.status import Status
from springtune.safe_io.atomic import write_text
from springtune.safe_io.escapes import markdown

from ...output.selection import labels_of
from ...output.text import cell_number, markdown_section, markdown_table
from . import PARTS
from .outputs import PAGE

TARGETS = (0.01, 0.001, 0.0001)
"""Errors to reach [1]."""


def write(tree, folder):
    """Write the page in Markdown."""
    write_text(Path(folder) / PAGE, page(tree))
    return [PAGE]


def page(tree: xr.DataTree) -> str:
    """Markdown: the quickest ways to an error, costs of one mesh size, orders and exponents, curves."""
    data = tree["benchmark"].to_dataset()
    loads = ", ".join(f"{float(value):.1f}" for value in data.machine_load.values)
    parts = {}
    for scene in map(str, data.scene.values):
        cells = data.sel(scene=scene)
        if np.isfinite(cells.assured_error).any():
            parts[f"{scene}: the quickest ways to an error"] = _quickest(cells)
        parts[f"{scene}: approaches on one mesh size"] = _one_size(cells)
        parts[f"{scene}: what has no numbers"] = _holes(cells.approach, cells.mesh_size, cells.status, cells.message)
    parts |= {
        "Solvers of one linear system": _solvers(data),
        "A sensitivity curve": _curve(data),
        "Explicit steps": _explicit(data),
    }
    lines = [f"Machine load at the start of each scene: {loads}.", "", _rule(data), ""]
    for title, part in parts.items():
        lines += [*markdown_section(title), *part, ""] if part else []
    return "\n".join(lines)


def _time(seconds, missing=""):
    seconds = float(seconds)
    return missing if np.isnan(seconds) else f"{1e3 * seconds:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


def _rule(data):
    """How the quickest ways are chosen."""
    if not np.isfinite(data.assured_error).any():
        return "Nothing is called the quickest way to an error: the study has no second beam to check it on."
    return (
        "The quickest ways to an error: a mesh size of an approach counts where it and all finer ones that were run, "
        "at least one, stay within the error, on the beam and on a second one "
        f"({data.attrs['second_beam']}). An error that happens to cross zero on its way counts for nothing."
    )


def _quickest(cells):
    """The three approaches that come first to each error and keep it, with their mesh size."""
    rows = []
    errors, seconds = cells.assured_error.transpose("approach", "mesh_size").values, cells.seconds.values
    for target in TARGETS:
        good = np.where((errors <= target) & np.isfinite(seconds), seconds, np.inf)
        best = good.min(axis=1)
        row = [f"{100 * target:g} %"]
        for i in np.argsort(best)[:3]:
            if np.isfinite(best[i]):
                size = 1e3 * float(cells.mesh_size.values[good[i].argmin()])
                row.append(f"`{cells.approach.values[i]}`, {size:g} mm: {_time(best[i])}")
        rows.append(row + [""] * (4 - len(row)))
    return markdown_table(["error", "first", "second", "third"], rows)


def _holes(approaches, sizes, status, message):
    """What was asked for and lacks numbers: a line a reason, with its approaches and mesh sizes."""
    flags, words = (one.transpose(..., "mesh_size").values for one in (status, message))
    found = {}
    for i, j in np.argwhere((flags != Status.NOT_REQUESTED) & ((flags != Status.SOLVED) | (words != ""))):
        found.setdefault(str(words[i, j]), {}).setdefault(str(approaches.values[i]), []).append(sizes.values[j])
    lines = []
    for why, places in found.items():
        named = [f"`{name}` ({', '.join(f'{1e3 * size:g}' for size in at)} mm)" for name, at in places.items()]
        lines.append(f"- {', '.join(named)}: {markdown(why)}")
    return lines


def _one_size(cells):
    """Error, seconds and memory on the finest size that half of the approaches are asked for."""
    asked = (cells.status != Status.NOT_REQUESTED) | np.isfinite(cells.seconds)
    counts = asked.transpose("approach", "mesh_size").values.sum(axis=0)
    place = int(np.flatnonzero(counts >= 0.5 * counts.max())[0])
    cells = cells.isel(mesh_size=place)
    rows = []
    for i in np.argsort(np.abs(cells.error.values)):
        cell = cells.isel(approach=i)
        if np.isnan(cell.error):
            continue
        rows.append([
            f"`{cell.approach.item()}`", cell_number(cell.error, "+.2g", 100, " %"),
            _time(cell.seconds, "not measured"),
            *(_time(cell[name]) for name in ("cold_seconds", *(f"{part}_seconds" for part in PARTS))),
            *(cell_number(cell[name], form, scale) for name, form, scale in
              (("peak_memory", ".0f", 1e-6), ("error_rate", ".1f", 1), ("cost_exponent", ".2f", 1))),
        ])  # fmt: skip
    heads = [f"at {1e3 * float(cells.mesh_size):g} mm", "error", "time", "cold", *PARTS, "memory [MB]", "order",
             "exponent of cost"]  # fmt: skip
    return markdown_table(heads, rows)


def _solvers(data):
    first, again = data.solver_seconds, data.solver_again_seconds
    status, message = data.solver_status, data.solver_message
    asked = (status != Status.NOT_REQUESTED) | np.isfinite(first)
    rows = []
    for size in labels_of(asked, "mesh_size"):
        seconds = zip(first.sel(mesh_size=size).values, again.sel(mesh_size=size).values)
        texts = (f"{_time(one)}, {_time(other)}" if np.isfinite(one) else "" for one, other in seconds)
        rows.append([f"{1e3 * size:g} mm", *texts])
    heads = ["structured mesh", *(f"{name}: first, next" for name in data.linear_solver.values)]
    lost = _holes(data.linear_solver, data.mesh_size, status, message)
    return markdown_table(heads, rows) + (["", *lost] if lost else [])


def _curve(data):
    if data.curve_message.item():
        return [f"None was timed: {markdown(data.curve_message.item())}."]
    rows = [
        [str(count), *(_time(data[name].sel(curve_count=count)) for name in ("curve_seconds", "separate_seconds"))]
        for count in data.curve_count.values
    ]  # fmt: skip
    lines = markdown_table(["stiffnesses", "one path", "solve by solve"], rows)
    return [*lines, "", f"One linear solve there takes {_time(data.linear_seconds)}, a nonlinear one "
            f"{_time(data.nonlinear_seconds)}."]  # fmt: skip


def _explicit(data):
    """Rates of explicit steps, by threads and precision, beside a plain copy of memory; errors of single precision."""
    rates, moved = data.spring_updates / 1e6, data.explicit_bandwidth / 1e9
    ways = [(threads, kind) for kind in data.precision.values for threads in data.thread_count.values]
    rows = []
    for size in labels_of(np.isfinite(rates), "mesh_size"):
        cells = [dict(mesh_size=size, thread_count=threads, precision=kind) for threads, kind in ways]
        numbers = [f"{float(rates.sel(cell)):.0f}, {float(moved.sel(cell)):.1f}" if np.isfinite(rates.sel(cell)) else ""
                   for cell in cells]  # fmt: skip
        wrong = float(data.explicit_error.sel(mesh_size=size, precision=data.precision.values[-1]))
        rows.append([f"{1e3 * size:g} mm", *numbers, f"{wrong:.1e}"])
    if not rows:
        words = {markdown(word) for word in data.explicit_message.values if word}
        return [f"None was timed{': ' + '; '.join(sorted(words)) if words else ''}."]
    heads = [f"{kind}, {threads} thread{'s' if threads > 1 else ''}" for threads, kind in ways]
    heads = ["structured mesh", *heads, f"error, {data.precision.values[-1]}"]
    copies = ", ".join(
        f"{cell_number(data.copy_bandwidth.sel(thread_count=threads), '.1f', 1e-9) or 'not measured'} GB/s by {threads}"
        for threads in data.thread_count.values
    )
    lines = ["Nonlinear springs that steps advance, in millions a second, and what they read and write, be it in a "
             f"cache, in GB/s. A plain copy of memory moves {copies}. The numbers of a run do not depend on threads; "
             "errors are those of displacements against double precision, over the largest.", ""]  # fmt: skip
    told = zip(data.mesh_size.values, data.explicit_message.values)
    lost = [f"- {1e3 * size:g} mm: {markdown(word)}" for size, word in told if word]
    return lines + markdown_table(heads, rows) + (["", *lost] if lost else [])

"""The page of the benchmark: every number from the dataset."""

from pathlib import Path

import numpy as np
import xarray as xr

from springtune.problem.status import Status
from springtune.safe_io.atomic import write_text
from springtune.safe_io.escapes import markdown

from ...output.text import cell_number, markdown_section, markdown_table
from . import PARTS
from .outputs import PAGE


def write(tree, folder):
    """Write the page in Markdown."""
    write_text(Path(folder) / PAGE, page(tree))
    return [PAGE]


def page(tree: xr.DataTree) -> str:
    """Markdown: errors and costs of one mesh size by scene, what lacks numbers, curves, explicit steps."""
    data = tree["benchmark"].to_dataset()
    parts = {}
    for scene in map(str, data.scene.values):
        cells = data.sel(scene=scene)
        parts[f"{scene}: approaches on one mesh size"] = _one_size(cells)
        parts[f"{scene}: what has no numbers"] = _holes(cells)
    parts |= {"A sensitivity curve": _curve(data), "Explicit steps": _explicit(data)}
    lines = []
    for title, part in parts.items():
        lines += [*markdown_section(title), *part, ""] if part else []
    return "\n".join(lines)


def _time(seconds):
    seconds = float(seconds)
    return "" if np.isnan(seconds) else f"{1e3 * seconds:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


def _holes(cells):
    """What was asked for and lacks numbers: a line a reason, with its approaches and mesh sizes."""
    status, message = (one.transpose("approach", "mesh_size").values for one in (cells.status, cells.message))
    found = {}
    for i, j in np.argwhere((status != Status.NOT_REQUESTED) & (status != Status.SOLVED)):
        places = found.setdefault(str(message[i, j]), {}).setdefault(str(cells.approach.values[i]), [])
        places.append(f"{1e3 * cells.mesh_size.values[j]:g}")
    lines = []
    for why, places in found.items():
        named = [f"`{name}` ({', '.join(sizes)} mm)" for name, sizes in places.items()]
        lines.append(f"- {', '.join(named)}: {markdown(why)}")
    return lines


def _one_size(cells):
    """Error and seconds on the finest size that half of the approaches are asked for."""
    counts = (cells.status != Status.NOT_REQUESTED).transpose("approach", "mesh_size").values.sum(axis=0)
    cells = cells.isel(mesh_size=int(np.flatnonzero(counts >= 0.5 * counts.max())[0]))
    rows = []
    for i in np.argsort(np.abs(cells.error.values)):
        cell = cells.isel(approach=i)
        if np.isfinite(cell.error):
            seconds = (_time(cell[name]) for name in ("seconds", *(f"{part}_seconds" for part in PARTS)))
            rows.append([f"`{cell.approach.item()}`", cell_number(cell.error, "+.2g", 100, " %"), *seconds])
    return markdown_table([f"at {1e3 * float(cells.mesh_size):g} mm", "error", "time", *PARTS], rows)


def _curve(data):
    rows = [
        [str(count), *(_time(data[name].sel(curve_count=count)) for name in ("curve_seconds", "separate_seconds"))]
        for count in data.curve_count.values
    ]  # fmt: skip
    lines = markdown_table(["stiffnesses", "one path", "solve by solve"], rows)
    return [*lines, "", f"One linear solve there takes {_time(data.linear_seconds)}, a nonlinear one "
            f"{_time(data.nonlinear_seconds)}."]  # fmt: skip


def _explicit(data):
    """Springs that explicit steps advance, by threads and precision."""
    rates = data.spring_updates / 1e6
    ways = [(threads, kind) for kind in data.precision.values for threads in data.thread_count.values]
    rows = [
        [f"{1e3 * size:g} mm", *(cell_number(rates.sel(mesh_size=size, thread_count=threads, precision=kind), ".0f")
                                 for threads, kind in ways)]
        for size in data.mesh_size.values
    ]  # fmt: skip
    heads = [f"{kind}, {threads} thread{'s' if threads > 1 else ''}" for threads, kind in ways]
    said = "Nonlinear springs that steps advance, in millions a second. Results do not depend on threads."
    return [said, "", *markdown_table(["structured mesh", *heads], rows)]

"""The page of the benchmark: every number from the dataset."""

import numpy as np
import xarray as xr

from springtune.problem.status import Status
from springtune.safe_io.escapes import markdown

from ...output import tables
from ...output.tables import numbers
from ...output.text import markdown_section
from . import PARTS


def page(tree: xr.DataTree) -> str:
    """Markdown: errors and costs of one mesh size by scene, what lacks numbers, and explicit steps."""
    data, lines = tree["benchmark"].to_dataset(), []
    for scene in map(str, data.scene.values):
        cells = data.sel(scene=scene)
        lines += [*markdown_section(f"{scene}: approaches on one mesh size"), *_one_size(cells), ""]
        holes = [*_holes(cells)]
        lines += [*markdown_section(f"{scene}: what has no numbers"), *holes, ""] if holes else []
    said = "Nonlinear springs that steps advance, in millions a second. Results do not depend on threads."
    rates = numbers(data.spring_updates, ".0f", 1e-6).transpose(..., "precision", "thread_count")
    steps = tables.markdown(["mesh_size"], {"{}, threads: {}": rates})
    return "\n".join([*lines, *markdown_section("Explicit steps", said), *steps])


def _time(seconds):
    return "" if np.isnan(seconds) else f"{1e3 * seconds:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


def _holes(cells):
    """What was asked for and lacks numbers: a line a reason, with its approaches and mesh sizes."""
    holes = (cells.status != Status.NOT_REQUESTED) & (cells.status != Status.SOLVED)
    found = {}
    for one in tables.listed(cells, holes.transpose("approach", "mesh_size"), ("approach", "mesh_size", "message")):
        found.setdefault(one["message"], {}).setdefault(one["approach"], []).append(f"{1e3 * one['mesh_size']:g}")
    for why, places in found.items():
        named = [f"`{name}` ({', '.join(sizes)} mm)" for name, sizes in places.items()]
        yield f"- {', '.join(named)}: {markdown(why)}"


def _one_size(cells):
    """Error and seconds on the finest size that half of the approaches are asked for."""
    counts = (cells.status != Status.NOT_REQUESTED).sum("approach")
    cells = cells.isel(mesh_size=int(np.flatnonzero(counts >= 0.5 * counts.max())[0]))
    cells = cells.sortby(abs(cells.error))
    columns = {"error": numbers(cells.error, "+.2g", 100, " %")}
    for head, name in (("time", "seconds"), *((part, f"{part}_seconds") for part in PARTS)):
        columns[head] = xr.apply_ufunc(_time, cells[name].where(cells.error.notnull()), vectorize=True)
    heads = {"approach": (f"at {1e3 * float(cells.mesh_size):g} mm", "`{}`".format)}
    return tables.markdown(["approach"], columns, heads)

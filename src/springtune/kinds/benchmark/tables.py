"""The page of the benchmark: every number from the dataset."""

from pathlib import Path

import numpy as np
import xarray as xr

from ...jobs.atomic import write_text
from ...output.tables import markdown_table
from .names import PARTS
from .outputs import PAGE

TARGETS = (0.01, 0.001, 0.0001)
"""Errors to reach [1]."""


def write(tree, folder):
    """Write the page in Markdown.

    Parameters
    ----------
    tree : xarray.DataTree
        With the group ``/benchmark``.
    folder : str or Path

    Returns
    -------
    list of str
        Names of the files written.
    """
    write_text(Path(folder) / PAGE, page(tree))
    return [PAGE]


def page(tree: xr.DataTree) -> str:
    """Markdown: the quickest ways to an error, costs of one mesh size, orders and exponents, curves."""
    data = tree["benchmark"].to_dataset()
    loads = ", ".join(f"{float(value):.1f}" for value in data.machine_load.values)
    parts = [f"Machine load at the start of each scene: {loads}.", "", _rule(data), ""]
    for scene in map(str, data.scene.values):
        cells = data.sel(scene=scene)
        if np.isfinite(cells.assured_error).any():
            parts += [f"### {scene}: the quickest ways to an error", "", *_quickest(cells), ""]
        parts += [f"### {scene}: approaches on one mesh size", "", *_one_size(cells), ""]
    parts += ["### Solvers of one linear system", "", *_solvers(data), ""]
    return "\n".join([*parts, "### A sensitivity curve", "", *_curve(data), ""])


def _time(seconds):
    seconds = float(seconds)
    if np.isnan(seconds):
        return ""
    return f"{1e3 * seconds:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


def _percent(value):
    value = 100 * float(value)
    return "" if np.isnan(value) else f"{value:+.2g} %".replace("-", "−")


def _plain(value, digits):
    return "" if np.isnan(float(value)) else f"{float(value):.{digits}f}"


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
        good = np.where(errors <= target, seconds, np.inf)
        best = good.min(axis=1)
        row = [f"{100 * target:g} %"]
        for i in np.argsort(best)[:3]:
            if np.isfinite(best[i]):
                size = 1e3 * float(cells.mesh_size.values[good[i].argmin()])
                row.append(f"`{cells.approach.values[i]}`, {size:g} mm: {_time(best[i])}")
        rows.append(row + [""] * (4 - len(row)))
    return markdown_table(["error", "first", "second", "third"], rows)


def _one_size(cells):
    """Error, seconds and memory on the finest size that half of the approaches have."""
    counts = np.isfinite(cells.seconds.values).sum(axis=0)
    place = int(np.flatnonzero(counts >= 0.5 * counts.max())[0])
    cells = cells.isel(mesh_size=place)
    order = np.argsort(np.abs(cells.error.values))
    rows = []
    for i in order:
        cell = cells.isel(approach=i)
        if np.isnan(cell.seconds):
            continue
        rows.append([
            f"`{cell.approach.item()}`", _percent(cell.error), _time(cell.seconds), _time(cell.cold_seconds),
            *(_time(cell[f"{part}_seconds"]) for part in PARTS),
            f"{float(cell.peak_memory) / 1e6:.0f}", _plain(cell.error_rate, 1), _plain(cell.cost_exponent, 2),
        ])  # fmt: skip
    heads = [f"at {1e3 * float(cells.mesh_size):g} mm", "error", "time", "cold", *PARTS, "memory [MB]", "order",
             "exponent of cost"]  # fmt: skip
    return markdown_table(heads, rows)


def _solvers(data):
    first, again = data.solver_seconds, data.solver_again_seconds
    sizes = [size for size in data.mesh_size.values if np.isfinite(first.sel(mesh_size=size)).any()]
    rows = [
        [f"{1e3 * size:g} mm"]
        + [
            f"{_time(first.sel(cell))}, {_time(again.sel(cell))}" if np.isfinite(first.sel(cell)) else ""
            for cell in ({"mesh_size": size, "linear_solver": name} for name in data.linear_solver.values)
        ]
        for size in sizes
    ]
    return markdown_table(["structured mesh", *(f"{name}: first, next" for name in data.linear_solver.values)], rows)


def _curve(data):
    rows = [
        [str(count), *(_time(data[name].sel(curve_count=count)) for name in ("curve_seconds", "separate_seconds"))]
        for count in data.curve_count.values
    ]  # fmt: skip
    lines = markdown_table(["stiffnesses", "one path", "solve by solve"], rows)
    lines += ["", f"One linear solve there takes {_time(data.linear_seconds)}, a nonlinear one "
              f"{_time(data.nonlinear_seconds)}."]  # fmt: skip
    if "explicit_steps" in data and np.isfinite(data.explicit_steps):
        lines += ["", f"Explicit steps of nonlinear springs: {float(data.explicit_steps):.0f} a second, which move "
                  f"{float(data.explicit_bandwidth) / 1e9:.1f} GB/s; a plain copy of memory moves "
                  f"{float(data.copy_bandwidth) / 1e9:.1f} GB/s."]  # fmt: skip
    return lines


NOISE = 1.3
"""Ratio of seconds that runs of one program on one machine show among themselves."""


def comparison(old: xr.Dataset, new: xr.Dataset) -> tuple[list[str], int]:
    """Ratios of the seconds of two benchmarks, approach by approach.

    A machine that is slower on the whole is no regression: ratios are over their median. Flagged is what lies outside
    of `NOISE` and of three times the spread that the runs showed.

    Parameters
    ----------
    old, new : xarray.Dataset
        Groups ``/benchmark``.

    Returns
    -------
    lines : list of str
    flagged : int
        Number of approaches that became slower.
    """
    both = {name: [label for label in old[name].values if label in new[name].values]
            for name in ("scene", "approach", "mesh_size")}  # fmt: skip
    old, new = old.sel(both), new.sel(both)
    ratio = (new.seconds / old.seconds).transpose("approach", "scene", "mesh_size").values
    if not np.isfinite(ratio).any():
        return ["The two datasets have no case in common."], 0
    spread = [
        (one.seconds_spread / one.seconds).transpose("approach", "scene", "mesh_size").values for one in (old, new)
    ]
    middle = float(np.nanmedian(ratio))
    lines = [f"{int(np.isfinite(ratio).sum())} cases in common, median ratio new / old {middle:.2f}."]
    flagged = 0
    for i, approach in enumerate(both["approach"]):
        cells = np.isfinite(ratio[i])
        if not cells.any():
            continue
        own = float(np.median(ratio[i][cells])) / middle
        noise = max(NOISE, 1 + 3 * float(np.median(np.fmax(*(part[i][cells] for part in spread)))))
        word = "slower" if own > noise else "faster" if own < 1 / noise else ""
        flagged += own > noise
        lines.append(f"{own:6.2f}  {approach}  {word}".rstrip())
    return lines, flagged

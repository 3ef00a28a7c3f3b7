"""Figures and page of the benchmark: error against run time. Every number is the dataset's."""

import numpy as np
import xarray as xr

from springtune.problem.compare import unbeaten
from springtune.problem.status import Status
from springtune.safe_io.escapes import markdown

from ...output import labels, style, tables
from ...output.selection import choose, group
from ...output.tables import numbers
from ...output.text import markdown_section
from . import PARTS
from .outputs import figures

SHOWN = ("delingette/structured", "van-gelder/structured", "area/braced", "linear-triangles", "quadratic-triangles",
         "condensation", "calculix-cps3", "calculix-cps8")  # fmt: skip
"""Approaches with names before others, which are grey."""

RING = {"markersize": 7, "markerfacecolor": "none", "markeredgecolor": "black", "markeredgewidth": 0.8}


def named(data):
    """Approaches to name: those with an error in `SHOWN`, then as many others as fit, the most accurate first."""
    dimensions = [name for name in data.error.dims if name != "approach"]
    smallest = np.abs(data.error).min(dimensions)
    order = np.argsort(smallest.values)
    there = data.approach.values[order[np.isfinite(smallest.values[order])]].tolist()
    chosen = [name for name in SHOWN if name in there]
    return chosen + [name for name in there if name not in chosen][: len(SHOWN) - len(chosen)]


def benchmark(tree):
    """Figures of the benchmark: errors over seconds of each scene."""
    for stem, selection in figures(group(tree, "benchmark").scene.values.tolist()).items():
        yield stem, plot_benchmark, selection


@style.styled
def plot_benchmark(data, ax=None, *, scene=None):
    """Error over run time: a line an approach, over mesh sizes.

    Rings: no other approach that finer meshes confirm is both faster and more accurate.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/benchmark``.
    ax : Axes or Figure, optional
        Where to plot; by default a new figure.
    scene : str, optional
        Scene of the benchmark; may be left out where there is one.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ValueError
        If the dataset has no benchmark, or the scene is not there, or left out where there are several.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_benchmark(tree, scene="traction")
    >>> axes.get_title(loc="left")
    'traction'
    >>> axes.get_xscale(), axes.get_ylabel()
    ('log', '|Error| [%]')
    """
    case = _scene(data, scene)
    rings = unbeaten(case.assured_error.values, case.seconds.values)
    ringed = "○: no other confirmed approach is both faster and more accurate" if rings.any() else ""
    lost = "; ".join(filter(None, (ringed, _lost(case) and f"not drawn: {_lost(case)}")))
    _, ((panel,),) = style.panels(ax, figsize=(style.PAGE, 4.0))
    shown = named(case)
    for ring, approach in zip(rings, map(str, case.approach.values)):
        here = case.sel(approach=approach)
        errors, seconds = 100 * np.abs(here.error.values), here.seconds.values
        good = np.isfinite(errors * seconds) & (errors > 0)
        look = {"color": "0.7", "linewidth": 0.4, "marker": ".", "markersize": 1.5}
        if approach in shown:
            look = style.line(shown.index(approach)) | {"label": approach}
        panel.plot(seconds[good], errors[good], **look)
        panel.plot(seconds[ring], errors[ring], "o", **RING)
    panel.set(xlabel="Seconds, from nothing to the displacement", ylabel="|Error| [%]", title=case.scene.item())
    if not shown:
        labels.say(panel, f"No approach has an error and a time: {_lost(case) or 'none was asked for'}.")
        return panel
    estimate, seconds = 100 * float(case.reference_error_estimate), float(case.reference_seconds)
    if estimate > 0 and seconds > 0:
        panel.plot([seconds], [estimate], "*", color="black", markersize=7, label="the reference")
    panel.set(**style.LOGARITHMIC)
    style.plain(panel, "x", "y")
    labels.finish(panel, [lost])
    return panel


def _scene(data, scene):
    data = group(data, "benchmark")
    return data.sel(choose(data.scene.notnull(), scene=scene))


def _lost(case):
    """How many cases have no numbers and why, in words; empty where all have."""
    counts = labels.statuses(case.status.values[case.status.values != Status.SOLVED]) if "status" in case else {}
    return ", ".join(f"{count} {word}" for word, count in counts.items() if count)


# -- tables ------------------------------------------------------------------------------------------------------------


def page(tree: xr.DataTree) -> str:
    """Markdown: errors and costs of one mesh size by scene, what lacks numbers, and explicit steps."""
    data, lines = tree["benchmark"].to_dataset(), []
    for scene in map(str, data.scene.values):
        cells = data.sel(scene=scene)
        lines += [*markdown_section(f"{scene}: approaches on one mesh size"), *_one_size(cells), ""]
        holes = [*_holes(cells)]
        lines += [*markdown_section(f"{scene}: what has no numbers"), *holes, ""] if holes else []
    said = "Millions of nonlinear springs that explicit steps advance in a second."
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

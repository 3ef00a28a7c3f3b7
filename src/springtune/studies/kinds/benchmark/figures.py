"""Figures and tables of the benchmark: error against run time."""

import numpy as np

from springtune.problem.compare import unbeaten
from springtune.problem.quantities import Status

from ...output import style
from ...output.answers import count_statuses
from ...output.dataset import STATUS, choose, group, table_rows
from . import PARTS

FIRST_NAMED = ("delingette/structured", "van-gelder/structured", "area/braced", "linear-triangles",
               "quadratic-triangles", "boundary-elements", "tensor-mass", "calculix-cps3",
               "calculix-cps8")  # fmt: skip
"""Approaches that are named first; unnamed ones are grey."""

RING_STYLE = {"markersize": 7, "markerfacecolor": "none", "markeredgecolor": "black", "markeredgewidth": 0.8}


def benchmark(tree):
    """Yield the figure of each scene: stem, plot function and selection."""
    for scene in group(tree, "benchmark").scene.values.tolist():
        yield f"benchmark_{scene}", plot_benchmark, {"scene": scene}


@style.styled
def plot_benchmark(data, ax=None, *, scene=None):
    """Error over run time, one line per approach over mesh sizes.

    Rings mark approaches that no other confirmed approach beats in both error and time.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/benchmark``.
    ax : Axes or Figure, optional
    scene : str, optional

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ValueError
        If the dataset has no benchmark or no such scene, or several scenes and none is given.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_benchmark(tree, scene="traction")
    >>> axes.get_title(loc="left")
    'traction'
    >>> axes.get_xscale(), axes.get_ylabel()
    ('log', '|Error| [%]')
    """
    data = group(data, "benchmark")
    case = data.sel(choose(data.scene.notnull(), scene=scene))
    rings = unbeaten(case.assured_error.values, case.seconds.values)
    ringed = "○: no other confirmed approach is both faster and more accurate" if rings.any() else ""
    counts = count_statuses(case.status.values[case.status.values != Status.SOLVED]) if "status" in case else {}
    missing = ", ".join(f"{count} {word}" for word, count in counts.items())
    lost = "; ".join(filter(None, (ringed, missing and f"not drawn: {missing}")))
    _, ((panel,),) = style.panels(ax, figsize=(style.PAGE_WIDTH, 4.0))
    smallest = np.abs(case.error).min("mesh_size").to_series().dropna().sort_values(kind="stable")
    named = [name for name in FIRST_NAMED if name in smallest.index]
    shown = list(dict.fromkeys([*named, *smallest.index]))[: len(FIRST_NAMED)]
    for ring, approach in zip(rings, map(str, case.approach.values)):
        here = case.sel(approach=approach)
        errors, seconds = 100 * np.abs(here.error.values), here.seconds.values
        good = np.isfinite(errors * seconds) & (errors > 0)
        look = {"color": "0.7", "linewidth": 0.4, "marker": ".", "markersize": 1.5}
        if approach in shown:
            look = style.line(shown.index(approach)) | {"label": approach}
        panel.plot(seconds[good], errors[good], **look)
        panel.plot(seconds[ring], errors[ring], "o", **RING_STYLE)
    panel.set(xlabel="Run time from mesh to displacement [s]", ylabel="|Error| [%]", title=case.scene.item())
    if not shown:
        style.write_reason(panel, f"No approach has an error and a time: {missing or 'none was requested'}.")
        return panel
    estimate, seconds = 100 * float(case.reference_error_estimate), float(case.reference_seconds)
    if estimate > 0 and seconds > 0:
        panel.plot([seconds], [estimate], "*", color="black", markersize=7, label="the reference")
    style.logarithmic(panel)
    style.add_legend(panel, [lost])
    return panel


# -- tables ------------------------------------------------------------------------------------------------------------

CASE_COLUMNS = {"mesh_size_mm": ("mesh_size", 1e3), "error_percent": ("error", 100)}
CASE_COLUMNS |= {"assured_error_percent": ("assured_error", 100), "time_ms": ("seconds", 1e3)}
CASE_COLUMNS |= {f"{part}_ms": (f"{part}_seconds", 1e3) for part in PARTS}
"""Columns of the table: variable and factor."""

STEP_COLUMNS = {"mesh_size_mm": ("mesh_size", 1e3), "million_springs_a_second": ("spring_updates", 1e-6)}


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.bodies.tables.tables`."""
    data = tree["benchmark"].to_dataset()
    asked = (data.status != 0).transpose("scene", "mesh_size", "approach")
    cases = table_rows(data, asked, ("scene", "approach", "status", "message"), CASE_COLUMNS)
    cases = [row | {"status": STATUS[row["status"]]} for row in cases]
    steps = table_rows(data, data.spring_updates.notnull(), ("precision", "thread_count"), STEP_COLUMNS)
    note = "Error, and run time with its parts, meshing included: medians of warm runs."
    about = "Nonlinear springs that explicit steps advance per second."
    return [
        {"stem": "benchmark", "title": "Run time against error", "note": note, "rows": cases},
        {"stem": "explicit_steps", "title": "Explicit steps", "note": about, "rows": steps},
    ]

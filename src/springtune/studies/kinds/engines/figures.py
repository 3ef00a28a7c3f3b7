"""Figures and table of scenes in engines: error over the time of a frame, and sensitivity curves."""

import numpy as np

from springtune.problem.compare import unbeaten

from ...output import style
from ...output.dataset import choose, group, labels_of, table_rows
from ...output.text import cell_text
from . import RUN_ENDS, SETTING

FRAME_SECONDS = 1 / 60  # motion that costs refer to [s]


def engines(tree):
    """Yield the figures of a dataset: stem, plot function and selection."""
    plots = {"engines": ("errors", plot_engine_errors), "engine_curves": ("curves", plot_engine_curves)}
    for name, (stem, plot) in plots.items():
        for scene in labels_of(group(tree, name).status != 0, "scene") if name in tree else ():
            yield f"engines_{stem}_{scene}", plot, {"scene": scene}


def _runs(data, name, scene):
    """Return a scene of a group, its runs by engine (and definition, if several), and the missing runs in words."""
    data = group(data, name)
    case = data.sel(choose(data.status != 0, scene=scene))
    runs = case[["status", "engine_status", "error", "frame_seconds"]].reset_coords(drop=True).to_dataframe()
    runs = runs[runs.status != 0].reset_index()
    runs["end"] = [RUN_ENDS[flag] for flag in runs.engine_status]
    if runs.definition.nunique() > 1:
        runs["engine"] += ", " + runs.definition
    lost = runs[runs.error.isna()].replace({"end": {"rest": "without a reference"}}).groupby("end", sort=False).engine
    missing = ", ".join(f"{len(names)} {end} ({'; '.join(names.unique())})" for end, names in lost)
    return case, dict(list(runs.groupby("engine", sort=False))), missing


@style.styled
def plot_engine_errors(data, ax=None, *, scene=None):
    """Error over the time of a frame: one line per engine joins its unbeaten settings.

    Times are per 1/60 s of motion, so settings with different frames compare. Small markers are all settings.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/engines``.
    ax : Axes or Figure, optional
    scene : str, optional

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ValueError
        If the dataset has no scenes in engines or no such scene, or several scenes and none is given.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_engine_errors(tree, scene="sheet")
    >>> axes.get_title(loc="left"), axes.get_xlabel()
    ('sheet', 'Time for 1/60 s of motion [ms]')
    """
    case, runs, lost = _runs(data, "engines", scene)
    _, ((panel,),) = style.panels(ax, figsize=(style.PAGE_WIDTH, 3.8))
    there = False
    for number, (name, rows) in enumerate(runs.items()):
        errors = 100 * rows.error.abs().where(rows.error != 0).values
        times = 1e3 * FRAME_SECONDS * (rows.frame_seconds / rows.dt).values
        look = style.line(number)
        panel.plot(times, errors, **look | {"linestyle": "", "markersize": 2, "alpha": 0.5}, label="_")
        best = np.flatnonzero(unbeaten(errors, times))
        best = best[np.argsort(times[best], kind="stable")]
        panel.plot(times[best], errors[best], label=name, **look)
        there |= bool(len(best))
    panel.set(xlabel="Time for 1/60 s of motion [ms]", ylabel="|Error| [%]", title=case.scene.item())
    notes = [f"not drawn: {lost}"] if lost else []
    if there:
        errors = 100 * np.abs(case.definition_error.sel(definition=labels_of(case.status != 0, "definition")))
        known = {name: error for name, error in errors.to_series().items() if error > 0}  # NaN is not
        for error in known.values():
            panel.axhline(error, color="0.45", linewidth=0.8, zorder=0, linestyle=(0, (1, 1.5)))
        texts = ", ".join(f"{name} {error:.2g} %" for name, error in known.items())
        notes.insert(0, f"dotted: error of the definition in equilibrium, {texts}")
        style.logarithmic(panel)
        low, high = panel.get_xlim()
        if low < 1e3 * FRAME_SECONDS < high:
            panel.axvline(1e3 * FRAME_SECONDS, color="0.7", linewidth=0.9, zorder=0)
            notes.insert(1, "right of the grey line: slower than real time")
    style.add_legend(panel, ["; ".join(notes)], f"No run is at rest beside a reference: {lost}.")
    return panel


@style.styled
def plot_engine_curves(data, ax=None, *, scene=None):
    """Sensitivity curves in engines: displacement over the reference by stiffness factor, one panel per engine.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/engine_curves``.
    ax : Figure or sequence of Axes, optional
    scene : str, optional

    Returns
    -------
    ndarray of matplotlib.axes.Axes
        One per engine that ran, and per definition if there are several.

    Raises
    ------
    ValueError
        If the dataset has no curves in engines or no such scene, several scenes and none is given, or ``ax`` has
        another number of Axes.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_engine_curves(tree, scene="sheet")
    >>> [panel.get_title(loc="left") for panel in axes]
    ['xpbd, paper', 'vbd, paper', 'xpbd, area', 'vbd, area']
    """
    case, runs, lost = _runs(data, "engine_curves", scene)
    shown = {name: rows for name, rows in runs.items() if rows.error.notna().any()}

    def draw(panel, rows):
        """Draw the curves of an engine."""
        panel.set(xlabel="Factor on what is typed", ylabel="Displacement / reference")
        if not len(rows):
            return [], f"No run of a curve is at rest beside a reference: {lost}."
        names = [name for name in SETTING if rows[name].nunique() > 1] or ["iterations"]
        for number, (values, one) in enumerate(rows.groupby(names, sort=False)):
            ratio, name = 1 + one.error, cell_text(dict(zip(names, values)), {"dt": "s"})
            panel.plot(one.stiffness_factor, ratio.where(ratio > 0), label=name, **style.line(number))
        panel.plot(1, 1 + case.definition_error.sel(definition=rows.definition.iloc[0]), "k+", markersize=7, zorder=4)
        style.logarithmic(panel)
        panel.axhline(1, color="0.45", linewidth=0.8, zorder=0)
        return [], ""

    title = f"{case.scene.item()}, +: the network in equilibrium{'; not drawn: ' + lost if lost else ''}"
    return style.small_multiples(ax, shown or {"": []}, 3, 2.1, title, draw, sharey=True)


# -- tables ------------------------------------------------------------------------------------------------------------

ENGINE_COLUMNS = (
    {"dt_ms": ("dt", 1e3), "displacement_mm": ("displacement", 1e3), "reference_mm": ("reference_displacement", 1e3)}
    | {f"{name}_percent": (name, 100) for name in ("error", "definition_error", "solver_error")}
    | {"frame_ms": ("frame_seconds", 1e3)}
)
"""Columns of the table: variable and factor."""


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.bodies.tables.tables`."""
    data = tree["engines"].to_dataset()
    names = ("scene", "definition", "engine", "precision", "substeps", "iterations", "engine_status", "message")
    rows = table_rows(data, data.status != 0, names, ENGINE_COLUMNS)
    rows = [row | {"engine_status": RUN_ENDS[row["engine_status"]]} for row in rows]
    note = "Displacement at rest against finite elements: error of the definition in equilibrium, and of the solver."
    return [{"stem": "engines", "title": "Scenes in engines", "note": note, "rows": rows}]

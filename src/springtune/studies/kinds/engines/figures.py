"""Figures of scenes in engines: error over the time of a frame, settings, sensitivity curves and their best factors."""

from collections import defaultdict

import numpy as np

from springtune.problem.compare import unbeaten

from ...output import labels, style
from ...output.drawing import NOT_ASKED, error_text, heat_map
from ...output.selection import choose, group, labels_of, records
from ...output.text import cell_text
from . import RUN_ENDS, SETTING, WITHOUT_RUN
from .outputs import figures

FRAME = 1 / 60
"""Time of motion that costs are given for [s]."""

END_SIGNS, NO_RUN = {"swings": "~", "moving": "→", "diverged": "!", "inverted": "↺"}, "∅"
"""On the map of settings: of runs that moved and have no error, and of those that did not begin or end."""

UNITY = {"color": "0.45", "linewidth": 0.8, "zorder": 0}
"""Look of the line at one."""


def engines(tree):
    """Stem, function that plots, and selection of each figure."""
    every = plot_engine_errors, plot_engine_maps, plot_engine_curves, plot_engine_factors
    plots = {plot.__name__.removeprefix("plot_engine_"): plot for plot in every}
    names = "engines", "engine_curves"
    scenes = [labels_of(group(tree, name).status != 0, "scene") if name in tree else [] for name in names]
    for stem, selection in figures(*scenes).items():
        yield stem, plots[stem.split("_")[1]], selection


def _runs(data, name, scene):
    """Scene of a group, its runs by engine, with the definition where there are several, and which have no error."""
    data = group(data, name)
    case = data.sel(choose(data.status != 0, scene=scene))
    wanted = ("engine_status", "error", "frame_seconds", "best_factor")
    rows = records(case, case.status != 0, [one for one in wanted if one in case])
    several, runs, lost = len({row["definition"] for row in rows}) > 1, defaultdict(list), defaultdict(list)
    for row in rows:
        engine = f"{row['engine']}, {row['definition']}" if several else row["engine"]
        runs[engine].append(row)
        if not np.isfinite(row["error"]):
            lost[RUN_ENDS[row["engine_status"]].replace("rest", "without a reference")].append(engine)
    said = ", ".join(f"{len(names)} {end} ({'; '.join(dict.fromkeys(names))})" for end, names in lost.items())
    return case, runs, said


def _varying(rows, names):
    """Those of some parameters of a setting that have several values."""
    return [name for name in names if len({row[name] for row in rows}) > 1]


def _setting(row, names):
    """Text of some parameters of a setting."""
    return cell_text({name: row[name] for name in names}, {"dt": "s"})


def _lines(panel, points):
    """Draw a line a name; return whether any has a point."""
    for number, (name, one) in enumerate(points.items()):
        x, y = np.array(sorted(one.items())).T
        panel.plot(x, y, label=name, **style.line(number))
    return any(np.isfinite([*one.values()]).any() for one in points.values())


@style.styled
def plot_engine_errors(data, ax=None, *, scene=None):
    """Error over the time of a frame: a line an engine joins the settings that no other of its settings beats.

    Times are for 1/60 s of motion, so that settings with other frames can be compared. Small markers are all settings.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/engines``.
    ax : Axes or Figure, optional
        Where to plot; by default a new figure.
    scene : str, optional
        Scene; may be left out where there is one.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ValueError
        If the dataset has no scenes in engines, or the scene is not there, or left out where there are several.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_engine_errors(tree, scene="sheet")
    >>> axes.get_title(loc="left"), axes.get_xlabel()
    ('sheet', 'Time for 1/60 s of motion [ms]')
    """
    case, runs, lost = _runs(data, "engines", scene)
    _, ((panel,),) = style.panels(ax, figsize=(style.PAGE, 3.8))
    there = False
    for number, (name, rows) in enumerate(runs.items()):
        errors = 100 * np.abs([row["error"] or np.nan for row in rows])
        times = 1e3 * FRAME * np.array([row["frame_seconds"] / row["dt"] for row in rows])
        look = style.line(number)
        panel.plot(times, errors, **look | {"linestyle": "", "markersize": 2, "alpha": 0.5}, label="_")
        best = np.flatnonzero(unbeaten(errors, times))
        best = best[np.argsort(times[best], kind="stable")]
        panel.plot(times[best], errors[best], label=name, **look)
        there |= bool(len(best))
    panel.set(xlabel="Time for 1/60 s of motion [ms]", ylabel="|Error| [%]")
    panel.set_title(case.scene.item())
    said = [f"not drawn: {lost}"] if lost else []
    if there:
        panel.set(**style.LOGARITHMIC)
        low, high = panel.get_xlim()
        if low < 1e3 * FRAME < high:
            panel.axvline(1e3 * FRAME, color="0.7", linewidth=0.9, zorder=0)
            said.insert(0, "right of the grey line: slower than real time")
        errors = 100 * np.abs(case.definition_error.sel(definition=labels_of(case.status != 0, "definition")))
        known = {name: error for name, error in errors.to_series().items() if error > 0}  # NaN is not
        for error in known.values():
            panel.axhline(error, color="0.45", linewidth=0.8, zorder=0, linestyle=(0, (1, 1.5)))
        if known:
            texts = ", ".join(f"{name} {error:.2g} %" for name, error in known.items())
            said.insert(0, f"dotted: error of the definition in equilibrium, {texts}")
        style.plain(panel, "x", "y")
    labels.finish(panel, ["; ".join(said)], f"No run is at rest beside a reference: {lost}.")
    return panel


@style.styled
def plot_engine_maps(data, ax=None, *, scene=None):
    """How runs end and their errors, by step and iterations: a panel an engine.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/engines``.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as panels; by default a new figure.
    scene : str, optional
        Scene; may be left out where there is one.

    Returns
    -------
    ndarray of matplotlib.axes.Axes
        One an engine that ran, with the definition where there are several.

    Raises
    ------
    ValueError
        As `plot_engine_errors`, or if ``ax`` has another number of Axes.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_engine_maps(tree, scene="sheet")
    >>> [panel.get_title(loc="left") for panel in axes]
    ['xpbd, paper', 'vbd, paper', 'xpbd, area', 'vbd, area']
    """
    case, runs, lost = _runs(data, "engines", scene)
    shown = {name: rows for name, rows in runs.items()
             if any(RUN_ENDS[row["engine_status"]] not in WITHOUT_RUN for row in rows)}  # fmt: skip
    why = "" if shown else f"Nothing was run: {lost}."
    ends = {RUN_ENDS[row["engine_status"]] for rows in shown.values() for row in rows if not np.isfinite(row["error"])}
    said = [f"{sign} {end}" for end, sign in END_SIGNS.items() if end in ends]
    said += [f"{NO_RUN} no run"] * bool(ends & {*WITHOUT_RUN})
    title = f"{case.scene.item()}, rows: frame [ms] / substeps; error [%], × displacement over the reference's"
    title = ", ".join([title, *said])
    absent = ", ".join(name for name in runs if name not in shown)
    title += f"; not run: {absent}" if absent else ""
    height = 0.8 + 0.19 * max([3, *(len(_steps(rows)) for rows in shown.values())])

    def draw(panel, rows):
        if rows:
            _map(panel, rows)
        return [], why

    return labels.small_multiples(ax, shown or {"": []}, 3, height, title, draw)


def _steps(rows):
    """Precision, frame and substeps of runs, the smallest step first."""
    steps = {tuple(row[name] for name in SETTING[:3]) for row in rows}
    return sorted(steps, key=lambda one: (one[0], one[1] / one[2], one[2]))


def _map(panel, rows):
    """Draw errors of runs at rest with their numbers, and signs of how the others ended."""
    steps, counts = _steps(rows), sorted({row["iterations"] for row in rows})
    errors = np.full((len(steps), len(counts)), np.nan)
    texts = np.full(errors.shape, NOT_ASKED, dtype=object)
    for row in rows:
        place = steps.index(tuple(row[name] for name in SETTING[:3])), counts.index(row["iterations"])
        errors[place] = error = 100 * row["error"]
        texts[place] = END_SIGNS.get(RUN_ENDS[row["engine_status"]], NO_RUN)
        if np.isfinite(error):
            times = 1 + error / 100
            texts[place] = error_text(error) if error < 100 else f"×{times:.{1 if times < 9.95 else 0}f}"
    heat_map(panel, errors, texts)
    several = _varying(rows, ["precision"])
    names = [f"{precision + ', ' if several else ''}{1e3 * dt:.3g} / {count}" for precision, dt, count in steps]
    panel.set_yticks(range(len(steps)), names)
    panel.set_xticks(range(len(counts)), map(str, counts))
    panel.set(xlabel="Iterations")


@style.styled
def plot_engine_curves(data, ax=None, *, scene=None):
    """Sensitivity curves in engines: displacement over the reference's against the typed factor, a panel an engine.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/engine_curves``.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as panels; by default a new figure.
    scene : str, optional
        Scene; may be left out where there is one.

    Returns
    -------
    ndarray of matplotlib.axes.Axes
        One an engine that ran, with the definition where there are several.

    Raises
    ------
    ValueError
        If the dataset has no curves in engines, or the scene is not there, or left out where there are several, or
        ``ax`` has another number of Axes.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_engine_curves(tree, scene="sheet")
    >>> [panel.get_title(loc="left") for panel in axes]
    ['xpbd, paper', 'vbd, paper', 'xpbd, area', 'vbd, area']
    """
    case, runs, lost = _runs(data, "engine_curves", scene)
    shown = {name: rows for name, rows in runs.items() if any(np.isfinite(row["error"]) for row in rows)}
    why = "" if shown else f"No run of a curve is at rest beside a reference: {lost}."

    def draw(panel, rows):
        panel.set(xlabel="Factor on what is typed", ylabel="Displacement / reference")
        names, points = _varying(rows, SETTING) or ["iterations"], defaultdict(dict)
        for row in rows:
            ratio = 1 + row["error"]
            points[_setting(row, names)][row["stiffness_factor"]] = ratio if ratio > 0 else np.nan
            panel.plot(1, 1 + case.definition_error.sel(definition=row["definition"]), "k+", markersize=7, zorder=4)
        if _lines(panel, points):
            panel.set(**style.LOGARITHMIC)
            style.plain(panel, "x", "y")
            panel.axhline(1, **UNITY)
        return [], why

    title = f"{case.scene.item()}, +: the network in equilibrium{'; not drawn: ' + lost if lost else ''}"
    return labels.small_multiples(ax, shown or {"": []}, 3, 2.1, title, draw, sharey=True)


@style.styled
def plot_engine_factors(data, ax=None, *, scene=None):
    """Best factor on what is typed over iterations: a line an engine and step.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/engine_curves``.
    ax : Axes or Figure, optional
        Where to plot; by default a new figure.
    scene : str, optional
        Scene; may be left out where there is one.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ValueError
        As `plot_engine_curves`.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_engine_factors(tree, scene="sheet")
    >>> axes.get_ylabel()
    'Best factor on what is typed'
    """
    case, runs, lost = _runs(data, "engine_curves", scene)
    every, points = [row for rows in runs.values() for row in rows], defaultdict(dict)
    for name, rows in runs.items():
        for row in rows:
            line = ", ".join(filter(None, (name, _setting(row, _varying(every, SETTING[:3])))))
            points[line][row["iterations"]] = row["best_factor"]
    factors = [factor for one in points.values() for factor in one.values()]
    _, ((panel,),) = style.panels(ax, figsize=(style.COLUMN, 2.6))
    panel.set(xlabel="Iterations", ylabel="Best factor on what is typed", title=case.scene.item())
    if _lines(panel, points):
        wide = np.nanmax([1.0, *factors]) > 5 * np.nanmin([1.0, *factors])  # on a logarithmic axis
        panel.set(xscale="log", yscale="log" if wide else "linear")
        style.plain(panel, "x", *(["y"] if wide else []))
        panel.axhline(1, **UNITY)
    none = f"{np.isnan(factors).sum()} of {len(factors)} curves have no such factor"
    labels.finish(panel, [none], f"{none}{lost and ': '}{lost}.")
    return panel

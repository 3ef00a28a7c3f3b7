"""Figures of scenes in engines: error over the time of a frame, settings, sensitivity curves and their best factors."""

from collections import Counter, defaultdict

import numpy as np
from matplotlib.colors import ListedColormap

from springtune.problem.compare import unbeaten

from ...output import labels, style
from ...output.drawing import NOT_ASKED, error_text, heat_map
from ...output.selection import choose, group, labels_of, records
from . import RUN_ENDS, SETTING, WITHOUT_RUN
from .outputs import figures

FRAME = 1 / 60
"""Time of motion that costs are given for [s]."""

END_COLOURS = {
    "swings": "#b5cfe3",
    "moving": "#dcdcdc",
    "diverged": "#4a0d1a",
    "inverted": "#a05a2c",
    "no run": "#8a8a8a",
}
"""Of runs without an error, on the map of settings."""

PANELS_IN_ROW = 3
"""Panels in a row."""

MAP_KEY = 0.24
"""Height of the key of a map [inch]."""

NARROW = 5
"""Largest over smallest best factor up to which their axis is not logarithmic."""

MAP_NUMBERS = "numbers: error [%]; ×: displacement over the reference's"

LARGEST_PERCENT = 100
"""Error from which a map shows the displacement as a multiple of the reference's [%]."""


def engines(tree):
    """Stem, function that plots, and selection of each figure."""
    plots = {
        "errors": plot_engine_errors,
        "maps": plot_engine_maps,
        "curves": plot_engine_curves,
        "factors": plot_engine_factors,
    }
    there = [group(tree, name) if name in tree else None for name in ("engines", "engine_curves")]
    scenes = [[] if data is None else labels_of(data.status != 0, "scene") for data in there]
    for stem, selection in figures(*scenes).items():
        yield stem, plots[stem.split("_")[1]], selection


def _runs(data, name, scene):
    """Scene of a group, and its runs by engine, with the definition where there are several."""
    data = group(data, name)
    case = data.sel(choose(data.status != 0, scene=scene))
    wanted = ("status", "engine_status", "error", "frame_seconds", "best_factor", "best_factor_message")
    rows = records(case, case.status != 0, [one for one in wanted if one in case])
    several, found = len({row["definition"] for row in rows}) > 1, defaultdict(list)
    for row in rows:
        found[f"{row['engine']}, {row['definition']}" if several else row["engine"]].append(row)
    return case, found


def _lost(runs):
    """How many runs have no error and why, with the names of what was not run at all; empty where all have one."""
    counts, alone = Counter(), defaultdict(list)
    for name, rows in runs.items():
        ends = [row["engine_status"] for row in rows if not np.isfinite(row["error"])]
        counts.update(ends)
        if len(set(ends)) == 1 and RUN_ENDS[ends[0]] in WITHOUT_RUN:
            alone[ends[0]].append(name)
    said = []
    for end, count in sorted(counts.items()):
        names = f" ({'; '.join(alone[end])})" if end in alone else ""
        said.append(f"{count} {RUN_ENDS[end] if RUN_ENDS[end] != 'rest' else 'without a reference'}{names}")
    return ", ".join(said)


def _frame(dt):
    """Text of the time of a frame."""
    return f"1/{round(1 / dt)} s" if dt < 1 and abs(round(1 / dt) * dt - 1) < 1e-9 else f"{1e3 * dt:.4g} ms"


def _setting(row, names):
    """Text of some parameters of a setting."""
    texts = {"precision": row["precision"], "dt": _frame(row["dt"])}
    for name in ("substeps", "iterations"):
        texts[name] = f"{row[name]} {name if row[name] > 1 else name[:-1]}"
    return ", ".join(texts[name] for name in names)


def _varying(rows, names):
    """Those of some parameters that have several values, or the last one."""
    return [name for name in names if len({row[name] for row in rows}) > 1] or [names[-1]]


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
    case, runs = _runs(data, "engines", scene)
    figure, axes = style.panels(ax, figsize=(style.PAGE, 3.6))
    panel, ends, place = axes[0, 0], [], {"left": 0.62, "right": 0.08, "bottom": 0.4, "top": 0.3}
    for number, (name, rows) in enumerate(runs.items()):
        errors = 100 * np.abs([row["error"] for row in rows])
        times = 1e3 * FRAME * np.array([row["frame_seconds"] / row["dt"] for row in rows])
        good = np.isfinite(errors) & (errors > 0) & np.isfinite(times)
        if not good.any():
            continue
        look = style.line(number)
        panel.plot(times[good], errors[good], **look | {"linestyle": "", "markersize": 2, "alpha": 0.5}, label="_")
        best = np.flatnonzero(good & unbeaten(errors, times))
        best = best[np.argsort(times[best], kind="stable")]
        panel.plot(times[best], errors[best], label=name, **look)
        ends.append((times[best[-1]], errors[best[-1]], name, look["color"]))
    panel.set(**style.LOGARITHMIC, xlabel="Time for 1/60 s of motion [ms]", ylabel="|Error| [%]")
    panel.set_title(case.scene.item())
    said = [f"not drawn: {_lost(runs)}"] if _lost(runs) else []
    if ends:
        said = [*_definition_lines(panel, case), *_real_time(panel), *said]
        style.plain(panel, "x", "y")
    why = "" if ends else f"No run is at rest beside a reference: {_lost(runs)}."
    note = labels.wrapped("; ".join(said), style.size(figure)[0] - 0.7 if figure else style.PAGE)
    labels.finish(figure, axes, place, {panel: (ends, note, why)}, 3.6 if ax is None else 0.0)
    return panel


def _definition_lines(panel, case):
    """Draw the errors of definitions in equilibrium, and say so."""
    known = {name: 100 * abs(float(case.definition_error.sel(definition=name))) for name in case.definition.values}
    known = {name: error for name, error in known.items() if error > 0}  # NaN is not
    for error in known.values():
        _across(panel, error, linestyle=(0, (1, 1.5)))
    said = ", ".join(f"{name} {error:.2g} %" for name, error in known.items())
    return [f"dotted: error of the definition in equilibrium, {said}"] if known else []


def _across(panel, value, **look):
    """Draw a line at a value, as far as the panel goes by now: names of lines stand right of it."""
    limits = panel.get_xlim()
    panel.hlines(value, *limits, color="0.45", linewidth=0.8, zorder=0, **look)
    panel.set_xlim(limits)


def _real_time(panel):
    """Draw where a frame takes as long as it lasts, if that is in sight, and say so."""
    low, high = panel.get_xlim()
    if not low < 1e3 * FRAME < high:
        return []
    panel.axvline(1e3 * FRAME, color="0.7", linewidth=0.9, zorder=0)
    return ["right of the grey line: slower than real time"]


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
    case, runs = _runs(data, "engines", scene)
    shown = {name: rows for name, rows in runs.items()
             if any(RUN_ENDS[row["engine_status"]] not in WITHOUT_RUN for row in rows)}  # fmt: skip
    lost = _lost({name: rows for name, rows in runs.items() if name not in shown})
    ends = set()

    def draw(panel, rows):
        ends.update(_map(panel, rows))

    said = f"{MAP_NUMBERS}; not drawn: {lost}" if lost else MAP_NUMBERS
    most = max((len(_steps(rows)) for rows in shown.values()), default=3)
    texts = {"xlabel": "Iterations", "ylabel": "Frame / substeps", "note": said, "why": f"Nothing was run: {lost}."}
    figure, flat, under = _multiples(ax, case, shown, draw, 0.8 + 0.19 * max(most, 3), 0.36, MAP_KEY, **texts)
    if shown and figure is not None:
        keys = labels.swatches({name: colour for name, colour in END_COLOURS.items() if name in ends})
        figure.legend(handles=keys, loc="lower left", ncols=len(END_COLOURS), borderaxespad=0.2,
                      bbox_to_anchor=(0.0, (under - MAP_KEY) / style.size(figure)[1]), columnspacing=1.2)  # fmt: skip
    return flat


def _multiples(ax, case, shown, draw, height, bottom, key=0.0, *, xlabel, ylabel, note, why, sharey=False):
    """Draw a panel an engine, its note below or why there is none: figure, panels, height of key and note [inch]."""
    columns = min(PANELS_IN_ROW, max(len(shown), 1))
    note = labels.wrapped(note, (style.PAGE if columns > 1 else style.COLUMN) - 0.2) if shown else ""
    under = key + labels.LINE * labels.lines_of(note)
    figure, axes, flat, _ = style.multiples(ax, max(len(shown), 1), columns, height, sharey=sharey, further=under)
    place = {"left": 0.5, "right": 0.08, "bottom": bottom + under, "top": 0.42, "down": 0.62, "across": 0.12}
    style.arrange(figure, axes, **place, title=case.scene.item())
    for number, (panel, (name, rows)) in enumerate(zip(flat, shown.items())):
        draw(panel, rows)
        panel.set(title=name, xlabel=xlabel, ylabel="" if number % axes.shape[1] else ylabel)
    labels.settle(figure, axes, place)
    if not shown:
        labels.say(flat[0], why)
    elif figure is not None:
        wide, high = style.size(figure)
        figure.text(0.08 / wide, 0.04 / high, note, fontsize=style.SMALL, color="0.25", va="bottom")
    return figure, flat, under


def _steps(rows):
    """Precision, frame and substeps of runs, the smallest step first."""
    steps = {tuple(row[name] for name in SETTING[:3]) for row in rows}
    return sorted(steps, key=lambda one: (one[0], one[1] / one[2], one[2]))


def _map(panel, rows):
    """Draw errors of runs at rest with their numbers, and how the others ended, which it returns."""
    steps, counts = _steps(rows), sorted({row["iterations"] for row in rows})
    errors = np.full((len(steps), len(counts)), np.nan)
    ends, texts = np.full(errors.shape, np.nan), np.full(errors.shape, NOT_ASKED, dtype=object)
    names = list(END_COLOURS)
    for row in rows:
        place = steps.index(tuple(row[name] for name in SETTING[:3])), counts.index(row["iterations"])
        end, error = RUN_ENDS[row["engine_status"]], 100 * row["error"]
        texts[place] = ""
        if np.isfinite(error):
            errors[place], times = error, 1 + error / 100
            texts[place] = error_text(error) if error < LARGEST_PERCENT else f"×{times:.{1 if times < 9.95 else 0}f}"
        elif end != "rest":
            ends[place] = names.index(end if end in names else "no run")
    heat_map(panel, errors, texts)
    if not np.isfinite(errors).any():
        panel.text(
            0.5,
            0.5,
            "none at rest",
            transform=panel.transAxes,
            ha="center",
            va="center",
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.5},
        )
    panel.imshow(ends, cmap=ListedColormap([*END_COLOURS.values()]), vmin=-0.5, vmax=len(names) - 0.5, aspect="auto")
    several = len({precision for precision, *_ in steps}) > 1
    panel.set_yticks(
        range(len(steps)),
        [f"{precision + ', ' if several else ''}{_frame(dt)} / {substeps}" for precision, dt, substeps in steps],
    )
    panel.set_xticks(range(len(counts)), map(str, counts))
    return {names[int(end)] for end in ends[np.isfinite(ends)]}


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
    case, runs = _runs(data, "engine_curves", scene)
    shown = {name: rows for name, rows in runs.items() if any(np.isfinite(row["error"]) for row in rows)}
    lost, ends = _lost(runs), {}

    def draw(panel, rows):
        ends[panel] = _curves(panel, rows, float(case.definition_error.sel(definition=rows[0]["definition"])))

    texts = {
        "xlabel": "Factor on what is typed",
        "ylabel": "Displacement / reference",
        "note": f"+: the network in equilibrium{'; not drawn: ' + lost if lost else ''}",
        "why": f"No run of a curve is at rest beside a reference: {lost}.",
    }
    _, flat, _ = _multiples(ax, case, shown, draw, 2.1, 0.42, **texts, sharey=True)
    for panel, found in ends.items():
        labels.name_lines(panel, found)
    return flat


def _curves(panel, rows, definition_error):
    """Draw a line a setting: ends of the lines, named by what tells them apart."""
    lines, names, ends = defaultdict(list), _varying(rows, SETTING), []
    for row in rows:
        lines[_setting(row, names)].append((row["stiffness_factor"], 1 + row["error"]))
    for number, (name, points) in enumerate(lines.items()):
        factors, ratios = np.array(sorted(points)).T
        ends += labels.line(panel, factors, np.where(ratios > 0, ratios, np.nan), style.line(number), name)
    if np.isfinite(definition_error):
        panel.plot([1], [1 + definition_error], "+", color="black", markersize=7, zorder=4)
    panel.set(**style.LOGARITHMIC)
    style.plain(panel, "y")
    every = [row["stiffness_factor"] for row in rows]
    ticks = sorted({min(every), 1.0, max(every)})
    panel.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    panel.set_xticks([], minor=True)
    _across(panel, 1)
    return ends


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
    case, runs = _runs(data, "engine_curves", scene)
    every = [row for rows in runs.values() for row in rows]
    names, lines = [name for name in SETTING[:3] if len({row[name] for row in every}) > 1], defaultdict(dict)
    for name, rows in runs.items():
        for row in rows:
            if np.isfinite(row["best_factor"]):
                lines[", ".join(filter(None, (name, _setting(row, names))))][row["iterations"]] = row["best_factor"]
    figure, axes = style.panels(ax, figsize=(style.COLUMN, 2.6))
    panel, ends, place = axes[0, 0], [], {"left": 0.5, "right": 0.08, "bottom": 0.4, "top": 0.3}
    for number, (name, points) in enumerate(lines.items()):
        counts, factors = np.array(sorted(points.items())).T
        ends += labels.line(panel, counts, factors, style.line(number), name)
    shown = [1.0, *(factor for points in lines.values() for factor in points.values())]
    scale = "log" if max(shown) > NARROW * min(shown) else "linear"
    panel.set(xscale="log", yscale=scale, xlabel="Iterations", ylabel="Best factor on what is typed")
    panel.set_title(case.scene.item())
    style.plain(panel, "x", *(["y"] if scale == "log" else []))
    if ends:
        _across(panel, 1)
    curves = {tuple(row[name] for name in ("engine", "definition", *SETTING)): row["best_factor"] for row in every}
    lost = sum(np.isnan(list(curves.values())))
    without = _lost(runs)
    why = f"None of {len(curves)} curves has a factor at which the displacement is right"
    why = "" if ends else f"{why}; {without}." if without else f"{why}."
    said = f"{lost} of {len(curves)} curves have no such factor" if lost else ""
    labels.finish(figure, axes, place, {panel: (ends, said, why)}, 2.6 if ax is None else 0.0)
    return panel

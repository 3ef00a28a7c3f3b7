"""Figures of the benchmark: error against run time, and how both grow."""

import numpy as np
from matplotlib.ticker import NullLocator

from springtune.problem.compare import unbeaten
from springtune.problem.status import Status

from ...output import labels, style
from ...output.selection import choose, group
from . import BUSY, PARTS
from .outputs import figures

APPROACH_FAMILIES = {
    "springs alone": style.line(1) | {"linestyle": "-"},
    "springs and energies": style.line(0) | {"linestyle": "-"},
    "finite elements": style.line(3) | {"linestyle": "-"},
    "CalculiX": style.line(4) | {"linestyle": "-"},
    "in motion": style.line(2) | {"linestyle": "-"},
    "other": style.line(5) | {"linestyle": "-"},
}
"""Colour and marker of each family of approaches."""

WITH_ENERGIES = ("area", "angular", "delingette", "delingette-tensile", "ielsm", "many-body", "neo-hooke",
                 "normal-shear", "patch-area")  # fmt: skip
SHOWN = ("delingette/structured", "van-gelder/structured", "area/braced", "linear-triangles", "quadratic-triangles",
         "boundary-elements", "tensor-mass", "relaxation", "calculix-cps3", "calculix-cps8")  # fmt: skip
"""Approaches with names before others."""

RING = {"markersize": 7, "markerfacecolor": "none", "markeredgecolor": "black", "markeredgewidth": 0.8}

PART_COLOURS = ("#0b3c5d", "#2879b9", "#7fb8da", "#c8ddf0", "#f2f2f2")
"""Of the parts of run time, and of the rest: lighter from part to part."""


def named(data):
    """Approaches to name: those with an error in `SHOWN`, then as many others as fit, the most accurate first."""
    dimensions = [name for name in data.error.dims if name != "approach"]
    smallest = np.abs(data.error).min(dimensions)
    order = np.argsort(smallest.values)
    there = data.approach.values[order[np.isfinite(smallest.values[order])]].tolist()
    chosen = [name for name in SHOWN if name in there]
    return chosen + [name for name in there if name not in chosen][: len(SHOWN) - len(chosen)]


def family(approach):
    """Family of an approach."""
    definition, slash, _ = approach.partition("/")
    if slash:
        return "springs and energies" if definition in WITH_ENERGIES else "springs alone"
    if approach.startswith("calculix"):
        return "CalculiX"
    if approach.endswith("triangles"):
        return "finite elements"
    return "in motion" if approach in ("relaxation", "backward-euler", "truncated-backward-euler") else "other"


def benchmark(tree):
    """Figures of the benchmark: errors over seconds of each scene; rates; costs, of the first scene; a whole curve."""
    others = {
        "benchmark_rates": plot_benchmark_rates,
        "benchmark_costs": plot_benchmark_costs,
        "benchmark_curve": plot_benchmark_curve,
    }
    for stem, selection in figures(group(tree, "benchmark").scene.values.tolist()).items():
        yield stem, others.get(stem, plot_benchmark), selection


@style.styled
def plot_benchmark(data, ax=None, *, scene=None):
    """Error over run time: a line an approach, over mesh sizes.

    Rings: no other approach that finer meshes and a second beam confirm is both faster and more accurate.

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
    figure, axes = style.panels(ax, figsize=(style.PAGE, 4.0))
    place = dict(left=0.62, right=0.08, bottom=0.8 if lost else 0.62, top=0.3)
    style.arrange(figure, axes, **place)
    panel, shown, there, ends = axes[0, 0], named(case), set(), []
    for ring, approach in zip(rings, map(str, case.approach.values)):
        here, kind = case.sel(approach=approach), family(approach)
        errors, seconds = 100 * np.abs(here.error.values), here.seconds.values
        good, look = np.isfinite(errors * seconds) & (errors > 0), APPROACH_FAMILIES[kind]
        if not good.any():
            continue
        thin = {} if approach in shown else {"linewidth": 0.3, "markersize": 1.5, "alpha": 0.4}
        panel.plot(seconds[good], errors[good], label="_" if kind in there else kind, **look | thin)
        there.add(kind)
        if approach in shown:
            finest = np.flatnonzero(good)[0]
            ends.append((seconds[finest], errors[finest], approach, look["color"]))
        panel.plot(seconds[ring], errors[ring], "o", **RING)
    panel.set(**style.LOGARITHMIC, xlabel="Seconds, from nothing to the displacement", ylabel="|Error| [%]")
    assured = np.isfinite(case.assured_error.values).any()
    panel.set_title(case.scene.item() if assured else f"{case.scene.item()}: no error is confirmed by a second beam")
    if not there:
        labels.say(panel, f"No approach has an error and a time: {_statuses(case)}.")
        return panel
    labels.note(panel, lost, below=0.64)
    estimate, seconds = 100 * float(case.reference_error_estimate), float(case.reference_seconds)
    if estimate > 0 and seconds > 0:
        panel.plot([seconds], [estimate], "*", color="black", markersize=7)
        ends.append((seconds, estimate, "the reference", "black"))
    style.plain(panel, "x", "y")
    labels.settle(figure, axes, place)
    labels.name_lines(panel, ends)
    kinds = [kind for kind in APPROACH_FAMILIES if kind in there]
    handles = [panel.plot([], [], label="_", **APPROACH_FAMILIES[kind])[0] for kind in kinds]
    panel.legend(handles, kinds, loc="upper left", bbox_to_anchor=(-0.02, -0.1), ncols=len(kinds), columnspacing=1.2,
                 handlelength=1.6)  # fmt: skip
    return panel


def _scene(data, scene):
    data = group(data, "benchmark")
    return data.sel(choose(data.scene.notnull(), scene=scene))


def _lost(case):
    """How many cases have no numbers or times and why, in words; empty where all have."""
    flags = case.status.values if "status" in case else np.zeros(0, dtype=int)
    counts = labels.statuses(flags[flags != Status.SOLVED])
    counts[BUSY] = int((case.error.notnull() & case.seconds.isnull()).sum())
    return ", ".join(f"{count} {word}" for word, count in counts.items() if count)


def _statuses(case):
    """As `_lost`, where there is nothing to draw."""
    return _lost(case) or "none was asked for"


def _lines(data, panel, x, y, approaches):
    """Draw a line an approach: their ends, for names with the fitted power."""
    fit, ends = {"unknowns": "cost_exponent", "mesh_size": "error_rate"}[x], []
    for number, approach in enumerate(approaches):
        case = data.sel(approach=approach)
        places, values = case[x].values * (1e3 if x == "mesh_size" else 1), np.abs(case[y].values)
        there = np.isfinite(values) & np.isfinite(places) & (values > 0)
        if not there.any():
            continue
        power, look = float(case[fit]), style.line(number)
        name = f"{approach} ({power:.1f})" if np.isfinite(power) else approach
        places, values = places[there], values[there] * (100 if y == "error" else 1)
        panel.plot(places, values, label=approach, **look)
        last = np.argmax(places)
        ends.append((places[last], values[last], name, look["color"]))
    panel.set(**style.LOGARITHMIC)
    return ends


@style.styled
def plot_benchmark_rates(data, ax=None):
    """Error over mesh size and its fitted order: a row a scene, networks beside other approaches.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/benchmark``.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as panels; by default a new figure.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_scenes, 2) or (n_scenes, 1)
        Of each scene networks, and the others where there are any.

    Raises
    ------
    ValueError
        If the dataset has no benchmark, or ``ax`` is not as many Axes as panels.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_benchmark_rates(tree)
    >>> [panel.get_title(loc="left") for panel in axes[:, 0]]
    ['traction: networks (order)', 'bending: networks (order)']
    >>> axes[0, 0].get_xlabel(), axes[0, 0].get_ylabel()
    ('Mesh size [mm]', '|Error| [%]')
    """
    data = group(data, "benchmark")
    scenes, shown = data.scene.values, named(data)
    sides = {"networks": [name for name in shown if "/" in name], "others": [name for name in shown if "/" not in name]}
    sides = {side: names for side, names in sides.items() if names} or {"networks": []}
    wide = style.PAGE if len(sides) > 1 else style.COLUMN
    size, place = (wide, 0.3 + 2.1 * len(scenes)), {"bottom": 0.52, "top": 0.25, "down": 0.78}
    with labels.arranged(ax, len(scenes), len(sides), figsize=size, **place) as (axes, ends):
        for row, scene in zip(axes, scenes):
            ends.update(_rates(row, data.sel(scene=scene), str(scene), sides))
    return axes


def _rates(row, case, scene, sides):
    """Draw the errors of one scene: ends of lines by panel."""
    shown = [name for names in sides.values() for name in names]
    found = {panel: _lines(case, panel, "mesh_size", "error", names) for panel, names in zip(row, sides.values())}
    values = 100 * np.abs(case.error.sel(approach=shown).values)
    values = values[np.isfinite(values) & (values > 0)]
    estimate = 100 * float(case.reference_error_estimate)
    for (panel, ends), side in zip(found.items(), sides):
        panel.set(xlabel="Mesh size [mm]", ylabel="|Error| [%]", title=f"{scene}: {side} (order)")
        if not ends:
            labels.say(panel, f"No approach has an error: {_statuses(case)}.")
            continue
        low, high = 0.6 * min(values.min(), estimate if estimate > 0 else np.inf), 1.6 * values.max()
        panel.set_ylim(low, high)
        if estimate > 0:
            panel.axhspan(low, estimate, color="0.9", zorder=0)
            labels.note(panel, "grey: within the reference's own error")
        style.plain(panel, "x", "y")
    return found


@style.styled
def plot_benchmark_costs(data, ax=None, *, scene=None):
    """Run time over unknowns and its exponent, and the parts of the run time of the first network that has them.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/benchmark``.
    ax : Figure or sequence of two Axes, optional
        Where to plot; by default a new figure.
    scene : str, optional
        Scene of the benchmark; may be left out where there is one.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (2,)

    Raises
    ------
    ValueError
        If the dataset has no benchmark, or the scene is not there, or left out where there are several, or ``ax`` is
        not two Axes.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_benchmark_costs(tree, scene="traction")
    >>> [panel.get_title(loc="left") for panel in axes]
    ['Run time (exponent from 3000 unknowns on)', 'delingette/structured']
    >>> [panel.get_xlabel() for panel in axes]
    ['Unknowns', 'Mesh size [mm]']
    """
    data = _scene(data, scene)
    shown = named(data)
    with labels.arranged(ax, ncols=2, figsize=(style.PAGE, 2.7), widths=(1.5, 1), bottom=0.4) as (axes, ends):
        left, right = axes[0]
        ends[left] = _costs(left, data, shown)
        ends[right] = _parts(right, data, [name for name in shown if "/" in name])
    return axes[0]


def _costs(left, data, shown):
    """Draw the seconds of approaches over unknowns: ends of the lines."""
    sizes = np.isfinite(data.seconds.sel(approach=shown)).sum("mesh_size").values
    # One size says nothing of growth.
    grown = [name for name, count in zip(shown, sizes) if count > 1] or shown
    ends = _lines(data, left, "unknowns", "seconds", grown)
    left.set(xlabel="Unknowns", ylabel="Seconds", title="Run time (exponent from 3000 unknowns on)")
    if ends:
        style.plain(left, "y")
        left.xaxis.set_minor_locator(NullLocator())
    else:
        labels.say(left, f"No approach was timed: {_statuses(data)}.")
    return ends


def _parts(panel, data, approaches):
    """Shares of the run time of the first of some approaches that has its parts, and of the rest: ends for names."""
    panel.set(xlabel="Mesh size [mm]", ylabel="Share of the seconds [%]", ylim=(0, 100))
    for approach in approaches:
        case = data.sel(approach=approach)
        seconds = np.array([case[f"{name}_seconds"].values for name in PARTS])
        there = np.isfinite(seconds).all(axis=0) & np.isfinite(case.seconds.values)
        if not there.any():
            continue
        seconds = seconds[:, there][:, ::-1]
        # Medians of each part need not add up to the median of all.
        rest = np.maximum(case.seconds.values[there][::-1] - seconds.sum(axis=0), 0.0)
        shares = np.vstack([seconds, rest])
        shares = 100 * shares / shares.sum(axis=0)
        place, bottom, ends = np.arange(there.sum()), np.zeros(there.sum()), []
        for name, share, colour in zip((*PARTS, "the rest"), shares, PART_COLOURS):
            panel.bar(place, share, bottom=bottom, color=colour, edgecolor="0.3", linewidth=0.4, label=name)
            ends.append((place[-1] + 0.42, bottom[-1] + 0.5 * share[-1], name, "0.15"))
            bottom = bottom + share
        panel.set_xlim(-0.6, place[-1] + 0.5)
        panel.set_xticks(place, [f"{1e3 * x:g}" for x in case.mesh_size.values[there][::-1]])
        panel.set_title(approach)
        panel.grid(False)
        return ends
    panel.set_title("Parts of the run time")
    labels.say(panel, "No network of the benchmark was timed in parts.")
    return []


@style.styled
def plot_benchmark_curve(data, ax=None):
    """Seconds of a nonlinear sensitivity curve over its stiffnesses: one path, or solve by solve.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/benchmark``.
    ax : Axes or Figure, optional
        Where to plot; by default a new figure.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    ValueError
        If the dataset has no benchmark.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_benchmark_curve(tree)
    >>> axes.get_title(loc="left")
    'Seconds of a nonlinear sensitivity curve'
    >>> [line.get_label() for line in axes.get_lines()]
    ['solve by solve', 'one path']
    """
    data = group(data, "benchmark")
    with labels.arranged(ax, figsize=(style.COLUMN, 2.2), bottom=0.4) as (axes, ends):
        panel, count, found = axes[0, 0], data.curve_count.values, []
        for number, name, label in ((1, "separate_seconds", "solve by solve"), (0, "curve_seconds", "one path")):
            found += labels.line(panel, count, data[name].values, style.line(number), label)
        panel.set(**style.LOGARITHMIC, xlabel="Stiffnesses on the curve", ylabel="Seconds",
                  title="Seconds of a nonlinear sensitivity curve")  # fmt: skip
        if found:
            style.plain(panel, "x", "y")
        else:
            labels.say(panel, str(np.asarray(data.get("curve_message", ""))) or "The benchmark has timed no curve.")
        ends[panel] = found
    return panel

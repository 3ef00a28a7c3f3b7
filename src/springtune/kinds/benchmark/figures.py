"""Figures of the benchmark: error against run time, and how both grow."""

import numpy as np

from ...output import style
from ...output.selection import choose, group
from ...problem.compare import unbeaten
from .names import PARTS
from .outputs import figures

APPROACH_FAMILIES = {
    "springs alone": "#b5382a",
    "springs and energies": "#14213d",
    "finite elements": "#6a994e",
    "CalculiX": "#e09f3e",
    "in motion": "#8d99ae",
    "other": "#7b2d8b",
}
"""Colour of each family of approaches."""

WITH_ENERGIES = ("area", "angular", "delingette", "delingette-tensile", "patch-area")
SHOWN = ("delingette/structured", "van-gelder/structured", "area/braced", "linear-triangles", "quadratic-triangles",
         "boundary-elements", "tensor-mass", "relaxation", "calculix-cps3", "calculix-cps8")  # fmt: skip
"""Approaches with lines of their own."""


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
    """Figures of the benchmark: errors over seconds of each scene; rates; costs, of the first scene; a whole curve.

    Parameters
    ----------
    tree : xarray.DataTree

    Yields
    ------
    tuple
        Stem, function that plots, and selection.
    """
    others = {
        "benchmark_rates": plot_benchmark_rates,
        "benchmark_costs": plot_benchmark_costs,
        "benchmark_curve": plot_benchmark_curve,
    }
    for stem, selection in figures(group(tree, "benchmark").scene.values.tolist()).items():
        yield stem, others.get(stem, plot_benchmark), selection


@style.styled
def plot_benchmark(data, ax=None, *, scene=None):
    """Error over run time: a line an approach, over mesh sizes; what assures an error soonest is ringed.

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
    'traction: ringed: nothing assures less error in less time'
    >>> axes.get_xscale(), axes.get_ylabel()
    ('log', '|error| [%]')
    """
    case = _scene(data, scene)
    _, ((panel,),) = style.panels(ax, figsize=(8.0, 5.0), layout="constrained")
    labelled, ends = set(), []
    rings = unbeaten(case.assured_error.values, case.seconds.values)
    for ring, approach in zip(rings, map(str, case.approach.values)):
        here = case.sel(approach=approach)
        errors, seconds = 100 * np.abs(here.error.values), here.seconds.values
        good = np.isfinite(errors)
        if not good.any():
            continue
        kind = family(approach)
        shown = approach in SHOWN
        look = {"color": APPROACH_FAMILIES[kind], "linewidth": 1.4 if shown else 0.4, "alpha": 1.0 if shown else 0.35}
        label = None if kind in labelled else kind
        labelled.add(kind)
        panel.plot(seconds[good], errors[good], marker="o", markersize=3 if shown else 1.5, label=label, **look)
        if shown:
            last = np.flatnonzero(good)[0]
            ends.append((seconds[last], errors[last], approach, APPROACH_FAMILIES[kind]))
        panel.plot(seconds[ring], errors[ring], "o", markersize=8, markerfacecolor="none", markeredgecolor="black",
                   markeredgewidth=0.8)  # fmt: skip
    estimate = 100 * float(case.reference_error_estimate)
    panel.plot([float(case.reference_seconds)], [estimate], "*", color="black", markersize=9)
    panel.annotate("the reference", (float(case.reference_seconds), estimate), xytext=(6, -2),
                   textcoords="offset points", fontsize=6.5)  # fmt: skip
    panel.set(**style.LOGARITHMIC, xlabel="seconds, from nothing to the displacement", ylabel="|error| [%]",
              title=f"{case.scene.item()}: ringed: nothing assures less error in less time")  # fmt: skip
    _name_ends(panel, ends)
    panel.legend(loc="lower left", fontsize=7)
    return panel


def _scene(data, scene):
    data = group(data, "benchmark")
    return data.sel(choose(data.scene.notnull(), scene=scene))


def _name_ends(panel, ends):
    """Names of lines in a column to the right, in the order of their ends and no two on each other."""
    low, high = np.log10(panel.get_ylim())
    gap, last = 0.035, np.inf
    for seconds, error, name, colour in sorted(ends, key=lambda end: -end[1]):
        last = min((np.log10(error) - low) / (high - low), last - gap)
        panel.annotate(name, (seconds, error), xytext=(1.01, last), textcoords=panel.transAxes, fontsize=6.5,
                       color=colour, va="center", annotation_clip=False,
                       arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.3})  # fmt: skip


def _lines(data, panel, x, y):
    for number, approach in enumerate(SHOWN):
        if approach not in data.approach.values:
            continue
        case = data.sel(approach=approach)
        there = np.isfinite(case[y].values) & np.isfinite(case[x].values if x in case else case[y].values)
        if there.sum() < 2:
            continue
        fit = {"unknowns": "cost_exponent", "mesh_size": "error_rate"}[x]
        power = float(case[fit])
        label = f"{approach}: {power:.1f}" if np.isfinite(power) else approach
        values = case[x].values[there] * (1e3 if x == "mesh_size" else 1)
        panel.plot(values, np.abs(case[y].values[there]) * (100 if y == "error" else 1), label=label,
                   **style.line(number))  # fmt: skip


@style.styled
def plot_benchmark_rates(data, ax=None):
    """Error over mesh size and its fitted order, a panel a scene, a line an approach.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/benchmark``.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as scenes; by default a new figure.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_scenes,)
        One a scene.

    Raises
    ------
    ValueError
        If the dataset has no benchmark, or ``ax`` is not as many Axes as scenes.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_benchmark_rates(tree)
    >>> [panel.get_title(loc="left") for panel in axes]
    ['traction: approach and order', 'bending: approach and order']
    >>> axes[0].get_xlabel(), axes[0].get_ylabel()
    ('mesh size [mm]', '|error| [%]')
    """
    data = group(data, "benchmark")
    scenes = data.scene.values
    _, (axes,) = style.panels(ax, ncols=len(scenes), figsize=(3.6 * len(scenes), 4.8), layout="constrained")
    for panel, scene in zip(axes, scenes):
        _lines(data.sel(scene=scene), panel, "mesh_size", "error")
        panel.set(**style.LOGARITHMIC, xlabel="mesh size [mm]", title=f"{scene}: approach and order")
        estimate = 100 * float(data.reference_error_estimate.sel(scene=scene))
        panel.axhspan(0, estimate, color="0.93", zorder=0, label="within the reference's own error")
        panel.legend(fontsize=5.5, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.05), columnspacing=0.8)
    axes[0].set_ylabel("|error| [%]")
    return axes


@style.styled
def plot_benchmark_costs(data, ax=None, *, scene=None):
    """Run time over unknowns and its exponent, and the parts of the run time of ``delingette/structured``.

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
    ['Run time; exponents from 3000 on', 'delingette/structured']
    >>> [panel.get_xlabel() for panel in axes]
    ['unknowns', 'mesh size [mm]']
    """
    data = _scene(data, scene)
    _, ((left, right),) = style.panels(ax, ncols=2, figsize=(8.0, 4.0), layout="constrained")
    _lines(data, left, "unknowns", "seconds")
    left.set(**style.LOGARITHMIC, xlabel="unknowns", ylabel="seconds", title="Run time; exponents from 3000 on")
    above = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.06), "columnspacing": 0.8}
    left.legend(fontsize=6, ncols=3, **above)
    if "delingette/structured" in data.approach.values:
        case = data.sel(approach="delingette/structured")
        there = np.isfinite(case.seconds.values)
        size, bottom = np.arange(there.sum()), np.zeros(there.sum())
        for number, name in enumerate(PARTS):
            share = 100 * (case[f"{name}_seconds"] / case.seconds).values[there][::-1]
            right.bar(size, share, bottom=bottom, color=style.line(number)["color"], label=name)
            bottom = bottom + share
        right.set_xticks(size, [f"{1e3 * x:g}" for x in case.mesh_size.values[there][::-1]])
        right.set(xlabel="mesh size [mm]", ylabel="share of the seconds [%]", title="delingette/structured")
        right.legend(fontsize=7, ncols=4, **above)
    return np.array([left, right])


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
    'A nonlinear sensitivity curve, steel in traction'
    >>> [line.get_label() for line in axes.get_lines()]
    ['solve by solve', 'one path']
    """
    data = group(data, "benchmark")
    _, ((panel,),) = style.panels(ax, figsize=(5.0, 3.4), layout="constrained")
    panel.plot(data.curve_count, data.separate_seconds, **style.line(1), label="solve by solve")
    panel.plot(data.curve_count, data.curve_seconds, **style.line(0), label="one path")
    panel.set(**style.LOGARITHMIC, xlabel="stiffnesses on the curve", ylabel="seconds",
              title="A nonlinear sensitivity curve, steel in traction")  # fmt: skip
    panel.legend()
    return panel

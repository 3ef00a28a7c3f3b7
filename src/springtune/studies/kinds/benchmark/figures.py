"""Figures of the benchmark: error against run time, and how both grow."""

import numpy as np

from springtune.problem.compare import unbeaten
from springtune.problem.status import Status

from ...output import labels, style
from ...output.selection import choose, group
from .outputs import figures

APPROACH_FAMILIES = {
    "springs alone": style.line(1) | {"linestyle": "-"},
    "springs and energies": style.line(0) | {"linestyle": "-"},
    "finite elements": style.line(3) | {"linestyle": "-"},
    "CalculiX": style.line(4) | {"linestyle": "-"},
    "other": style.line(5) | {"linestyle": "-"},
}
"""Colour and marker of each family of approaches."""

WITH_ENERGIES = ("area", "angular", "delingette", "delingette-tensile", "ielsm", "many-body", "neo-hooke",
                 "normal-shear", "patch-area")  # fmt: skip
SHOWN = ("delingette/structured", "van-gelder/structured", "area/braced", "linear-triangles", "quadratic-triangles",
         "boundary-elements", "tensor-mass", "calculix-cps3", "calculix-cps8")  # fmt: skip
"""Approaches with names before others."""

RING = {"markersize": 7, "markerfacecolor": "none", "markeredgecolor": "black", "markeredgewidth": 0.8}


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
    return "other"


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
    panel.set_title(case.scene.item())
    if not there:
        labels.say(panel, f"No approach has an error and a time: {_lost(case) or 'none was asked for'}.")
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
    """How many cases have no numbers and why, in words; empty where all have."""
    counts = labels.statuses(case.status.values[case.status.values != Status.SOLVED]) if "status" in case else {}
    return ", ".join(f"{count} {word}" for word, count in counts.items() if count)

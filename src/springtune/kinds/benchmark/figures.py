"""Figures of the benchmark: error against run time, and how both grow."""

import numpy as np

from ...output import style
from ...output.names import benchmark as stems
from ...problem.compare import unbeaten

FAMILIES = {
    # family: (methods by name or definition, colour)
    "springs alone": "#b5382a",
    "springs and energies": "#14213d",
    "finite elements": "#6a994e",
    "CalculiX": "#e09f3e",
    "in motion": "#8d99ae",
    "other": "#7b2d8b",
}
"""Colour of each family of methods."""

WITH_ENERGIES = ("area", "angular", "delingette", "delingette-tensile", "patch-area")
SHOWN = ("delingette/structured", "van-gelder/structured", "area/braced", "linear-triangles", "quadratic-triangles",
         "boundary-elements", "tensor-mass", "relaxation", "calculix-cps3", "calculix-cps8")  # fmt: skip
"""Methods with lines of their own."""

LOGARITHMIC = {"xscale": "log", "yscale": "log"}


def family(method):
    """Family of a method."""
    definition, slash, _ = method.partition("/")
    if slash:
        return "springs and energies" if definition in WITH_ENERGIES else "springs alone"
    if method.startswith("calculix"):
        return "CalculiX"
    if method.endswith("triangles"):
        return "finite elements"
    return "in motion" if method in ("relaxation", "backward-euler", "truncated-backward-euler") else "other"


def draw(tree, folder):
    """Draw the figures of the benchmark.

    Parameters
    ----------
    tree : xarray.DataTree
        With the group ``/benchmark``.
    folder : str or Path

    Returns
    -------
    list of str
        Stems of the files written.
    """
    data = tree["benchmark"].to_dataset()
    for scene in data.scene.values:
        _precision(data.sel(scene=scene), folder, f"benchmark_{scene}")
    _rates(data, folder)
    _costs(data, folder)
    _curve(data, folder)
    return stems([str(scene) for scene in data.scene.values])


def _precision(race, folder, stem):
    """Error over run time: a line a method, over mesh sizes; what assures an error soonest is ringed."""
    with style.figure(folder, stem, figsize=(8.0, 5.0), layout="constrained") as (_, panel):
        labelled, ends = set(), []
        rings = unbeaten(race.assured_error.values, race.seconds.values)
        for ring, method in zip(rings, map(str, race.approach.values)):
            case = race.sel({"approach": method})
            errors, seconds = 100 * np.abs(case.error.values), case.seconds.values
            good = np.isfinite(errors)
            if not good.any():
                continue
            kind = family(method)
            shown = method in SHOWN
            look = {"color": FAMILIES[kind], "linewidth": 1.4 if shown else 0.4, "alpha": 1.0 if shown else 0.35}
            label = None if kind in labelled else kind
            labelled.add(kind)
            panel.plot(seconds[good], errors[good], marker="o", markersize=3 if shown else 1.5, label=label, **look)
            if shown:
                last = np.flatnonzero(good)[0]
                ends.append((seconds[last], errors[last], method, FAMILIES[kind]))
            panel.plot(seconds[ring], errors[ring], "o", markersize=8, markerfacecolor="none", markeredgecolor="black",
                       markeredgewidth=0.8)  # fmt: skip
        estimate = 100 * float(race.reference_error_estimate)
        panel.plot([float(race.reference_seconds)], [estimate], "*", color="black", markersize=9)
        panel.annotate("the reference", (float(race.reference_seconds), estimate), xytext=(6, -2),
                       textcoords="offset points", fontsize=6.5)  # fmt: skip
        panel.set(**LOGARITHMIC, xlabel="seconds, from nothing to the displacement", ylabel="|error| [%]",
                  title=f"{race.scene.item()}: ringed: nothing assures less error in less time")  # fmt: skip
        _name_ends(panel, ends)
        panel.legend(loc="lower left", fontsize=7)


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
    for number, method in enumerate(SHOWN):
        if method not in data.approach.values:
            continue
        case = data.sel({"approach": method})
        there = np.isfinite(case[y].values) & np.isfinite(case[x].values if x in case else case[y].values)
        if there.sum() < 2:
            continue
        fit = {"unknowns": "cost_exponent", "mesh_size": "error_rate"}[x]
        power = float(case[fit])
        label = f"{method}: {power:.1f}" if np.isfinite(power) else method
        values = case[x].values[there] * (1e3 if x == "mesh_size" else 1)
        panel.plot(values, np.abs(case[y].values[there]) * (100 if y == "error" else 1), label=label,
                   **style.line(number))  # fmt: skip


def _rates(data, folder):
    scenes = data.scene.values
    arguments = {"ncols": len(scenes), "squeeze": False, "figsize": (3.6 * len(scenes), 4.8), "layout": "constrained"}
    with style.figure(folder, "benchmark_rates", **arguments) as (_, axes):
        for panel, scene in zip(axes[0], scenes):
            _lines(data.sel(scene=scene), panel, "mesh_size", "error")
            panel.set(**LOGARITHMIC, xlabel="mesh size [mm]", title=f"{scene}: method and order")
            estimate = 100 * float(data.reference_error_estimate.sel(scene=scene))
            panel.axhspan(0, estimate, color="0.93", zorder=0, label="within the reference's own error")
            panel.legend(fontsize=5.5, ncols=2, loc="lower center", bbox_to_anchor=(0.5, 1.05), columnspacing=0.8)
        axes[0, 0].set_ylabel("|error| [%]")


def _costs(data, folder):
    scene = data.isel(scene=0)
    with style.figure(folder, "benchmark_costs", ncols=2, figsize=(8.0, 4.0), layout="constrained") as (_, axes):
        _lines(scene, axes[0], "unknowns", "seconds")
        axes[0].set(**LOGARITHMIC, xlabel="unknowns", ylabel="seconds", title="Run time; exponents from 3000 on")
        above = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.06), "columnspacing": 0.8}
        axes[0].legend(fontsize=6, ncols=3, **above)
        if "delingette/structured" in scene.approach.values:
            case = scene.sel({"approach": "delingette/structured"})
            there = np.isfinite(case.seconds.values)
            size, bottom = np.arange(there.sum()), np.zeros(there.sum())
            for number, part in enumerate(("meshing", "assembling", "factorizing", "solving")):
                share = 100 * (case[f"{part}_seconds"] / case.seconds).values[there][::-1]
                axes[1].bar(size, share, bottom=bottom, color=style.line(number)["color"], label=part)
                bottom = bottom + share
            axes[1].set_xticks(size, [f"{1e3 * x:g}" for x in case.mesh_size.values[there][::-1]])
            axes[1].set(xlabel="mesh size [mm]", ylabel="share of the seconds [%]", title="delingette/structured")
            axes[1].legend(fontsize=7, ncols=4, **above)


def _curve(data, folder):
    with style.figure(folder, "benchmark_curve", figsize=(5.0, 3.4), layout="constrained") as (_, panel):
        panel.plot(data.curve_count, data.separate_seconds, **style.line(1), label="solve by solve")
        panel.plot(data.curve_count, data.curve_seconds, **style.line(0), label="one path")
        panel.set(**LOGARITHMIC, xlabel="stiffnesses on the curve", ylabel="seconds",
                  title="A nonlinear sensitivity curve, steel in traction")  # fmt: skip
        panel.legend()

"""Sensitivity curves: deformation error against uniform stiffness, as in figures 7 and 8 of the paper."""

import numpy as np

from ...output import style
from ...output.names import SENSITIVITY, selections

LIMIT = 60.0
"""Largest error shown [%]."""


def draw(tree, folder):
    """Draw one figure for each beam, mesh type, material and load.

    Parameters
    ----------
    tree : xarray.DataTree
    folder : str or Path

    Returns
    -------
    list of str
        Stems of the files written.
    """
    curves = tree["sensitivity"].to_dataset().sel(kinematics="nonlinear")
    present = (curves.status != 0).any("stiffness_ratio").any("mesh_size").stack(cell=SENSITIVITY)
    cells = [dict(zip(SENSITIVITY, cell)) for cell in present.cell.values[present.values]]
    chosen = selections("sensitivity", SENSITIVITY, cells)
    for stem, selection in chosen.items():
        _draw(curves.sel(selection), tree.to_dataset().sel(selection), selection, folder, stem)
    return list(chosen)


def _draw(curves, root, selection, folder, stem):
    reference = 1e3 * float(root.reference_displacement)
    lowest, highest = np.nanmin(curves.stiffness.values), np.nanmax(curves.stiffness.values)
    unit = 1e6 if highest >= 1e6 else 1.0
    with style.figure(folder, stem, figsize=(5.6, 3.5)) as (drawn, axes):
        drawn.subplots_adjust(left=0.1, right=0.975, bottom=0.135, top=0.85)
        unstable_shown = False
        for number, size in enumerate(curves.mesh_size.values):
            curve = curves.sel(mesh_size=size)
            if not (curve.status != 0).any():
                continue
            look = style.line(number)
            marker = look.pop("marker")
            stiffness, error = curve.stiffness.values, 100 * np.abs(curve.deformation_error.values)
            best, predicted = float(curve.best_stiffness), float(curve.predicted_stiffness)
            stable = curve.status.values == 1
            if np.isfinite(best):
                # The curve's lowest point lies between two of its stiffnesses.
                place = np.searchsorted(stiffness, best)
                stable = np.insert(stable, place, True)
                stiffness, error = np.insert(stiffness, place, best), np.insert(error, place, 0.0)
            stiffness = stiffness / unit
            axes.plot(stiffness, np.where(stable, error, np.nan), label=f"{1e3 * size:g} mm", **look)
            if not stable.all():
                unstable_shown = True
                axes.plot(stiffness, np.where(stable, np.nan, error), color=look["color"], linewidth=0.7)
            axes.plot(best / unit, 0, marker=marker, color=look["color"], clip_on=False, zorder=4)
            axes.plot(
                predicted / unit, 0, marker="|", markersize=13, markeredgewidth=1.6, color=look["color"], clip_on=False
            )
        printed = np.unique(root.paper_stiffness.values[np.isfinite(root.paper_stiffness.values)])
        for value in printed:
            axes.axvline(value / unit, color="0.45", linewidth=0.8, linestyle=(0, (2, 2)), zorder=1)
            place = {"xy": (value / unit, 0.985), "xycoords": ("data", "axes fraction")}
            axes.annotate(
                "paper", **place, xytext=(2, 0), textcoords="offset points", va="top", color="0.35", fontsize=7.5
            )
        axes.plot([], [], marker="o", color="0.3", linestyle="", label="minimum")
        axes.plot([], [], marker="|", markersize=10, markeredgewidth=1.6, color="0.3", linestyle="", label="predicted")
        if unstable_shown:
            axes.plot([], [], color="0.3", linewidth=0.7, label="buckled: equilibrium unstable")
        axes.set(xlim=(lowest / unit, highest / unit), ylim=(0, LIMIT), ylabel="|Deformation error| [%]")
        axes.set_xlabel(f"Uniform spring stiffness [{'' if unit == 1 else '10⁶ '}N/m]")
        axes.legend(loc="upper center", bbox_to_anchor=(0.62, 1.0), ncols=2)
        axes.set_title(
            f"{selection['beam']} mm, {selection['mesh_type']}, {selection['material']}, {selection['load']}\n"
            f"{_force(float(root.force))}, reference {reference:.4g} mm"
        )


def _force(newtons):
    return f"{newtons / 1e3:g} kN" if abs(newtons) >= 1e3 else f"{newtons:g} N"

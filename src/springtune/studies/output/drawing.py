"""Plots of a single scene and of a single curve, in the style of all figures."""

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from . import labels, style

if TYPE_CHECKING:
    from springtune.mesh import Mesh
    from springtune.scene.curve import Curve


LARGEST_SHOWN = 100.0
"""Largest error of a curve in a plot [%]."""


@style.styled
def draw_springs(ax: Axes | None, mesh: "Mesh", displacements: np.ndarray, forces: np.ndarray, title: str) -> Axes:
    """Draw deformed springs coloured by force, and the outline at rest.

    `displacements` has shape (n_points, 2) [m], `forces` (n_edges,) [N].
    """
    _, ((panel,),) = style.panels(ax, figsize=(style.COLUMN, 2.2), layout="constrained")
    largest = float(np.abs(forces).max()) or 1.0
    outline = mesh.points[mesh.edges[mesh.on_outline]]
    panel.add_collection(LineCollection(1e3 * outline, colors="0.6", linewidths=0.7))
    moved = 1e3 * (mesh.points + displacements)[mesh.edges]
    lines = LineCollection(moved, array=forces, cmap="coolwarm", clim=(-largest, largest), linewidths=0.7)
    panel.add_collection(lines)
    panel.figure.colorbar(lines, ax=panel, label="Spring force [N], tension positive", orientation="horizontal",
                          aspect=40)  # fmt: skip
    panel.autoscale()
    panel.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", title=title)
    panel.grid(False)
    return panel


@style.styled
def draw_curve(ax: Axes | None, curve: "Curve") -> Axes:
    """Draw the deformation error over uniform stiffness, and its zero."""
    figure, axes = style.panels(ax, figsize=(style.COLUMN, 2.5))
    place: dict[str, Any] = {"left": 0.5, "right": 0.08, "bottom": 0.66, "top": 0.28}
    style.arrange(figure, axes, **place)
    panel, error = axes[0, 0], 100 * curve.error
    unit, written = labels.power_of_ten(float(curve.stiffness.max()))
    panel.axhline(0.0, color="0.6", linewidth=0.7)
    colour, stiffness = style.line(0)["color"], curve.stiffness / unit
    panel.plot(stiffness, np.where(curve.stable, error, np.nan), color=colour, label="network")
    unstable, said = np.where(curve.stable, np.nan, error), []
    if np.isfinite(unstable).any():
        panel.plot(stiffness, unstable, color=colour, linewidth=0.5, label="not stable")
        said.append("thin: not stable")
    marks = (("dashes", "best", curve.best_stiffness), ("dash-dots", "closed form", curve.predicted_stiffness))
    for number, (dashes, name, value) in enumerate(marks):
        if np.isfinite(value):
            look = style.line(1 + number)
            panel.axvline(value / unit, color=look["color"], linestyle=look["linestyle"], linewidth=0.9, label=name)
            said.append(f"{dashes}: {name}, {value / unit:.4g} {written}N/m")
    panel.set(xlabel=f"Stiffness [{written}N/m]", ylabel="Deformation error [%]", title=curve.title)
    known = error[np.isfinite(error)]
    if len(known):  # a beam that buckled errs by thousands
        panel.set_ylim(
            max(min(1.1 * known.min(), 0.0), -LARGEST_SHOWN), min(max(1.1 * known.max(), 1.0), LARGEST_SHOWN)
        )
    labels.settle(figure, axes, place)
    if not len(known):
        labels.say(panel, curve.message or "There is no reference, and so no error.", bare=False)
    labels.note(panel, "; ".join(said))
    return panel

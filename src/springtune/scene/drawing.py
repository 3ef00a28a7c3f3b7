"""Drawing a result: matplotlib is imported where something is drawn, and no backend is chosen."""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..mesh import Mesh


def axes(ax: "Axes | None" = None) -> "Axes":
    """The axes that are given, or new ones.

    Parameters
    ----------
    ax : matplotlib.axes.Axes, optional

    Returns
    -------
    matplotlib.axes.Axes
    """
    if ax is not None:
        return ax
    from matplotlib import pyplot

    return pyplot.subplots(layout="constrained")[1]


def draw_springs(ax: "Axes | None", mesh: "Mesh", displacements: np.ndarray, forces: np.ndarray) -> "Axes":
    """Draw springs where they have come to, coloured by their force, and the outline at rest.

    Parameters
    ----------
    ax : matplotlib.axes.Axes or None
    mesh : Mesh
    displacements : ndarray of float, shape (n_points, 2)
        [m]
    forces : ndarray of float, shape (n_edges,)
        [N]

    Returns
    -------
    matplotlib.axes.Axes
    """
    from matplotlib.collections import LineCollection

    ax, largest = axes(ax), float(np.abs(forces).max()) or 1.0
    outline = mesh.points[mesh.edges[mesh.on_outline]]
    ax.add_collection(LineCollection(1e3 * outline, colors="0.7", linewidths=0.8))
    moved = 1e3 * (mesh.points + displacements)[mesh.edges]
    lines = LineCollection(moved, array=forces, cmap="coolwarm", clim=(-largest, largest), linewidths=0.8)
    ax.add_collection(lines)
    ax.figure.colorbar(lines, ax=ax, label="spring force [N]", shrink=0.6)
    ax.autoscale()
    ax.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
    return ax

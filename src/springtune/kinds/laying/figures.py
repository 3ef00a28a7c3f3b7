"""Strips laid on a trapezoid, networks over finite elements, as in figure 13 of the paper."""

import numpy as np

from ...output import style
from ...output.selection import cells, choose, group


def laying(tree):
    """The figure of laid strips.

    Parameters
    ----------
    tree : xarray.DataTree

    Yields
    ------
    tuple
        Stem, function that plots, and selection.
    """
    yield "laying", plot_laying, {}


@style.styled
def plot_laying(data, ax=None, *, loading=None, friction=None):
    """Strips laid on a trapezoid: a panel a loading and friction, the finest mesh of each definition.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/laying``.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as panels; by default a new figure.
    loading : str, optional
        One loading in place of all.
    friction : float, optional
        One coefficient of friction [1] in place of all.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_panels,)
        One a panel.

    Raises
    ------
    ValueError
        If the dataset has no laid strips, or nothing has the loading or friction, or ``ax`` is not as many Axes as
        panels.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_laying(tree, friction=0.0)
    >>> [panel.get_title(loc="left") for panel in axes]
    ['gravity', 'pressure']
    """
    laid = group(data, "laying")
    for name, label in {"loading": loading, "friction": friction}.items():
        if label is not None:
            choose(laid.status != 0, **{name: label})
            laid = laid.sel({name: [label]})
    shown = cells(laid.status != 0, ("loading", "friction"))
    figure, axes = style.panels(ax, nrows=len(shown), figsize=(8.0, 0.6 + 2.5 * len(shown)))
    axes = axes[:, 0]
    for panel, cell in zip(axes, shown):
        _panel(panel, laid.sel(cell), cell)
    style.arrange(figure, left=0.56, right=0.08, bottom=0.45, top=0.35, hspace=0.5)
    return axes


def _panel(panel, laid, cell):
    corners = 1e3 * np.stack([laid.trapezoid_x.values, laid.trapezoid_y.values], axis=1)
    panel.fill(*corners.T, facecolor="0.9", edgecolor="0.45", linewidth=1.0)
    panel.axhline(0, color="0.45", linewidth=1.0)
    reference = 1e3 * np.stack([laid.reference_x.values, laid.reference_y.values], axis=1)
    reference = reference[np.isfinite(reference[:, 0])]
    if len(reference):
        known = 100 * float(laid.reference_elongation_error_estimate)
        known = f" ± {known:.2f}" if np.isfinite(known) else ", error unknown,"
        text = f"finite elements: elongation {100 * float(laid.reference_elongation):.2f}{known} %"
        panel.fill(*reference.T, facecolor="0.75", edgecolor="none", label=text)
    for number, definition in enumerate(laid.definition.values):
        strips = laid.sel(definition=definition)
        solved = np.flatnonzero(strips.status.values == 1)
        if not len(solved):
            continue
        strip = strips.isel(mesh_size=solved[0])
        points = 1e3 * np.stack([strip.strip_x.values, strip.strip_y.values], axis=1)
        points = points[np.isfinite(points[:, 0])]
        look = style.line(number) | {"marker": "", "linewidth": 1.0}
        text = f"{definition}, {1e3 * float(strip.mesh_size):g} mm: area {100 * float(strip.area_error):+.2f} %, "
        text += f"elongation {100 * float(strip.elongation):.2f} %"
        panel.plot(*np.vstack([points, points[:1]]).T, label=text, **look)
    friction = f", friction {cell['friction']:g}" if cell["friction"] else ""
    panel.set_title(f"{cell['loading']}{friction}")
    panel.set(aspect="equal", adjustable="datalim", xlabel="x [mm]", ylabel="y [mm]")
    panel.legend(loc="upper right", fontsize=6.2)
    panel.set_ylim(-2, 24)

"""Strips laid on a trapezoid, networks over finite elements, as in figure 13 of the paper."""

import numpy as np

from ...output import style


def draw(tree, folder):
    """Draw the figure ``laying``: one panel a loading and friction, the finest mesh of each definition.

    Parameters
    ----------
    tree : xarray.DataTree
        With the group ``/laying``.
    folder : str or Path

    Returns
    -------
    list of str
        Stems of the files written.
    """
    laid = tree["laying"].to_dataset()
    cells = [
        {"loading": loading, "friction": friction}
        for loading in laid.loading.values
        for friction in laid.friction.values
        if (laid.status.sel(loading=loading, friction=friction) != 0).any()
    ]
    arguments = {"nrows": len(cells), "squeeze": False, "figsize": (8.0, 0.6 + 2.5 * len(cells))}
    with style.figure(folder, "laying", **arguments) as (drawn, axes):
        for panel, cell in zip(axes[:, 0], cells):
            _panel(panel, laid.sel(cell), cell)
        height = drawn.get_size_inches()[1]
        drawn.subplots_adjust(left=0.07, right=0.99, bottom=0.45 / height, top=1 - 0.35 / height, hspace=0.5)
    return ["laying"]


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

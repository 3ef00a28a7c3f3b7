"""Strips laid on a trapezoid: their shape, and area and elongation of each network beside finite elements."""

import numpy as np

from springtune.safe_io import no_mathematics

from ...output import style
from ...output.answers import count_statuses
from ...output.dataset import cells, choose, group, labels_of, table_rows


def laying(tree):
    """Yield the figure of laid strips."""
    yield "laying", plot_laying, {}


@style.styled
def plot_laying(data, ax=None, *, loading=None, friction=None):
    """Strips laid on a trapezoid: shape, area error and elongation, one row per loading and friction.

    Networks look alike, so only one shape is drawn.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/laying``.
    ax : Figure or sequence of Axes, optional
    loading : str, optional
        Show this loading only.
    friction : float, optional
        Show this coefficient of friction [1] only.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_rows, 3)

    Raises
    ------
    ValueError
        If the dataset has no laid strips, or not the loading or friction, or ``ax`` is not three Axes per row.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_laying(tree, friction=0.0)
    >>> [panel.get_title(loc="left") for panel in axes[:, 0]]
    ['gravity', 'pressure']
    """
    laid = group(data, "laying")
    for name, label in {"loading": loading, "friction": friction}.items():
        if label is not None:
            choose(laid.status != 0, **{name: label})
            laid = laid.sel({name: [label]})
    shown = cells(laid.status != 0, ("loading", "friction"))
    names = labels_of(laid.status != 0, "definition")
    size = (style.PAGE_WIDTH, (1.05 + 0.16 * max(len(names), 4)) * len(shown))
    _, axes = style.panels(ax, len(shown), 3, figsize=size, width_ratios=[1.9, 1.0, 1.0])
    for panels, cell in zip(axes, shown):
        _draw_row(*panels, laid.sel(cell), cell, names)
    return axes


def _draw_row(shape, area, elongation, laid, cell, names):
    friction = f", friction {cell['friction']:g}" if cell["friction"] else ""
    style.add_note(shape, [_draw_shape(shape, laid)])
    shape.set(title=f"{cell['loading']}{friction}", xlabel="x [mm]", ylabel="y [mm]")
    shape.set(aspect="equal", adjustable="datalim")
    known, reference = 100 * float(laid.reference_elongation_error_estimate), 100 * float(laid.reference_elongation)
    if np.isfinite(reference):
        found = ", error unknown"
        if np.isfinite(known):
            elongation.axvspan(reference - known, reference + known, color="0.87", zorder=0)
            found = f" ± {known:.2g}"
        elongation.axvline(reference, color="0.45", linewidth=1.5)
        style.add_note(elongation, [f"grey: finite elements {reference:.2f}{found} %".replace("-", "−")])
    area.axvline(0, color="0.45", linewidth=1.5)
    _draw_dots(area, laid, names, "area_error")
    _draw_dots(elongation, laid, names, "elongation")
    area.set(xlabel="Error [%]", title="Area below the strip")
    elongation.set(xlabel="Elongation [%]", title="Lower fibre")
    elongation.tick_params(labelleft=False)
    if ((laid.status == 1).sum("mesh_size") > 1).any():
        style.add_note(area, ["filled: finest mesh; hollow: coarser"])


def _outline_points(laid, name):
    """Points of an outline [mm], shape (n, 2)."""
    points = 1e3 * np.stack([laid[f"{name}_{axis}"].values for axis in "xy"], axis=1)
    return points[np.isfinite(points[:, 0])]


def _draw_shape(panel, laid):
    """Draw trapezoid, reference and the finest solved network; return a note that names them."""
    panel.fill(*_outline_points(laid, "trapezoid").T, facecolor="0.93", edgecolor="0.45", linewidth=0.8)
    panel.axhline(0, color="0.45", linewidth=0.8)
    reference, note = _outline_points(laid, "reference"), "no reference"
    if len(reference):
        panel.fill(*reference.T, facecolor="0.72", edgecolor="none")
        note = "grey: finite elements"
    for cell in cells(laid.status == 1, ("definition", "mesh_size"))[:1]:
        points = _outline_points(laid.sel(cell), "strip")
        panel.plot(*np.vstack([points, points[:1]]).T, color=style.line(1)["color"], linewidth=0.9)
        return f"{note}; line: {cell['definition']}, {1e3 * cell['mesh_size']:g} mm"
    return f"{note}; no network was solved"


def _draw_dots(panel, laid, names, variable):
    """Draw a dot for each definition and mesh size, the finest filled; write the status if none is solved."""
    for number, definition in enumerate(names):
        strips, look = laid.sel(definition=definition), style.line(number)
        solved = np.flatnonzero(strips.status.values == 1)
        values = 100 * strips[variable].values
        mark = {"linestyle": "", "marker": look["marker"], "color": look["color"]}
        panel.plot(values[solved[1:]], np.full(len(solved[1:]), number), markerfacecolor="white", **mark)
        panel.plot(values[solved[:1]], np.full(len(solved[:1]), number), markersize=4.5, label=definition, **mark)
        if not len(solved):
            reason = ", ".join(count_statuses(strips.status.values)) or "not requested"
            panel.text(0.5, number, reason, transform=panel.get_yaxis_transform(), ha="center", va="center",
                       fontsize=style.SMALL_TEXT, color="0.25")  # fmt: skip
    panel.set_yticks(range(len(names)), map(no_mathematics, names))
    panel.set_ylim(len(names) - 0.4, -0.6)
    panel.margins(x=0.12)


# -- tables ------------------------------------------------------------------------------------------------------------

LAYING_COLUMNS = {"mesh_size_mm": ("mesh_size", 1e3), "area_mm2": ("area_under_strip", 1e6)}
LAYING_COLUMNS |= {f"{name}_percent": (name, 100) for name in ("area_error", "elongation", "reference_elongation")}
LAYING_COLUMNS |= {"reference_elongation_known_to_points": ("reference_elongation_error_estimate", 100)}
LAYING_COLUMNS |= {"penetration_per_mesh_size": ("penetration", 1)}
"""Columns of the table: variable and factor."""


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.bodies.tables.tables`."""
    laid = tree["laying"].to_dataset()
    present = laid.area_under_strip.notnull().transpose("loading", "friction", "mesh_size", "definition")
    rows = table_rows(laid, present, ("loading", "friction", "definition"), LAYING_COLUMNS)
    note = (
        "Area between strip and floor, and elongation of the strip's lower fibre. The reference elongation has an "
        "error band of twice the spread of three meshes: corners of the trapezoid catch between particles of the strip "
        "at places that depend on the mesh. Networks scatter as much."
    )
    return [{"stem": "laying", "title": "Laid strips", "note": note, "rows": rows}]

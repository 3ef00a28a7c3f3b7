"""The figure of refinements: errors over the parameter, with the values that were added, and where they matter."""

import numpy as np

from springtune.problem.status import Status

from ...output import labels, style
from ...output.drawing import fitted
from ...output.selection import choose, group, sign_of_errors
from .outputs import SPACINGS, VARIED

HOLLOW = "hollow: unstable, or beyond the linear reference"


def refinement(tree):
    """The figure of refinements."""
    yield "refinement", plot_refinement, {}


@style.styled
def plot_refinement(data, ax=None, *, refinement=None):
    """Deformation error over what is varied: a panel a refinement, a line a definition, a marker a value.

    Hollow markers show networks that are not stable or deform too far for the reference. The grey band is the
    tolerance; ticks on the zero line show where the error is zero.

    Parameters
    ----------
    data : xarray.DataTree or xarray.Dataset
        A study's dataset, or its group ``/refinement``.
    ax : Figure or sequence of Axes, optional
        Where to plot: as many Axes as refinements; by default a new figure.
    refinement : str, optional
        One refinement in place of all.

    Returns
    -------
    ndarray of matplotlib.axes.Axes, shape (n_refinements,)
        One a refinement.

    Raises
    ------
    ValueError
        If the dataset has no refinements, or none of that name, or ``ax`` is not as many Axes.

    Examples
    --------
    >>> import springtune as st  # tree = st.open("results/mine")
    >>> axes = st.plot_refinement(tree)
    >>> [panel.get_title(loc="left") for panel in axes]
    ['size', 'thick']
    """
    data = group(data, "refinement")
    if refinement is not None:
        choose(data.status != 0, refinement=refinement)
        data = data.sel(refinement=[refinement])
    names = data.refinement.values.tolist()
    figure, axes, flat, _ = style.multiples(ax, len(names), min(2, len(names)), 2.6)
    place = {"left": 0.6, "right": 0.1, "bottom": 0.7, "top": 0.55, "across": 0.14, "down": 1.15}
    style.arrange(figure, axes, **place)
    ends = [_panel(panel, data.sel(refinement=name)) for panel, name in zip(flat, names)]
    labels.settle(figure, axes, place)
    for panel, name, (found, said) in zip(flat, names, ends):
        labels.note(panel, said)
        _entitle(panel, name, fitted(panel, [str(data.scene.sel(refinement=name).item())]))
        if found:
            labels.name_lines(panel, found)
        else:
            labels.say(panel, "No value has an error: see status and message.")
    return flat


def _entitle(panel, name, scene):
    """Name of a refinement, and below it in smaller letters what is not varied."""
    panel.annotate(scene, (0, 1), xycoords="axes fraction", xytext=(0, 3), textcoords="offset points",
                   va="bottom", ha="left", fontsize=labels.SMALL, color="0.25")  # fmt: skip
    panel.set_title(name, pad=4 + 1.3 * labels.SMALL * labels.lines_of(scene))


def _panel(panel, data):
    """Draw one refinement; ends of its lines with their names and colours, and a note."""
    parameter = str(data.parameter.item())
    known, tolerance = VARIED[parameter], 100 * float(data.tolerance)
    panel.axhspan(-tolerance, tolerance, color="0.92", zorder=0)
    panel.axhline(0, color="0.45", linewidth=0.8)
    values, logarithmic = data[f"refined_{parameter}"].values, str(data.spacing.item()) == SPACINGS[1]
    values = values[np.isfinite(values)]
    # On a logarithmic axis the unit is that of the middle: ticks at both ends are short then.
    middle = np.sqrt(values.min() * values.max()) if logarithmic and values.size else values.max(initial=0.0)
    name, size = known.scale(middle)
    unit = f" [{name}]" if name else ""
    panel.set(xlabel=f"{known.meaning[0].upper()}{known.meaning[1:]}{unit}", ylabel="Deformation error [%]")
    if logarithmic:
        panel.set_xscale("log")
    ends, hollow, ticked = [], False, False
    data = data.isel(definition=np.flatnonzero(data.value_count))
    for number, definition in enumerate(data.definition.values.tolist()):
        cell = data.sel(definition=definition)
        cell = cell.isel(point=np.argsort(cell[f"refined_{parameter}"].values, kind="stable"))
        x, y = cell[f"refined_{parameter}"].values / size, 100 * cell.deformation_error.values
        there, look = np.isfinite(x) & np.isfinite(y), style.line(number)
        small = look | {"markersize": 2.2, "linewidth": 0.9}
        ends += labels.line(panel, x[there], y[there], small, definition)
        doubted = there & ((cell.status.values != Status.SOLVED) | (cell.reference_applies.values == 0))
        hollow |= bool(doubted.any())
        panel.plot(x[doubted], y[doubted], **small | {"markerfacecolor": "white", "linestyle": ""})
        zeros = cell[f"crossing_{parameter}"].values[cell.crossing_level.values == 0] / size
        ticked |= bool(len(zeros))
        panel.plot(zeros, np.zeros(len(zeros)), "|", color=look["color"], markersize=9)
    if logarithmic:
        style.plain(panel, "x")
    said = [sign_of_errors(data), f"grey: within the tolerance, {tolerance:g} %"]
    said += ["ticks: zeros" * ticked, HOLLOW * hollow]
    return ends, "; ".join(filter(None, said))

"""One style for all figures: readable in grey, at the width of a text column."""

from collections.abc import Callable
from functools import wraps
from typing import Any, Literal, ParamSpec, TypeVar

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

P = ParamSpec("P")
Drawn = TypeVar("Drawn")

SETTINGS: dict[Any, object] = {
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.labelsize": 9,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 9.5,
    "axes.titley": 1.0,  # without a look at what stands on top of the axes, which takes a tenth of drawing
    "figure.dpi": 100,
    "figure.titlesize": 10,
    "font.size": 9,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "lines.markersize": 5,
    "pdf.fonttype": 3,  # type 42 cuts fonts to size, in half of the time of a figure
    "savefig.dpi": 150,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
}

# Of falling darkness, each with its own dashes and marker: the order survives a grey print.
LINES: tuple[dict[str, Any], ...] = (
    {"color": "#14213d", "linestyle": "-", "marker": "o"},
    {"color": "#b5382a", "linestyle": "--", "marker": "s"},
    {"color": "#e09f3e", "linestyle": "-.", "marker": "D"},
    {"color": "#6a994e", "linestyle": ":", "marker": "^"},
    {"color": "#8d99ae", "linestyle": (0, (6, 2, 1, 2, 1, 2)), "marker": "v"},
)

LOGARITHMIC = {"xscale": "log", "yscale": "log"}


def line(number: int) -> dict[str, Any]:
    """Colour, dashes and marker of the line of that number; beyond the fifth, colours come back with other markers."""
    turn, colour = divmod(number, len(LINES))
    return {"color": LINES[colour]["color"]} | {
        key: LINES[(colour + 2 * turn) % len(LINES)][key] for key in ("linestyle", "marker")
    }


def styled(plot: Callable[P, Drawn]) -> Callable[P, Drawn]:
    """Decorator: a function that plots in `SETTINGS`, which are put back after it."""

    @wraps(plot)
    def inside(*arguments: P.args, **keywords: P.kwargs) -> Drawn:
        with matplotlib.rc_context(SETTINGS):
            return plot(*arguments, **keywords)

    return inside


def panels(
    ax: Figure | SubFigure | Axes | np.ndarray | None,
    nrows: int = 1,
    ncols: int = 1,
    *,
    figsize: tuple[float, float],
    layout: Literal["constrained", "compressed", "tight"] | None = None,
    sharex: bool = False,
    sharey: bool = False,
) -> tuple[Figure | SubFigure | None, np.ndarray]:
    """Axes to plot on, and the figure where that is to be arranged.

    Parameters
    ----------
    ax : None, matplotlib Figure, Axes or array of Axes
        None makes a figure, by pyplot, so that a notebook shows it. A figure is filled. Axes are taken as they are.
    nrows, ncols : int
        Panels of the plot.
    figsize : tuple of float
        Width and height of a figure that is made [inch].
    layout : str, optional
        Layout engine of a figure that is made.
    sharex, sharey : bool, optional
        Whether the panels of a figure share their axes.

    Returns
    -------
    figure : Figure, SubFigure or None
        None where Axes were given: their figure is their owner's to arrange.
    axes : (nrows, ncols) ndarray of Axes

    Raises
    ------
    ValueError
        If Axes were given and they are not as many as the panels.
    """
    if ax is None:
        # Here, since pyplot chooses a backend: who only imports, or plots on axes that are there, chooses none.
        import matplotlib.pyplot as plt

        ax = plt.figure(figsize=figsize, layout=layout)
    if isinstance(ax, Figure | SubFigure):
        return ax, ax.subplots(nrows, ncols, squeeze=False, sharex=sharex, sharey=sharey)
    given = np.asarray(ax, dtype=object)
    if given.size != nrows * ncols:
        raise ValueError(f"the plot has {nrows} x {ncols} panels, ax has {given.size} Axes")
    return None, given.reshape(nrows, ncols)


def size(figure: Figure | SubFigure) -> tuple[float, float]:
    """Width and height of a figure, or of a part of one [inch]."""
    box = figure.bbox.transformed(figure.dpi_scale_trans.inverted())
    return box.width, box.height


def arrange(
    figure: Figure | SubFigure | None,
    *,
    left: float,
    right: float,
    bottom: float,
    top: float,
    wspace: float | None = None,
    hspace: float | None = None,
    title: str | None = None,
) -> None:
    """Margins of a figure [inch] and the title above its panels, at the upper left."""
    if figure is None:
        return
    width, height = size(figure)
    margins = {"left": left / width, "right": 1 - right / width, "bottom": bottom / height, "top": 1 - top / height}
    figure.subplots_adjust(**margins, wspace=wspace, hspace=hspace)
    if title:
        figure.suptitle(title, x=0.01, y=1 - 0.06 / height, va="top", ha="left")

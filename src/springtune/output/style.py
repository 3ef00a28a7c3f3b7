"""One style for all figures: readable in grey, at the width of a text column."""

from functools import wraps

import matplotlib
import numpy as np
from matplotlib.figure import FigureBase

SETTINGS = {
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
LINES = (
    {"color": "#14213d", "linestyle": "-", "marker": "o"},
    {"color": "#b5382a", "linestyle": "--", "marker": "s"},
    {"color": "#e09f3e", "linestyle": "-.", "marker": "D"},
    {"color": "#6a994e", "linestyle": ":", "marker": "^"},
    {"color": "#8d99ae", "linestyle": (0, (6, 2, 1, 2, 1, 2)), "marker": "v"},
)

LOGARITHMIC = {"xscale": "log", "yscale": "log"}


def line(number):
    """Colour, dashes and marker of the line of that number; beyond the fifth, colours come back with other markers."""
    turn, colour = divmod(number, len(LINES))
    return {"color": LINES[colour]["color"]} | {
        key: LINES[(colour + 2 * turn) % len(LINES)][key] for key in ("linestyle", "marker")
    }


def styled(plot):
    """Decorator: a function that plots in `SETTINGS`, which are put back after it."""

    @wraps(plot)
    def inside(*arguments, **keywords):
        with matplotlib.rc_context(SETTINGS):
            return plot(*arguments, **keywords)

    return inside


def panels(ax, nrows=1, ncols=1, *, figsize, layout=None, **shared):
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
    **shared
        ``sharex`` and ``sharey`` of the panels of a figure.

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
    if isinstance(ax, FigureBase):
        return ax, ax.subplots(nrows, ncols, squeeze=False, **shared)
    given = np.asarray(ax, dtype=object)
    if given.size != nrows * ncols:
        raise ValueError(f"the plot has {nrows} x {ncols} panels, ax has {given.size} Axes")
    return None, given.reshape(nrows, ncols)


def size(figure):
    """Width and height of a figure, or of a part of one [inch]."""
    box = figure.bbox.transformed(figure.dpi_scale_trans.inverted())
    return box.width, box.height


def arrange(figure, *, left, right, bottom, top, wspace=None, hspace=None, title=None):
    """Margins of a figure [inch] and the title above its panels, at the upper left."""
    if figure is None:
        return
    width, height = size(figure)
    margins = {"left": left / width, "right": 1 - right / width, "bottom": bottom / height, "top": 1 - top / height}
    figure.subplots_adjust(**margins, wspace=wspace, hspace=hspace)
    if title:
        figure.suptitle(title, x=0.01, y=1 - 0.06 / height, va="top", ha="left")

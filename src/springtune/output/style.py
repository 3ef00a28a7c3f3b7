"""One style for all figures: readable in grey, at the width of a text column."""

from contextlib import contextmanager
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402  the backend comes first

from .names import FORMATS  # noqa: E402

SETTINGS = {
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.labelsize": 9,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlelocation": "left",
    "axes.titlesize": 9.5,
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


def line(number):
    """Colour, dashes and marker of the line of that number; beyond the fifth, colours come back with other markers."""
    turn, colour = divmod(number, len(LINES))
    return {"color": LINES[colour]["color"]} | {
        key: LINES[(colour + 2 * turn) % len(LINES)][key] for key in ("linestyle", "marker")
    }


@contextmanager
def figure(folder, stem, **arguments):
    """Axes of a new figure in the style; written to every format on leaving, then closed.

    Parameters
    ----------
    folder : str or Path
    stem : str
        File name without ending.
    **arguments
        For `matplotlib.pyplot.subplots`.
    """
    with matplotlib.rc_context(SETTINGS):
        drawn, axes = plt.subplots(**arguments)
        try:
            yield drawn, axes
            for ending in FORMATS:
                # Without a date in it the same figure is the same file.
                metadata = {"CreationDate": None} if ending == "pdf" else {"Software": None}
                drawn.savefig(Path(folder) / f"{stem}.{ending}", metadata=metadata)
        finally:
            plt.close(drawn)

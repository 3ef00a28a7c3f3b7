"""One style for all figures, readable in grey at a journal's column or page width, and their files."""

import io
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any, Literal, ParamSpec, TypeVar

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.text import Text
from matplotlib.ticker import FuncFormatter, NullLocator

P = ParamSpec("P")
Drawn = TypeVar("Drawn")

COLUMN_WIDTH = 3.5
"""Width of a column of a journal with two [inch]."""

PAGE_WIDTH = 7.16
"""Width of its page [inch]."""

METRES_PER_INCH = 0.0254

POINTS_PER_INCH = 72
"""Points in an inch, the units of a PDF page."""

SETTINGS: dict[Any, Any] = dict(
    matplotlib.rc_params_from_file(Path(__file__).with_suffix(".mplstyle"), use_default_template=False)
)
"""Settings of matplotlib."""

PIXELS_PER_INCH = SETTINGS["savefig.dpi"]
"""Pixels in an inch of a PNG file."""

SMALL_TEXT = SETTINGS["legend.fontsize"]
"""Size of the smallest text of a figure [pt], which journals still take at these widths."""

TEXT_SIZES = ("axes.labelsize", "axes.titlesize", "figure.titlesize", "font.size", "legend.fontsize", "xtick.labelsize",
              "ytick.labelsize")  # fmt: skip
"""Settings that follow the size of text."""


def choose(width: float | None = None, font_size: float | None = None) -> None:
    """Choose the width of a column [m] and the size of text [pt] of all figures of this process."""
    global COLUMN_WIDTH, PAGE_WIDTH, SMALL_TEXT
    if width:
        wide = width / METRES_PER_INCH
        COLUMN_WIDTH, PAGE_WIDTH = wide, wide / COLUMN_WIDTH * PAGE_WIDTH
    if font_size:
        larger = font_size / SETTINGS["font.size"]
        SMALL_TEXT *= larger
        SETTINGS.update({name: larger * SETTINGS[name] for name in TEXT_SIZES})


def settings() -> dict[Any, Any]:
    """`SETTINGS` without those that the user's rcParams change; texts follow a size of theirs."""
    ours, usual = matplotlib.rcParams, matplotlib.rcParamsDefault
    kept = {name: value for name, value in SETTINGS.items() if ours[name] == usual[name]}
    larger = 1.0 if "font.size" in kept else ours["font.size"] / SETTINGS["font.size"]
    return kept | {name: larger * kept[name] for name in TEXT_SIZES if name in kept}


# Okabe and Ito's colours (https://jfly.uni-koeln.de/color), which the colour-blind tell apart; dashes and markers tell
# lines apart in grey.
LINE_STYLES: tuple[dict[str, Any], ...] = (
    {"color": "#000000", "linestyle": "-", "marker": "o"},
    {"color": "#d55e00", "linestyle": (0, (5, 1.6)), "marker": "s"},
    {"color": "#0072b2", "linestyle": (0, (6, 1.5, 1.2, 1.5)), "marker": "D"},
    {"color": "#009e73", "linestyle": (0, (1.4, 1.4)), "marker": "^"},
    {"color": "#e69f00", "linestyle": (0, (8, 2)), "marker": "v"},
    {"color": "#aa4488", "linestyle": (0, (3, 1.4, 1.2, 1.4, 1.2, 1.4)), "marker": "P"},
)

LOGARITHMIC = {"xscale": "log", "yscale": "log"}


def line(number: int) -> dict[str, Any]:
    """Colour, dashes and marker of a line by its number; colours repeat with other markers."""
    turn, colour = divmod(number, len(LINE_STYLES))
    return LINE_STYLES[(colour + 2 * turn) % len(LINE_STYLES)] | {"color": LINE_STYLES[colour]["color"]}


def plain(panel: Axes, *axes: Literal["x", "y"]) -> None:
    """Numbers such as 0.5, 2 and 300 in place of powers on a logarithmic axis."""
    for name in axes:
        chosen, (low, high) = getattr(panel, f"{name}axis"), sorted(getattr(panel, f"get_{name}lim")())
        chosen.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        if low <= 0 or high / low > 150:
            chosen.set_minor_locator(NullLocator())
            continue
        kept = "25" if high / low > 5 else "235" if high / low > 3 else "2345678"
        chosen.set_minor_formatter(
            FuncFormatter(lambda value, _, kept=kept: f"{value:g}" if f"{value:e}"[0] in kept else "")
        )


def styled(plot: Callable[P, Drawn]) -> Callable[P, Drawn]:
    """Decorator that runs a plot function with `settings` and restores them."""

    @wraps(plot)
    def inside(*arguments: P.args, **keywords: P.kwargs) -> Drawn:
        with matplotlib.rc_context(settings()):
            drawn = plot(*arguments, **keywords)
            interactive = matplotlib.is_interactive()
        matplotlib.interactive(interactive)  # a notebook's backend sets it, when pyplot is imported by a first plot
        for panel in np.ravel(np.asarray(drawn, dtype=object)):
            _show_texts_verbatim(panel)
        return drawn

    return inside


def _show_texts_verbatim(panel: Axes) -> None:
    """Show texts verbatim: no formulas between $ signs, no ligatures. Powers of ten beside ticks stay formulas."""
    legend = panel.get_legend()
    found = [panel.xaxis.label, panel.yaxis.label, *panel.get_children(), *panel.figure.get_children()]
    for one in (*found, *(legend.get_texts() if legend else ())):
        if isinstance(one, Text):
            one.set_parse_math(False)
            if hasattr(one, "set_fontfeatures"):  # since matplotlib 3.11: a ligature embeds a PDF's font twice
                one.set_fontfeatures(["-liga"])


def panels(
    ax: Figure | SubFigure | Axes | np.ndarray | None,
    nrows: int = 1,
    ncols: int = 1,
    *,
    figsize: tuple[float, float],
    **subplots: Any,
) -> tuple[Figure | SubFigure | None, np.ndarray]:
    """Return the figure to arrange, if any, and axes of shape (nrows, ncols)."""
    if ax is None:
        # Here, since pyplot chooses a backend: who only imports, or plots on axes that are there, chooses none.
        import matplotlib.pyplot as plt

        ax = plt.figure(figsize=figsize)
    if isinstance(ax, Figure) and ax.get_layout_engine() is None:
        ax.set_layout_engine("constrained", wspace=0.02, hspace=0.04)
    if isinstance(ax, Figure | SubFigure):
        return ax, ax.subplots(nrows, ncols, squeeze=False, **subplots)
    given = np.asarray(ax, dtype=object)
    if given.size != nrows * ncols:
        raise ValueError(f"the plot has {nrows} x {ncols} panels, ax has {given.size} Axes")
    return None, given.reshape(nrows, ncols)


def size(figure: Figure | SubFigure) -> tuple[float, float]:
    """Width and height of a figure or subfigure [inch]."""
    box = figure.bbox.transformed(figure.dpi_scale_trans.inverted())
    return box.width, box.height


def png_and_pdf(figure: Figure) -> dict[str, bytes]:
    """Save a figure in both formats from one drawing, without dates: the same figure gives the same bytes."""
    import pypdfium2  # here, since plots in notebooks do without

    pdf, png = io.BytesIO(), io.BytesIO()
    with matplotlib.rc_context(SETTINGS):
        if engine := figure.get_layout_engine():
            engine.execute(figure)
            figure.set_layout_engine(None)  # which would draw everything once more
        figure.savefig(pdf, format="pdf", metadata={"CreationDate": None})
    with pypdfium2.PdfDocument(pdf.getvalue()) as document:
        scale = (1 - 1e-6) * PIXELS_PER_INCH / POINTS_PER_INCH  # pdfium rounds the numbers of pixels up
        picture = document[0].render(scale=scale).to_pil()
    # Higher levels take twice the time for a tenth of the size.
    picture.save(png, format="png", dpi=(PIXELS_PER_INCH, PIXELS_PER_INCH), compress_level=1)
    return {"png": png.getvalue(), "pdf": pdf.getvalue()}

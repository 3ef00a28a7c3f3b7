"""One style for all figures, readable in grey at a journal's column or page width; plots of a single scene or curve."""

import io
import re
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure, SubFigure
from matplotlib.text import Text
from matplotlib.ticker import NullLocator

from springtune.problem.compare import sign_sentence
from springtune.safe_io import no_mathematics

from .answers import ERROR_COLOURS, ERROR_RANGE

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from springtune.mesh.cells import Mesh
    from springtune.scene.curve import Curve

Canvas = Figure | SubFigure | Axes | np.ndarray | None  # where a plot is drawn: a new figure if None

P = ParamSpec("P")
Drawn = TypeVar("Drawn")

COLUMN_WIDTH = 3.5  # width of a column of a journal with two [inch]

PAGE_WIDTH = 7.16  # width of the page of such a journal [inch]

METRES_PER_INCH = 0.0254

POINTS_PER_INCH = 72  # points in an inch, the units of a PDF page

SETTINGS: dict[Any, Any] = dict(
    matplotlib.rc_params_from_file(Path(__file__).with_suffix(".mplstyle"), use_default_template=False)
)
"""Settings of matplotlib."""

PIXELS_PER_INCH = SETTINGS["savefig.dpi"]  # pixels in an inch of a PNG file

SMALL_TEXT = SETTINGS["legend.fontsize"]
"""Size of the smallest text of a figure [pt], which journals still take at these widths."""

TEXT_SIZES = ("axes.labelsize", "axes.titlesize", "figure.titlesize", "font.size", "legend.fontsize", "xtick.labelsize",
              "ytick.labelsize")  # fmt: skip
"""Settings that follow the size of text."""


def choose(width: float, font_size: float) -> None:
    """Choose the width of a column [m] and the size of text [pt] of all figures of this process; 0 leaves it."""
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


def line(number: int) -> dict[str, Any]:
    """Colour, dashes and marker of a line by its number; colours repeat with other markers."""
    turn, colour = divmod(number, len(LINE_STYLES))
    return LINE_STYLES[(colour + 2 * turn) % len(LINE_STYLES)] | {"color": LINE_STYLES[colour]["color"]}


def logarithmic(panel: Axes) -> None:
    """Make both axes logarithmic, with numbers such as 0.5, 2 and 300 in place of powers."""
    panel.set(xscale="log", yscale="log")
    for name in "xy":
        chosen, (low, high) = getattr(panel, f"{name}axis"), sorted(getattr(panel, f"get_{name}lim")())
        chosen.set_major_formatter(lambda value, _: f"{value:g}")
        if low <= 0 or high / low > 150:
            chosen.set_minor_locator(NullLocator())
            continue
        kept = "25" if high / low > 5 else "235" if high / low > 3 else "2345678"
        chosen.set_minor_formatter(lambda value, _, kept=kept: f"{value:g}" if f"{value:e}"[0] in kept else "")


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
    ax: Canvas, nrows: int = 1, ncols: int = 1, *, figsize: tuple[float, float], **subplots: Any
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


@styled
def draw_alone(tree: "xr.DataTree", name: str, draw: Callable[[Axes, Any], object]) -> Axes:
    """Draw a group of a dataset on a single panel."""
    _, ((panel,),) = panels(None, figsize=(COLUMN_WIDTH, 2.4))
    draw(panel, tree[name].to_dataset())
    return panel


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


# -- texts: constrained layout makes room for them ---------------------------------------------------------------------

CHARACTER_WIDTH = 0.54  # mean width of a character over its size

SPACE_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:m|mm|N|kN|Pa|kPa|MPa|GPa|N/m|%)(?:\W|$))")
"""Space at which a text is not wrapped."""

WIDEST_NAME_SHARE = 0.55  # largest width of a line's name over that of a panel before its layout

POWERS_OF_TEN = {0: "", 3: "10³ ", 6: "10⁶ ", 9: "10⁹ "}


def power_of_ten(largest: float) -> tuple[float, str]:
    """Divisor of an axis and its text before the unit: 1e6 and ``"10⁶ "``."""
    power = max([power for power in POWERS_OF_TEN if largest >= 10 * 10.0**power], default=0)
    return 10.0**power, POWERS_OF_TEN[power]


def wrap_to_width(text: str, room: float, size: float | None = None) -> str:
    """Wrap a text, small if no size is given, at spaces to a width [inch]; a number keeps its unit."""
    characters = max(1, int(room * POINTS_PER_INCH / (CHARACTER_WIDTH * (size or SMALL_TEXT))))
    kept = SPACE_BEFORE_UNIT.sub("\x1f", text)
    lines = textwrap.wrap(kept, characters, break_long_words=False, break_on_hyphens=False)
    return "\n".join(lines).replace("\x1f", " ")


def wrap_to_panel(panel: Axes, texts: Iterable[str], size: float | None = None, share: float = 1.0) -> str:
    """Texts, one a line, wrapped to a share of the width of a panel before its layout."""
    room = share * panel.get_window_extent().width / panel.figure.dpi
    return "\n".join(wrap_to_width(text, room, size) for text in texts if text)


# -- lines -------------------------------------------------------------------------------------------------------------


def add_legend(panel: Axes, notes: Iterable[str] = (), why: str = "", key: Iterable[Artist] = ()) -> None:
    """Name lines in the order of their ends, and write notes below; without lines write `why`."""
    ends = {}
    for line in panel.get_lines():
        values = np.asarray(line.get_ydata(), dtype=float)
        if not str(line.get_label()).startswith("_") and np.isfinite(values).any():
            ends[line] = values[np.isfinite(values)][-1]
    if why and not ends:
        write_reason(panel, why)
        return
    if handles := [*sorted(ends, key=lambda line: -ends[line]), *key]:
        arranged = panel.figure.get_layout_engine() is not None
        place: Any = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)} if arranged else {}
        texts = [wrap_to_panel(panel, [str(one.get_label())], share=WIDEST_NAME_SHARE) for one in handles]
        panel.legend(handles, texts, handlelength=2.2, borderaxespad=0.3, labelspacing=0.35, **place)
    add_note(panel, notes)


def add_note(panel: Axes, texts: Iterable[str]) -> None:
    """Write small texts below a panel's label, wrapped to its width."""
    if text := wrap_to_panel(panel, texts):
        panel.annotate(text, (0, 0), xycoords="axes fraction", xytext=(0, -0.38 * POINTS_PER_INCH), va="top",
                       textcoords="offset points", fontsize=SMALL_TEXT, color="0.25")  # fmt: skip


def write_reason(panel: Axes, text: str, bare: bool = True) -> None:
    """Write into an empty panel the reason why it is empty."""
    place: Any = {"transform": panel.transAxes, "ha": "center", "va": "center"}
    panel.text(0.5, 0.5, wrap_to_panel(panel, [text], 8), color="0.25", **place)
    if bare:
        panel.tick_params(which="both", length=0, labelbottom=False, labelleft=False)
        panel.grid(False)


def add_title(figure: Figure | SubFigure | None, title: str, note: str = "") -> None:
    """Write the title of a figure, and a note below all panels, wrapped to its width."""
    if figure is None:
        return
    width = figure.bbox.width / figure.dpi
    figure.suptitle(wrap_to_width(title, width - 0.2, 8.5), x=0.05 / width, ha="left")
    if note:
        note = wrap_to_width(note, width - 0.2)
        figure.supxlabel(note, x=0.05 / width, ha="left", multialignment="left", fontsize=SMALL_TEXT, color="0.25")


def small_multiples(
    ax: Canvas,
    shown: Mapping[str, Any],
    columns: int,
    height: float,
    title: str,
    draw: Callable[[Axes, Any], tuple[Iterable[str], str]],
    *,
    sharey: bool = False,
    note: str = "",
    key: Sequence[Artist] = (),
) -> np.ndarray:
    """Draw a panel of some `height` [inch] for each title; `draw` returns notes, and the reason if it drew no line."""
    given = ax is not None and not isinstance(ax, Figure | SubFigure)
    wide = COLUMN_WIDTH if len(shown) == 1 < columns else PAGE_WIDTH
    columns = len(shown) if given else min(columns, len(shown))
    rows = -(-len(shown) // columns)
    figure, axes = panels(ax, rows, columns, figsize=(wide, height * rows), sharey=sharey)
    flat, lines, line_height = axes.ravel()[: len(shown)], 0, 1.22 * SMALL_TEXT / POINTS_PER_INCH
    for panel in axes.ravel()[len(shown) :]:
        panel.remove()
    for panel, (name, part) in zip(flat, shown.items()):
        panel.set_title(wrap_to_panel(panel, [name], 8))
        notes, why = draw(panel, part)
        add_legend(panel, notes, why)
        lines = max(lines, panel.get_title("left").count("\n") + len(wrap_to_panel(panel, notes).splitlines()))
        if legend := panel.get_legend():
            names = sum(1.4 + text.get_text().count("\n") for text in legend.get_texts())
            height = max(height, line_height * names + 0.4)
    for panel in axes[:, 1:].flat if sharey else ():
        panel.set_ylabel("")
    add_title(figure, title, note)
    if key:
        place: dict[str, Any] = {"loc": "outside upper right", "ncols": len(key)} if figure else {}
        (figure or flat[-1]).legend(handles=key, **place)
    if ax is None and isinstance(figure, Figure):
        tall = 0.2 + (height + line_height * lines) * rows
        figure.set_size_inches(wide, tall + line_height * (bool(note) + bool(key)))
    return flat


# -- plots of a single scene and of a single curve ---------------------------------------------------------------------

LARGEST_ERROR_SHOWN = 100.0  # largest error of a curve in a plot [%]

BEYOND_SMALL_STRAIN = "beyond small strain"
"""Note of a figure on errors whose reference does not apply, `reference_applies` false."""

NO_RESULT, NOT_REQUESTED = "×", "–"  # cells of a heat map without an error


@styled
def draw_springs(ax: Axes | None, mesh: "Mesh", displacements: np.ndarray, forces: np.ndarray, title: str) -> Axes:
    """Draw deformed springs coloured by force [N], and the outline at rest."""
    _, ((panel,),) = panels(ax, figsize=(COLUMN_WIDTH, 2.2))
    largest = float(np.abs(forces).max()) or 1.0
    outline = 1e3 * mesh.points[mesh.edges[mesh.on_outline]]
    panel.add_collection(LineCollection(outline, colors="0.6", linewidths=0.7))
    moved = 1e3 * (mesh.points + displacements)[mesh.edges]
    lines = LineCollection(moved, array=forces, cmap="coolwarm", clim=(-largest, largest), linewidths=0.7)
    panel.add_collection(lines)
    label = "Spring force [N], tension positive"
    panel.figure.colorbar(lines, ax=panel, label=label, orientation="horizontal", aspect=40)
    panel.autoscale()
    panel.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", title=title)
    panel.grid(False)
    return panel


@styled
def draw_curve(ax: Axes | None, curve: "Curve") -> Axes:
    """Draw the deformation error over uniform stiffness, and its zero."""
    _, ((panel,),) = panels(ax, figsize=(COLUMN_WIDTH, 2.5))
    error, notes = 100 * curve.error, []
    unit, written = power_of_ten(float(curve.stiffness.max()))
    stiffness, colour = curve.stiffness / unit, line(0)["color"]
    panel.axhline(0.0, color="0.6", linewidth=0.7)
    panel.plot(stiffness, np.where(curve.stable, error, np.nan), color=colour, label="network")
    panel.plot(stiffness, np.where(curve.stable, np.nan, error), color=colour, linewidth=0.5, label="not stable")
    marks = {"best": curve.best_stiffness, "closed form": curve.predicted_stiffness}
    for number, (name, value) in enumerate(marks.items(), start=1):
        if np.isfinite(value):
            look = line(number) | {"marker": "", "linewidth": 0.9}
            panel.axvline(value / unit, label=f"{name}, {value / unit:.4g} {written}N/m", **look)
    panel.set(xlabel=f"Stiffness [{written}N/m]", ylabel="Deformation error [%]", title=curve.title)
    known = error[np.isfinite(error)]
    if len(known):  # a beam that buckled errs by thousands
        low, high = min(1.1 * known.min(), 0.0), max(1.1 * known.max(), 1.0)
        panel.set_ylim(*np.clip([low, high], -LARGEST_ERROR_SHOWN, LARGEST_ERROR_SHOWN))
        notes = [sign_sentence({"": float(np.nansum(curve.displacement))})]
    else:
        write_reason(panel, curve.message or "There is no reference, and so no error.", bare=False)
    add_legend(panel, notes)
    return panel


@styled
def draw_residuals(ax: Axes | None, residuals: Mapping[str, np.ndarray], places: Mapping[str, np.ndarray]) -> Axes:
    """Draw residuals over the noise of each column or field, over the largest load or coordinate."""
    _, ((panel,),) = panels(ax, figsize=(COLUMN_WIDTH, 2.5))
    for number, (label, values) in enumerate(residuals.items()):
        along = places[label] if places[label].ndim == 1 else np.repeat(places[label][:, 0], 2)
        panel.plot(along / np.abs(along).max(), values, ".", color=line(number)["color"], label=label)
    panel.axhline(0.0, color="0.6", linewidth=0.7)
    panel.set(xlabel="Load, or x, over its largest [1]", ylabel="Residual over noise [1]")
    panel.legend(fontsize=SMALL_TEXT)
    return panel


# -- heat maps ---------------------------------------------------------------------------------------------------------


def heat_map(
    panel: Axes, errors: "pd.DataFrame", asked: np.ndarray, starred: np.ndarray | bool = False, sign: str = ""
) -> np.ndarray:
    """Draw cells coloured by the size of an error [%], with row and column names; return the texts of the cells."""
    texts, stars = np.where(asked, NO_RESULT, NOT_REQUESTED).astype(object), np.broadcast_to(starred, errors.shape)
    for place in zip(*np.nonzero(np.isfinite(errors.values))):
        texts[place] = error_text(errors.values[place], sign) + "*" * int(stars[place])
    shade, (low, high) = np.log10(np.clip(np.abs(errors.values), *ERROR_RANGE)), np.log10(ERROR_RANGE)
    colours = LinearSegmentedColormap.from_list("errors", ERROR_COLOURS)
    panel.imshow(shade, cmap=colours, vmin=low, vmax=high, aspect="auto")
    for (row, column), text in np.ndenumerate(texts):
        colour = "white" if shade[row, column] > 1.2 else "0.5" if text == NOT_REQUESTED else "k"
        panel.text(column, row, text, ha="center", va="center", fontsize=SMALL_TEXT, color=colour)
    panel.set_xticks(range(errors.shape[1]), map(no_mathematics, errors.columns), rotation=90)
    panel.set_yticks(range(len(errors)), map(no_mathematics, errors.index))
    panel.tick_params(length=0)
    panel.grid(False)
    return texts


def error_text(error: float, sign: str) -> str:
    """Format an error [%] for a cell of a heat map."""
    size = abs(error)
    return f"{error:{sign}.{0 if size >= 9.95 else 1 if size >= 0.095 else 2}f}".replace("-", "−")

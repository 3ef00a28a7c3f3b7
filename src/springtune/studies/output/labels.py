"""Texts of figures: names of lines, notes, titles and messages. Constrained layout makes room for them."""

import re
import textwrap
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Patch
from matplotlib.ticker import NullLocator

from springtune.problem.quantities import Status

from . import style
from .style import POINTS_PER_INCH, SMALL_TEXT

LINE_HEIGHT = 1.22 * SMALL_TEXT / POINTS_PER_INCH
"""Height of a line of small text [inch]."""

CHARACTER_WIDTH = 0.54
"""Mean width of a character over its size."""

SPACE_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:m|mm|N|kN|Pa|kPa|MPa|GPa|N/m|%)(?:\W|$))")
"""Space at which a text is not wrapped."""

WIDEST_NAME_SHARE = 0.55
"""Largest width of a line's name over that of a panel before its layout."""

POWERS_OF_TEN = {0: "", 3: "10³ ", 6: "10⁶ ", 9: "10⁹ "}


def power_of_ten(largest: float) -> tuple[float, str]:
    """Divisor of an axis and its text before the unit: 1e6 and ``"10⁶ "``."""
    power = max([power for power in POWERS_OF_TEN if largest >= 10 * 10.0**power], default=0)
    return 10.0**power, POWERS_OF_TEN[power]


def wrap_to_width(text: str, room: float, size: float = SMALL_TEXT) -> str:
    """Wrap a text at spaces to a width [inch]; a number keeps its unit."""
    characters = max(1, int(room * POINTS_PER_INCH / (CHARACTER_WIDTH * size)))
    lines = textwrap.wrap(
        SPACE_BEFORE_UNIT.sub("\x1f", text), characters, break_long_words=False, break_on_hyphens=False
    )
    return "\n".join(lines).replace("\x1f", " ")


def wrap_to_panel(panel: Axes, texts: Iterable[str], size: float = SMALL_TEXT, share: float = 1.0) -> str:
    """Texts, one a line, wrapped to a share of the width of a panel before its layout."""
    room = share * panel.get_window_extent().width / panel.figure.dpi
    return "\n".join(wrap_to_width(text, room, size) for text in texts if text)


# -- lines -------------------------------------------------------------------------------------------------------------


def group_equal_curves(curves: dict[str, np.ndarray], within: float) -> list[list[str]]:
    """Groups of curves that look like one line, in order."""
    groups: list[list[str]] = []
    for name, values in curves.items():
        for group in groups:
            other = curves[group[0]]
            if (np.isnan(values) == np.isnan(other)).all() and not (np.abs(values - other) > within).any():
                group.append(name)
                break
        else:
            groups.append([name])
    return groups


def sizes_axis(panel: Axes, sizes: np.ndarray, count: int) -> list[np.ndarray]:
    """Set up an axis of mesh sizes [mm]; return the x of each line: points of a single size stand side by side."""
    if len(sizes) == 1:
        panel.set(xlabel=f"One mesh size, {sizes[0]:g} mm", xlim=(-0.6, count - 0.4), xticks=[])
        return [np.array([float(number)]) for number in range(count)]
    panel.set(xscale="log", xlabel="Mesh size [mm]")
    panel.set_xticks(sizes, [f"{size:g}" for size in sizes])
    panel.xaxis.set_minor_locator(NullLocator())
    panel.set_xlim(sizes.min() / 1.2, sizes.max() * 1.2)
    return [sizes] * count


def count_statuses(flags: np.ndarray) -> dict[str, int]:
    """Number of requested cells by status in words."""
    return {str(Status(flag)).replace("_", " "): int((flags == flag).sum()) for flag in np.unique(flags[flags != 0])}


# -- texts -------------------------------------------------------------------------------------------------------------


def add_legend(panel: Axes, said: Iterable[str] = (), why: str = "", key: Iterable[Artist] = ()) -> None:
    """Name lines in the order of their ends, and write notes below; without lines write `why`."""
    ends = {}
    for line in panel.get_lines():
        values = np.asarray(line.get_ydata(), dtype=float)
        if not str(line.get_label()).startswith("_") and np.isfinite(values).any():
            ends[line] = values[np.isfinite(values)][-1]
    if why and not ends:
        write_reason(panel, why)
        return
    handles = [*sorted(ends, key=lambda line: -ends[line]), *key]
    if handles:
        arranged = panel.figure.get_layout_engine() is not None
        place: dict[str, Any] = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5)} if arranged else {}
        texts = [wrap_to_panel(panel, [str(one.get_label())], share=WIDEST_NAME_SHARE) for one in handles]
        panel.legend(handles, texts, handlelength=2.2, borderaxespad=0.3, labelspacing=0.35, **place)
    add_note(panel, said)


def add_note(panel: Axes, texts: Iterable[str]) -> None:
    """Write small texts below a panel's label, wrapped to its width."""
    if text := wrap_to_panel(panel, texts):
        panel.annotate(text, (0, 0), xycoords="axes fraction", xytext=(0, -0.38 * POINTS_PER_INCH), va="top",
                       textcoords="offset points", fontsize=SMALL_TEXT, color="0.25")  # fmt: skip


def write_reason(panel: Axes, text: str, bare: bool = True) -> None:
    """Write into an empty panel what is missing and why."""
    panel.text(
        0.5, 0.5, wrap_to_panel(panel, [text], 8), transform=panel.transAxes, ha="center", va="center", color="0.25"
    )
    if bare:
        panel.tick_params(which="both", length=0, labelbottom=False, labelleft=False)
        panel.grid(False)


def add_title(figure: Figure | SubFigure | None, title: str, said: str = "") -> None:
    """Write the title of a figure, and a note below all panels, wrapped to its width."""
    if figure is None:
        return
    width = style.size(figure)[0]
    figure.suptitle(wrap_to_width(title, width - 0.2, 8.5), x=0.05 / width, ha="left")
    if said:
        said = wrap_to_width(said, width - 0.2)
        figure.supxlabel(said, x=0.05 / width, ha="left", multialignment="left", fontsize=SMALL_TEXT, color="0.25")


def swatches(colours: Mapping[str, str]) -> list[Patch]:
    """Coloured boxes for a legend."""
    return [Patch(facecolor=colour, edgecolor="0.3", linewidth=0.4, label=text) for text, colour in colours.items()]


def small_multiples(
    ax: Figure | SubFigure | Axes | np.ndarray | None,
    shown: Mapping[str, Any],
    columns: int,
    height: float,
    title: str,
    draw: Callable[[Axes, Any], tuple[Iterable[str], str]],
    *,
    sharey: bool = False,
    said: str = "",
    key: Sequence[Artist] = (),
) -> np.ndarray:
    """Draw a panel of some `height` [inch] for each title; `draw` returns notes, and the reason if it drew no line."""
    given = ax is not None and not isinstance(ax, Figure | SubFigure)
    wide = style.COLUMN_WIDTH if len(shown) == 1 < columns else style.PAGE_WIDTH
    columns = len(shown) if given else min(columns, len(shown))
    rows = -(-len(shown) // columns)
    figure, axes = style.panels(ax, rows, columns, figsize=(wide, height * rows), sharey=sharey)
    flat, lines = axes.ravel()[: len(shown)], 0
    for panel in axes.ravel()[len(shown) :]:
        panel.remove()
    for panel, (name, part) in zip(flat, shown.items()):
        panel.set_title(wrap_to_panel(panel, [name], 8))
        notes, why = draw(panel, part)
        add_legend(panel, notes, why)
        lines = max(lines, panel.get_title("left").count("\n") + len(wrap_to_panel(panel, notes).splitlines()))
        if legend := panel.get_legend():
            names = sum(1.4 + text.get_text().count("\n") for text in legend.get_texts())
            height = max(height, LINE_HEIGHT * names + 0.4)
    for panel in axes[:, 1:].flat if sharey else ():
        panel.set_ylabel("")
    add_title(figure, title, said)
    if key:
        place: dict[str, Any] = {"loc": "outside upper right", "ncols": len(key)} if figure else {}
        (figure or flat[-1]).legend(handles=key, **place)
    if ax is None and isinstance(figure, Figure):
        figure.set_size_inches(
            wide, 0.2 + (height + LINE_HEIGHT * lines) * rows + LINE_HEIGHT * (bool(said) + bool(key))
        )
    return flat

"""Place texts in figures: line names, notes and messages."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure, SubFigure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.patches import Patch
from matplotlib.ticker import NullLocator

from springtune.problem.status import Status

from . import style
from .style import POINTS, SMALL, arrange

End = tuple[float, float, str, str]
"""Where a line ends, its name and its colour, for `name_lines`."""

DARKER = 0.75
"""Factor on a line's lightness for its name, to be readable on white."""

LINE = 1.22 * SMALL / POINTS
"""Height of a line of small text [inch]."""


@cache
def width(text: str, size: float = SMALL) -> float:
    """Width of the longest line of a text in the style's font [inch]."""
    font = get_font(findfont(FontProperties()))
    font.set_size(size, POINTS)
    found = 0.0
    for line in text.split("\n"):
        font.set_text(line, 0.0)
        found = max(found, font.get_width_height()[0] / 64 / POINTS)
    return found


POWERS = {0: "", 3: "10³ ", 6: "10⁶ ", 9: "10⁹ "}


def power_of_ten(largest: float) -> tuple[float, str]:
    """Divisor of an axis and its text before the unit: 1e6 and ``"10⁶ "``."""
    power = max([power for power in POWERS if largest >= 10 * 10.0**power], default=0)
    return 10.0**power, POWERS[power]


BETWEEN_WORDS = re.compile(r"(?<!\d) | (?!(?:m|mm|N|kN|Pa|kPa|MPa|GPa|N/m|%)(?:\W|$))")
"""Spaces at which a text may be wrapped."""


def wrapped(text: str, room: float, size: float = SMALL) -> str:
    """Wrap a text at spaces to a width [inch]; a number keeps its unit."""
    lines = [""]
    for word in BETWEEN_WORDS.split(text):
        longer = f"{lines[-1]} {word}".strip()
        if lines[-1] and width(longer, size) > room:
            lines.append(word)
        else:
            lines[-1] = longer
    return "\n".join(lines)


def spread(wanted: Sequence[float], sizes: Sequence[float], low: float, high: float) -> np.ndarray:
    """Places without overlap nearest to the wanted ones.

    Minimises the sum of squared moves in the given order (pool adjacent violators), then moves all between the ends.
    """
    if not len(wanted):
        return np.zeros(0)
    order = np.argsort(wanted, kind="stable")
    extent = np.asarray(sizes, dtype=float)[order]
    offsets = np.concatenate([[0.0], np.cumsum(0.5 * (extent[1:] + extent[:-1]))])
    pools: list[list[float]] = []
    for value in np.asarray(wanted, dtype=float)[order] - offsets:
        pools.append([value, 1.0])
        while len(pools) > 1 and pools[-2][0] > pools[-1][0]:
            value, count = pools.pop()
            pools[-1] = [(pools[-1][0] * pools[-1][1] + value * count) / (pools[-1][1] + count), pools[-1][1] + count]
    level = np.concatenate([np.full(int(count), value) for value, count in pools])
    first, last = low + 0.5 * extent[0], high - 0.5 * extent[-1] - offsets[-1]
    level = np.clip(level, first, last) if first <= last else np.full(len(level), 0.5 * (first + last))
    found = np.empty(len(level))
    found[order] = level + offsets
    return found


def name_lines(panel: Axes, ends: Iterable[End], share: float = 0.6) -> None:
    """Write line names to the right of their ends, without overlap, in the widened panel.

    Call it once position and limits of the panel are set.
    """
    lines = [end for end in ends if np.isfinite(end[0]) and np.isfinite(end[1])]
    if not lines:
        return
    box, dpi = panel.get_window_extent(), panel.figure.dpi
    room, height = box.width / dpi, box.height / dpi
    texts = [wrapped(text, share * room - 0.14) for _, _, text, _ in lines]
    taken = min(max(map(width, texts)) + 0.14, 0.75 * room) / room
    axis, limits = panel.xaxis.get_transform(), np.array(panel.get_xlim(), dtype=float)
    low, high = axis.transform(limits)
    left, right = axis.inverted().transform(np.array([low, low + (high - low) / (1 - taken)]))
    panel.set_xlim(left, right)
    ticks = {minor: panel.get_xticks(minor=minor) for minor in (False, True)}
    for minor, places in ticks.items():  # none below the names
        panel.set_xticks(places[(places >= limits.min()) & (places <= limits.max())], minor=minor)
    panel.spines["bottom"].set_bounds(*limits)
    panel.xaxis.label.set_x(max(0.5 * (1 - taken), 0.5 * width(panel.get_xlabel(), 8) / room - 0.2 / room))
    panel.get_ylim()  # limits that are not settled yet
    here = panel.transAxes.inverted().transform(panel.transData.transform([end[:2] for end in lines]))
    here = np.clip(here, 0, 1)
    sizes = [LINE * (1 + text.count("\n")) / height for text in texts]
    places = spread(here[:, 1], sizes, 0.0, 1.0)
    begin = 1 - taken + 0.1 / room
    leaders = [[at, (begin - 0.02 / room, place)] for at, place in zip(here, places)]
    colours = [end[3] for end in lines]
    panel.add_collection(
        LineCollection(leaders, colors=colours, linewidths=0.4, transform=panel.transAxes, zorder=1), autolim=False
    )
    for text, place, colour in zip(texts, places, colours):
        dark = tuple(DARKER * np.array(to_rgb(colour)))
        panel.text(begin, place, text, transform=panel.transAxes, fontsize=SMALL, color=dark, va="center",
                   linespacing=1.1)  # fmt: skip


def alike(curves: dict[str, np.ndarray], within: float) -> list[list[str]]:
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
    """Axis of mesh sizes [mm]: places of each of so many lines; a single size has its points side by side."""
    if len(sizes) == 1:
        panel.set(xlabel=f"One mesh size, {sizes[0]:g} mm", xlim=(-0.6, count - 0.4), xticks=[])
        return [np.array([float(number)]) for number in range(count)]
    panel.set(xscale="log", xlabel="Mesh size [mm]")
    panel.set_xticks(sizes, [f"{size:g}" for size in sizes])
    panel.xaxis.set_minor_locator(NullLocator())
    panel.set_xlim(sizes.min() / 1.2, sizes.max() * 1.2)
    return [sizes] * count


def line(panel: Axes, x: np.ndarray, y: np.ndarray, look: Mapping[str, Any], name: str, end: str = "") -> list[End]:
    """Draw a line that has points: where it ends, with its name or another text, for `name_lines`."""
    known = np.flatnonzero(np.isfinite(y))
    if not len(known):
        return []
    panel.plot(x, y, label=name, **look)
    return [(x[known[-1]], y[known[-1]], end or name, look["color"])]


def lines(
    panel: Axes, x: np.ndarray, curves: dict[str, np.ndarray], within: float, logarithmic: bool = False
) -> list[End]:
    """Draw a line a name, those that are `alike` as one: their ends for `name_lines`."""
    shown = {name: np.log(np.abs(values)) for name, values in curves.items()} if logarithmic else curves
    ends: list[End] = []
    for number, names in enumerate(alike(shown, within)):
        ends += line(panel, x, curves[names[0]], style.line(number), ", ".join(names))
    return ends


def swatches(colours: Mapping[str, str]) -> list[Patch]:
    """Coloured boxes of a legend, by their texts."""
    return [Patch(facecolor=colour, edgecolor="0.3", linewidth=0.4, label=text) for text, colour in colours.items()]


Drawn = tuple[list[End], str, str]
"""What a panel is finished with: ends of its lines, a note, and the reason if there are no lines."""

TITLE_LINE = 0.13
"""Height of a line of a panel's title [inch]."""


def room_left(panel: Axes) -> float:
    """Width of tick and axis labels on the left [inch]; call it once limits are set."""
    found = 0.04 + (0.16 if panel.get_ylabel() else 0.0)
    if not panel.yaxis.get_tick_params().get("labelleft", True):
        return found + 0.06
    low, high = sorted(panel.get_ylim())
    texts = []
    for minor, formatter in ((False, panel.yaxis.get_major_formatter()), (True, panel.yaxis.get_minor_formatter())):
        places = [place for place in panel.get_yticks(minor=minor) if low <= place <= high]
        texts += formatter.format_ticks(places)
    # Powers of ten are set by matplotlib's own mathematics.
    return found + 0.11 + max((0.28 if "$" in text else width(text) for text in texts), default=0.0)


def settle(figure: Figure | SubFigure | None, axes: np.ndarray, place: Mapping[str, Any]) -> None:
    """Arrange panels with room for the texts on their left; `axes` has shape (nrows, ncols)."""
    left = max(room_left(panel) for panel in axes[:, 0])
    between = max((room_left(panel) for panel in axes[:, 1:].flat if panel.get_visible()), default=0.0)
    arrange(figure, axes, **{**place, "left": left, "across": place.get("across", 0.0) + between})


def finish(
    figure: Figure | SubFigure | None,
    axes: np.ndarray,
    place: Mapping[str, Any],
    drawn: Mapping[Axes, Drawn],
    height: float = 0.0,
) -> None:
    """Settle panels, name their lines and write their notes below; a new figure of a `height` [inch] grows by these."""
    under = LINE * max((lines_of(said) for _, said, _ in drawn.values()), default=0)
    if height and isinstance(figure, Figure):
        figure.set_size_inches(style.size(figure)[0], height + len(axes) * under)
    settle(figure, axes, {**place, "bottom": place["bottom"] + under, "down": place.get("down", 0.0) + under})
    for panel, (ends, said, why) in drawn.items():
        name_lines(panel, ends)
        if why:
            say(panel, why)
        else:
            note(panel, said)


def small_multiples(
    ax: Figure | SubFigure | Axes | np.ndarray | None,
    shown: Mapping[str, Any],
    columns: int,
    height: float,
    title: str,
    draw: Callable[[Axes, Any], Drawn],
    *,
    sharey: bool = False,
) -> np.ndarray:
    """Draw a panel a name, each of a `height` [inch], below a wrapped title; `draw` gets a panel and its part."""
    columns = min(columns, max(1, len(shown)))
    figure, axes, flat, whole = style.multiples(ax, len(shown), columns, height, sharey=sharey)
    title = wrapped(title, (style.PAGE if columns > 1 else style.COLUMN) - 0.1, 8.5)
    place = {"left": 0.5, "right": 0.06, "bottom": 0.4, "top": 0.36 + 0.14 * lines_of(title), "down": 0.68}
    arrange(figure, axes, across=0.5, title=title, **place)
    drawn = {panel: draw(panel, part) for panel, part in zip(flat, shown.values())}
    for panel, name in zip(flat, shown):
        panel.set_title(name)
    finish(figure, axes, place | {"across": 0.1, "title": title}, drawn, whole if ax is None else 0.0)
    return flat


@contextmanager
def arranged(
    ax: Figure | SubFigure | Axes | np.ndarray | None,
    nrows: int = 1,
    ncols: int = 1,
    *,
    figsize: tuple[float, float],
    sharey: bool = False,
    widths: Sequence[float] | None = None,
    across: float = 0.1,
    **place: Any,
) -> Iterator[tuple[np.ndarray, dict[Axes, list[End]]]]:
    """Panels to draw on, and the ends of their lines to name; afterwards `settle` and `name_lines`.

    `across` [inch] and `place` are as in `arrange`, `across` beside the texts between panels.
    """
    figure, axes = style.panels(ax, nrows, ncols, figsize=figsize, sharey=sharey, widths=widths)
    margins = {"right": 0.08, "top": 0.28} | place
    arrange(figure, axes, left=0.5, across=across + (0.0 if sharey else 0.5), **margins)
    ends: dict[Axes, list[End]] = {}
    yield axes, ends
    settle(figure, axes, margins | {"across": across})
    for panel, named in ends.items():
        name_lines(panel, named)


KEY_ROW, KEY_COLUMNS = 0.16, 2
"""Height of a row of a key [inch], and the entries of a row."""


def key_below(panel: Axes, shown: Sequence[tuple[str, Mapping[str, Any]]], below: float = 0.38) -> None:
    """Explain looks `below` a panel's label [inch]."""
    handles = [panel.plot([], [], color="0.3", **look)[0] for _, look in shown]
    height = panel.get_window_extent().height / panel.figure.dpi
    panel.legend(handles, [text for text, _ in shown], loc="upper left", bbox_to_anchor=(0, -below / height),
                 ncols=KEY_COLUMNS, handlelength=1.2, borderaxespad=0, borderpad=0)  # fmt: skip


def statuses(flags: np.ndarray) -> dict[str, int]:
    """Number of cells of each status but those that were not asked for, by its words."""
    return {str(Status(flag)).replace("_", " "): int((flags == flag).sum()) for flag in np.unique(flags[flags != 0])}


def say(panel: Axes, text: str, bare: bool = True) -> None:
    """Write in the middle of an empty panel what is missing and why."""
    room = panel.get_window_extent().width / panel.figure.dpi
    panel.text(
        0.5, 0.5, wrapped(text, 0.9 * room, 8), transform=panel.transAxes, ha="center", va="center", fontsize=8,
        color="0.25",
    )  # fmt: skip
    if bare:
        panel.tick_params(which="both", length=0, labelbottom=False, labelleft=False)
        panel.grid(False)


def note(panel: Axes, text: str, below: float = 0.38) -> None:
    """Write small text `below` a panel's label [inch], wrapped to its width."""
    if text:
        text = wrapped(text, panel.get_window_extent().width / panel.figure.dpi)
        panel.annotate(text, (0, 0), xycoords="axes fraction", xytext=(0, -POINTS * below), va="top", ha="left",
                       textcoords="offset points", fontsize=SMALL, color="0.25")  # fmt: skip


def lines_of(text: str) -> int:
    """Number of lines of a text; 0 for an empty one."""
    return 1 + text.count("\n") if text else 0

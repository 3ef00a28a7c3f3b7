"""Texts of numbers, labels and tables."""

import json
import math
import re
from collections.abc import Iterable, Mapping
from typing import Any, SupportsFloat

from springtune.problem.quantities import SWEPT, with_unit
from springtune.safe_io import number_text, shown

NOT_ALL_SOLVED = "Not everything is solved"
"""How the last line of a dataset's summary begins where scenes are not solved."""


def paragraphs(parts: Iterable[Iterable[str]]) -> str:
    """Join paragraphs of lines, escaping line breaks in values."""
    return "\n\n".join("\n".join(map(shown, lines)) for lines in parts)


def bytes_text(number: float) -> str:
    """Bytes with a readable unit."""
    power = min(len(f"{number:.0f}") - 1, 9) // 3
    return f"{number / 1000**power:.3g} {('B', 'kB', 'MB', 'GB')[power]}"


def label_text(dimension: str, label: object, unit: str = "1") -> str:
    """Label of a dimension for readers.

    >>> label_text("mesh_size", 0.0, "m"), label_text("friction", 0.2), label_text("force", 12345.6, "N")
    ('size of the file', 'friction 0.2', '12.3456 kN')
    """
    if isinstance(label, str) or not isinstance(label, SupportsFloat):
        return str(label)
    if dimension in SWEPT:
        return with_unit(dimension, float(label), digits=6).replace("\u00a0", " ")
    if dimension == "mesh_size" and not float(label):  # of a shape's own mesh
        return "size of the file"
    shown = number_text(float(label), unit)
    return shown if dimension == "mesh_size" else f"{dimension.replace('_', ' ')} {shown}"


def cell_text(labels: Mapping[str, object], units: Mapping[str, str]) -> str:
    """Labels of a cell for readers; `units` are by dimension."""
    return ", ".join(label_text(name, label, units.get(name, "1")) for name, label in labels.items())


NUMBER = re.compile(r"[+-]?[0-9][0-9.]*(e[+-]?[0-9]+)?")


def without_numbers(text: str) -> str:
    """Replace numbers, so that messages that differ only in them are equal."""
    return NUMBER.sub("#", text)


def variable_name(group: str, variable: str) -> str:
    """Name of a variable with its group, as ``sensitivity/displacement``; the root's name is left out."""
    return f"{group.strip('/')}/{variable}".lstrip("/")


def from_json(text: object) -> dict[str, Any]:
    """Parse an attribute with JSON; empty if it has none."""
    try:
        return dict(json.loads(str(text or "{}")))
    except ValueError:
        return {}


def range_text(values: Iterable[float]) -> str:
    """Return the smallest and the largest value in four digits, or the one that they have in common."""
    found = [*values]
    return " to ".join(dict.fromkeys(f"{end:.4g}" for end in (min(found), max(found)))) if found else ""


# -- tables ------------------------------------------------------------------------------------------------------------


def decimals(values: Iterable[float], digits: int = 4, most: int = 8) -> int | None:
    """Decimals that show some significant digits of a column's largest number; None if there would be too many."""
    sizes = [abs(value) for value in values if math.isfinite(value) and value]
    if not sizes:
        return 0
    high, low = (math.floor(math.log10(size)) for size in (max(sizes), min(sizes)))
    found = max(digits - 1 - high, digits - 2 - low, 0)
    return found if found <= most and high + found < digits + 4 and high < 9 else None


def number(value: float, places: int | None, sign: bool = False) -> str:
    """Format a number by `decimals`; "–" if missing."""
    if not math.isfinite(value):
        return "–"
    text = f"{value:{'+' if sign else ''}{'.4g' if places is None else f'.{places}f'}}"
    text = text.lstrip("-+") if not float(text) else text  # zero has no sign
    return text.replace("-", "−")

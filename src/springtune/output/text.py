"""Text for a terminal."""

import re
from collections.abc import Collection, Iterable
from typing import SupportsFloat

from ..problem.parameters import SWEPT, with_unit


def aligned(rows: Iterable[Iterable[object]], left: int, right: Collection[int] = ()) -> str:
    """Rows in columns, those in `right` flush right."""
    texts = [[str(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*texts)]
    lines = []
    for row in texts:
        cells = [
            cell.rjust(width) if n in right else cell.ljust(width) for n, (cell, width) in enumerate(zip(row, widths))
        ]
        lines.append((" " * left + "  ".join(cells)).rstrip())
    return "\n".join(lines)


def bytes_text(number: float) -> str:
    """So many bytes, as people read them."""
    for unit in ("B", "kB", "MB"):
        if number < 1000:
            return f"{number:.3g} {unit}"
        number /= 1000
    return f"{number:.3g} GB"


def label_text(dimension: str, label: object, unit: str = "1") -> str:
    """A label of a dimension as people read it.

    Parameters
    ----------
    dimension : str
    label : str or float
    unit : str, optional
        Of a number.

    Returns
    -------
    str

    Examples
    --------
    >>> label_text("mesh_size", 0.005, "m"), label_text("load", "shear"), label_text("friction", 0.2)
    ('5 mm', 'shear', 'friction 0.2')
    """
    if isinstance(label, str) or not isinstance(label, SupportsFloat):
        return str(label)
    value = float(label)
    if dimension in SWEPT:
        return with_unit(dimension, value)
    if unit == "m":
        return f"{1e3 * value:g} mm"
    return f"{dimension.replace('_', ' ')} {value:g}{'' if unit == '1' else ' ' + unit}"


NUMBER = re.compile(r"[+-]?[0-9][0-9.]*(e[+-]?[0-9]+)?")


def without_numbers(text: str) -> str:
    """A message by which those are alike that differ in numbers alone."""
    return NUMBER.sub("#", text)

"""Table rows as CSV and Markdown."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

if TYPE_CHECKING:
    from .dataset import Label


def cells_with_values(values: xr.DataArray, dimensions: Sequence[str]) -> Iterator[dict[str, Label]]:
    """Labels of cells with values."""
    stacked = values.transpose(*dimensions)
    labels = [stacked[name].values.tolist() for name in dimensions]
    for place in np.argwhere(np.isfinite(stacked.values)):
        yield {name: label[i] for name, label, i in zip(dimensions, labels, place)}


def csv_text(rows: Sequence[Mapping[str, object]]) -> str:
    """Rows as CSV; missing numbers are empty."""
    text = io.StringIO()
    columns = list(dict.fromkeys(name for row in rows for name in row))
    writer = csv.DictWriter(text, columns, lineterminator="\n")
    writer.writeheader()
    for row in rows:
        writer.writerow({name: _number(value) for name, value in row.items()})
    return text.getvalue()


def _number(value: object) -> object:
    if not isinstance(value, float):
        return value
    return "" if np.isnan(value) else f"{value:.8g}"


def decimals(values: Iterable[float], digits: int = 4, most: int = 8) -> int | None:
    """Decimals that show so many significant digits of a column; NaN is a missing number.

    The largest number has all of them, the smallest nonzero one at most one fewer.
    """
    sizes = np.abs(np.fromiter(values, dtype=float))
    sizes = sizes[np.isfinite(sizes) & (sizes > 0)]
    if not len(sizes):
        return 0
    high, low = (int(np.floor(np.log10(size))) for size in (sizes.max(), sizes.min()))
    found = max(digits - 1 - high, digits - 2 - low, 0)
    return found if found <= most and high + found < digits + 4 and high < 9 else None


def number(value: float, places: int | None, sign: bool = False) -> str:
    """Format a number by `decimals`; "–" if missing."""
    if not np.isfinite(value):
        return "–"
    text = f"{value:{'+' if sign else ''}{'.4g' if places is None else f'.{places}f'}}"
    # Nothing is not below nothing.
    text = text.lstrip("-+") if not float(text) else text
    return text.replace("-", "−")


def markdown_table(heads: list[str], rows: Iterable[list[str]]) -> list[str]:
    """Markdown lines: first column left, others right."""
    lines = [heads, ["---", *["---:"] * (len(heads) - 1)], *rows]
    return [f"| {' | '.join(line)} |" for line in lines]

"""Tables of a dataset's arrays: in Markdown, and as rows of the page of all tables."""

from collections.abc import Collection, Iterable, Mapping
from itertools import product
from types import MappingProxyType
from typing import Any

import xarray as xr

from .selection import records
from .text import cell_number, markdown_table

LABEL_HEADS: dict[str, tuple[str, Any]] = {
    "definition": ("definition", "`{}`".format),
    "approach": ("approach", "`{}`".format),
    "integrator": ("integrator", "`{}`".format),
    "mesh_type": ("mesh type", str),
    "mesh_size": ("mesh [mm]", lambda size: f"{1e3 * size:g}"),
}
"""Head of a column of labels, and their texts."""


def numbers(array: xr.DataArray, form: str = ".3g", scale: float = 1.0, unit: str = "") -> xr.DataArray:
    """Texts of the numbers of an array; empty if missing."""
    return xr.apply_ufunc(cell_number, array, form, scale, unit, vectorize=True, output_dtypes=[object])


def markdown(
    rows: Iterable[str], columns: Mapping[str, xr.DataArray], heads: Mapping[str, Any] = LABEL_HEADS
) -> list[str]:
    """Markdown lines: a row for each cell over the dimensions `rows` that has a text, and columns of texts by head.

    Arrays with further dimensions have a column for each cell over them, whose labels fill the ``{}`` of their head.

    Examples
    --------
    >>> errors = xr.DataArray([[1.0, 2.0]], {"definition": ["area"], "load": ["shear", "traction"]})
    >>> markdown(["definition"], {"under {}": numbers(errors, ".1f")})
    ['| definition | under shear | under traction |', '| --- | ---: | ---: |', '| `area` | 1.0 | 2.0 |']
    """
    named, found = {name: heads[name] for name in rows}, {}
    for head, texts in columns.items():
        further = [name for name in texts.dims if name not in named]
        for labels in product(*(texts[name].values for name in further)):
            found[head.format(*labels)] = texts.sel(dict(zip(further, labels))).reset_coords(drop=True)
    frame = xr.Dataset(found).to_dataframe([*named])
    frame = frame[(frame != "").any(axis=1)].reset_index()
    for name, (_, written) in named.items():
        frame[name] = frame[name].map(written)
    return markdown_table([*(head for head, _ in named.values()), *found], frame.values.tolist())


def listed(
    data: xr.Dataset,
    present: xr.DataArray,
    names: Collection[str],
    scaled: Mapping[str, tuple[str, float]] = MappingProxyType({}),
) -> list[dict[str, Any]]:
    """Rows of the present cells: labels and variables by name, and variables by column times a factor."""
    variables = [name for name in (*names, *(name for name, _ in scaled.values())) if name in data.variables]
    return [
        {name: one[name] for name in names} | {head: factor * one[name] for head, (name, factor) in scaled.items()}
        for one in records(data, present, variables)
    ]

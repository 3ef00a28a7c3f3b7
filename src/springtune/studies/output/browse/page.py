"""The page: a dataset, the views of the study kinds, and BokehJS from its installed package, in one file.

Numbers are packed as float32 without the digits that the page never shows. An array with a long last dimension (a
curve, a field) keeps only rows with values, as differences from point to point. Bytes are sorted by their place in a
number, where they are alike, and each group is compressed as a whole. `assets/payload.js` reads it.
"""

import base64
import hashlib
import json
import os
import sys
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from importlib.util import find_spec
from itertools import accumulate
from pathlib import Path
from typing import Any

import h5netcdf
import h5py
import jinja2
import numpy as np
from markupsafe import Markup

from springtune.registry import imported
from springtune.safe_io.atomic import write_json, write_text
from springtune.safe_io.inputs import bounded

from ...config.kind import modules
from ..colours import ERROR_COLOURS, ERROR_RANGE
from ..reading import REMEDY, check, dataset_file, guarded, most_of, reason
from . import View

SCRIPTS = ("payload", "words", "charts", "table", "cells", "shape", "explorer", "main")
"""Modules of the page's own script, in the order in which they are put together."""

LIBRARY = ("bokeh", "bokeh-api")
"""Scripts of BokehJS that the page needs."""


def views() -> dict[str, View]:
    """Views that the study kinds declare."""
    return {view.group: view for name in modules("outputs") for view in getattr(imported(name), "VIEWS", ())}


def page(dataset: str | os.PathLike[str], files: Iterable[str] = ()) -> str:
    """Page of a dataset."""
    path = dataset_file(dataset)
    check(path)
    try:
        with guarded(path), bounded(most_of(path)), h5py.File(path) as opened:
            with h5netcdf.File(opened, decode_vlen_strings=True) as file:
                groups, contents = packed(file)
    except (OSError, ValueError) as error:
        raise ValueError(f"{path}: cannot be read ({reason(error)}); {REMEDY}") from None
    attributes = groups[0]["attributes"]
    if "springtune_version" not in attributes:
        raise ValueError(f"{path}: is not a dataset of springtune; {REMEDY}")
    declared = {path: asdict(view) for path, view in views().items()}
    scale = {"colours": ERROR_COLOURS, "range": ERROR_RANGE}
    content = {"groups": groups, "declared": declared, "files": sorted(files), "scale": scale}
    library = _library()
    texts = {"content": json.dumps(content, separators=(",", ":"), allow_nan=False)} | library
    script = "(() => {\n" + "".join(_asset(f"{name}.js") for name in SCRIPTS) + "})();\n"
    blocks = {name: zlib.compress(text.encode(), 9) for name, text in texts.items()}
    blocks |= {f"group-{number}": content for number, content in enumerate(contents)}
    # Scripts run only with one of these hashes, and nothing may be loaded: a script in a title stays a text.
    hashes = " ".join(_hash(text) for text in (script, *library.values()))
    policy = f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'"
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("springtune.studies.output.browse", "assets"), autoescape=True, trim_blocks=True
    )
    return environment.get_template("page.html").render(
        title=attributes.get("title") or attributes.get("study") or "Study",
        policy=f"{policy}; form-action 'none'",
        style=Markup(_asset("style.css")),
        script=Markup(script),
        blocks={name: base64.b64encode(block).decode() for name, block in blocks.items()},
    )


def _asset(name: str) -> str:
    return (Path(__file__).parent / "assets" / name).read_text(encoding="utf-8")


def _library() -> dict[str, str]:
    """Scripts of BokehJS by name, without importing Bokeh, which takes longer than making the page."""
    found = find_spec("bokeh")
    if found is None or found.origin is None:
        raise FileNotFoundError("the package bokeh is not installed; `pip install bokeh` or `make study` installs it")
    folder = Path(found.origin).parent / "server/static/js"
    return {name: (folder / f"{name}.min.js").read_text(encoding="utf-8") for name in LIBRARY}


def _hash(script: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


# -- packed numbers ----------------------------------------------------------------------------------------------------

LONG_DIMENSION = 16
"""Fewest labels of a last dimension that counts as points along a line."""

CLEARED_OF_CELLS, CLEARED_OF_LINES = 6, 9
"""Cleared bits of 23: 5 digits of a number are left, and 4 of a point on a line, finer than a pixel."""

ABSENT = -1
"""Number of an empty text."""

ROOM = 3_200_000
"""Most bytes of all numbers: the page with its library, in base64, stays below 5 MB."""

Packed = tuple[dict[str, Any], list[bytes]]
"""A group's description, and the bytes of each of its variables."""


def packed(file: h5netcdf.File, room: int = ROOM) -> tuple[list[dict[str, Any]], list[bytes]]:
    """Describe and pack the groups of a dataset."""
    found = list(_walk(file, {}))
    contents = [zlib.compress(b"".join(parts), 9) for _, parts in found]
    if sum(map(len, contents)) > room:
        _lighten(found, room)
        contents = [zlib.compress(b"".join(parts), 9) for _, parts in found]
    for described, parts in found:
        ends = list(accumulate(map(len, parts), initial=0))
        for row, begin in zip(described["variables"], ends):
            row["at"] = begin
    return [described for described, _ in found], contents


def _lighten(found: list[Packed], room: int) -> None:
    """Leave out the largest variables until the rest fits; each group lists what is left out."""
    sizes = [
        (len(zlib.compress(part, 1)), number, row["name"])
        for number, (described, parts) in enumerate(found)
        for row, part in zip(described["variables"], parts)
    ]
    excess = sum(size for size, _, _ in sizes) - room
    # Cells last: without them there is no table.
    for size, number, name in sorted(sizes, key=lambda one: (one[1] == 0, -one[0])):
        if excess <= 0:
            break
        described, parts = found[number]
        place = [row["name"] for row in described["variables"]].index(name)
        described["left_out"].append(name)
        del described["variables"][place], parts[place]
        excess -= size


def _walk(group: h5netcdf.Group, above: dict[str, Any]) -> Iterator[Packed]:
    """Describe and pack a group and the groups below it; `above` holds labels that they share."""
    # Once: h5netcdf looks up dimensions at each access.
    read = {name: (variable.dimensions, _attributes(variable)) for name, variable in group.variables.items()}
    labels = above | {
        name: {
            "labels": [_plain(one) for one in _values(group.variables[name], attributes).tolist()],
            **_words_on(attributes),
        }
        for name, (dimensions, attributes) in read.items()
        if dimensions == (name,)
    }
    if read or group.name == "/":
        yield _described(group, read, labels)
    for child in group.groups.values():
        yield from _walk(child, labels)


def _described(
    group: h5netcdf.Group,
    read: dict[str, tuple[tuple[str, ...], dict[str, Any]]],
    labels: dict[str, Any],
) -> Packed:
    variables: list[dict[str, Any]] = []
    parts: list[bytes] = []
    sizes: dict[str, int] = {}
    for name, (dimensions, attributes) in read.items():
        if dimensions == (name,):
            sizes[name] = len(labels[name]["labels"])
            continue
        values = _values(group.variables[name], attributes)  # each read, packed and forgotten
        sizes |= zip(dimensions, values.shape)
        row, content = _variable(values)
        row |= {"name": name, "dims": list(dimensions)} | _words_on(attributes)
        if "flag_meanings" in attributes:
            meanings = str(attributes["flag_meanings"]).split()
            flags = np.ravel(attributes.get("flag_values", range(len(meanings)))).tolist()
            row["flags"] = dict(zip(map(str, flags), meanings))
        variables.append(row)
        parts.append(content)
    described = {
        "path": group.name,
        "attributes": {key: _plain(value) for key, value in _attributes(group).items()},
        "dims": [{"name": name, "size": size, **labels.get(name, {})} for name, size in sizes.items()],
        "variables": variables,
        "left_out": [],
    }
    return described, parts


def _attributes(holder: h5netcdf.Group | h5netcdf.Variable) -> dict[str, Any]:
    """Attributes; netCDF's own library writes texts of one letter as bytes."""
    found = dict(holder.attrs)
    return {key: one.decode(errors="replace") if isinstance(one, bytes) else one for key, one in found.items()}


def _words_on(attributes: dict[str, Any]) -> dict[str, str]:
    return {key: str(attributes[key]) for key in ("units", "long_name", "comment") if key in attributes}


def _values(variable: h5netcdf.Variable, attributes: dict[str, Any]) -> np.ndarray:
    """Values of a variable, decoded by the conventions of netCDF."""
    values = np.asarray(variable[...])
    fill = attributes.get("_FillValue")
    if values.dtype.kind in "iuf" and fill is not None and np.isfinite(fill).all():
        values = np.where(values == np.ravel(fill)[0], np.nan, values)
    if values.dtype.kind in "iuf" and ("scale_factor" in attributes or "add_offset" in attributes):
        values = values * float(attributes.get("scale_factor", 1)) + float(attributes.get("add_offset", 0))
    return values


def _plain(value: Any) -> Any:
    """A label or an attribute for JSON, which has no NaN."""
    if isinstance(value, np.ndarray):
        return [_plain(one) for one in value.tolist()]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value if isinstance(value, bool | int | float | str) else str(value)


def _variable(values: np.ndarray) -> tuple[dict[str, Any], bytes]:
    if values.dtype.kind in "fc" or values.dtype.kind in "iu" and np.abs(values, dtype=float).max(initial=0) >= 2**31:
        with np.errstate(over="ignore"):  # numbers beyond 3e38 are shown as infinite
            numbers = values.real.astype(np.float32)
        return _rows({"type": "float"}, numbers, ~np.isnan(numbers))
    if values.dtype.kind in "iub":
        return _rows({"type": "integer"}, values.astype(np.int32), values != 0)
    # No array of texts, which gives each the room of the longest one.
    texts = list(map(str, (values if values.dtype.kind == "O" else values.astype(str)).ravel().tolist()))
    words = sorted(set(texts))
    numbers_of = {word: number if word else ABSENT for number, word in enumerate(words)}
    places = np.fromiter(map(numbers_of.__getitem__, texts), np.int32, len(texts)).reshape(values.shape)
    return _rows({"type": "text", "words": words}, places, places != ABSENT)


def _rows(row: dict[str, Any], values: np.ndarray, present: np.ndarray) -> tuple[dict[str, Any], bytes]:
    """Pack an array: how to read it, and its bytes."""
    long = values.ndim > 1 and values.shape[-1] >= LONG_DIMENSION
    points = values.shape[-1] if long or values.ndim == 1 and values.size >= LONG_DIMENSION else 1
    numbers = values.reshape(-1, points)
    parts = []
    row["points"] = points
    if long:
        kept = present.reshape(-1, points).any(axis=1)
        row["kept"] = int(kept.sum())
        parts.append(np.packbits(kept, bitorder="little").tobytes())
        numbers = numbers[kept]
    if row["type"] == "float":
        row["cleared"] = CLEARED_OF_LINES if points > 1 else CLEARED_OF_CELLS
        numbers = np.where(np.isnan(numbers), np.float32(np.nan), numbers)  # all NaN are equal
        bits = numbers.view(np.int32).copy()
        bits[np.isfinite(numbers)] += 1 << (row["cleared"] - 1)
        bits >>= row["cleared"]
    else:
        bits = np.ascontiguousarray(numbers)
    if points > 1:
        # Integer differences wrap around, as they do in the page.
        bits = np.diff(bits, axis=1, prepend=np.int32(0))
    folded = (bits << 1) ^ (bits >> 31)
    parts.append(np.ascontiguousarray(folded.reshape(-1).view(np.uint8).reshape(-1, 4).T).tobytes())
    return row, b"".join(parts)


def main(dataset: str, output: str, record: str, digest: str, *files: str) -> None:
    """Write the page of a dataset, and the record of it."""
    write_text(output, page(dataset, files))
    write_json(record, {"digest": digest})


if __name__ == "__main__":
    main(*sys.argv[1:])

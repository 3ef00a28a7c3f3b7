"""The page: a dataset, the views of the study kinds, and BokehJS from its installed package, in one file.

Numbers are packed as float32, rounded to the shown digits, as differences and by bytes; `assets/data.js` reads it.
"""

import base64
import hashlib
import json
import os
import re
import sys
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import h5netcdf
import jinja2
import numpy as np
import yaml
from markupsafe import Markup

from springtune.safe_io.files import write_json, write_text

from ...config.kind import VIEWS, kind_files
from .. import reading
from ..answers import broadcast
from ..error_scale import ERROR_COLOURS, ERROR_RANGE, sign_of_displacements
from . import Plot, View
from .overview import FILTERS, GROUPS, REMARK, overview

PAGE_SCRIPTS = ("data", "words", "charts", "table", "plot", "shape", "cells", "main")
"""Modules of the page's own script, in the order in which they are put together."""

BOKEH_SCRIPTS = ("bokeh", "bokeh-api")
"""Scripts of BokehJS that the page needs."""


def views() -> dict[str, View]:
    """Views that the study kinds declare, by group."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # the first takes a sixth of the time, where it was built
    texts = [path.read_text(encoding="utf-8") for path in kind_files(VIEWS)]
    declared = [one for text in texts for one in yaml.load(text, loader)]
    return {one["group"]: View(**one | {"plots": tuple(Plot(**plot) for plot in one["plots"])}) for one in declared}


def page(dataset: str | os.PathLike[str], files: Iterable[str] = ()) -> str:
    """Page of a dataset."""
    with reading.opened(dataset) as file, reading.guarded(dataset):
        groups = packed(file)
        parts = {group.name: _read(group, file) for group in (file, *file.groups.values()) if group.name in GROUPS}
        found = overview(parts)
    attributes = groups[0]["attributes"]
    declared = {path: asdict(view) for path, view in views().items()}
    scale = {"colours": ERROR_COLOURS, "range": ERROR_RANGE}
    content = {"groups": groups, "declared": declared, "scale": scale}
    library = _library()
    texts = {"content": json.dumps(content, separators=(",", ":"), allow_nan=False)} | library
    script = "(() => {\n" + "".join(_asset(f"{name}.js") for name in PAGE_SCRIPTS) + "})();\n"
    # Scripts run only with one of these hashes, and nothing may be loaded: a script in a title stays a text.
    hashes = " ".join(_hash(text) for text in (script, *library.values()))
    policy = f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'"
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("springtune.studies.output.browse", "assets"), autoescape=True, trim_blocks=True
    )
    environment.filters |= FILTERS
    return environment.get_template("page.html").render(
        title=attributes.get("title") or attributes.get("study") or "Study",
        policy=f"{policy}; form-action 'none'",
        style=Markup(_asset("style.css")),
        script=Markup(script),
        attributes=attributes,
        files=sorted(files),
        overview=found,
        blocks={name: _compress(text.encode()) for name, text in texts.items()},
    )


def _asset(name: str) -> str:
    return (Path(__file__).parent / "assets" / name).read_text(encoding="utf-8")


def _compress(content: bytes) -> str:
    return base64.b64encode(zlib.compress(content, 9)).decode()


def _library() -> dict[str, str]:
    """Read the scripts of BokehJS; importing Bokeh would take longer than making the page."""
    found = find_spec("bokeh")
    if found is None or found.origin is None:
        raise FileNotFoundError("the package bokeh is not installed; `pip install bokeh` or `make study` installs it")
    folder = Path(found.origin).parent / "server/static/js"
    return {name: (folder / f"{name}.min.js").read_text(encoding="utf-8") for name in BOKEH_SCRIPTS}


def _hash(script: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


# -- packed numbers ----------------------------------------------------------------------------------------------------

LONG_DIMENSION = 16
"""Fewest labels of a last dimension that counts as points along a line."""

CELL_BITS_CLEARED, LINE_BITS_CLEARED = 6, 9
"""Cleared bits of 23: 5 digits of a number are left, and 4 of a point on a line, finer than a pixel."""

EMPTY_TEXT = -1
"""Number of an empty text."""

MOST_CHARACTERS = 4_200_000
"""Most characters of all numbers: the page with its library stays below 5 MB."""


def packed(file: h5netcdf.File, room: int = MOST_CHARACTERS) -> list[dict[str, Any]]:
    """Describe and pack the groups of a dataset; leave out and name the largest variables if there is no room."""
    children = [group for group in file.groups.values() if group.variables]
    groups = [_describe(group, group.variables, file.variables) for group in (file, *children)]
    rows = [(group, row) for group in groups for row in group["variables"]]
    excess = sum(len(row["data"]) for _, row in rows) - room
    # Cells last: without them there is no table.
    for group, row in sorted(rows, key=lambda pair: (pair[0]["path"] == "/", -len(pair[1]["data"]))):
        if excess > 0:
            group["left_out"].append(row["name"])
            group["variables"].remove(row)
            excess -= len(row["data"])
    return groups


Variables = Mapping[str, h5netcdf.Variable]


def _describe(group: h5netcdf.Group, own: Variables, root: Variables) -> dict[str, Any]:
    """Describe and pack a group: its `own` variables, with labels that it may share with the `root`."""
    rows: list[dict[str, Any]] = []
    sizes: dict[str, int] = {}
    for name, stored in own.items():
        if stored.dimensions == (name,):
            sizes[name] = len(stored)
            continue
        row: dict[str, Any] = {"name": name, "dims": list(stored.dimensions)} | _words_on(stored)
        if "flag_meanings" in stored.attrs:
            meanings = str(stored.attrs["flag_meanings"]).split()
            flags = np.ravel(stored.attrs.get("flag_values", range(len(meanings)))).tolist()
            row["flags"] = dict(zip(map(str, flags), meanings))
        values = _values(stored)  # each read, packed and forgotten
        sizes |= dict(zip(stored.dimensions, values.shape))
        if name == "status":
            values = _mark_beyond_linear(own, row, values)
        elif ERROR.search(name) and row.get("units", "1") == "1":
            row["error"] = True
            if _has_sign(row, values):
                row |= {"signed": True, "sign": _sign_sentence(name, own, root)}
        rows.append(row | _pack_values(values))
    dims = [{"name": name, "size": size} | _labels(name, own, root) for name, size in sizes.items()]
    attributes = {name: _json_value(value) for name, value in group.attrs.items() if name != "coordinates"}
    return {"path": group.name, "attributes": attributes, "dims": dims, "variables": rows, "left_out": []}


def _labels(name: str, own: Variables, root: Variables) -> dict[str, Any]:
    """Labels of a dimension with their unit and name; empty if it has none."""
    stored = own.get(name) or root.get(name)
    return {"labels": list(map(_json_value, stored[...].tolist()))} | _words_on(stored) if stored else {}


def _words_on(stored: h5netcdf.Variable) -> dict[str, str]:
    """Unit and name of a variable."""
    return {name: str(stored.attrs[name]) for name in ("units", "long_name") if name in stored.attrs}


def _read(group: h5netcdf.Group, root: h5netcdf.File) -> dict[str, tuple[Sequence[str], np.ndarray]]:
    """Dimensions and values of a group's numbers and labels, and of those labels that it shares with the root."""
    dims = {name for stored in group.variables.values() for name in stored.dimensions}
    labels = {name: root.variables[name] for name in dims if name in root.variables}
    found = {}
    for name, stored in (labels | dict(group.variables)).items():
        if len(stored.dimensions) == 1 or np.dtype(stored.dtype).kind in "iuf" or name == REMARK:
            found[name] = (stored.dimensions, _values(stored))
    return found


def _values(stored: h5netcdf.Variable) -> np.ndarray:
    """Values of an array; missing integers are NaN."""
    values, fill = stored[...], stored.attrs.get("_FillValue")
    return np.where(values == fill, np.nan, values) if fill is not None and values.dtype.kind in "iu" else values


def _broadcast(stored: h5netcdf.Variable, dims: Sequence[str]) -> np.ndarray:
    return broadcast(dims, stored.dimensions, stored[...])


# -- errors ------------------------------------------------------------------------------------------------------------

ERROR = re.compile(r"(^|_)errors?(?!_rate|_estimate)(_|$)")
"""Names of errors; rates and estimates have no sign."""

REFERENCES = {
    "face_error": "reference_face_displacement",
    "error": "reference_value",
    "expected_error": "expected_value",
}
"""Reference variables of errors, if not `reference_displacement`."""


def _mark_beyond_linear(own: Variables, row: dict[str, Any], status: np.ndarray) -> np.ndarray:
    """Give solved cells that the linear reference cannot judge a status of their own."""
    flags = {meaning: int(flag) for flag, meaning in row.get("flags", {}).items()}
    applies = own.get("reference_applies")
    if "solved" not in flags or applies is None or not set(applies.dimensions) <= set(row["dims"]):
        return status
    beyond = max(flags.values()) + 1
    found = np.where((status == flags["solved"]) & (_broadcast(applies, row["dims"]) == 0), beyond, status)
    if (found == beyond).any():
        row["flags"][str(beyond)] = "beyond_linear"
    return found


def _has_sign(row: dict[str, Any], values: np.ndarray) -> bool:
    """Return whether an error has a sign; norms and numbers printed without one have none."""
    said = row.get("long_name", "")
    stated = re.search(r"signed|less 1|- 1$|network - reference", said)
    return "without sign" not in said and bool(stated or (values < 0).any())


def _sign_sentence(name: str, own: Variables, root: Variables) -> str:
    """Sentence on which sign of a group's errors means too soft."""
    reference = REFERENCES.get(name, "reference_displacement")
    reference = reference if reference in own else "reference_displacement"
    group = own if reference in own else root
    if reference not in group or not re.fullmatch("(deformation_|second_|face_|expected_)?error", name):
        return "positive: too large"
    dims, others = group[reference].dimensions, False
    values = group[reference][...]
    if "quantity_kind" in group:
        displacements = _broadcast(group["quantity_kind"], dims) == "displacement"
        others = bool((np.isfinite(values) & ~displacements).any())
        values = np.where(displacements, values, np.nan)
    axes = {one: _labels(one, own, root).get("labels", ()) for one in dims}
    said = sign_of_displacements(values, axes)
    if not others:
        return said
    return f"displacements: {said}; other quantities: positive: too large" if said else "positive: too large"


# -- arrays ------------------------------------------------------------------------------------------------------------


def _json_value(value: Any) -> Any:
    """Convert a label or an attribute for JSON, which has no NaN."""
    if isinstance(value, np.ndarray):
        return [_json_value(one) for one in value.tolist()]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value if isinstance(value, bool | int | float | str) else str(value)


def _pack_values(values: np.ndarray) -> dict[str, Any]:
    if values.dtype.kind in "fc" or values.dtype.kind in "iu" and np.abs(values, dtype=float).max(initial=0) >= 2**31:
        with np.errstate(over="ignore"):  # numbers beyond 3e38 are shown as infinite
            numbers = values.real.astype(np.float32)
        return _pack({"type": "float"}, numbers, ~np.isnan(numbers))
    if values.dtype.kind in "iub":
        return _pack({"type": "integer"}, values.astype(np.int32), values != 0)
    # No array of texts, which gives each the room of the longest one.
    texts = list(map(str, (values if values.dtype.kind == "O" else values.astype(str)).ravel().tolist()))
    words = sorted(set(texts))
    numbers_of = {word: number if word else EMPTY_TEXT for number, word in enumerate(words)}
    places = np.fromiter(map(numbers_of.__getitem__, texts), np.int32, len(texts)).reshape(values.shape)
    return _pack({"type": "text", "words": words}, places, places != EMPTY_TEXT)


def _pack(row: dict[str, Any], values: np.ndarray, present: np.ndarray) -> dict[str, Any]:
    """Pack an array: its bytes and how to read them."""
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
        row["cleared"] = LINE_BITS_CLEARED if points > 1 else CELL_BITS_CLEARED
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
    return row | {"data": _compress(b"".join(parts))}


def main(dataset: str, output: str, record: str, digest: str, *files: str) -> None:
    """Write the page of a dataset, and the record of it."""
    write_text(output, page(dataset, files))
    write_json(record, {"digest": digest})


if __name__ == "__main__":
    main(*sys.argv[1:])

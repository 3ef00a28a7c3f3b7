"""The page to browse a dataset with, in one file that needs neither a server nor a network.

It has the dataset, the views of the study kinds, and BokehJS from its installed package.

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
from dataclasses import asdict, dataclass, field
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import Any, Literal, NamedTuple, cast

import jinja2
import numpy as np
import pandas as pd
import xarray as xr
import yaml
from markupsafe import Markup

from springtune.problem.compare import error_text
from springtune.problem.quantities import Status
from springtune.safe_io import write_json, write_text

from ..config.model import view_files
from . import reading
from .answers import ERROR_COLOURS, ERROR_RANGE, DefinitionErrors, definition_errors, status_words, what_to_type
from .dataset import against_own_laws, columns, flag_words, requested_cells, sign_of_errors
from .text import label_text, range_text

PAGE_SCRIPTS = ("data", "words", "charts", "table", "plot", "shape", "cells", "main")
"""Modules of the page's own script, in the order in which they are put together."""

BOKEH_SCRIPTS = ("bokeh", "bokeh-api")  # scripts of BokehJS that the page needs


@dataclass(frozen=True)
class Plot:
    """A plot of a group; readers choose along unnamed dimensions.

    `by` has one line per label, or is a map's y axis. A line joins the points `along` a dimension if `x` is a variable.
    `log` names logarithmic axes ("x", "y", "xy"), which show magnitudes.
    """

    title: str
    value: str
    x: str
    by: str = ""
    shows: Literal["lines", "points", "map"] = "lines"
    along: str = ""
    ascending: bool = False
    log: Literal["", "x", "y", "xy"] = ""
    equal: bool = False
    beside: tuple[tuple[str, str, str], ...] = ()
    selection: Mapping[str, str | float] = field(default_factory=dict)


@dataclass(frozen=True)
class View:
    """View of a group: its `plots`, without missing variables, and table `columns` for the root."""

    group: str
    title: str
    note: str = ""
    plots: tuple[Plot, ...] = ()
    columns: tuple[str, ...] = ()


def views() -> dict[str, View]:
    """Views that the study kinds declare, by group."""
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # the first takes a sixth of the time, where it was built
    declared = [one for path in view_files() for one in yaml.load(path.read_text(encoding="utf-8"), loader)]
    return {one["group"]: View(**one | {"plots": tuple(Plot(**plot) for plot in one["plots"])}) for one in declared}


def page(dataset: str | os.PathLike[str], files: Iterable[str] = ()) -> str:
    """Page of a dataset."""
    with reading.open(dataset) as tree, reading.guard(dataset):
        groups, found = packed(tree), overview(tree)
    attributes = groups[0]["attributes"]
    # Importing Bokeh would take longer than making the page.
    scripts = Path(cast(Any, find_spec("bokeh")).origin).parent / "server/static/js"
    library = {name: (scripts / f"{name}.min.js").read_text(encoding="utf-8") for name in BOKEH_SCRIPTS}
    scale = {"colours": ERROR_COLOURS, "range": ERROR_RANGE}
    content = {"groups": groups, "declared": {path: asdict(view) for path, view in views().items()}, "scale": scale}
    texts = {"content": json.dumps(content, separators=(",", ":"), allow_nan=False)} | library
    script = "(() => {\n" + "".join(_asset(f"{name}.js") for name in PAGE_SCRIPTS) + "})();\n"
    # Scripts run only with one of these hashes, and nothing may be loaded: a script in a title stays a text.
    digests = (hashlib.sha256(text.encode()).digest() for text in (script, *library.values()))
    hashes = " ".join(f"'sha256-{base64.b64encode(digest).decode()}'" for digest in digests)
    policy = f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'"
    loader = jinja2.PackageLoader("springtune.studies.output", "assets")
    environment = jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True)
    environment.filters |= {"size": _size, "stiffnesses": _stiffnesses, "error": error_text}
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


# -- packed numbers ----------------------------------------------------------------------------------------------------

LONG_DIMENSION = 16  # fewest labels of a last dimension that counts as points along a line

CELL_BITS_CLEARED, LINE_BITS_CLEARED = 6, 9
"""Cleared bits of 23: 5 digits of a number are left, and 4 of a point on a line, finer than a pixel."""

MOST_CHARACTERS = 4_200_000  # most characters of all numbers: the page with its library stays below 5 MB


def packed(tree: xr.DataTree, room: int = MOST_CHARACTERS) -> list[dict[str, Any]]:
    """Describe and pack the groups of a dataset; leave out and name the largest variables if there is no room."""
    groups = [_describe(node, tree.to_dataset()) for node in tree.subtree if node is tree or node.data_vars]
    rows = [(group, row) for group in groups for row in group["variables"]]
    excess = sum(len(row["data"]) for _, row in rows) - room
    # Cells last: without them there is no table.
    for group, row in sorted(rows, key=lambda pair: (pair[0]["path"] == "/", -len(pair[1]["data"]))):
        if excess > 0:
            group["left_out"].append(row["name"])
            group["variables"].remove(row)
            excess -= len(row["data"])
    return groups


def _describe(node: xr.DataTree, root: xr.Dataset) -> dict[str, Any]:
    """Describe and pack a group: its variables, and labels that it may share with the `root`."""
    data, rows = node.to_dataset(), list[dict[str, Any]]()
    for name, stored in data.variables.items():
        if name in data.dims:
            continue
        row: dict[str, Any] = {"name": name, "dims": list(stored.dims)} | _words_on(stored)
        if "flag_meanings" in stored.attrs:
            row["flags"] = {str(flag): word for flag, word in flag_words(data[name]).items()}
        values = stored.values  # each read, packed and forgotten
        if name == "status" and "flags" in row and "reference_applies" in data:
            # Solved cells that the linear reference cannot judge have a status of their own.
            beyond, number = (stored == Status.SOLVED) & (data.reference_applies.variable == 0), len(row["flags"])
            row["flags"] |= {str(number): "beyond_linear"} if beyond.any() else {}
            values = np.where(beyond.transpose(*stored.dims), number, values)
        elif ERROR.search(row["name"]) and row.get("units", "1") == "1":
            row["error"] = True
            if _has_sign(row, values):
                row |= {"signed": True, "sign": _sign_sentence(row["name"], data, root)}
        rows.append(row | _pack(values))
    dims = [dict[str, Any](name=name, size=size) for name, size in node.to_dataset(inherit=False).sizes.items()]
    for dim in dims:
        if (name := dim["name"]) in data.coords:
            dim |= {"labels": list(map(_json_value, data[name].values.tolist()))} | _words_on(data[name].variable)
    attributes = {name: _json_value(value) for name, value in node.attrs.items()}
    return {"path": node.path, "attributes": attributes, "dims": dims, "variables": rows, "left_out": []}


def _words_on(stored: xr.Variable) -> dict[str, str]:
    return {name: str(stored.attrs[name]) for name in ("units", "long_name") if name in stored.attrs}


# -- errors ------------------------------------------------------------------------------------------------------------

ERROR = re.compile(r"(^|_)errors?(?!_rate|_estimate)(_|$)")  # names of errors; rates and estimates have no sign

REFERENCES = {
    "face_error": "reference_face_displacement",
    "error": "reference_value",
    "expected_error": "expected_value",
}
"""Reference variables of errors, if not `reference_displacement`."""


def _has_sign(row: dict[str, Any], values: np.ndarray) -> bool:
    """Return whether an error has a sign; norms and numbers printed without one have none."""
    long_name = row.get("long_name", "")
    stated = re.search(r"signed|less 1|- 1$|network - reference", long_name) is not None
    return "without sign" not in long_name and (stated or bool((values < 0).any()))


def _sign_sentence(name: str, data: xr.Dataset, root: xr.Dataset) -> str:
    """Sentence on which sign of a group's errors means too soft."""
    reference = REFERENCES.get(name, "reference_displacement")
    reference = reference if reference in data else "reference_displacement"
    data = data if reference in data else root
    if reference not in data or not re.fullmatch("(deformation_|face_|expected_)?error", name):
        return "positive: too large"
    signs = sign_of_errors(data, reference)
    if (data[reference].notnull() & (data.get("quantity_kind", "displacement") != "displacement")).any():
        return f"displacements: {signs}; other quantities: positive: too large" if signs else "positive: too large"
    return signs


# -- arrays ------------------------------------------------------------------------------------------------------------


def _json_value(value: Any) -> Any:
    """Convert a label or an attribute for JSON, which has no NaN."""
    value = value.tolist() if isinstance(value, np.ndarray | np.generic) else value
    if isinstance(value, list):
        return [_json_value(one) for one in value]
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value if isinstance(value, bool | int | float | str) else str(value)


def _pack(values: np.ndarray) -> dict[str, Any]:
    """Pack an array: its bytes and how to read them."""
    row: dict[str, Any] = {"type": "integer"}
    if values.dtype.kind not in "iubf":
        # No array of texts, which gives each the room of the longest one.
        texts = pd.Series(values.ravel(), dtype=object)
        places, words = pd.factorize(texts.mask(texts == ""), sort=True)
        row, values = {"type": "text", "words": ["", *map(str, words)]}, places.reshape(values.shape) + 1
    elif values.dtype.kind == "f" or values.size and max(-int(values.min()), int(values.max())) >= 2**31:
        row = {"type": "float"}
    with np.errstate(over="ignore"):  # numbers beyond 3e38 are shown as infinite
        values = values.astype(np.float32 if row["type"] == "float" else np.int32)
    long = values.ndim > 1 and values.shape[-1] >= LONG_DIMENSION
    points = values.shape[-1] if long or values.ndim == 1 and values.size >= LONG_DIMENSION else 1
    bits, head, row["points"] = values.reshape(-1, points), b"", points
    if long:
        kept = (~np.isnan(bits) if row["type"] == "float" else bits != 0).any(axis=1)
        row["kept"], head, bits = int(kept.sum()), np.packbits(kept, bitorder="little").tobytes(), bits[kept]
    if row["type"] == "float":
        row["cleared"] = LINE_BITS_CLEARED if points > 1 else CELL_BITS_CLEARED
        finite = np.isfinite(bits)
        bits = np.where(np.isnan(bits), np.float32(np.nan), bits).view(np.int32)  # all NaN are equal
        bits[finite] += 1 << (row["cleared"] - 1)
        bits >>= row["cleared"]
    if points > 1:
        # Integer differences wrap around, as they do in the page.
        bits = np.diff(bits, axis=1, prepend=np.int32(0))
    folded = (bits << 1) ^ (bits >> 31)
    return row | {"data": _compress(head + folded.reshape(-1).view(np.uint8).reshape(-1, 4).T.tobytes())}


# -- the overview that a page opens on, without a script ---------------------------------------------------------------

Content = dict[str, Any]  # values that a template shows


class Source(NamedTuple):
    """A group with errors of definitions: its cells, their error and body, and what the dots of a definition are by."""

    group: str
    cells: str
    error: str
    body: str
    by: str


SOURCES = (
    Source("/", "scenes", "deformation_error", "beam", "load"),
    Source("/shapes", "quantities of shapes", "error", "shape", "shape"),
    Source("/samples", "samples", "deformation_error", "", "load"),
)

LOOK_COUNT = 8  # different colours of lines and dots

SMALLEST_PERCENT = 1e-4  # smaller errors stand at the end of their axis

SHORTEST_TIME = 1e-6  # shorter times [s] stand at the end of their axis

LARGEST_CURVE_PERCENT = 60.0  # largest error of a sensitivity curve

PANEL_LABELS = ("mesh_type", "material", "load", "kinematics")  # labels of a chart of sensitivity curves

MOST_PANELS, MOST_LINES, MOST_ANSWERS = 12, 12, 24
"""Most charts of sensitivity curves and tables, curves in each chart, and rows on what to type."""


class Axis:
    """An axis, with `ticks` of a place in percent and a text."""

    def __init__(self, label: str, values: Iterable[float], log: bool = False) -> None:
        low, high = np.min([*values]), np.max([*values])
        if log:
            first = np.floor(np.log10(low))
            steps = 10.0 ** np.arange(first, max(np.ceil(np.log10(high)), first + 1) + 1)
        else:
            step = 10.0 ** np.ceil(np.log10(max(high - low, 1e-3 * abs(high), 1e-9)))
            step *= next(share for share in (0.02, 0.05, 0.1, 0.2) if high - low <= 6 * share * step)
            steps = step * np.arange(np.floor(low / step), np.ceil(high / step) + 1)
        self.label, self.log, self.ends = label, log, (steps[0], steps[-1])
        self.ticks = [(self.at(one), f"{one:g}") for one in steps]

    def at(self, value: float) -> float:
        """Place of a value."""
        low, high, place = np.log10([*self.ends, value]) if self.log else (*self.ends, value)
        return round(100 * float((place - low) / (high - low)), 1)


ERROR_AXIS = "error, without sign [%]"
CURVE_AXIS = Axis("error [%]", [-LARGEST_CURVE_PERCENT, LARGEST_CURVE_PERCENT])


class Chart(NamedTuple):
    """A chart, with places in percent of its axes."""

    x: Axis
    y: Axis | None
    rows: Sequence[tuple[float, str, str]] = ()  # place, name and numbers, instead of an axis
    lines: Sequence[tuple[int, Sequence[tuple[float, float]]]] = ()  # look and points
    dots: Sequence[tuple[str, float, float, str]] = ()  # look, place and text
    names: Mapping[str, int] = {}  # looks of lines or dots
    title: str = ""


def overview(tree: xr.DataTree) -> Content:
    """Content of the overview of a dataset."""
    found, groups = [], {node.path: node.to_dataset() for node in tree.subtree}
    root, curves = groups["/"], groups.get("/sensitivity", xr.Dataset())
    for source in SOURCES:
        data = groups.get(source.group, xr.Dataset())
        if {source.error, "status", "definition"} <= {*data.variables}:
            data = against_own_laws(data, groups.get("/finite_strain") if source.group == "/" else None)
            found.append(_errors(source, data))
    return {
        "sources": found,
        "curves": _curves(curves) if "deformation_error" in curves else {},
        "paper": _paper_tables(requested_cells(root)) if "paper_table" in root else {},
    }


# -- what to type, errors and times ------------------------------------------------------------------------------------


def _errors(source: Source, data: xr.Dataset) -> Content:
    """Stiffnesses to type, errors of definitions, and errors over run time."""
    cells = requested_cells(data, source.error)
    cells["percent"] = (100 * cells.valid_error.abs()).clip(lower=SMALLEST_PERCENT)
    by = source.body, "mesh_type", "material"
    # Each takes some milliseconds.
    typed = [*islice(what_to_type(cells, by), MOST_ANSWERS + 1)] if source.body else []
    content: Content = {"source": source, "finite_strain": "finite_strain" in data.attrs}
    content |= {"answers": typed[:MOST_ANSWERS], "more_answers": len(typed) > MOST_ANSWERS}
    if source.body and {"solve_seconds", "definition_seconds"} <= {*cells}:
        pairs = cells[[source.body, "mesh_size"]].drop_duplicates()
        alike = len(pairs) == pairs[source.body].nunique() * pairs.mesh_size.nunique()
        # Where each body has mesh sizes of its own, medians by mesh size would be of different bodies.
        cells["size"] = cells.mesh_size.map(_size) if alike else ""
        cells["seconds"] = (cells.solve_seconds + cells.definition_seconds).fillna(0).clip(lower=SHORTEST_TIME)
    if found := sorted(definition_errors(cells), key=lambda one: one.median):
        content["errors"] = _dots(found, source.by, cells[source.by].unique())
        content["times"] = _times(found[:LOOK_COUNT]) if "seconds" in cells else None
    return content


def _size(mesh_size: float) -> str:
    return label_text("mesh_size", mesh_size, "m")


def _stiffnesses(values: np.ndarray) -> str:
    return re.sub(r"e\+0?", "e", range_text(values)) + " N/m"


def _dots(found: Sequence[DefinitionErrors], by: str, labels: Iterable[str]) -> Chart:
    """Errors of each definition: medians by label, of all, and the worst."""
    x, dots, rows = Axis(ERROR_AXIS, (drawn := pd.concat([one.cells for one in found])).percent, log=True), [], []
    names = {label: number % LOOK_COUNT for number, label in enumerate(labels) if label in {*drawn[by]}}
    for row, one in enumerate(found):
        y, own = 100 - 100 * (row + 0.5) / len(found), one.cells.percent
        median, worst = f"{100 * one.median:.2g} %", error_text(one.worst.valid_error)
        rows.append((y, ", ".join(one.labels), f"{median}; {worst}"))
        for label, size in own.groupby(one.cells[by], sort=False).median().items():
            dots.append((f"look{names[label]}", x.at(size), y, f"{label}: median {size:.2g} %"))
        dots.append(("worst", x.at(own.max()), y, f"worst: {worst}"))
        dots.append(("median", x.at(own.median()), y, f"median: {median}"))
    return Chart(x, None, rows, dots=dots, names=names)


def _times(found: Sequence[DefinitionErrors]) -> Chart:
    """Median error over median run time, one line per definition through its mesh sizes."""
    medians = {", ".join(one.labels): one.cells.groupby("size", sort=False)[["seconds", "percent"]].median()
               for one in found}  # fmt: skip
    whole, lines, dots = pd.concat(medians), [], []
    x, y = Axis("run time [s]", whole.seconds, log=True), Axis(ERROR_AXIS, whole.percent, log=True)
    for look, (name, rows) in enumerate(medians.items()):
        lines.append((look, [(x.at(time), y.at(error)) for time, error in rows.to_numpy()]))
        for place, (size, time, error) in zip(lines[-1][1], rows.itertuples()):
            label = ", ".join(filter(None, (name, size)))
            dots.append((f"look{look}", *place, f"{label}: {error:.2g} %, {time:.2g} s"))
    return Chart(x, y, lines=lines, dots=dots, names={name: look for look, name in enumerate(medians)})


# -- sensitivity curves ------------------------------------------------------------------------------------------------


def _curves(curves: xr.Dataset) -> Content:
    """Charts of the error over k / (E t), one for each mesh type, material and load: nonlinear if available."""
    ratios, known = curves.stiffness_ratio.values, curves.deformation_error.notnull().any("stiffness_ratio")
    found = pd.DataFrame(columns(curves, known, ("predicted_stiffness", "best_stiffness")))
    curves = curves[["deformation_error", "stiffness"]]
    found["place"] = np.argwhere(known.values).tolist()
    panels = dict(list(found.groupby([*PANEL_LABELS], sort=False)))
    shown = [panel for panel in panels if panel[-1] == "nonlinear" or (*panel[:-1], "nonlinear") not in panels]
    looks = {_size(size): number % LOOK_COUNT for number, size in enumerate(curves.mesh_size.values)}
    x, charts, drawn = Axis("k / (E t)", ratios), [], set[str]()
    for panel in shown[:MOST_PANELS]:
        lines, dots, members = [], [], panels[panel]
        for _, cell in members[:MOST_LINES].iterrows():
            one = curves.isel(dict(zip(known.dims, cell.place)))
            size, percents = _size(cell.mesh_size), 100 * one.deformation_error.values
            kept = np.abs(percents) <= LARGEST_CURVE_PERCENT
            drawn |= {size} if kept.any() else set()
            lines.append((looks[size], [*zip(map(x.at, ratios[kept]), map(CURVE_AXIS.at, percents[kept]))]))
            membrane = float(np.nanmedian(one.stiffness.values / ratios))
            for name, stiffness in (("predicted", cell.predicted_stiffness), ("best", cell.best_stiffness)):
                if ratios[0] <= stiffness / membrane <= ratios[-1]:
                    text = f"{cell.beam}, {size}, {name}: {stiffness:.4g} N/m"
                    drawn |= {size, name}
                    dots.append((f"{name} look{looks[size]}", x.at(stiffness / membrane), CURVE_AXIS.at(0), text))
        more = f"; {len(members) - MOST_LINES} curves more" if len(members) > MOST_LINES else ""
        charts.append(Chart(x, CURVE_AXIS, lines=lines, dots=dots, title=", ".join(panel) + more))
    names = {size: look for size, look in looks.items() if size in drawn}
    return {"charts": charts, "names": names, "seen": drawn, "further": len(shown) - MOST_PANELS}


# -- the paper's tables ------------------------------------------------------------------------------------------------


def _paper_tables(cells: pd.DataFrame) -> Content:
    """Tables of the paper: printed numbers, and beside them our reference and errors of definitions."""
    tables: dict[str, dict[Any, Content]] = {}
    kinematics: dict[str, str] = {}  # that of each definition which is shown: nonlinear if there is one
    for one in sorted(definition_errors(cells), key=lambda one: (one.labels[0] != "paper", one.median)):
        name, own = one.labels
        kinematics[name] = own if own == "nonlinear" else kinematics.get(name, own)
    for cell in cells[cells.paper_table.notna()].to_dict("records"):
        title = f"Table {cell['paper_table']:g}: {cell['load']}, {cell['mesh_type']}, {cell['material']}"
        row = tables.setdefault(title, {}).setdefault((cell["beam"], f"{1e3 * cell['mesh_size']:.4g}"), {
            "printed": (f"{1e3 * cell['paper_reference_displacement']:.3f}", f"{1e3 * cell['paper_displacement']:.2f}",
                        f"{100 * cell['paper_deformation_error']:.2f}" + "*" * bool(cell.get("paper_remark"))),
            "reference": f"{1e3 * cell['reference_displacement']:.3f}", "errors": {},
        })  # fmt: skip
        if cell["kinematics"] == kinematics.get(cell["definition"]):
            status, error = Status(cell["status"]), f"{100 * cell['deformation_error']:+.2f}"
            row["errors"][cell["definition"]] = error if status == Status.SOLVED else status_words(status)
    return {"tables": dict(sorted(tables.items())[:MOST_PANELS]), "kinematics": kinematics}


def main(dataset: str, output: str, record: str, digest: str, *files: str) -> None:
    """Write the page of a dataset, and the record of it."""
    write_text(output, page(dataset, files))
    write_json(record, {"digest": digest})


if __name__ == "__main__":
    # xarray would import it, in a sixth of a second, to ask whether arrays are its own.
    sys.modules["pint"] = cast(Any, None)
    main(*sys.argv[1:])

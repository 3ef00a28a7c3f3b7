"""The overview that a page opens on, without a script: what to type, errors, curves, run times, the paper's tables."""

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from springtune.problem.compare import error_text
from springtune.problem.quantities import Status

from ..answers import (
    Columns,
    DefinitionErrors,
    Variables,
    definition_errors,
    has_own_law,
    requested_cells,
    what_to_type,
)
from ..text import label_text, range_text

Content = dict[str, Any]
"""Values that a template shows."""


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

GROUPS = {*(source.group for source in SOURCES), "/finite_strain", "/sensitivity"}
"""Groups that the overview reads."""

REMARK = "paper_remark"
"""Variable that says where the print contradicts itself."""

LOOKS = 8
"""Different colours of lines and dots."""

SMALLEST_PERCENT = 1e-4
"""Smaller errors stand at the end of their axis."""

SHORTEST_TIME = 1e-6
"""Shorter times [s] stand at the end of their axis."""

LARGEST_CURVE_PERCENT = 60.0
"""Largest error of a sensitivity curve."""

PANEL_LABELS = ("mesh_type", "material", "load", "kinematics")
"""Labels of a chart of sensitivity curves."""

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


def overview(groups: Mapping[str, Variables]) -> Content:
    """Content of the overview of a dataset's groups."""
    found, root, curves = [], groups.get("/", {}), groups.get("/sensitivity", {})
    for source in SOURCES:
        group = groups.get(source.group, {})
        if {source.error, "status", "definition"} <= {*group}:
            finite = groups.get("/finite_strain", {}) if source.group == "/" else {}
            content = _errors(source, requested_cells(group, finite, source.error))
            found.append(content | {"finite_strain": has_own_law(finite)})
    return {
        "sources": found,
        "curves": _curves({**root, **curves}) if "deformation_error" in curves else {},
        "paper": _paper_tables(requested_cells(root)) if "paper_table" in root else {},
    }


# -- what to type, errors and times ------------------------------------------------------------------------------------


def _errors(source: Source, cells: Columns) -> Content:
    """What to type, errors of definitions, and errors over run time."""
    found = sorted(definition_errors(cells), key=lambda one: one.median)
    answers = [*what_to_type(cells, (source.body, "mesh_type", "material"))] if source.body else []
    content: Content = {"source": source, "answers": answers[:MOST_ANSWERS], "further": len(answers) - MOST_ANSWERS}
    if found:
        percents = np.maximum(100 * np.abs(cells["valid_error"]), SMALLEST_PERCENT)
        content["errors"] = _dots(found, percents, cells[source.by], cells["valid_error"])
        if source.body and {"solve_seconds", "definition_seconds"} <= {*cells}:
            pairs = {*zip(cells[source.body].tolist(), cells["mesh_size"].tolist())}
            alike = len(pairs) == len({body for body, _ in pairs}) * len({size for _, size in pairs})
            # Where each body has mesh sizes of its own, medians by mesh size would be of different bodies.
            sizes = [_size(size) if alike else "" for size in cells["mesh_size"].tolist()]
            seconds = np.nan_to_num(cells["solve_seconds"] + cells["definition_seconds"])
            content["times"] = _times(found[:LOOKS], percents, np.array(sizes), seconds)
    return content


def _size(mesh_size: float) -> str:
    return label_text("mesh_size", mesh_size, "m")


def _stiffnesses(values: np.ndarray) -> str:
    return re.sub(r"e\+0?", "e", range_text(values)) + " N/m"


FILTERS = {"size": _size, "stiffnesses": _stiffnesses, "error": error_text}
"""Filters of the template."""


def _dots(found: Sequence[DefinitionErrors], percents: np.ndarray, labels: np.ndarray, errors: np.ndarray) -> Chart:
    """Errors of each definition: medians by label, of all, and the worst."""
    x, dots, rows = Axis(ERROR_AXIS, percents[np.concatenate([one.places for one in found])], log=True), [], []
    names = {label: number % LOOKS for number, label in enumerate(dict.fromkeys(labels.tolist()))}
    for row, one in enumerate(found):
        y, own = 100 - 100 * (row + 0.5) / len(found), percents[one.places]
        median, worst = f"{100 * one.median:.2g} %", error_text(errors[one.worst])
        rows.append((y, ", ".join(one.labels), f"{median}; {worst}"))
        for label, look in names.items():
            if (mine := own[labels[one.places] == label]).size:
                size = float(np.median(mine))
                dots.append((f"look{look}", x.at(size), y, f"{label}: median {size:.2g} %"))
        dots.append(("worst", x.at(own.max()), y, f"worst: {worst}"))
        dots.append(("median", x.at(np.median(own)), y, f"median: {median}"))
    return Chart(x, None, rows, dots=dots, names=names)


def _times(found: Sequence[DefinitionErrors], percents: np.ndarray, sizes: np.ndarray, seconds: np.ndarray) -> Chart:
    """Median error over median run time, a line a definition through its mesh sizes."""
    medians = {}
    for one in found:
        parts = {size: one.places[sizes[one.places] == size] for size in dict.fromkeys(sizes[one.places].tolist())}
        medians[", ".join(one.labels)] = [(size, float(np.median(seconds[places])), float(np.median(percents[places])))
                                          for size, places in parts.items()]  # fmt: skip
    _, times, errors = zip(*(row for rows in medians.values() for row in rows))
    x, y = Axis("run time [s]", np.maximum(times, SHORTEST_TIME), log=True), Axis(ERROR_AXIS, errors, log=True)
    lines, dots = [], []
    for look, (name, rows) in enumerate(medians.items()):
        places = [(x.at(max(time, SHORTEST_TIME)), y.at(error)) for _, time, error in rows]
        texts = [f"{name}, {size}: {error:.2g} %, {time:.2g} s".replace(", :", ":") for size, time, error in rows]
        lines.append((look, places))
        dots += [(f"look{look}", *place, text) for place, text in zip(places, texts)]
    return Chart(x, y, lines=lines, dots=dots, names={name: look for look, name in enumerate(medians)})


# -- sensitivity curves ------------------------------------------------------------------------------------------------


def _curves(curves: Variables) -> Content:
    """Charts of the error over k / (E t), one for each mesh type, material and load: nonlinear where there is one."""
    dims, errors = curves["deformation_error"]
    labels = {name: curves[name][1].tolist() for name in dims}
    panels: dict[tuple[str, ...], list[tuple[Content, tuple[int, ...]]]] = {}
    for place in map(tuple, np.argwhere(np.isfinite(errors).any(axis=-1))):
        cell = {name: labels[name][at] for name, at in zip(dims, place)}
        panels.setdefault(tuple(cell[name] for name in PANEL_LABELS), []).append((cell, place))
    shown = [panel for panel in panels if panel[-1] == "nonlinear" or (*panel[:-1], "nonlinear") not in panels]
    looks = {_size(size): number % LOOKS for number, size in enumerate(labels["mesh_size"])}
    x, charts = Axis("k / (E t)", curves["stiffness_ratio"][1]), []
    for panel in shown[:MOST_PANELS]:
        lines, dots, members = [], [], panels[panel]
        for cell, place in members[:MOST_LINES]:
            size = _size(cell["mesh_size"])
            points, marks = _curve(curves, place, x)
            lines.append((looks[size], points))
            for name, at, stiffness in marks:
                text = f"{cell['beam']}, {size}, {name}: {stiffness:.4g} N/m"
                dots.append((f"{name} look{looks[size]}", at, CURVE_AXIS.at(0), text))
        more = f"; {len(members) - MOST_LINES} curves more" if len(members) > MOST_LINES else ""
        charts.append(Chart(x, CURVE_AXIS, lines=lines, dots=dots, title=", ".join(panel) + more))
    seen = {dot[0].split()[0] for chart in charts for dot in chart.dots}
    return {"charts": charts, "names": looks, "seen": seen, "further": len(shown) - MOST_PANELS}


def _curve(curves: Variables, place: tuple[int, ...], x: Axis) -> tuple[list[Any], list[tuple[str, float, float]]]:
    """Points of a curve, and name, place and value of its predicted and its best stiffness."""
    ratios, percents = curves["stiffness_ratio"][1], 100 * curves["deformation_error"][1][place]
    kept = np.abs(percents) <= LARGEST_CURVE_PERCENT
    points = [(x.at(one), CURVE_AXIS.at(other)) for one, other in zip(ratios[kept], percents[kept])]
    membrane = float(np.nanmedian(curves["stiffness"][1][place] / ratios))
    marks = [(name, float(curves[f"{name}_stiffness"][1][place])) for name in ("predicted", "best")]
    return points, [(name, x.at(stiffness / membrane), stiffness) for name, stiffness in marks
                    if ratios[0] <= stiffness / membrane <= ratios[-1]]  # fmt: skip


# -- the paper's tables ------------------------------------------------------------------------------------------------


def _paper_tables(cells: Columns) -> Content:
    """Tables of the paper: printed numbers, and beside them our reference and errors of definitions."""
    printed = np.flatnonzero(np.isfinite(cells["paper_table"]))
    tables: dict[str, dict[Any, Content]] = {}
    kinematics: dict[str, str] = {}  # that of each definition which is shown: nonlinear if there is one
    for one in sorted(definition_errors(cells), key=lambda one: (one.labels[0] != "paper", one.median)):
        name, own = one.labels
        kinematics[name] = own if own == "nonlinear" else kinematics.get(name, own)
    for place in printed:
        cell: Content = {name: values[place] for name, values in cells.items()}
        title = f"Table {cell['paper_table']:g}: {cell['load']}, {cell['mesh_type']}, {cell['material']}"
        row = tables.setdefault(title, {}).setdefault((cell["beam"], f"{1e3 * cell['mesh_size']:.4g}"), {
            "printed": (f"{1e3 * cell['paper_reference_displacement']:.3f}", f"{1e3 * cell['paper_displacement']:.2f}",
                        f"{100 * cell['paper_deformation_error']:.2f}" + "*" * bool(cell.get(REMARK))),
            "reference": f"{1e3 * cell['reference_displacement']:.3f}", "errors": {},
        })  # fmt: skip
        if cell["kinematics"] == kinematics.get(cell["definition"]):
            solved = cell["status"] == Status.SOLVED
            text = (
                f"{100 * cell['deformation_error']:+.2f}" if solved else str(Status(cell["status"])).replace("_", " ")
            )
            row["errors"][cell["definition"]] = text
    return {"tables": dict(sorted(tables.items())[:MOST_PANELS]), "kinematics": kinematics}

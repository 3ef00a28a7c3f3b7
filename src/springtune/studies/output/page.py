"""The page of all tables, each also as CSV."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import xarray as xr

from springtune.safe_io.atomic import write_text

from ..config.kind import kinds
from .selection import sign_of_errors
from .text import csv_text, decimals, number

ANSWERED = ("solved", "unstable", "linear_only")
"""Statuses of networks with a displacement."""

MOST_ROWS = 1000
"""Most rows on the page; CSV files have all."""

COLUMN_UNITS = {"mm2": "mm²", "mm": "mm", "percent": "%", "points": "points", "N": "N", "MPa": "MPa", "ms": "ms"}


def write(tree: xr.DataTree, folder: str | Path) -> list[str]:
    """Write a CSV file for each table, and a page with all."""
    tables = [table for kind in kinds() if kind.tables for table in kind.module(kind.tables_by).tables(tree)]
    written = {f"{table['stem']}.csv": csv_text(table["rows"]) for table in tables}
    scenes = [_scenes(table, list(map(str, tree.kinematics.values))) for table in tables if "title" not in table]
    further = [shown(table) for table in tables if "title" in table]
    root = tree.to_dataset()
    about = tree.attrs | {"sign": sign_of_errors(root) if scenes else ""}
    written["index.html"] = html(scenes, further, _beams(root), about)
    for name, text in written.items():
        write_text(Path(folder) / name, text)
    return list(written)


def html(
    scenes: list[dict[str, Any]], further: list[dict[str, Any]], beams: list[str], attributes: Mapping[Any, Any]
) -> str:
    """Page of tables prepared by `shown`, with the dataset's attributes and the meaning of a `sign`."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("springtune.studies.output", ""),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    marks = {mark for table in scenes for mark in table["marks"]}
    return environment.get_template("page.html").render(
        tables=scenes, further=further, beams=beams, marks=marks, attributes=attributes
    )


def _beams(root: xr.Dataset) -> list[str]:
    """Dimensions of a study's beams."""
    found = []
    for name in root.beam.values if "beam_length" in root else []:
        one = root.sel(beam=name)
        sides = [1e3 * float(one[f"beam_{side}"]) for side in ("length", "height")]
        told = "beam_thickness" in one and one.beam_thickness.ndim == 0  # else it is swept
        thick = 1e3 * float(one.beam_thickness) if told else np.nan
        said = name == f"{sides[0]:g}x{sides[1]:g}"  # as "200x40"
        if np.isfinite(sides).all() and (not said or np.isfinite(thick)):
            text = f"{name} mm" if said else f"{name}, {sides[0]:.4g} x {sides[1]:.4g} mm"
            found.append(f"{text}, {thick:.4g} mm thick" if np.isfinite(thick) else text)
    return found


# -- tables of scenes --------------------------------------------------------------------------------------------------


def _scenes(table: Mapping[str, Any], kinematics: list[str]) -> dict[str, Any]:
    """Prepare a table of scenes: one line for each kinematics of a row."""
    rows, definitions = table["rows"], table["definitions"]
    there = [name for name in kinematics if any(f"{one}_{name}_status" in row for row in rows for one in definitions)]
    displacements = [row["reference_mm"] for row in rows]
    displacements += [row[name] for row in rows for name in map(_own_reference, there) if name in row]
    errors = []
    for row in rows:
        for name in (f"{one}_{kind}" for one in definitions for kind in there):
            displacements.append(row.get(f"{name}_mm", np.nan))
            errors.append(row.get(f"{name}_error_percent", np.nan))
    places = decimals(displacements), _of_errors(errors)
    marks: set[str] = set()
    swept = {name: [f"{row[name]:.6g}" for row in rows] for name in table["swept"]}
    lines = []
    for place, row in enumerate(rows[:MOST_ROWS]):
        own = [texts[place] for texts in swept.values()]
        lines += [line | {"swept": own} for line in _lines(row, definitions, there, places, marks)]
    return dict(table) | {
        "lines": lines,
        "beyond": _beyond(rows),
        "kinematics": there,
        "printed": any(row["printed_displacement_mm"] == row["printed_displacement_mm"] for row in rows),
        "heads": [_head(name) for name in table["swept"]],
        "stiffness": list(_stiffnesses(rows, definitions, there)),
        "objections": _objections(rows, there),
        "remarks": [f"{row['beam']}, {row['mesh_size_mm']:g} mm: {row['remark']}" for row in rows if row["remark"]],
        "marks": marks,
    }


def _beyond(rows: list[Mapping[str, Any]]) -> str:
    """Note on rows that are left out."""
    return f"The first {MOST_ROWS} of {len(rows)} rows; the file has all of them: " if len(rows) > MOST_ROWS else ""


def _of_errors(values: list[float]) -> int:
    """Decimals of errors [%] for three digits of their median."""
    sizes = np.abs([value for value in values if np.isfinite(value) and value])
    return int(np.clip(decimals([float(np.median(sizes))], 3) or 0, 1, 4)) if len(sizes) else 2


def _lines(
    row: Mapping[str, Any],
    definitions: list[str],
    kinematics: list[str],
    places: tuple[int | None, int],
    marks: set[str],
) -> Iterable[dict[str, Any]]:
    """Lines of a row, one for each kinematics; the first has the common columns."""
    length, percent = places
    asked = [name for name in kinematics if any(f"{one}_{name}_status" in row for one in definitions)]
    objected = [name for name in asked if row[f"reference_applies_{name}"] == "no"]
    marks |= {"r"} if objected else set()
    marks |= {"*"} if row["remark"] else set()
    own = [name for name in asked if _own_reference(name) in row]
    marks |= {"f"} if own else set()
    for name in asked:
        cells = []
        for definition in definitions:
            one = f"{definition}_{name}"
            status, message = row.get(f"{one}_status", "not_requested"), row.get(f"{one}_message", "")
            if status not in ANSWERED or not np.isfinite(row[f"{one}_mm"]):  # beyond a limit point there is none
                said = "not asked" if status == "not_requested" else status.replace("_", " ")
                cells.append({"words": said, "soft": status == "not_requested", "title": message})
                continue
            mark = {"unstable": "u", "linear_only": "l"}.get(status, "")
            marks |= {mark} if mark else set()
            cells.append({
                "displacement": number(row[f"{one}_mm"], length),
                "error": number(row[f"{one}_error_percent"], percent, sign=True),
                "mark": mark,
                "title": message,
            })  # fmt: skip
        yield {
            "first": name == asked[0],
            "span": len(asked),
            "row": row,
            "size": f"{row['mesh_size_mm']:g}",
            "force": f"{row['force_N']:g}".replace("-", "−"),
            "printed": [number(row["printed_reference_mm"], 3), number(row["printed_displacement_mm"], 2),
                        number(row["printed_error_percent"], 2)],
            "kinematics": name,
            "reference": number(row[_own_reference(name)] if name in own else row["reference_mm"], length),
            "shares_reference": not own,
            "finite": name in own,
            "objection": f"{' and '.join(objected)}: {row['reference_message']}" if objected else "",
            "cells": cells,
        }  # fmt: skip


def _own_reference(kinematics: str) -> str:
    """Column of a kinematics' own reference at finite strain."""
    return f"reference_{kinematics}_mm"


def _stiffnesses(rows: list[Mapping[str, Any]], definitions: list[str], kinematics: list[str]) -> Iterable[str]:
    """Uniform stiffnesses of a table's networks."""
    for definition in definitions:
        texts = {}
        for name in kinematics:
            found = [row.get(f"{definition}_{name}_stiffness_N_per_m", np.nan) for row in rows]
            known = sorted(value for value in found if np.isfinite(value))
            ends = list(dict.fromkeys(f"{value:.4g}" for value in known[:1] + known[-1:]))
            if ends:
                texts[name] = " to ".join(ends)
        if len(set(texts.values())) == 1:
            yield f"{definition}: k = {next(iter(texts.values()))} N/m"
        else:
            yield from (f"{definition}, {name}: k = {text} N/m" for name, text in texts.items())


def _objections(rows: list[Mapping[str, Any]], kinematics: list[str]) -> list[str]:
    """Objections to references, once a beam."""
    found: dict[str, None] = {}
    for row in rows:
        against = [name for name in kinematics if row[f"reference_applies_{name}"] == "no"]
        if against:
            found.setdefault(f"{row['beam']}, {' and '.join(against)}: {row['reference_message']}", None)
    return list(found)


# -- other tables ------------------------------------------------------------------------------------------------------


def shown(table: Mapping[str, Any]) -> dict[str, Any]:
    """Prepare any table: heads with units, and texts."""
    rows = table["rows"]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    texts, words = {}, []
    for name in columns:
        values = [row.get(name, np.nan) for row in rows]
        if any(isinstance(value, str) for value in values):
            texts[name] = [value if isinstance(value, str) else "–" for value in values]
            words.append(columns.index(name))
            continue
        short = [f"{value:g}" for value in values]
        if max(map(len, short)) <= 4 and "nan" not in short:  # as a study says it: mesh sizes, friction
            texts[name] = short
            continue
        error = "error" in name
        places = _of_errors(values) if error else decimals(values)
        texts[name] = [number(value, places, sign=error) for value in values]
    return dict(table) | {
        "heads": [_head(name) for name in columns],
        "words": words,
        "lines": [[texts[name][place] for name in columns] for place in range(len(rows[:MOST_ROWS]))],
        "beyond": _beyond(rows),
    }


def _head(name: str) -> str:
    """Column name with its unit in brackets."""
    words = name.split("_")
    unit = COLUMN_UNITS.get(words[-1], "") if len(words) > 1 else ""
    return f"{' '.join(words[:-1])} [{unit}]" if unit else " ".join(words)

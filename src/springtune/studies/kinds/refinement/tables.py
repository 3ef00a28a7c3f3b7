"""Tables of refinements: their values, and where errors are zero or the tolerance."""

from pathlib import Path

import numpy as np

from springtune.safe_io.atomic import write_text

from ...output.dataset import STATUS
from ...output.tables import csv_text
from .names import VARIED
from .outputs import REFINEMENT_TABLES

CROSSING_COLUMNS = ("refinement", "definition", "parameter", "unit", "error", "value", "width", "change")
"""Columns of the table of crossings."""

VALUE_COLUMNS = ("displacement", "reference_displacement", "reference_error_estimate", "deformation_error", "particles")


def write(tree, folder):
    """Write two CSV files."""
    data = tree["refinement"].to_dataset()
    for name, rows in zip(REFINEMENT_TABLES, (_values(data), _crossings(data))):
        write_text(Path(folder) / name, csv_text(rows))
    return list(REFINEMENT_TABLES)


def _cells(data):
    """Each refinement and definition that has values: its part of the dataset, and its labels for a row."""
    for name in data.refinement.values.tolist():
        for definition in data.definition.values.tolist():
            cell = data.sel(refinement=name, definition=definition)
            if cell.value_count:
                parameter = str(cell.parameter.item())
                # NaN, where there is no value, comes last.
                cell = cell.isel(point=np.argsort(cell[f"refined_{parameter}"].values, kind="stable"))
                labels = {"refinement": name, "definition": definition, "parameter": parameter}
                yield cell, labels | {"unit": VARIED[parameter].unit}


def _values(data):
    rows = []
    for cell, labels in _cells(data):
        for point in range(int(cell.value_count)):
            one = cell.isel(point=point)
            row = labels | {"value": float(one[f"refined_{labels['parameter']}"]), "batch": int(one.batch)}
            row |= {name: float(one[name]) for name in VALUE_COLUMNS}
            rows.append(row | {"status": STATUS[int(one.status)], "message": str(one.message.item())})
    return rows


def _crossings(data):
    rows = []
    for cell, labels in _cells(data):
        for number in np.flatnonzero(np.isfinite(cell.crossing_level.values)):
            one, name = cell.isel(crossing=number), f"crossing_{labels['parameter']}"
            row = {"error": float(one.crossing_level), "value": float(one[name]), "width": float(one[f"{name}_width"])}
            rows.append(labels | row | {"change": float(one.crossing_change)})
    # A file without rows has its columns.
    return rows or [dict.fromkeys(CROSSING_COLUMNS, "")]

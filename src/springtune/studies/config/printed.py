"""Printed values to compare with."""

import math
from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path
from typing import Any

from springtune.problem.loads import LOADS
from springtune.problem.quantities import nearest

from .csv_files import read_lines
from .messages import Problems, show
from .model import PrintedCell

_PRINTED_COLUMNS = {
    # column: field and unit of PrintedCell; without unit, a text
    "table": ("table", ""),
    "beam": ("beam", None),
    "mesh_type": ("mesh_type", None),
    "mesh_size_mm": ("mesh_size", "1e-3"),
    "material": ("material", None),
    "load": ("load", None),
    "force_N": ("force", "1"),
    "stiffness_N_per_m": ("stiffness", "1"),
    "reference_displacement_mm": ("reference_displacement", "1e-3"),
    "displacement_mm": ("displacement", "1e-3"),
    "deformation_error_percent": ("deformation_error", "1e-2"),
    "remark": ("remark", None),
}


def read_printed(path: Path, mesh_types: Sequence[str], problems: Problems) -> tuple[PrintedCell, ...]:
    """Read printed cells from CSV; lines that start with # are comments."""
    file_problems = Problems(str(path))
    cells: dict[tuple[Any, ...], tuple[int, PrintedCell]] = {}
    header: list[str] | None = None
    remedy = "give the path of a CSV file, or remove the key"
    for line, row in read_lines(path, ("printed",), problems, file_problems, remedy):
        if header is None:
            header = row
            if sorted(header) != sorted(_PRINTED_COLUMNS):
                wanted = ",".join(_PRINTED_COLUMNS)
                file_problems.add((), f"has columns {show(','.join(header))}; give {wanted}", line)
                break
        else:
            cell = _printed_cell(header, row, mesh_types, line, file_problems)
            if cell:
                label = (cell.beam, cell.mesh_type, cell.mesh_size, cell.material, cell.load)
                first = cells.setdefault(label, (line, cell))[0]
                if first != line:
                    file_problems.add((), f"is the cell of line {first} again; remove one", line)
    if not cells:
        file_problems.add((), f"no printed values; give a line {','.join(_PRINTED_COLUMNS)} and a line for each cell")
    file_problems.stop()
    return tuple(cell for _, cell in cells.values())


def _printed_cell(
    header: Sequence[str], row: Sequence[str], mesh_types: Sequence[str], line: int, problems: Problems
) -> PrintedCell | None:
    if len(row) != len(header):
        problems.add((), f"{len(row)} values for {len(header)} columns; add or remove some", line)
        return None
    values: dict[str, Any] = {}
    for column, text in zip(header, row):
        field, size = _PRINTED_COLUMNS[column]
        known = {"mesh_type": mesh_types, "load": LOADS}.get(field)
        if size is None:
            values[field] = text
            if known and text not in known:
                problems.add((column,), f"unknown {field.replace('_', ' ')} {show(text)}; {nearest(text, known)}", line)
                return None
            continue
        try:
            values[field] = int(text) if field == "table" else float(Decimal(text) * Decimal(size))
            if not math.isfinite(values[field]) or values[field] < 0:
                raise ValueError
        except (ValueError, ArithmeticError):
            problems.add((column,), f"{show(text)} is not a number of 0 or more; give the printed one, unsigned", line)
            return None
    return PrintedCell(**values)

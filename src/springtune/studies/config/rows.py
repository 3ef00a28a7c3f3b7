"""Combinations of a grid from a CSV file: one column a parameter, one row a combination."""

import re
from pathlib import Path
from typing import Any

from springtune.problem.quantities import nearest

from .csv_files import read_lines
from .fields import MOST_LISTED
from .messages import Problems, show
from .sections import GRID_PARAMETERS

HEAD = re.compile(r"\s*(?P<name>\w*)\s*(\[(?P<unit>[^\]]*)\])?\s*")
"""Column head: a parameter and the unit of its numbers in brackets."""


def with_rows(content: Any, folder: Path, problems: Problems) -> Any:
    """Replace the file of rows in each grid by its content."""
    grids = content.get("grids") if isinstance(content, dict) else None
    if not isinstance(grids, dict):
        return content
    found = dict(grids)
    for name, grid in grids.items():
        rows = grid.get("rows") if isinstance(grid, dict) else None
        if not isinstance(rows, str) or not rows.strip():
            continue  # as any other value that is none
        columns = _columns(name, folder / rows, problems)
        for key in columns:
            if grid.get(key) is not None:
                problems.add(("grids", name, key), f"'{rows}' has a column '{key}', too; remove one of them")
        problems.stop()
        values = {key: [text for text, _ in cells] for key, cells in columns.items()}
        for key, cells in columns.items():
            for number, (_, line) in enumerate(cells):
                problems.located(("grids", name, key, number), f"{folder / rows}:{line}")
        zipped = grid.get("zip") or []
        zipped = [zipped] if isinstance(zipped, list) and zipped and isinstance(zipped[0], str) else zipped
        found[name] = grid | values
        if len(values) > 1 and isinstance(zipped, list):
            found[name]["zip"] = [*zipped, [*values]]
    return content | {"grids": found}


def _columns(grid: str, path: Path, problems: Problems) -> dict[str, list[tuple[str, int]]]:
    columns: dict[str, list[tuple[str, int]]] = {}
    heads: list[tuple[str, str]] = []
    own = Problems(str(path))
    for line, row in read_lines(path, ("grids", grid, "rows"), problems, own, "give the path of a CSV file"):
        if not heads:
            heads = _heads(row, line, own)
            columns = {name: [] for name, _ in heads}
        elif len(row) != len(heads):
            own.add((), f"{len(row)} values in {len(heads)} columns; give one for each", line)
        else:
            for (name, unit), cell in zip(heads, row):
                if not cell.strip():
                    own.add((), f"nothing in column '{name}'; give a value", line)
                columns[name].append((f"{cell.strip()} {unit}".strip(), line))
    count = max(map(len, columns.values()), default=0)
    if not count and own.nothing:
        own.add((), "no rows; give a line of parameters such as beam,mesh_size,force and a line for each combination")
    if count > MOST_LISTED:
        own.add((), f"{count} rows; give at most {MOST_LISTED}, or split the file and the grid into several")
    own.stop()
    return columns


def _heads(row: list[str], line: int, problems: Problems) -> list[tuple[str, str]]:
    """Read the parameter and the unit of each column."""
    found: list[tuple[str, str]] = []
    for cell in row:
        head = HEAD.fullmatch(cell)
        name = head["name"] if head else cell.strip()
        if not head or name not in GRID_PARAMETERS:
            problems.add((), f"unknown column {show(cell)}; {nearest(name, GRID_PARAMETERS)}", line)
        elif name in (known for known, _ in found):
            problems.add((), f"a second column '{name}'; remove one", line)
        else:
            found.append((name, head["unit"] or ""))
    problems.stop()
    return found

"""Combinations of a grid's parameters, from lists and CSV files; printed values to compare with, from CSV files."""

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from itertools import chain, product
from pathlib import Path
from typing import Any

from springtune.problem.loads import LOADS
from springtune.problem.quantities import nearest
from springtune.safe_io.inputs import LARGEST_CSV, read

from .fields import MOST_LISTED
from .messages import Key, Problems, show, unseen
from .model import PrintedCell
from .sections import GRID_PARAMETERS, GridConfig

Factor = tuple[tuple[str, ...], list[tuple[Any, ...]]]
"""Names of zipped parameters, and one tuple of values for each combination."""

Combination = dict[str, Any]

SAME_VALUE = 1e-9
"""Relative difference below which two numbers are the same value."""


def values_of(grid: GridConfig, name: str) -> list[Any]:
    """Values of a grid's parameter; forces given by beam are joined."""
    values = getattr(grid, name)
    if isinstance(values, dict):
        return [force for forces in values.values() for force in forces]
    return values or []


def groups_of(grid: GridConfig) -> list[tuple[str, ...]]:
    """Groups of zipped parameters in the order of `GRID_PARAMETERS`."""
    zipped = {name: tuple(group) for group in grid.zip for name in group}
    given = [name for name in GRID_PARAMETERS if getattr(grid, name) is not None]
    return list(dict.fromkeys(zipped.get(name, (name,)) for name in given))


def check_groups(name: str, grid: GridConfig, content: Mapping[str, Any], problems: Problems) -> None:
    """Check that zipped lists have equal lengths and other lists no duplicates."""
    for group in groups_of(grid):
        if len(group) == 1:
            _check_repeats(name, group[0], grid, content, problems)
            continue
        where = ("grids", name, "zip")
        absent = [one for one in group if not values_of(grid, one)]
        if absent:
            problems.add(where, f"'{absent[0]}' is zipped and has no values; give it some, or leave it out of 'zip'")
        elif grid.force and "force" in group and None not in grid.force:
            problems.add(where, "'force' is zipped and has values for each beam; give one list for all, or zip neither")
        else:
            lengths = {one: len(values_of(grid, one)) for one in group}
            if len(set(lengths.values())) > 1:
                shown = ", ".join(f"{length} of '{one}'" for one, length in lengths.items())
                problems.add(where, f"{shown} cannot go together; give each as many values")


def _check_repeats(name: str, parameter: str, grid: GridConfig, content: Mapping[str, Any], problems: Problems) -> None:
    values = getattr(grid, parameter)
    for beam, listed in values.items() if isinstance(values, dict) else [(None, values)]:
        written = content.get(parameter)
        path: tuple[Key, ...] = ("grids", name, parameter)
        if beam is not None:
            written, path = written[beam], (*path, beam)  # type: ignore[index]
        seen = set()
        for number, value in enumerate(listed):
            if value in seen:
                shown = written[number] if isinstance(written, list) else value
                place = (*path, number) if isinstance(written, list) else path
                problems.add(place, f"'{shown}' is listed twice; remove one")
            seen.add(value)


def factors(grid: GridConfig) -> list[Factor]:
    """Factors whose product is all combinations of a grid."""
    found: list[Factor] = []
    for group in groups_of(grid):
        if group == ("force",) and grid.force and None not in grid.force:
            continue  # forces of each beam go with the beam
        columns = [grid.force[None] if one == "force" else getattr(grid, one) for one in group]  # type: ignore[index]
        found.append((group, list(zip(*columns, strict=True))))
    if grid.force and None not in grid.force:
        place = next(number for number, (group, _) in enumerate(found) if "beam" in group)
        group, rows = found[place]
        beam = group.index("beam")
        found[place] = (*group, "force"), [(*row, force) for row in rows for force in grid.force.get(row[beam], ())]
    return found


def count(grid: GridConfig) -> tuple[int, dict[str, int]]:
    """Count the combinations before exclusions, and the size of each factor."""
    lengths = {" and ".join(group): len(rows) for group, rows in factors(grid)}
    return math.prod(lengths.values()), lengths


def combinations(name: str, grid: GridConfig, problems: Problems) -> Iterator[Combination]:
    """Yield the combinations of a grid without excluded ones."""
    parts = factors(grid)
    names = [*chain.from_iterable(group for group, _ in parts)]
    left_out = [{key: values for key, values in one if values is not None} for one in grid.exclude]
    matched = [False] * len(left_out)
    for rows in product(*(rows for _, rows in parts)):
        combination = dict(zip(names, chain.from_iterable(rows)))
        found = [all(_among(combination.get(key), values) for key, values in one.items()) for one in left_out]
        if True in found:
            matched = [before or now for before, now in zip(matched, found)]
            continue
        yield combination
    for number, there in enumerate(matched):
        if not there:
            shown = ", ".join(left_out[number])
            problems.add(
                ("grids", name, "exclude", number),
                f"no combination of the grid has these values of {shown}; correct them, or remove the entry",
            )


def _among(value: Any, values: list[Any]) -> bool:
    """Return whether a value is listed; numbers match within `SAME_VALUE`."""
    if isinstance(value, float):
        return any(abs(value - one) <= SAME_VALUE * abs(one) for one in values)
    return value in values


# -- CSV files ---------------------------------------------------------------------------------------------------------


def read_lines(
    path: Path, where: Sequence[Key], problems: Problems, own: Problems, remedy: str
) -> Iterator[tuple[int, list[str]]]:
    """Yield the lines of a CSV file without empty ones and comments (#)."""
    try:
        text = read(path, LARGEST_CSV).decode("utf-8-sig")
    except ValueError as error:
        why = "not UTF-8 text" if isinstance(error, UnicodeDecodeError) else error
        problems.stop_at(where, f"'{path}' cannot be read: {why}; {remedy}")
    # Empty lines in place of comments, so that the reader's line numbers are the file's.
    reader = csv.reader("\n" if line.startswith("#") else line for line in text.splitlines(keepends=True))
    try:
        for row in reader:
            for why in filter(None, (unseen(cell.strip()) for cell in row)):
                own.add((), why, reader.line_num)
            if any(cell.strip() for cell in row):
                yield reader.line_num, row
    except csv.Error as error:
        own.add((), f"not CSV: {error}; correct or remove the line", reader.line_num)


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
            continue  # validation refuses it
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

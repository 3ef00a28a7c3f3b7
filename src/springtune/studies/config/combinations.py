"""Combinations of a grid's parameters, from lists and CSV files; printed values to compare with, from CSV files."""

from collections.abc import Iterator, Sequence
from decimal import Decimal
from itertools import chain, product
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from springtune.problem.quantities import nearest
from springtune.safe_io.files import Rows, csv_rows

from .fields import BeamName, Load, MaterialName, MeshType, Section
from .messages import Key, Problems, control_character_fault, show, validated
from .sections import GRID_PARAMETERS, GridConfig

Factor = tuple[tuple[str, ...], list[tuple[Any, ...]]]
"""Names of zipped parameters, and one tuple of values for each combination."""

Combination = dict[str, Any]

SAME_VALUE = 1e-9
"""Relative difference below which two numbers are the same value."""


def factors(grid: GridConfig) -> list[Factor]:
    """Factors whose product is all combinations of a grid; forces by beam, material or load go with it."""
    columns = tuple(grid.rows[1:])
    names = [name for name in GRID_PARAMETERS if getattr(grid, name) and name not in columns]
    found: list[Factor] = []
    for group in filter(None, (columns, *((name,) for name in names))):
        if group != ("force",) or not isinstance(grid.force, dict):
            found.append((group, list(zip(*(getattr(grid, name) for name in group), strict=True))))
    if isinstance(grid.force, dict):
        place = next(number for number, (group, _) in enumerate(found) if grid.force_owner in group)
        group, rows = found[place]
        owner = group.index(grid.force_owner)
        found[place] = (*group, "force"), [(*row, force) for row in rows for force in grid.force.get(row[owner], ())]
    return found


def combinations(grid: GridConfig) -> Iterator[Combination]:
    """Yield the combinations of a grid."""
    parts = factors(grid)
    names = [*chain.from_iterable(group for group, _ in parts)]
    for rows in product(*(rows for _, rows in parts)):
        yield dict(zip(names, chain.from_iterable(rows)))


# -- CSV files ---------------------------------------------------------------------------------------------------------


def _table(path: Path, where: Sequence[Key], problems: Problems, example: str) -> Rows:
    """Rows of a CSV file with their lines, the head first; `where` is the key of the file."""
    try:
        rows = csv_rows(path, ValueError, "give the path of a CSV file, or remove the key")
    except ValueError as error:
        problems.stop_at(where, str(error))
    own = Problems(str(path))
    for line, row in rows:
        for why in filter(None, map(control_character_fault, row)):
            own.add((), why, line)
        if len(row) != len(rows[0][1]):
            own.add((), f"{len(row)} values in {len(rows[0][1])} columns; give one for each", line)
    if len(rows) == 1:
        own.add((), f"no rows below the head; give {example}")
    own.stop()
    return rows


def add_rows(content: Any, problems: Problems, files: list[str]) -> None:
    """Add the columns of the file of rows to each grid that has one, and note the file."""
    grids = content.get("grids") if isinstance(content, dict) else None
    for name, grid in grids.items() if isinstance(grids, dict) else ():
        file = grid.get("rows") if isinstance(grid, dict) else None
        if not isinstance(file, str) or not file.strip():
            continue  # validation refuses it
        where, path = ("grids", name), problems.folder / file
        example = "a head such as beam,mesh_size [mm],force and a line for each combination"
        (first, head), *rows = _table(path, (*where, "rows"), problems, example)
        problems.located((*where, "rows"), f"{path}:{first}")
        columns: dict[str, list[str]] = {}
        for place, cell in enumerate(head):
            key, _, unit = (part.strip(" ]") for part in cell.partition("["))
            if key not in GRID_PARAMETERS:
                message = f"unknown column {show(cell)}; {nearest(key, GRID_PARAMETERS)}"
                problems.add((*where, "rows"), message)
            if key in columns or grid.get(key) is not None:
                problems.add((*where, key), f"'{file}' has a column '{key}', too; remove one of them")
            columns[key] = [f"{row[place].strip()} {unit}".strip() for _, row in rows]
            for item, (line, _) in enumerate(rows):
                problems.located((*where, key, item), f"{path}:{line}")
        problems.stop()
        grid |= {key: tuple(values) for key, values in columns.items()} | {"rows": [file, *columns]}
        files.append(file)


def _printed(unit: str) -> tuple[Any, ...]:
    """Notes of a printed number in a unit of this size."""
    title = "the printed number, of 0 or more and unsigned"
    return Field(ge=0, le=Decimal("1e30"), title=title), AfterValidator(lambda found: float(found * Decimal(unit)))


class PrintedCell(Section):
    """A printed table cell in SI units; magnitudes only. `remark` names contradictions in the print."""

    table: Annotated[int, Field(ge=1, title="a whole number from 1")]
    beam: BeamName
    mesh_type: MeshType
    mesh_size: Annotated[Decimal, *_printed("1e-3")] = Field(alias="mesh_size_mm")
    material: MaterialName
    load: Load
    force: Annotated[Decimal, *_printed("1")] = Field(alias="force_N")
    stiffness: Annotated[Decimal, *_printed("1")] = Field(alias="stiffness_N_per_m")
    reference_displacement: Annotated[Decimal, *_printed("1e-3")] = Field(alias="reference_displacement_mm")
    displacement: Annotated[Decimal, *_printed("1e-3")] = Field(alias="displacement_mm")
    deformation_error: Annotated[Decimal, *_printed("1e-2")] = Field(alias="deformation_error_percent")
    remark: str


def read_printed(path: Path, mesh_types: Sequence[str], problems: Problems) -> tuple[PrintedCell, ...]:
    """Read printed cells from CSV; lines that start with # are comments."""
    columns = ",".join(field.alias or name for name, field in PrintedCell.model_fields.items())
    (_, head), *rows = _table(path, ("printed",), problems, f"the head {columns} and a line for each cell")
    own = Problems(str(path))
    cells: dict[tuple[Any, ...], tuple[int, PrintedCell]] = {}
    for line, row in rows:
        cell = validated(PrintedCell, dict(zip(head, row)), own, line)
        if cell.mesh_type not in mesh_types:
            own.add(
                ("mesh_type",), f"unknown mesh type '{cell.mesh_type}'; {nearest(cell.mesh_type, mesh_types)}", line
            )
        first, _ = cells.setdefault((cell.beam, cell.mesh_type, cell.mesh_size, cell.material, cell.load), (line, cell))
        if first != line:
            own.add((), f"is the cell of line {first} again; remove one", line)
    own.stop()
    return tuple(cell for _, cell in cells.values())

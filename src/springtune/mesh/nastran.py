"""Read the mesh of Nastran's bulk data; the number of a property names its cells."""

import re
from collections import defaultdict

import numpy as np

from .cells import MeshError
from .content import IN_OTHER_FILES, LINEAR, Content, places

CARDS = {
    **dict.fromkeys(("CTRIA3", "CTRIAR"), ("triangle", 2, 5)),
    **dict.fromkeys(("CQUAD4", "CQUADR", "CSHEAR"), ("quad", 2, 6)),
    **dict.fromkeys(("CROD", "CBAR", "CBEAM", "CTUBE"), ("line", 2, 4)),
    **dict.fromkeys(("CONROD", "PLOTEL"), ("line", 1, 3)),
}
"""Type of cells by card, and where their points are."""

OTHER_CARDS = re.compile(r"C(TRIA6|TRIAX\d*|TRAX\d+|QUAD|QUAD[89]|QUADX\d*|TETRA|HEXA|PENTA|PYRAM?)")
"""Cards of cells that are not read."""


def _cards(text: str) -> list[list[str]]:
    """Fields of cards, by commas or in columns of 8 or 16 characters, with the lines that go on."""
    lines = [line.partition("$")[0].expandtabs(8).rstrip() for line in text.splitlines()]
    begin = next((n for n, line in enumerate(lines) if re.match(r"\s*BEGIN\s+\w", line, re.IGNORECASE)), -1)
    cards: list[list[str]] = []
    for line in filter(None, lines[begin + 1 :]):
        if re.match(r"\s*ENDDATA", line, re.IGNORECASE):
            break
        if re.match(r"\s*INCLUDE\b", line, re.IGNORECASE):
            raise MeshError(IN_OTHER_FILES)
        width = 16 if "*" in line.partition(",")[0][:8] else 8
        fields = line.split(",") if "," in line else [line[:8], *(line[at : at + width] for at in range(8, 72, width))]
        first, *fields = (field.strip() for field in [*fields, *[""] * 8][: 1 + 64 // width])
        if first[:1] not in ("", "+", "*"):
            cards.append([first.rstrip("* ").upper(), *fields])
        elif cards:
            cards[-1] += fields
    return cards


def _real(field: str) -> float:
    """Number of a field, whose exponent may have no E."""
    return float(re.sub(r"(?<=[\d.])([+-]\d+)$", r"E\1", field.upper().replace("D", "E")) or 0)


def read(raw: bytes) -> Content:
    """Read a file of Nastran, with or without ``BEGIN BULK``."""
    points: dict[int, list[float]] = {}
    cells: dict[str, list[list[int]]] = defaultdict(list)
    for name, *fields in _cards(raw.decode("utf-8-sig", "replace")):
        if name in ("GRID", "GRDSET") and fields[1].strip("0"):
            system = f"coordinate system {fields[1]}"
            raise MeshError(f"{name} {fields[0]} is in {system}; write all in the basic one, CP = 0")
        if name == "GRID":
            points[int(fields[0])] = [_real(field) for field in fields[2:5]]
        elif name in CARDS:
            kind, start, stop = CARDS[name]
            group = int(fields[1] or 0) if start == 2 else 0
            cells[kind].append([group, *map(int, fields[start:stop])])
        elif OTHER_CARDS.fullmatch(name):
            raise MeshError(f"has cells {name}; {LINEAR}, CTRIA3 and CQUAD4")
    content = Content(np.array(list(points.values())).reshape(-1, 3))
    tables = [np.array(rows) for rows in cells.values()]
    corners = places(np.array(list(points), dtype=np.int64), [table[:, 1:] for table in tables])
    for kind, table, found in zip(cells, tables, corners):
        number = content.add(kind, found)
        for group in np.unique(table[table[:, 0] > 0, 0]).tolist():
            content.members.append((str(group), number, np.flatnonzero(table[:, 0] == group)))
    return content

"""Read the mesh and the sets of Abaqus' input files, which CalculiX and Gmsh write, too."""

import re
from collections import defaultdict
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .cells import MeshError
from .sheets import Content, find_tags

OTHER_FILES_REASON = "parts of it are in other files, whose changes would not be seen; write it as one .vtu or .msh"
"""Why a file is refused that names other files."""

KEYWORDS_NOT_READ = {
    r"N(GEN|FILL|COPY|MAP)|EL(GEN|COPY)|SYSTEM|PARAMETER|IMPORT|SYMMETRICMODEL\w*|MODELCHANGE": (
        "is not supported; mesh the part in the program and write all nodes and elements"
    ),
    "PART|ASSEMBLY|INSTANCE": (
        "is not supported; write one flat model: in Abaqus/CAE, Model > Edit Attributes > "
        "Do not use parts and assemblies in input files"
    ),
    "INCLUDE": OTHER_FILES_REASON,
}
"""Keywords that make, move, remove or import points or cells, and why they are refused."""

PLANE_ELEMENTS = re.compile(r"(?:CPS|CPEG?|S?FM3D|M3D|S|STRI|DS|DC2D|R3D|CAX(?=4P$))([34])[A-Z0-9]*")
"""Types of elements in the plane, and their number of points; meshio writes R3D3 and CAX4P."""

LINE_ELEMENTS = re.compile(r"(T[23]D2|B[23][13]|DC1D2|R2D2)[A-Z]*")  # types of elements with two points


class _Section(NamedTuple):
    """A keyword with its line in the file, its parameters and its rows of data."""

    line: int
    keyword: str
    given: dict[str, str]
    rows: list[list[str]]

    def refused(self, why: str) -> MeshError:
        """Error that names this section."""
        return MeshError(f"`*{self.keyword}` in line {self.line} {why}")


def _sections(text: str) -> Iterator[_Section]:
    """Sections without comments and empty lines; a keyword's line that ends in a comma goes on."""
    heads: list[tuple[int, str, list[list[str]]]] = []
    for number, line in enumerate(map(str.strip, text.splitlines()), 1):
        if not line or line.startswith("**"):
            continue
        if heads and not heads[-1][2] and heads[-1][1].endswith(","):
            heads[-1] = (heads[-1][0], heads[-1][1] + line, [])
        elif line.startswith("*"):
            heads.append((number, line, []))
        elif heads:
            heads[-1][2].append([item.strip().strip("'\"") for item in line.split(",")])
    for number, head, rows in heads:
        keyword, *words = head[1:].split(",")
        pairs = (word.partition("=") for word in words)
        given = {"".join(key.split()).upper(): value.strip().strip("'\"") for key, _, value in pairs}
        yield _Section(number, "".join(keyword.split()).upper(), given, rows)


def read(raw: bytes) -> Content:
    """Read a flat file of Abaqus, without parts and instances."""
    model = _Model()
    for one in _sections(raw.decode("utf-8-sig", "replace")):
        for keywords, why in KEYWORDS_NOT_READ.items():
            if re.fullmatch(keywords, one.keyword):
                raise one.refused(why)
        model.add(one)
    return model.content()


class _Model:
    """Points, elements and sets by kind and name."""

    def __init__(self) -> None:
        self.points: list[list[float]] = []
        self.elements: list[tuple[str, np.ndarray]] = []
        self.sets: dict[tuple[str, str], list[np.ndarray]] = defaultdict(list)
        self.shown, self.ranks = dict[str, str](), dict[str, int]()
        self.surfaces: list[str] = []

    def add(self, one: _Section) -> None:
        """Add a section."""
        if one.keyword.endswith("SECTION"):
            self.ranks[one.given.get("ELSET", "").upper()] = 2
        if one.keyword == "SURFACE":
            self.surfaces.append(one.given.get("NAME", ""))
        reader = {"NODE": self._nodes, "ELEMENT": self._cells, "NSET": self._members, "ELSET": self._members}
        if one.keyword not in reader:
            return
        if "INPUT" in one.given:
            raise MeshError(OTHER_FILES_REASON)
        kind = "ELSET" if one.keyword in ("ELEMENT", "ELSET") else "NSET"
        name = one.given.get(kind, "")
        self.sets[kind, name.upper()].append(reader[one.keyword](one))
        if name and "INTERNAL" not in one.given:
            self.shown.setdefault(name.upper(), name)
            self.ranks.setdefault(name.upper(), 0 if one.keyword == "ELEMENT" else 1)

    def _nodes(self, one: _Section) -> np.ndarray:
        """Add points, and return their numbers."""
        if one.given.get("SYSTEM", "R").upper() != "R":
            raise one.refused(f"has SYSTEM={one.given['SYSTEM']}; write x and y")
        rows = [[float(item.upper().replace("D", "E") or 0) for item in (row + ["", ""])[:4]] for row in one.rows]
        self.points += [(row + [0.0])[:4] for row in rows]
        return np.array([row[0] for row in rows], dtype=np.int64)

    def _cells(self, one: _Section) -> np.ndarray:
        """Add elements, and return their numbers."""
        given = one.given.get("TYPE", "").upper()
        surface, line = PLANE_ELEMENTS.fullmatch(given), LINE_ELEMENTS.fullmatch(given)
        name, count = {"3": ("triangle", 3), "4": ("quad", 4)}.get(surface[1] if surface else "", ("line", 2))
        if not surface and not line:
            raise one.refused(f"has TYPE={given}, which is not supported; write linear CPS3, CPS4 and T2D2 only")
        numbers = [int(item) for row in one.rows for item in row if item]
        if len(numbers) % (count + 1):
            raise one.refused(f"has TYPE={given}, and rows that are not {count + 1} numbers; correct them")
        self.elements.append((name, np.array(numbers, dtype=np.int64).reshape(-1, count + 1)))
        return self.elements[-1][1][:, 0]

    def _members(self, one: _Section) -> np.ndarray:
        """Numbers of points or cells in a set, by numbers, ranges and names of sets before it."""
        found = [np.zeros(0, dtype=np.int64)]
        named_sets = [("ELSET", one.given["ELSET"])] if one.keyword == "NSET" and "ELSET" in one.given else []
        for row in one.rows:
            numbers = [int(item) for item in row if item.isdigit()]
            if "GENERATE" in one.given:
                numbers = [*range(numbers[0], numbers[1] + 1, (*numbers, 1)[2])]
            found.append(np.array(numbers, dtype=np.int64))
            named_sets += [(one.keyword, item) for item in row if item and not item.isdigit()]
        for kind, name in named_sets:
            if not (before := self.sets.get((kind, name.upper()))):
                raise one.refused(f"has the set '{name}', which is not before it; put it there")
            members = np.concatenate(before)
            found += [members] if kind == one.keyword else map(np.ravel, self._corners(members))
        return np.concatenate(found)

    def _corners(self, cells: np.ndarray) -> list[np.ndarray]:
        """Points of elements, by block."""
        return [rows[np.isin(rows[:, 0], cells), 1:] for _, rows in self.elements]

    def content(self) -> Content:
        """Return the content of the file."""
        table = np.array(self.points).reshape(-1, 4)
        tags = table[:, 0].astype(np.int64)
        corners = find_tags(tags, [rows[:, 1:] for _, rows in self.elements])
        content = Content(table[:, 1:], [(kind, found) for (kind, _), found in zip(self.elements, corners)])
        for name in self.surfaces:
            if name.upper() not in self.shown:
                content.unusable[name] = "is a `*SURFACE`, which is not read; give a set of its points"
        every = np.concatenate([tags[:0], *(rows[:, 0] for _, rows in self.elements)])
        if len(np.unique(every)) < len(every):
            raise MeshError("elements have one number twice; renumber them")
        body = np.concatenate([tags[:0], *(rows[:, 0] for kind, rows in self.elements if kind != "line")])
        sets = {key: np.unique(np.concatenate(numbers)) for key, numbers in self.sets.items() if key[1] in self.shown}
        for name in [name for kind, name in sets if kind == "NSET" and ("ELSET", name) in sets]:
            own, chosen = self._corners(sets["ELSET", name]), sets["NSET", name]
            if np.array_equal(chosen, np.unique(np.concatenate([tags[:0], *map(np.ravel, own)]))):
                del sets["NSET", name]  # all points of a part
            elif all((np.isin(ends, chosen).sum(axis=1) > 1).all() for ends in own):
                del sets["ELSET", name]  # the cells along a side
        cells = {name: np.intersect1d(chosen, body) for (kind, name), chosen in sets.items() if kind == "ELSET"}
        parts = {name for name, chosen in cells.items() if 0 < len(chosen) < len(body)}
        best = max((self.ranks[name] for name in parts), default=0)
        for (kind, name), chosen in sets.items():
            shown, known = self.shown[name], every if kind == "ELSET" else tags
            if not np.isin(chosen, known).all():
                content.unusable[shown] = "has what is not in the file; remove this"
            elif kind == "NSET":
                content.point_groups[shown] += find_tags(tags, [chosen])
            elif name in parts and self.ranks[name] < best:
                content.unusable[shown] = "is no part, as others have a `*SOLID SECTION` or an `*ELSET`; use these"
            else:
                content.cell_groups[shown] = [np.flatnonzero(np.isin(every, chosen))]
        return content

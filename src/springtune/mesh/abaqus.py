"""Read the mesh and the sets of Abaqus' input files, which CalculiX and Gmsh write, too."""

import re
from collections import defaultdict
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .cells import MeshError
from .content import IN_OTHER_FILES, Content, places

MAKERS = re.compile(r"N(GEN|FILL|COPY|MAP)|EL(GEN|COPY)|SYSTEM|PARAMETER|IMPORT|SYMMETRICMODEL\w*|MODELCHANGE")
"""Keywords that make, move or remove points or cells."""

PLANE_ELEMENTS = re.compile(r"(?:CPS|CPEG?|S?FM3D|M3D|S|STRI|DS|DC2D|R3D|CAX(?=4P$))([34])[A-Z0-9]*")
"""Types of elements in the plane, and their number of points; meshio writes R3D3 and CAX4P."""

LINE_ELEMENTS = re.compile(r"(T[23]D2|B[23][13]|DC1D2|R2D2)[A-Z]*")
"""Types of elements with two points."""


class _Section(NamedTuple):
    """A keyword with its line in the file, its parameters and its rows of data."""

    line: int
    keyword: str
    given: dict[str, str]
    rows: list[str]

    def refused(self, why: str) -> MeshError:
        """Error that names this section."""
        return MeshError(f"`*{self.keyword}` in line {self.line} {why}")

    def items(self) -> Iterator[list[str]]:
        """Return what is given in each row."""
        return ([item.strip().strip("'\"") for item in row.split(",")] for row in self.rows)


def _sections(text: str) -> Iterator[_Section]:
    """Sections without comments and empty lines; a keyword's line that ends in a comma goes on."""
    heads: list[tuple[int, str, list[str]]] = []
    for number, line in enumerate(map(str.strip, text.splitlines()), 1):
        if not line or line.startswith("**"):
            continue
        if heads and not heads[-1][2] and heads[-1][1].endswith(","):
            heads[-1] = (heads[-1][0], heads[-1][1] + line, [])
        elif line.startswith("*"):
            heads.append((number, line, []))
        elif heads:
            heads[-1][2].append(line)
    for number, head, rows in heads:
        keyword, *words = head[1:].split(",")
        pairs = (word.partition("=") for word in words)
        given = {"".join(key.split()).upper(): value.strip().strip("'\"") for key, _, value in pairs}
        yield _Section(number, "".join(keyword.split()).upper(), given, rows)


def read(raw: bytes) -> Content:
    """Read a file of Abaqus: one part, which an instance may move."""
    sections = list(_sections(raw.decode("utf-8-sig", "replace")))
    for one in sections:
        if MAKERS.fullmatch(one.keyword):
            raise one.refused("is not supported; mesh the part in the program and write all nodes and elements")
        if one.keyword == "INCLUDE" or ("INPUT" in one.given and one.keyword in ("NODE", "ELEMENT", "NSET", "ELSET")):
            raise MeshError(IN_OTHER_FILES)
    instances = [one for one in sections if one.keyword == "INSTANCE"]
    parts = instances or [one for one in sections if one.keyword == "PART"]
    if len(parts) > 1:
        raise parts[1].refused("is a second one, and one is read; write a file for each, or merge the parts")
    model = _Model()
    owner, above = None, False
    for one in sections:
        if one.keyword in ("ASSEMBLY", "ENDASSEMBLY"):
            above = one.keyword == "ASSEMBLY"
        elif one.keyword in ("PART", "INSTANCE", "ENDPART", "ENDINSTANCE"):
            owner = None if one.keyword.startswith("END") else one
        elif not (instances and owner and owner.keyword == "PART") or (
            owner.given.get("NAME", "").upper() == instances[0].given.get("PART", "").upper()
        ):
            model.add(one, above and owner is None)
    return model.content(instances[0] if instances else None)


class _Model:
    """Points, elements and sets by kind and name; one of the assembly replaces those of the part with its name."""

    def __init__(self) -> None:
        self.points: list[list[float]] = []
        self.elements: list[tuple[str, np.ndarray]] = []
        self.sets: dict[tuple[str, str], list[np.ndarray]] = defaultdict(list)
        self.shown: dict[str, str] = {}
        self.of_assembly: set[str] = set()
        self.ranks: dict[str, int] = {}
        self.surfaces: list[str] = []

    def add(self, one: _Section, above: bool) -> None:
        """Add a section; points of the assembly itself are for reference only."""
        kind = "ELSET" if one.keyword in ("ELEMENT", "ELSET") else "NSET"
        name = one.given.get(kind, "")
        if one.keyword.endswith("SECTION"):
            self.ranks[one.given.get("ELSET", "").upper()] = 2
        if one.keyword == "SURFACE":
            self.surfaces.append(one.given.get("NAME", ""))
        named = one.keyword in ("NSET", "ELSET") and ("INSTANCE" in one.given or any("." in row for row in one.rows))
        if one.keyword not in ("NODE", "ELEMENT", "NSET", "ELSET") or (above and not named):
            return
        found = {"NODE": self._nodes, "ELEMENT": self._cells}.get(one.keyword, self._members)(one)
        if above and name.upper() not in self.of_assembly:
            self.of_assembly.add(name.upper())
            for of_part in ("NSET", "ELSET"):
                self.sets.pop((of_part, name.upper()), None)
        self.sets[kind, name.upper()].append(found)
        if name and "INTERNAL" not in one.given:
            self.shown.setdefault(name.upper(), name)
            self.ranks.setdefault(name.upper(), 0 if one.keyword == "ELEMENT" else 1)

    def _nodes(self, one: _Section) -> np.ndarray:
        """Add points, and return their numbers."""
        system = one.given.get("SYSTEM", "R")[:1].upper()
        if system not in ("R", "C"):
            raise one.refused(f"has SYSTEM={system}; write x and y")
        numbers = ([float(item.upper().replace("D", "E") or 0) for item in row[:4]] for row in one.items())
        rows = np.array([(row + [0.0] * 3)[:4] for row in numbers]).reshape(-1, 4)
        if system == "C":
            spun = rows[:, 1] * np.exp(1j * np.radians(rows[:, 2]))
            rows[:, 1], rows[:, 2] = spun.real, spun.imag
        self.points.extend(rows.tolist())
        return rows[:, 0].astype(np.int64)

    def _cells(self, one: _Section) -> np.ndarray:
        """Add elements, and return their numbers."""
        given = one.given.get("TYPE", "").upper()
        surface, line = PLANE_ELEMENTS.fullmatch(given), LINE_ELEMENTS.fullmatch(given)
        name, count = {"3": ("triangle", 3), "4": ("quad", 4)}.get(surface[1] if surface else "", ("line", 2))
        if not surface and not line:
            raise one.refused(f"has TYPE={given}, which is not supported; write linear CPS3, CPS4 and T2D2 only")
        numbers = [int(item) for row in one.items() for item in row if item]
        if len(numbers) % (count + 1):
            raise one.refused(f"has TYPE={given}, and rows that are not {count + 1} numbers; correct them")
        self.elements.append((name, np.array(numbers, dtype=np.int64).reshape(-1, count + 1)))
        return self.elements[-1][1][:, 0]

    def _members(self, one: _Section) -> np.ndarray:
        """Numbers of points or cells in a set, by numbers, ranges and names of sets."""
        found = [np.zeros(0, dtype=np.int64)]
        if one.keyword == "NSET" and "ELSET" in one.given:
            found += map(np.ravel, self._corners(self._named(one, "ELSET", one.given["ELSET"])))
        for items in one.items():
            row = [item.rpartition(".")[2] for item in items]  # without the instance's name
            numbers = [int(item) for item in row if item.isdigit()]
            if "GENERATE" in one.given:
                numbers = [*range(numbers[0], numbers[1] + 1, (*numbers, 1)[2])]
            found.append(np.array(numbers, dtype=np.int64))
            found += [self._named(one, one.keyword, item) for item in row if item and not item.isdigit()]
        return np.concatenate(found)

    def _named(self, one: _Section, kind: str, name: str) -> np.ndarray:
        """Numbers in a set that stands before."""
        if not (found := self.sets.get((kind, name.upper()))):
            raise one.refused(f"has the set '{name}', which is not before it; put it there")
        return np.concatenate(found)

    def _corners(self, cells: np.ndarray) -> list[np.ndarray]:
        """Points of elements, by block."""
        return [rows[np.isin(rows[:, 0], cells), 1:] for _, rows in self.elements]

    def content(self, instance: _Section | None) -> Content:
        """Return all of it."""
        table = np.array(self.points).reshape(-1, 4)
        tags, points = table[:, 0].astype(np.int64), table[:, 1:]
        moved = [[float(item or 0) for item in row] for row in instance.items()] if instance else []
        if moved:
            points = points + moved[0][:3]
        if len(moved) > 1:
            from scipy.spatial.transform import Rotation

            start, end, angle = np.array(moved[1][:3]), np.array(moved[1][3:6]), np.radians(moved[1][6])
            axis = (end - start) / np.linalg.norm(end - start)
            points = start + Rotation.from_rotvec(angle * axis).apply(points - start)
        content = Content(points)
        for name in self.surfaces:
            if name.upper() not in self.shown:
                content.unusable[name] = "is a `*SURFACE`, which is not read; give a set of its points"
        for (kind, _), corners in zip(self.elements, places(tags, [rows[:, 1:] for _, rows in self.elements])):
            content.add(kind, corners)
        cells = [rows[:, 0] for _, rows in self.elements]
        every = np.concatenate([tags[:0], *cells])
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
        parts = {name: np.intersect1d(chosen, body) for (kind, name), chosen in sets.items() if kind == "ELSET"}
        for (kind, name), chosen in sets.items():
            shown = self.shown[name]
            if not np.isin(chosen, every if kind == "ELSET" else tags).all():
                content.unusable[shown] = "has what is not in the file; remove this"
            elif kind == "NSET":
                content.point_sets[shown] = places(tags, [chosen])[0]
            elif better := [self.shown[one] for one in parts if self._better(name, one, parts, len(body))]:
                content.unusable[shown] = f"has cells of '{better[0]}', which is a part; use that"
            else:
                content.members += [(shown, n, np.flatnonzero(np.isin(ids, chosen))) for n, ids in enumerate(cells)]
        return content

    def _better(self, name: str, other: str, parts: dict[str, np.ndarray], total: int) -> bool:
        """Whether another set is what the file means as a part: it has a section, or is no block of elements."""
        rank, own = self.ranks[other], self.ranks[name]
        if rank <= own or len(parts[other]) == total:
            return False
        shared = np.isin(parts[name], parts[other])
        return bool(shared.any() and (rank == 2 or shared.all()))

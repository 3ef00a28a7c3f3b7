"""Read Gmsh's MSH files, where an entity may be in several physical groups."""

import re
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from .cells import MeshError
from .sheets import Content, find_tags

LINEAR_CELLS_REMEDY = "write linear triangles and quadrilaterals only"  # remedy for cells that are not read

ELEMENT_TYPES = {15: ("vertex", 1), 1: ("line", 2), 2: ("triangle", 3), 3: ("quad", 4)}
"""Name and number of points of elements that are read, by Gmsh's number."""

OTHER_ELEMENTS = {4: "tetra", 5: "hexahedron", 8: "line3", 9: "triangle6", 10: "quad9", 16: "quad8"}
"""Names of elements that are refused."""


SECTIONS_NOT_READ = {
    b"ParametricNodes": "Mesh.SaveParametric = 0",
    b"PartitionedEntities": "the mesh before it is partitioned",
}
"""Sections that are not read, with the remedy."""


class _Numbers:
    """Numbers of a section, one after the other; `order` is that of bytes, empty for text."""

    def __init__(self, raw: bytes, order: str, size: int):
        self.order, self.size, self.at, self.total = order, size, 0, 0
        self.source: Any = raw if order else np.fromstring(raw.decode("ascii", "replace"), sep=" ")

    def take(self, kind: str, count: int) -> np.ndarray:
        """Return the next numbers: ``i`` are integers, ``u`` counts and tags, ``f`` coordinates."""
        width = {"i": 4, "u": self.size, "f": 8}[kind] if self.order else 1
        piece = self.source[self.at : self.at + count * width]
        self.at += count * width
        if len(piece) < count * width:
            raise ValueError("it states other numbers of points or cells than it has")
        values: np.ndarray = np.frombuffer(piece, f"{self.order}{kind}{width}") if self.order else piece
        return values if kind == "f" else values.astype(np.int64)

    def one(self, kind: str) -> int:
        """Return the next number."""
        return int(self.take(kind, 1)[0])

    def blocks(self) -> int:
        """Return how many blocks of points or cells follow."""
        count, self.total = self.take("u", 4)[:2].tolist()
        return count


def read(raw: bytes) -> Content | None:
    """Read a file of version 4.1; None for 2.2, which meshio reads."""
    sections = dict(re.findall(rb"\$(\w+)[ \t]*\r?\n(.*?)\$End\1\b", raw, flags=re.DOTALL))
    if b"MeshFormat" not in sections and not raw.lstrip().startswith(b"$NOD"):
        raise ValueError("no $MeshFormat")
    version, binary, size, *rest = sections.get(b"MeshFormat", b"1 0 8").split(maxsplit=3)
    if version not in (b"2", b"2.0", b"2.1", b"2.2", b"4.1"):
        raise MeshError(f"is MSH of version {version.decode()}; write 4.1 or 2.2: Mesh.MshFileVersion = 4.1")
    for name, remedy in SECTIONS_NOT_READ.items():
        if name in sections:
            raise MeshError(f"has ${name.decode()}, which are not read; write {remedy}")
    named = re.findall(rb'(\d+)\s+(\d+)\s+"([^"\n]*)"', sections.get(b"PhysicalNames", b""))
    names = {(int(dimension), int(tag)): name.decode("utf-8", "replace") for dimension, tag, name in named}
    if version != b"4.1":
        parted = re.findall(rb"^\d+ \d+ 4 -?\d+ -?\d+ 1 (\d+) ", sections[b"Elements"], flags=re.MULTILINE)
        if len(set(parted)) == 1:
            raise MeshError("is one of several partitions; write all into one file: Mesh.PartitionSplitMeshFiles = 0")
        return None
    order = (">" if rest[0][:1] == b"\0" else "<") if binary == b"1" else ""
    nodes, elements = (_Numbers(sections[name], order, int(size)) for name in (b"Nodes", b"Elements"))
    tags, points = (np.concatenate(arrays) for arrays in zip(*_points(nodes)))
    groups = _groups(_Numbers(sections[b"Entities"], order, int(size))) if b"Entities" in sections else {}
    found = []
    for _ in range(elements.blocks()):
        dimension, entity, kind = elements.take("i", 3).tolist()
        if kind not in ELEMENT_TYPES:
            other = OTHER_ELEMENTS.get(kind, kind)
            raise MeshError(f"has cells '{other}'; {LINEAR_CELLS_REMEDY}: Mesh.ElementOrder = 1")
        count, width = elements.one("u"), 1 + ELEMENT_TYPES[kind][1]
        corners = elements.take("u", count * width).reshape(count, width)[:, 1:]
        own = [names.get((dimension, tag), str(tag)) for tag in groups.get((dimension, entity), ())]
        found.append((ELEMENT_TYPES[kind][0], corners, own))
    if [len(tags), sum(len(corners) for _, corners, _ in found)] != [nodes.total, elements.total]:
        raise ValueError("it states other numbers of points or cells than it has")
    placed = find_tags(tags, [corners for _, corners, _ in found])
    content = Content(points, [(kind, own) for (kind, *_), own in zip(found, placed)])
    content.cell_groups |= {name: [] for name in names.values()}
    for (*_, own), (start, stop) in zip(found, pairwise(content.starts())):
        for name in own:
            content.cell_groups[name].append(np.arange(start, stop))
    return content


def check_once(content: Content) -> Content:
    """Return the content of a file of version 2.2, refused where it repeats a cell for each of its groups."""
    for kind in ("triangle", "quad"):
        cells = [np.sort(corners) for own, corners in content.cells if own == kind]
        if cells and len(np.unique(np.concatenate(cells), axis=0)) < sum(map(len, cells)):
            why = "has cells twice, as version 2.2 repeats those of two physical groups"
            raise MeshError(f"{why}; write 4.1: Mesh.MshFileVersion = 4.1")
    return content


def _points(file: _Numbers) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Tags and coordinates of points, by entity."""
    for _ in range(file.blocks()):
        dimension, _, parametric = file.take("i", 3)
        count, width = file.one("u"), 3 + bool(parametric) * dimension
        yield file.take("u", count), file.take("f", count * width).reshape(count, width)[:, :3]


def _groups(file: _Numbers) -> dict[tuple[int, int], list[int]]:
    """Physical groups of entities, by dimension and tag; the sign of a group is a direction."""
    groups = {}
    for dimension, count in enumerate(file.take("u", 4)):
        for _ in range(count):
            entity = file.one("i")
            file.take("f", 6 if dimension else 3)
            groups[dimension, entity] = np.abs(file.take("i", file.one("u"))).tolist()
            if dimension:
                file.take("i", file.one("u"))
    return groups

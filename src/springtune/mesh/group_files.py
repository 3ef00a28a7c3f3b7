"""Mesh files with groups: Gmsh's physical groups, sets of Abaqus and others, marks in VTU."""

from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..registry import NAME, NAME_RULE
from .cells import Mesh, MeshError
from .formats import CELL_DIMENSIONS, CELLS, LEFT_OUT, PART_NUMBERS, PHYSICAL, assembled, coordinates, file_content
from .groups import GroupedMesh
from .sheets import in_words, outline_of, sheet_fault


def read_shape(path: str | Path, unit: float = 1.0) -> GroupedMesh:
    """Read a mesh with its groups, of any format that meshio supports.

    Groups are physical groups of Gmsh (by number if unnamed), sets of cells and points of Abaqus and others, and
    named arrays of zeros and ones in VTU; cell data ``part`` numbers parts. Lines, and points joined by the outline,
    make sides; one point makes a point; triangles and quadrilaterals make a part, unless they are all cells.

    Parameters
    ----------
    path : str or Path
    unit : float, optional
        Unit of the coordinates in the file [m].

    Returns
    -------
    GroupedMesh
        `unusable` says why groups of the file are not usable.

    Raises
    ------
    MeshError
        As `read_mesh`, and if the cells are not a conforming plane sheet.
    """
    content = file_content(path)
    mesh, used = assembled(path, content, unit)
    fault = sheet_fault(mesh)
    if fault:
        raise MeshError(f"{path}: {fault}")
    return _Groups(mesh, used, unit * coordinates(path, content)[:, :2], content).grouped()


class _Groups:
    """Groups of a file, by what meshio read."""

    def __init__(self, mesh: Mesh, used: np.ndarray, places: np.ndarray, content: Any):
        self.mesh, self.places, self.content = mesh, places, content
        self.numbers = np.full(len(places), -1)
        self.numbers[used] = np.arange(len(used))
        self.sides: dict[str, np.ndarray] = {}
        self.points: dict[str, np.ndarray] = {}
        self.parts: dict[str, dict[int, np.ndarray]] = {}
        self.unusable: dict[str, str] = {}
        self.outline, _ = outline_of(mesh)
        count = len(mesh.points)
        self.codes = self.outline @ [count, 1]
        self.inner = np.unique(np.sort(mesh.edges[~mesh.on_outline], axis=1) @ [count, 1])

    def grouped(self) -> GroupedMesh:
        """The mesh with what can be groups of it."""
        lines: dict[str, list[np.ndarray]] = defaultdict(list)
        points: dict[str, list[np.ndarray]] = defaultdict(list)
        cells: dict[str, dict[int, np.ndarray]] = {}
        starts = dict.fromkeys(CELLS.values(), 0)
        # Cells of one number of corners stand in the mesh in the order of the file's blocks.
        offsets = []
        for block in self.content.cells:
            corners = CELLS.get(block.type, 0)
            offsets.append(starts.get(corners, 0))
            if corners:
                starts[corners] += len(block.data)
        for name, number, chosen in self._sets():
            block = self.content.cells[number]
            if not len(chosen):
                continue
            if not 0 <= chosen.min() <= chosen.max() < len(block.data):
                self.unusable[name] = "has cells that are not in the file; remove these"
            elif block.type in CELLS:
                masks = cells.setdefault(
                    name, {n: np.zeros(len(found), dtype=bool) for n, found in self.mesh.cells.items()}
                )
                masks[CELLS[block.type]][offsets[number] + chosen] = True
            elif block.type in LEFT_OUT:
                (lines if block.type == "line" else points)[name].append(np.asarray(block.data)[chosen])
        for name, nodes in self._point_sets():
            if len(nodes):
                points[name].append(nodes)
        for name in {**lines, **points, **cells}:
            if not NAME.fullmatch(name):
                self.unusable[name] = f"cannot be a name; {NAME_RULE}"
            given = np.concatenate(
                [one.ravel() for one in [*lines.get(name, []), *points.get(name, [])]] or [np.zeros(1)]
            )
            if not 0 <= given.min() <= given.max() < len(self.numbers):
                self.unusable[name] = "has points that are not in the file; remove these"
            if name in self.unusable:
                continue
            if name in lines:
                self._add_lines(name, np.unique(np.concatenate(lines[name]).reshape(-1, 2), axis=0))
            if name in points and name not in self.unusable:
                self._add_points(name, np.unique(np.concatenate(points[name])))
        self._add_parts({name: masks for name, masks in cells.items() if name not in self.unusable})
        for name in [name for name in self.sides if name in self.points]:
            del self.points[name], self.sides[name]
            self.unusable[name] = "names sides and a point in the file; rename one"
        named = [*self.content.field_data, *self.content.point_sets, *self.content.cell_sets]
        for name in named:
            if not name.startswith("gmsh:") and name not in {*lines, *points, *cells}:
                self.unusable.setdefault(name, "has nothing in the file; put something in it")
        return GroupedMesh(self.mesh, self.sides, self.points, self.parts, self.unusable)

    def _sets(self) -> Iterator[tuple[str, int, np.ndarray]]:
        """Name, number of the block of cells, and numbers of cells in it, of all sets of cells."""
        content, blocks = self.content, self.content.cells
        named = [name for name in content.cell_sets if not name.startswith("gmsh:")]
        for name in named:
            parts = content.cell_sets[name]
            if len(parts) != len(blocks):
                self.unusable[name] = "is a set of which meshio does not tell the cells; give it as cells"
                continue
            for number, part in enumerate(parts):
                if part is not None:
                    yield name, number, np.asarray(part, dtype=np.int64).ravel()
        tags = {tuple(int(one) for one in value): name for name, value in content.field_data.items() if len(value) == 2}
        for key, arrays in content.cell_data.items():
            for number, values in enumerate(arrays):
                values = np.asarray(values)
                if values.ndim != 1 or values.dtype.kind not in "iub" or blocks[number].type not in CELL_DIMENSIONS:
                    continue
                if key == PHYSICAL:
                    for tag in np.unique(values[values != 0]).tolist():
                        name = tags.get((tag, CELL_DIMENSIONS[blocks[number].type]), str(tag))
                        if name not in named:
                            yield name, number, np.flatnonzero(values == tag)
                elif key == PART_NUMBERS:
                    for tag in np.unique(values[values != 0]).tolist():
                        yield str(tag), number, np.flatnonzero(values == tag)
                elif ":" not in key and self._marks(key, arrays):
                    yield key, number, np.flatnonzero(values)

    def _point_sets(self) -> Iterator[tuple[str, np.ndarray]]:
        """Name and points of all sets of points."""
        for name, nodes in self.content.point_sets.items():
            yield name, np.asarray(nodes, dtype=np.int64).ravel()
        for name, values in self.content.point_data.items():
            values = np.asarray(values)
            if values.ndim == 1 and values.dtype.kind in "iub" and ":" not in name and self._marks(name, [values]):
                yield name, np.flatnonzero(values)

    def _marks(self, name: str, arrays: list[Any]) -> bool:
        """Whether data are zeros and ones."""
        if any(((np.asarray(values) != 0) & (np.asarray(values) != 1)).any() for values in arrays):
            self.unusable[name] = "has other values than 0 and 1 in the file; mark what belongs to it by 1"
            return False
        if not any(np.any(values) for values in arrays):
            self.unusable[name] = "is 0 all over in the file; mark what belongs to it by 1"
            return False
        return True

    def _add_lines(self, name: str, lines: np.ndarray) -> None:
        """Sides of lines, by points of the file."""
        ends = self.numbers[lines]
        count = len(self.mesh.points)
        forth, back = np.isin(ends @ [count, 1], self.codes), np.isin(ends @ [1, count], self.codes)
        known = (ends >= 0).all(axis=1)
        wrong = ~(known & (forth | back))
        if wrong.any():
            inside = known & np.isin(np.sort(ends, axis=1) @ [count, 1], self.inner)
            nowhere = wrong & ~inside
            where = in_words(self.places[lines[wrong][0]])
            counts = {"inside the body": inside.sum(), "no edges of cells": nowhere.sum()}
            what = " and ".join(f"{count} are {place}" for place, count in counts.items() if count)
            self.unusable[name] = (
                f"is not on the outline: of its {len(lines)} lines, {what}, the first one at {where}; take these out"
            )
            return
        self.sides[name] = np.unique(np.where(forth[:, None], ends, ends[:, ::-1]), axis=0)

    def _add_points(self, name: str, nodes: np.ndarray) -> None:
        """A point, or sides of points, by points of the file."""
        if len(nodes) == 1:
            self.points[name] = self.places[nodes[0]]
            return
        chosen = np.zeros(len(self.mesh.points) + 1, dtype=bool)
        chosen[self.numbers[nodes]] = True
        lost = int((self.numbers[nodes] < 0).sum())
        chosen = chosen[:-1]
        edges = self.outline[chosen[self.outline].all(axis=1)]
        alone = chosen.copy()
        alone[edges] = False
        if lost or alone.any():
            at_outline = np.zeros(len(chosen), dtype=bool)
            at_outline[self.outline] = True
            counts = {
                "are inside the body": (alone & ~at_outline).sum(),
                "have no neighbour on the outline that is one": (alone & at_outline).sum(),
                "belong to no cell": lost,
            }
            what = " and ".join(f"{count} {reason}" for reason, count in counts.items() if count)
            self.unusable[name] = f"is neither one point nor sides: of its {len(nodes)} points, {what}; take these out"
            return
        if name in self.sides and {*map(tuple, edges.tolist())} != {*map(tuple, self.sides[name].tolist())}:
            del self.sides[name]
            self.unusable[name] = "is lines and points in the file that are not the same sides; rename one"
            return
        self.sides[name] = edges

    def _add_parts(self, found: dict[str, dict[int, np.ndarray]]) -> None:
        """Parts of the body, where no cell is in two."""
        found = {name: masks for name, masks in found.items() if not all(mask.all() for mask in masks.values())}
        for name, masks in found.items():
            others = [
                other
                for other, their in found.items()
                if other != name and any((masks[n] & their[n]).any() for n in masks)
            ]
            if others:
                self.unusable[name] = f"has cells that part '{others[0]}' has, too; a cell has one material"
            else:
                self.parts[name] = masks

"""A mesh with named groups of its sides, points and cells; and the content of a mesh file, which readers return."""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .cells import Mesh, MeshError
from .segments import edge_in_words
from .sheets import outline_of


@dataclass(frozen=True, eq=False)
class GroupedMesh:
    """A mesh and named groups of its edges, points and cells.

    Parameters
    ----------
    mesh : Mesh
    sides : mapping of str to ndarray of int, shape (n, 2), optional
        Edges of the outline, holes included, by group, the body to the left.
    points : mapping of str to ndarray of float, shape (2,), optional
        Coordinates of named points [m], in the body.
    parts : mapping of str to dict of int to ndarray of bool, shape (n_cells,), optional
        Cells by part and number of corners, as in `Mesh.cells`; each is in at most one part. The rest are the main
        part, ``""``.
    unusable : mapping of str to str, optional
        Groups of a file that are not usable, and why, as in ``"is not on the outline: ..."``.

    Examples
    --------
    >>> import springtune as st
    >>> grouped = st.mesh_shape(st.Shape.rectangle("100 mm", "40 mm"), "10 mm")
    >>> {name: len(edges) for name, edges in grouped.sides.items()}
    {'lower': 10, 'right': 4, 'upper': 10, 'left': 4}
    >>> grouped.mesh.points[grouped.sides["right"][0]].round(6).tolist()
    [[0.1, 0.0], [0.1, 0.01]]
    >>> grouped.mesh.points[grouped.particles("right"), 1].round(6).tolist()
    [0.0, 0.01, 0.02, 0.03, 0.04]
    >>> corner = st.GroupedMesh(grouped.mesh, points={"corner": grouped.mesh.points[-1]})
    >>> corner.particle("corner") == len(grouped.mesh.points) - 1
    True
    >>> turned = st.GroupedMesh(grouped.mesh, {"left": grouped.sides["left"][:, ::-1]})
    >>> turned.side_fault("left"), turned.side_fault("left", directed=True)
    ('', 'has edges with the body on their right, the first one from (0, 30) mm to (0, 40) mm; turn them')
    """

    mesh: Mesh
    sides: Mapping[str, np.ndarray] = field(default_factory=dict)
    points: Mapping[str, np.ndarray] = field(default_factory=dict)
    parts: Mapping[str, Mapping[int, np.ndarray]] = field(default_factory=dict)
    unusable: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        groups = {"sides": self.sides, "points": self.points, "parts": self.parts}
        named = (f"{what} {', '.join(names)}" for what, names in groups.items() if names)
        return f"GroupedMesh({'; '.join([repr(self.mesh), *named])})"

    def particle(self, name: str) -> int | None:
        """Return the particle at a named point.

        Parameters
        ----------
        name : str
            Key of `points`.

        Returns
        -------
        int or None
            None if no particle is within rounding.
        """
        distances = np.linalg.norm(self.mesh.points - self.points[name], axis=1)
        nearest = int(np.argmin(distances))
        return nearest if distances[nearest] <= 1e-9 * np.ptp(self.mesh.points, axis=0).max() else None

    def particles(self, name: str) -> np.ndarray:
        """Return the particles of a group.

        Parameters
        ----------
        name : str
            Key of `sides` or `points`.

        Returns
        -------
        ndarray of int
            Sorted, each once; empty for a point without particle.
        """
        if name in self.sides:
            return np.unique(self.sides[name])
        number = self.particle(name)
        return np.array([] if number is None else [number], dtype=np.int64)

    @cached_property
    def _outline_codes(self) -> np.ndarray:
        """One number for each edge of the outline, the body on its left."""
        return outline_of(self.mesh)[0] @ [len(self.mesh.points), 1]

    def side_fault(self, name: str, *, directed: bool = False) -> str:
        """Return why a group of sides is not usable, with the remedy, or an empty string.

        Parameters
        ----------
        name : str
            Key of `sides`.
        directed : bool, optional
            Whether the body must be on the left of its edges, as for a pressure.

        Returns
        -------
        str
        """
        count, edges = len(self.mesh.points), np.reshape(self.sides[name], (-1, 2))
        wrong = edges[~np.isin(edges @ [count, 1], self._outline_codes)]
        inside = wrong[~np.isin(wrong @ [1, count], self._outline_codes)]
        if len(inside):
            first = edge_in_words(self.mesh.points, inside[0])
            return f"has edges that are not on the outline, the first one {first}; take these out"
        if directed and len(wrong):
            first = edge_in_words(self.mesh.points, wrong[0])
            return f"has edges with the body on their right, the first one {first}; turn them"
        return ""


def parts_of(grouped: GroupedMesh) -> list[str]:
    """Return the parts that have cells, sorted: ``""`` for the main part."""
    return sorted({str(name) for labels in part_names(grouped).values() for name in labels})


def part_names(grouped: GroupedMesh) -> dict[int, np.ndarray]:
    """Return the part of each cell, by number of corners: ``""`` for the main part."""
    found = {}
    for count, corners in grouped.mesh.cells.items():
        found[count] = np.full(len(corners), "", dtype=object)
        for name, cells in grouped.parts.items():
            if count in cells:
                found[count][cells[count]] = name
    return found


OTHER_FILES_REASON = "parts of it are in other files, whose changes would not be seen; write it as one .vtu or .msh"
"""Why a file is refused that names other files."""

LINEAR_CELLS_REMEDY = "write linear triangles and quadrilaterals only"
"""Remedy for cells that are not read."""


class Block(NamedTuple):
    """Cells of one type, by meshio's name, and their points."""

    type: str
    data: np.ndarray


@dataclass
class Content:
    """Content of a mesh file: numbers of cells, over all blocks, and of points, by group; `unusable` are reasons."""

    points: np.ndarray
    cells: list[Block]
    cell_groups: dict[str, list[np.ndarray]] = field(default_factory=lambda: defaultdict(list))
    point_groups: dict[str, list[np.ndarray]] = field(default_factory=lambda: defaultdict(list))
    unusable: dict[str, str] = field(default_factory=dict)

    def starts(self) -> list[int]:
        """Number of the first cell of each block, and of all cells."""
        return [0, *np.cumsum([len(block.data) for block in self.cells]).tolist()]


def places(tags: np.ndarray, wanted: list[np.ndarray]) -> list[np.ndarray]:
    """Return where the wanted tags are; refused where one is missing or two are equal."""
    order = np.argsort(tags, kind="stable")
    ordered, flat = tags[order], np.concatenate([np.zeros(0, dtype=np.int64), *(one.ravel() for one in wanted)])
    twice = ordered[1:][ordered[1:] == ordered[:-1]]
    if len(twice):
        raise MeshError(f"points have one number twice: {twice[0]}; renumber them")
    at = np.searchsorted(ordered, flat)
    missing = np.append(ordered, -1)[at] != flat
    if missing.any():
        raise MeshError(f"a cell has point {flat[missing][0]}, which the file does not have; write all points")
    parts = np.split(order[at], np.cumsum([one.size for one in wanted[:-1]]))
    return [part.reshape(one.shape) for part, one in zip(parts, wanted)]

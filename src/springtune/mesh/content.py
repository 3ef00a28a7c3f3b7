"""What a mesh file has: points, cells and sets of both. Readers of single formats return it."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from .cells import MeshError

IN_OTHER_FILES = "parts of it are in other files, whose changes would not be seen; write it as one .vtu or .msh"
"""Why a file is refused that names other files."""

LINEAR = "write linear triangles and quadrilaterals only"
"""What to do with cells that are not read."""


class Block(NamedTuple):
    """Cells of one type, by meshio's name, and their points."""

    type: str
    data: np.ndarray


@dataclass
class Content:
    """Content of a mesh file, with the names of meshio's `Mesh`; `members` are set, number of block and cells in it."""

    points: np.ndarray
    cells: list[Block] = field(default_factory=list)
    members: list[tuple[str, int, np.ndarray]] = field(default_factory=list)
    point_sets: dict[str, np.ndarray] = field(default_factory=dict)
    point_data: dict[str, np.ndarray] = field(default_factory=dict)
    cell_data: dict[str, list[np.ndarray]] = field(default_factory=dict)
    cell_sets: dict[str, Any] = field(default_factory=dict)
    field_data: dict[str, tuple[int, ...]] = field(default_factory=dict)
    unusable: dict[str, str] = field(default_factory=dict)

    def add(self, kind: str, corners: np.ndarray, *names: str) -> int:
        """Add a block whose cells are in these sets, and return its number."""
        self.cells.append(Block(kind, corners))
        self.members += [(name, len(self.cells) - 1, np.arange(len(corners))) for name in names]
        return len(self.cells) - 1


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

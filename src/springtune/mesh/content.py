"""What a mesh file has: points, cells and groups of both. Readers of single formats return it."""

from collections import defaultdict
from dataclasses import dataclass, field
from typing import NamedTuple

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
    """Content of a mesh file.

    `cell_groups` are numbers of cells, counted through all blocks, and `point_groups` numbers of points, in one or more
    arrays; `unusable` are reasons why other groups of the file are left out.
    """

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

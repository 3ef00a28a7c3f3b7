"""A mesh with named groups of its sides, points and cells."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from .cells import Mesh


@dataclass(frozen=True, eq=False)
class GroupedMesh:
    """A mesh and the names of some of its edges, points and cells.

    Parameters
    ----------
    mesh : Mesh
    sides : mapping of str to ndarray of int, shape (n, 2), optional
        Edges of the outline, holes included, by group: indices of the particles at their ends, the body to the left.
    points : mapping of str to ndarray of float, shape (2,), optional
        Coordinates of named points [m], in the body.
    parts : mapping of str to dict of int to ndarray of bool, shape (n_cells,), optional
        Cells by part and number of corners, as in `Mesh.cells`; each cell is in at most one. Cells that are in none are
        the body's main part, ``""``.

    Examples
    --------
    >>> import springtune as st
    >>> grouped = st.mesh_shape(st.Shape.rectangle("100 mm", "40 mm"), "10 mm")
    >>> {name: len(edges) for name, edges in grouped.sides.items()}
    {'lower': 10, 'right': 4, 'upper': 10, 'left': 4}
    >>> grouped.mesh.points[grouped.sides["right"][0]].round(6).tolist()
    [[0.1, 0.0], [0.1, 0.01]]
    """

    mesh: Mesh
    sides: Mapping[str, np.ndarray] = field(default_factory=dict)
    points: Mapping[str, np.ndarray] = field(default_factory=dict)
    parts: Mapping[str, Mapping[int, np.ndarray]] = field(default_factory=dict)

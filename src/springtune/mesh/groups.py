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
    unusable : mapping of str to str, optional
        Groups of a file that can be none here, and why, as in ``"is not on the outline: ..."``.

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
    unusable: Mapping[str, str] = field(default_factory=dict)

    def particle(self, name: str) -> int | None:
        """Particle at a named point.

        Parameters
        ----------
        name : str
            Key of `points`.

        Returns
        -------
        int or None
            None where none is within rounding.

        Examples
        --------
        >>> import springtune as st
        >>> plate = st.Shape.rectangle("100 mm", "40 mm", points={"corner": ("100 mm", "40 mm")})
        >>> grouped = st.mesh_shape(plate, "10 mm")
        >>> grouped.mesh.points[grouped.particle("corner")].tolist()
        [0.1, 0.04]
        """
        distances = np.linalg.norm(self.mesh.points - self.points[name], axis=1)
        nearest = int(np.argmin(distances))
        return nearest if distances[nearest] <= 1e-9 * np.ptp(self.mesh.points, axis=0).max() else None

    def particles(self, name: str) -> np.ndarray:
        """Particles of a group.

        Parameters
        ----------
        name : str
            Key of `sides` or `points`.

        Returns
        -------
        ndarray of int
            Sorted, each once; none of a point at which there is none.

        Examples
        --------
        >>> import springtune as st
        >>> grouped = st.mesh_shape(st.Shape.rectangle("100 mm", "40 mm"), "10 mm")
        >>> grouped.mesh.points[grouped.particles("right"), 1].round(6).tolist()
        [0.0, 0.01, 0.02, 0.03, 0.04]
        """
        if name in self.sides:
            return np.unique(self.sides[name])
        number = self.particle(name)
        return np.array([] if number is None else [number], dtype=np.int64)

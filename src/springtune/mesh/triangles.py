"""A triangle mesh and what a network needs to know of it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np


@dataclass(frozen=True)
class TriangleMesh:
    r"""A conforming mesh of counter-clockwise triangles.

    ::

        3 ------- 4
         \  B   / \        edges    each pair of particles once, smaller index first
          \   /  A \       triangles_per_edge    2 inside (the edge between A and B), 1 on the outline
           0 ------- 1

    Parameters
    ----------
    points : ndarray of float, shape (n_points, 2)
        Coordinates [m].
    triangles : ndarray of int, shape (n_triangles, 3)
        Corner indices, counter-clockwise.
    """

    points: np.ndarray
    triangles: np.ndarray

    @cached_property
    def _edges(self):
        corners = self.triangles
        sides = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
        # One integer per edge sorts ten times faster than rows do.
        codes, counts = np.unique(sides[:, 0] * len(self.points) + sides[:, 1], return_counts=True)
        return np.stack(np.divmod(codes, len(self.points)), axis=1), counts

    @property
    def edges(self):
        """Edges, shape (n_edges, 2), sorted, each once."""
        return self._edges[0]

    @property
    def triangles_per_edge(self):
        """Number of triangles at each edge, shape (n_edges,): 2 inside, 1 on the outline."""
        return self._edges[1]

    @cached_property
    def edge_lengths(self):
        """Length of each edge [m], shape (n_edges,)."""
        ends = self.points[self.edges]
        return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)

    def outline_edges(self, coordinate, value):
        """Outline edges that lie on a line ``x = value`` or ``y = value``.

        Parameters
        ----------
        coordinate : int
            0 for x, 1 for y.
        value : float
            Where the line is [m].

        Returns
        -------
        ndarray of int, shape (n, 2)
        """
        outline = self.edges[self.triangles_per_edge == 1]
        tolerance = 1e-9 * np.ptp(self.points[:, coordinate])
        return outline[(np.abs(self.points[outline, coordinate] - value) <= tolerance).all(axis=1)]


def signed_areas(points, triangles):
    """Signed area of each triangle [m2], shape (n_triangles,); negative where it is inverted."""
    a, b, c = points[triangles[:, 0]], points[triangles[:, 1]], points[triangles[:, 2]]
    return 0.5 * ((b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0]))


def quality(mesh):
    """Quality figures of a mesh.

    Parameters
    ----------
    mesh : TriangleMesh

    Returns
    -------
    dict
        ``minimum_angle`` : smallest angle of all triangles [degree];
        ``edge_length_spread`` : standard deviation of the edge lengths over their mean [1].
    """
    corners = mesh.points[mesh.triangles]
    smallest = np.pi
    for i in range(3):
        first, second = corners[:, (i + 1) % 3] - corners[:, i], corners[:, (i + 2) % 3] - corners[:, i]
        cross = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
        smallest = min(smallest, np.arctan2(np.abs(cross), (first * second).sum(axis=1)).min())
    lengths = mesh.edge_lengths
    return {"minimum_angle": float(np.degrees(smallest)), "edge_length_spread": float(lengths.std() / lengths.mean())}

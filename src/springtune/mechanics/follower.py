"""Loads that follow the edges that they act on."""

import numpy as np

from ..mesh.cells import Mesh


class FollowerPressure:
    """A pressure that turns and grows with the edges that it acts on, of total force 1 at rest.

    Each edge of vector e carries ``e`` turned by a right angle, over the length of the side, half of it on either end.

    Parameters
    ----------
    mesh : Mesh
    edges : ndarray of int, shape (n, 2)
        Edges of a straight side.
    axis : int
        Axis along the side; the force is along the other one.
    """

    def __init__(self, mesh: Mesh, edges: np.ndarray, axis: int) -> None:
        along = mesh.points[edges[:, 1], axis] - mesh.points[edges[:, 0], axis]
        self.edges = np.where((along < 0)[:, None], edges[:, ::-1], edges)
        self.rest = mesh.points[self.edges[:, 1]] - mesh.points[self.edges[:, 0]]
        turn = np.array([[0.0, -1.0], [1.0, 0.0]]) * (1 if axis == 0 else -1)
        self.turn = 0.5 * turn / np.abs(along).sum()
        half = np.block([-self.turn, self.turn])
        self.derivative = np.broadcast_to(np.vstack([half, half]), (len(edges), 4, 4))

    def forces(self, displacements: np.ndarray) -> np.ndarray:
        """Forces on the particles.

        Parameters
        ----------
        displacements : ndarray of float, shape (n_points, 2)
            [m]

        Returns
        -------
        ndarray of float, shape (n_points, 2)
            [1]
        """
        sides = self.rest + displacements[self.edges[:, 1]] - displacements[self.edges[:, 0]]
        field = np.zeros(displacements.shape)
        np.add.at(field, self.edges, (sides @ self.turn.T)[:, None, :])
        return field

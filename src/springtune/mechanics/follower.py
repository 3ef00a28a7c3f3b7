"""Loads that follow the edges that they act on."""

import copy
from functools import cached_property

import numpy as np

from ..mesh.cells import Mesh


class FollowerPressure:
    """A pressure that turns and grows with the edges that it acts on.

    Each edge of vector e carries ``e`` turned to the left by a right angle, times the pressure on it, half of it on
    either end.

    Parameters
    ----------
    edges : ndarray of int, shape (n, 2)
        Edges of the outline, the body to the left; of one side or of several.
    pressure : float or ndarray of float, shape (n,)
        Force over length on each of them, towards the body [1/m].
    """

    def __init__(self, mesh: Mesh, edges: np.ndarray, pressure: float | np.ndarray) -> None:
        self.edges = edges
        self.rest = mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]]
        self.half = 0.5 * np.broadcast_to(pressure, len(edges))[:, None]
        turn = np.array([[0.0, -1.0], [1.0, 0.0]])
        on_either = np.block([-turn, turn])
        self.derivative = self.half[:, :, None] * np.vstack([on_either, on_either])

    @classmethod
    def of_side(cls, mesh: Mesh, edges: np.ndarray, axis: int) -> "FollowerPressure":
        """Pressure on a straight side, of total force 1 at rest.

        Parameters
        ----------
        edges : ndarray of int, shape (n, 2)
            Edges of the side, either way round.
        """
        along = mesh.points[edges[:, 1], axis] - mesh.points[edges[:, 0], axis]
        wanted = 1 if axis == 0 else -1
        turned = np.where((wanted * along < 0)[:, None], edges[:, ::-1], edges)
        return cls(mesh, turned, 1.0 / np.abs(along).sum())

    @cached_property
    def symmetric(self) -> "FollowerPressure":
        """A load with the symmetric part of the derivative."""
        load = copy.copy(self)
        load.derivative = 0.5 * (self.derivative + self.derivative.swapaxes(1, 2))
        return load

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
        np.add.at(field, self.edges, (self.half * np.stack([-sides[:, 1], sides[:, 0]], axis=1))[:, None, :])
        return field

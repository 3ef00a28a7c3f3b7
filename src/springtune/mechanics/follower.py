"""Loads that follow the edges that they act on."""

import copy
from functools import cached_property

import numpy as np

from ..mesh.cells import Mesh


class FollowerPressure:
    """Pressure that turns and grows with its edges.

    Each edge of vector e carries ``e`` turned left by a right angle times its pressure, half on either end. `edges`
    (n, 2) have the body to their left; `pressure`, one or (n,), is force over length towards the body [1/m].
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
        """Return the pressure on a straight side of total force 1 at rest; `edges` (n, 2) may run either way."""
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
        """Return the forces on the particles [1], shape (n_points, 2)."""
        sides = self.rest + displacements[self.edges[:, 1]] - displacements[self.edges[:, 0]]
        field = np.zeros(displacements.shape)
        np.add.at(field, self.edges, (self.half * np.stack([-sides[:, 1], sides[:, 0]], axis=1))[:, None, :])
        return field

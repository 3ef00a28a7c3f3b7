"""The displacement field of a reference, handed from file to file without the finite elements behind it."""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..mesh import Mesh


def interpolate(x: np.ndarray, y: np.ndarray, displacements: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Interpolate displacements (n_x, n_y, 2) [m] on an ascending grid at points (n, 2) inside [m], by cubic splines.

    On the grid of a `ReferenceSolution` within 1e-5 of the largest displacement; the error is mostly at a clamp's
    corners.
    """
    from scipy.interpolate import RectBivariateSpline  # here: whoever wants the outline alone does without

    return np.stack([RectBivariateSpline(x, y, displacements[:, :, axis]).ev(*points.T) for axis in range(2)], axis=1)


def outline(x: np.ndarray, y: np.ndarray, displacements: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the grid points on the outline, in order around it and not closed, and their displacements (n, 2) [m]."""
    n_x, n_y = len(x), len(y)
    i = np.concatenate([np.arange(n_x), np.full(n_y - 1, n_x - 1), np.arange(n_x - 2, -1, -1), np.zeros(n_y - 2, int)])
    j = np.concatenate([np.zeros(n_x, int), np.arange(1, n_y), np.full(n_x - 1, n_y - 1), np.arange(n_y - 2, 0, -1)])
    return np.stack([x[i], y[j]], axis=1), displacements[i, j]


def field_error(mesh: "Mesh", displacements: np.ndarray, reference: np.ndarray) -> float:
    """Return the L2 difference of displacement fields (n_points, 2) over the norm of the reference's [1]."""
    difference, size = (
        mesh.particle_areas @ (field**2).sum(axis=1) for field in (displacements - reference, reference)
    )
    return float(np.sqrt(difference / size))

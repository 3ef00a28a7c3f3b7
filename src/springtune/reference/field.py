"""The displacement field of a reference, handed from file to file without the finite elements behind it."""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ..mesh import Mesh


def interpolate(x: np.ndarray, y: np.ndarray, displacements: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Displacements between the points of a grid, by cubic splines.

    Parameters
    ----------
    x : ndarray of float, shape (n_x,)
    y : ndarray of float, shape (n_y,)
        Coordinates of the grid [m], ascending.
    displacements : ndarray of float, shape (n_x, n_y, 2)
        Displacements there [m].
    points : ndarray of float, shape (n, 2)
        Where they are wanted [m], inside the grid.

    Returns
    -------
    ndarray of float, shape (n, 2)
        With the grid of a `ReferenceSolution` within 1e-5 of the largest displacement, most of it near a clamp's
        corners.
    """
    from scipy.interpolate import RectBivariateSpline  # here: whoever wants the outline alone does without

    return np.stack([RectBivariateSpline(x, y, displacements[:, :, axis]).ev(*points.T) for axis in range(2)], axis=1)


def outline(x: np.ndarray, y: np.ndarray, displacements: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points of a grid on its outline, in order around it, and their displacements.

    Parameters
    ----------
    x, y, displacements
        As in `interpolate` [m].

    Returns
    -------
    points, moved : ndarray of float, shape (n, 2)
        [m]; the first point is not repeated.
    """
    n_x, n_y = len(x), len(y)
    i = np.concatenate([np.arange(n_x), np.full(n_y - 1, n_x - 1), np.arange(n_x - 2, -1, -1), np.zeros(n_y - 2, int)])
    j = np.concatenate([np.zeros(n_x, int), np.arange(1, n_y), np.full(n_x - 1, n_y - 1), np.arange(n_y - 2, 0, -1)])
    return np.stack([x[i], y[j]], axis=1), displacements[i, j]


def field_error(mesh: "Mesh", displacements: np.ndarray, reference: np.ndarray) -> float:
    """Difference of whole displacement fields in L2, over the norm of the reference's [1].

    Parameters
    ----------
    displacements, reference : ndarray of float, shape (n_points, 2)
        Displacements of the particles [m].
    """
    difference, size = (
        mesh.particle_areas @ (field**2).sum(axis=1) for field in (displacements - reference, reference)
    )
    return float(np.sqrt(difference / size))

"""How a load holds and pulls a mesh."""

import numpy as np


def clamped(mesh):
    """Directions that the clamped left end (x = 0) holds, shape (n_points, 2)."""
    on_end = np.zeros(len(mesh.points), dtype=bool)
    on_end[mesh.outline_edges(0, 0.0)] = True
    return np.repeat(on_end[:, None], 2, axis=1)


def end_weights(mesh, length):
    """Weight of each particle in an even distribution over the right end (x = length), along x.

    Each edge of the end gives half of its share of the height to either particle. The same field is the load pattern
    of a force of 1 and the weights of the mean axial displacement of that end.

    Parameters
    ----------
    mesh : Mesh
    length : float
        Where the right end is [m].

    Returns
    -------
    ndarray of float, shape (n_points, 2)
        Sum 1 along x, zero along y.
    """
    edges = mesh.outline_edges(0, length)
    share = np.abs(mesh.points[edges[:, 1], 1] - mesh.points[edges[:, 0], 1])
    weights = np.zeros(mesh.points.shape)
    np.add.at(weights[:, 0], edges, 0.5 * share[:, None])
    return weights / weights.sum()

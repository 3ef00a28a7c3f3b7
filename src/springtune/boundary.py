"""How a load holds and pulls a mesh."""

import numpy as np


def held(mesh, kind):
    """Directions that a kind of load holds, see `springtune.loads`.

    Parameters
    ----------
    mesh : Mesh
        Of a box with its lower left corner at the origin.
    kind : str
        One of `springtune.loads.KINDS`.

    Returns
    -------
    ndarray of bool, shape (n_points, 2)
    """
    directions = np.zeros(mesh.points.shape, dtype=bool)
    if kind == "shear":
        directions[mesh.outline_edges(1, 0.0)] = True
        directions[mesh.outline_edges(1, mesh.points[:, 1].max()), 1] = True
    else:
        directions[mesh.outline_edges(0, 0.0)] = True
    return directions


def weights(mesh, kind):
    """Weight of each particle in an even distribution over the loaded side, along the force.

    Each edge of the side gives half of its share of the length to either particle. The same field is the load pattern
    of a force of 1 and the weights of the mean displacement of that side.

    Parameters
    ----------
    mesh : Mesh
        Of a box with its lower left corner at the origin.
    kind : str
        One of `springtune.loads.KINDS`.

    Returns
    -------
    ndarray of float, shape (n_points, 2)
        Sum 1 along the force, zero across.
    """
    along, across = (1, 0) if kind == "shear" else (0, 1)
    edges = mesh.outline_edges(along, mesh.points[:, along].max())
    share = np.abs(mesh.points[edges[:, 1], across] - mesh.points[edges[:, 0], across])
    field = np.zeros(mesh.points.shape)
    np.add.at(field[:, 1 if kind == "bending" else 0], edges, 0.5 * share[:, None])
    return field / field.sum()

"""How a load holds and pulls a mesh."""

import numpy as np

FACE_POSITIONS = np.linspace(0.0, 1.0, 101)
"""Where the profile of a pressed face is given, over its length [1]."""


def held(mesh, kind):
    """Directions that a kind of load holds, see `springtune.problem.loads`.

    Parameters
    ----------
    mesh : Mesh
        Of a box with its lower left corner at the origin.
    kind : str
        One of `springtune.problem.loads.KINDS`.

    Returns
    -------
    ndarray of bool, shape (n_points, 2)
    """
    directions = np.zeros(mesh.points.shape, dtype=bool)
    if kind == "face":
        directions[mesh.outline_edges(1, 0.0)] = True
    elif kind == "shear":
        directions[mesh.outline_edges(1, 0.0)] = True
        directions[mesh.outline_edges(1, mesh.points[:, 1].max()), 1] = True
    else:
        directions[mesh.outline_edges(0, 0.0)] = True
    return directions


def weights(mesh, kind):
    """Weight of each particle in an even distribution over the loaded side, along the force: the pattern of a load.

    Each edge of the side gives half of its share of the length to either particle.

    Parameters
    ----------
    mesh : Mesh
        Of a box with its lower left corner at the origin.
    kind : str
        One of `springtune.problem.loads.KINDS`.

    Returns
    -------
    ndarray of float, shape (n_points, 2)
        Sum 1 along the force, zero across.
    """
    edges, across = loaded_edges(mesh, kind)
    field = np.zeros(mesh.points.shape)
    field[:, 1 if kind in ("bending", "face") else 0] = mesh.side_shares(edges, across)
    return field / field.sum()


def loaded_edges(mesh, kind):
    """Edges of the loaded side, shape (n, 2), and the axis along it."""
    along, across = (1, 0) if kind in ("shear", "face") else (0, 1)
    return mesh.outline_edges(along, mesh.points[:, along].max()), across


def measured(mesh, kind):
    """Weights of the displacements that make the displacement of a load, shape (n_points, 2), sum 1.

    The mean over the loaded side; of a face its middle, by interpolation along the edge that it lies on.
    """
    if kind != "face":
        return weights(mesh, kind)
    edges, across = loaded_edges(mesh, kind)
    ends = mesh.points[edges, across]
    middle = 0.5 * (mesh.points[:, across].min() + mesh.points[:, across].max())
    found = int(np.argmax((ends.min(axis=1) <= middle) & (middle <= ends.max(axis=1))))
    share = (middle - ends[found, 0]) / (ends[found, 1] - ends[found, 0])
    field = np.zeros(mesh.points.shape)
    field[edges[found], 1] = 1 - share, share
    return field

"""How a load holds and pulls a mesh."""

from typing import TYPE_CHECKING

import numpy as np

from .loads import LoadKind, Side

if TYPE_CHECKING:
    from ..mesh import Mesh

FACE_POSITIONS = np.linspace(0.0, 1.0, 101)
"""Where the profile of a pressed face is given, over its length [1]."""


def side_edges(mesh: "Mesh", side: Side) -> np.ndarray:
    """Edges on a side of a box with its lower left corner at the origin.

    Parameters
    ----------
    mesh : Mesh
    side : Side

    Returns
    -------
    ndarray of int, shape (n, 2)
    """
    return mesh.outline_edges(side.axis, side.place(*mesh.points.max(axis=0)))


def held(mesh: "Mesh", kind: LoadKind) -> np.ndarray:
    """Directions that a kind of load holds, see `springtune.problem.loads`.

    Parameters
    ----------
    mesh : Mesh
        Of a box with its lower left corner at the origin.
    kind : LoadKind

    Returns
    -------
    ndarray of bool, shape (n_points, 2)
    """
    directions = np.zeros(mesh.points.shape, dtype=bool)
    for side, axes in kind.held:
        for axis in axes:
            directions[side_edges(mesh, side), axis] = True
    return directions


def weights(mesh: "Mesh", kind: LoadKind) -> np.ndarray:
    """Weight of each particle in an even distribution over the loaded side, along the force: the pattern of a load.

    Each edge of the side gives half of its share of the length to either particle.

    Parameters
    ----------
    mesh : Mesh
        Of a box with its lower left corner at the origin.
    kind : LoadKind

    Returns
    -------
    ndarray of float, shape (n_points, 2)
        Sum 1 along the force, zero across.
    """
    field = np.zeros(mesh.points.shape)
    field[:, kind.axis] = mesh.side_shares(*loaded_edges(mesh, kind))
    return field / field.sum()


def loaded_edges(mesh: "Mesh", kind: LoadKind) -> tuple[np.ndarray, int]:
    """Edges of the loaded side.

    Parameters
    ----------
    mesh : Mesh
        Of a box with its lower left corner at the origin.
    kind : LoadKind

    Returns
    -------
    edges : ndarray of int, shape (n, 2)
    along : int
        Axis along the side.
    """
    return side_edges(mesh, kind.loaded), kind.along


def measured(mesh: "Mesh", kind: LoadKind) -> np.ndarray:
    """Weights of the displacements that make the displacement of a load.

    Parameters
    ----------
    mesh : Mesh
        Of a box with its lower left corner at the origin.
    kind : LoadKind

    Returns
    -------
    ndarray of float, shape (n_points, 2)
        Sum 1: the mean over the loaded side; of a pressed side its middle, by interpolation along the edge that it
        lies on.
    """
    if not kind.pressed:
        return weights(mesh, kind)
    edges, along = loaded_edges(mesh, kind)
    ends = mesh.points[edges, along]
    middle = 0.5 * (mesh.points[:, along].min() + mesh.points[:, along].max())
    found = int(np.argmax((ends.min(axis=1) <= middle) & (middle <= ends.max(axis=1))))
    share = (middle - ends[found, 0]) / (ends[found, 1] - ends[found, 0])
    field = np.zeros(mesh.points.shape)
    field[edges[found], kind.axis] = 1 - share, share
    return field

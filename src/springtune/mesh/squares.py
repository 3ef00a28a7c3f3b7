"""Meshes of squares: one diagonal each (`right`, `alternating`) or both (`braced`, figure 4a of the paper)."""

import numpy as np

from .cells import Mesh, no_cells


def right(length, height, size):
    r"""Mesh a box with squares cut by parallel diagonals.

    ::

        +---+---+
        | / | / |
        +---+---+
        | / | / |
        +---+---+

    Parameters
    ----------
    length, height : float
        Extent of the box [m].
    size : float
        Asked side of a square [m]; both directions are stretched to fit whole numbers of them.

    Returns
    -------
    Mesh
    """
    points, a, b, c, d = _grid(length, height, size)
    return Mesh(points, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]))


def alternating(length, height, size):
    r"""Mesh a box with squares whose diagonals alternate like a chequerboard; parameters as `right`.

    ::

        +---+---+
        | \ | / |
        +---+---+
        | / | \ |
        +---+---+
    """
    points, a, b, c, d = _grid(length, height, size)
    columns, rows = _counts(length, height, size)
    falling = np.add.outer(np.arange(columns), np.arange(rows)).ravel() % 2 == 1
    first = np.where(falling[:, None], np.stack([a, b, d], axis=1), np.stack([a, b, c], axis=1))
    second = np.where(falling[:, None], np.stack([b, c, d], axis=1), np.stack([a, c, d], axis=1))
    return Mesh(points, np.concatenate([first, second]))


def braced(length, height, size):
    r"""Mesh a box with squares that have both diagonals; parameters as `right`.

    ::

        +---+---+
        | X | X |     the diagonals of a square do not meet: there is no particle between them
        +---+---+
    """
    points, *corners = _grid(length, height, size)
    return Mesh(points, no_cells(3), np.stack(corners, axis=1))


def _counts(length, height, size):
    return max(1, round(length / size)), max(1, round(height / size))


def _grid(length, height, size):
    """Points column by column, and the four corners of each square, counter-clockwise from the lower left."""
    columns, rows = _counts(length, height, size)
    x, y = np.meshgrid(np.linspace(0, length, columns + 1), np.linspace(0, height, rows + 1), indexing="ij")
    a = np.add.outer(np.arange(columns) * (rows + 1), np.arange(rows)).ravel()
    b = a + rows + 1
    return np.stack([x.ravel(), y.ravel()], axis=1), a, b, b + 1, a + 1

"""Meshes of squares: one diagonal each (`right`, `alternating`) or both (`braced`, figure 4a of the paper)."""

import numpy as np

from .cells import Mesh, no_cells
from .types import mesh_type, nearest_counts


@mesh_type("right", order=30)
def right(length: float, height: float, size: float) -> Mesh:
    r"""Squares cut by parallel diagonals.

    Their edges have about `size` [m]; they are stretched to fit the box.

    ::

        +---+---+
        | / | / |
        +---+---+
        | / | / |
        +---+---+
    """
    points, a, b, c, d = _grid(length, height, size)
    return Mesh(points, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]))


@mesh_type("alternating", order=40)
def alternating(length: float, height: float, size: float) -> Mesh:
    r"""Squares whose diagonals alternate like a chequerboard.

    ::

        +---+---+
        | \ | / |
        +---+---+
        | / | \ |
        +---+---+
    """
    points, a, b, c, d = _grid(length, height, size)
    columns, rows = nearest_counts(length, height, size)
    falling = np.add.outer(np.arange(columns), np.arange(rows)).ravel() % 2 == 1
    first = np.where(falling[:, None], np.stack([a, b, d], axis=1), np.stack([a, b, c], axis=1))
    second = np.where(falling[:, None], np.stack([b, c, d], axis=1), np.stack([a, c, d], axis=1))
    return Mesh(points, np.concatenate([first, second]))


@mesh_type("braced", order=50, corners=4)
def braced(length: float, height: float, size: float) -> Mesh:
    r"""Squares with both diagonals.

    ::

        +---+---+
        | X | X |     the diagonals of a square do not meet: there is no particle between them
        +---+---+
    """
    points, *corners = _grid(length, height, size)
    return Mesh(points, no_cells(3), np.stack(corners, axis=1))


def _grid(length: float, height: float, size: float) -> tuple[np.ndarray, ...]:
    """Points column by column, and the four corners of each square, counter-clockwise from the lower left."""
    columns, rows = nearest_counts(length, height, size)
    x, y = np.meshgrid(np.linspace(0, length, columns + 1), np.linspace(0, height, rows + 1), indexing="ij")
    a = np.add.outer(np.arange(columns) * (rows + 1), np.arange(rows)).ravel()
    b = a + rows + 1
    return np.stack([x.ravel(), y.ravel()], axis=1), a, b, b + 1, a + 1

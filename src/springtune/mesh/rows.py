"""Meshes in rows: near-equilateral and other isosceles triangles, and squares with one diagonal or both."""

import math
from itertools import cycle
from numbers import Integral, Real

import numpy as np

from .cells import Mesh, MeshError, check_box, mesh_type, nearest_counts, nearest_whole, no_cells

ROW_HEIGHT = math.sqrt(3) / 2  # height of a row of equilateral triangles of unit edge


@mesh_type("structured", order=10, row_height=ROW_HEIGHT)
def structured(length: float, height: float, size: float) -> Mesh:
    r"""Rows of near-equilateral triangles along x, fitted to the box.

    Every other line of points is shifted by half a cell and closed with a point on either end::

        +---+---+---+      4 points, as the lowest line
        |\ / \ / \ /|
        +-+---+---+-+      shifted by half an edge, closed at both ends: 5 points
        |/ \ / \ / \|
        +---+---+---+
    """
    return _fitted(length, height, *nearest_counts(length, height, size, ROW_HEIGHT))


def isosceles(length: float, height: float, size: float, poisson_ratio: float) -> Mesh:
    """Rows of isosceles triangles whose shape sets Poisson's ratio under load along x.

    Only the row springs carry this load, so ``nu = (a / 2h)^2`` with edges a = `size` and rows of height h, whatever
    the stiffness. An anisotropic mesh, as in figure 4b of the paper.
    """
    check_box(length, height, size)
    if not (isinstance(poisson_ratio, Real) and 1e-6 <= poisson_ratio <= 1):
        raise MeshError(f"poisson_ratio: {poisson_ratio!r} has no such rows; give a number above 0 and at most 1")
    rows = nearest_whole(height / row_height(size, poisson_ratio))
    size = 2 * math.sqrt(poisson_ratio) * height / rows
    return _fitted(length, height, nearest_whole(length / size), rows)


def row_height(size: float, poisson_ratio: float) -> float:
    """Return the height [m] of a row of isosceles triangles of base `size` [m] that sets Poisson's ratio."""
    return size / (2 * math.sqrt(poisson_ratio))


def _declare_isosceles(order: float, poisson_ratio: float) -> None:
    def made(length: float, height: float, size: float) -> Mesh:
        return isosceles(length, height, size, poisson_ratio)

    made.__doc__ = f"Rows of triangles along x whose shape sets a Poisson's ratio of {poisson_ratio:g}."
    mesh_type(f"isosceles-{poisson_ratio:g}", order=order, row_height=row_height(1.0, poisson_ratio))(made)


_declare_isosceles(order=60, poisson_ratio=0.3)
_declare_isosceles(order=70, poisson_ratio=0.5)


def _fitted(length: float, height: float, cells: int, rows: int) -> Mesh:
    straight = np.linspace(0.0, length, cells + 1)
    shifted = np.concatenate([[0.0], 0.5 * (straight[:-1] + straight[1:]), [length]])
    mesh = _join(straight, shifted, np.linspace(0.0, height, rows + 1))
    vars(mesh)["_box_fault"] = ""  # rows fill it once: `springtune.mesh.sheets.box_fault` need not look
    return mesh


def lattice(cells: int, rows: int, size: float = 1.0, row_height: float | None = None) -> Mesh:
    """Exact lattice with staggered ends, on which closed forms hold: every particle inside has the same neighbours."""
    row_height = ROW_HEIGHT * size if row_height is None else row_height
    for name, value in (("cells", cells), ("rows", rows)):
        if not (isinstance(value, Integral) and value >= 1):
            raise MeshError(f"{name}: {value!r} is not a whole number above zero; give one, such as 10")
    check_box(cells * size, rows * row_height, size)
    line = size * np.arange(cells + 1.0)
    return _join(line, line + 0.5 * size, row_height * np.arange(rows + 1.0))


def _join(even: np.ndarray, odd: np.ndarray, heights: np.ndarray) -> Mesh:
    """Join lines of points of two kinds in turn, sorted along x, by triangles: always the next point to the left."""
    lines = [odd if row % 2 else even for row in range(len(heights))]
    points = np.concatenate([np.column_stack([line, np.full(len(line), y)]) for line, y in zip(lines, heights)])
    starts = np.cumsum([0, *map(len, lines[:-1])])
    joined = cycle([_joined(even, odd), _joined(odd, even)])
    bands = zip(joined, starts, starts[1:])
    return Mesh(points, np.concatenate([corners + np.where(above, high, low) for (corners, above), low, high in bands]))


def _joined(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles between two lines: places of their corners in these, and whether a corner is of the upper one."""
    # Merging the mid points of both lines' cells from left to right gives the order of the triangles.
    mids = np.concatenate([low[:-1] + low[1:], high[:-1] + high[1:]])
    upper = np.repeat([False, True], [len(low) - 1, len(high) - 1])
    upper = upper[np.argsort(mids, kind="stable")]
    i = np.concatenate([[0], np.cumsum(~upper)])[:-1]
    j = np.concatenate([[0], np.cumsum(upper)])[:-1]
    above = np.stack([np.zeros_like(upper), upper, np.ones_like(upper)], axis=1)
    return np.stack([i, np.where(upper, j + 1, i + 1), j], axis=1), above


@mesh_type("right", order=30)
def right(length: float, height: float, size: float) -> Mesh:
    """Squares cut by parallel diagonals.

    ::

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

        | \ | / |
        +---+---+
        | / | \ |
    """
    points, a, b, c, d = _grid(length, height, size)
    columns, rows = nearest_counts(length, height, size)
    falling = np.add.outer(np.arange(columns), np.arange(rows)).ravel() % 2 == 1
    first = np.where(falling[:, None], np.stack([a, b, d], axis=1), np.stack([a, b, c], axis=1))
    second = np.where(falling[:, None], np.stack([b, c, d], axis=1), np.stack([a, c, d], axis=1))
    return Mesh(points, np.concatenate([first, second]))


@mesh_type("braced", order=50, corners=4)
def braced(length: float, height: float, size: float) -> Mesh:
    """Squares with both diagonals.

    The diagonals of a square do not meet: there is no particle between them.
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

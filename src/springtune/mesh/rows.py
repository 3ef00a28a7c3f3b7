"""Rows of isosceles triangles fitted to a box: equilateral ones (`structured`) and others (`isosceles`)."""

import math

import numpy as np

from .cells import Mesh

ROW_HEIGHT = math.sqrt(3) / 2
"""Height of a row of equilateral triangles of unit edge."""


def structured(length, height, size):
    r"""Mesh a box with rows of near-equilateral triangles along x.

    The number of cells along x and of rows are the whole numbers nearest to the exact lattice; both directions are
    then stretched to fit. Every other line of points is shifted by half a cell and closed with a point on either end,
    so that the ends are straight::

        +---+---+---+      4 points, as the lowest line
        |\ / \ / \ /|
        +-+---+---+-+      shifted by half an edge, closed at both ends: 5 points
        |/ \ / \ / \|
        +---+---+---+

    Parameters
    ----------
    length, height : float
        Extent of the box [m].
    size : float
        Asked length of an edge [m].

    Returns
    -------
    Mesh
    """
    return _fitted(length, height, max(1, round(length / size)), max(1, round(height / (ROW_HEIGHT * size))))


def isosceles(length, height, size, poisson_ratio):
    """Mesh a box with rows of isosceles triangles whose shape sets Poisson's ratio under load along x.

    Only the row springs of such a network carry a uniaxial load along the rows, so ``nu = (a / 2h)^2`` whatever the
    stiffness is: rows of height ``h = a / (2 sqrt(nu))``. An anisotropic mesh, as in figure 4b of the paper.

    Parameters
    ----------
    length, height : float
        Extent of the box [m].
    size : float
        Asked length a of an edge along the rows [m].
    poisson_ratio : float
        Poisson's ratio that the shape is for, above 0 [1].

    Returns
    -------
    Mesh
        As `structured`; the number of rows is the nearest whole one, that of cells along x keeps the shape best.
    """
    rows = max(1, round(height / row_height(size, poisson_ratio)))
    size = 2 * math.sqrt(poisson_ratio) * height / rows
    return _fitted(length, height, max(1, round(length / size)), rows)


def row_height(size, poisson_ratio):
    """Height of a row of isosceles triangles of base `size` that sets Poisson's ratio [m]."""
    return size / (2 * math.sqrt(poisson_ratio))


def _fitted(length, height, cells, rows):
    straight = np.linspace(0.0, length, cells + 1)
    shifted = np.concatenate([[0.0], 0.5 * (straight[:-1] + straight[1:]), [length]])
    return _join([straight if row % 2 == 0 else shifted for row in range(rows + 1)], np.linspace(0.0, height, rows + 1))


def lattice(cells, rows, size=1.0, row_height=None):
    """Exact lattice with staggered ends: every particle inside sees the same neighbours.

    Each line of points has the same length, every other one shifted by half an edge; no triangle is cut. It is what
    closed forms of a lattice hold on exactly.

    Parameters
    ----------
    cells, rows : int
        Edges in a line, rows of triangles.
    size : float, optional
        Length of an edge along the rows [m].
    row_height : float, optional
        Height of a row [m]; that of equilateral triangles without.

    Returns
    -------
    Mesh
    """
    row_height = ROW_HEIGHT * size if row_height is None else row_height
    line = size * np.arange(cells + 1.0)
    return _join([line + 0.5 * size * (row % 2) for row in range(rows + 1)], row_height * np.arange(rows + 1.0))


def _join(lines, heights):
    """Join lines of points, each sorted along x, by triangles: always the next point that is further left."""
    starts = np.concatenate([[0], np.cumsum([len(line) for line in lines])])
    points = np.concatenate([np.stack([line, np.full(len(line), y)], axis=1) for line, y in zip(lines, heights)])
    triangles = []
    for row, (low, high) in enumerate(zip(lines[:-1], lines[1:])):
        # Merging the mid points of both lines' cells from left to right gives the order of the triangles.
        mids = np.concatenate([low[:-1] + low[1:], high[:-1] + high[1:]])
        upper = np.repeat([False, True], [len(low) - 1, len(high) - 1])
        upper = upper[np.argsort(mids, kind="stable")]
        i = starts[row] + np.concatenate([[0], np.cumsum(~upper)])[:-1]
        j = starts[row + 1] + np.concatenate([[0], np.cumsum(upper)])[:-1]
        triangles.append(np.stack([i, np.where(upper, j + 1, i + 1), j], axis=1))
    return Mesh(points, np.concatenate(triangles))

"""Symmetric matrices of 2 x 2 blocks, a row and a column a point of the plane, and regular grids to coarsen them by."""

from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import LinAlgError

CHUNKS = 8
"""Parts of the rows that threads share; fixed, so that results do not depend on the number of threads."""

ROWS_PER_CHUNK = 5_000
"""Rows below which threads cost more than they save."""


class Blocks(NamedTuple):
    """Symmetric matrix: `blocks` (n_blocks, 4) right of the `diagonal` (n_points, 3: xx, xy, yy), row by row."""

    pointers: np.ndarray
    columns: np.ndarray
    blocks: np.ndarray
    diagonal: np.ndarray


class Chunks(NamedTuple):
    """Matrix in chunks of rows; blocks that couple two chunks are kept apart, and its diagonal is inverted."""

    starts: np.ndarray
    pointers: np.ndarray
    columns: np.ndarray
    blocks: np.ndarray
    diagonal: np.ndarray
    rows_between: np.ndarray
    columns_between: np.ndarray
    blocks_between: np.ndarray
    rows_added: np.ndarray
    added: np.ndarray


class Grid(NamedTuple):
    """Cell of a regular grid that each point is in, its place there from 0 to 1, and the numbers of nodes."""

    cells: np.ndarray
    at: np.ndarray
    shape: tuple[int, int]


def row_pointers(rows: np.ndarray, count: int) -> np.ndarray:
    """Start of each row among sorted rows, shape (count + 1,)."""
    return np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=count))]).astype(np.int32)


def dense(matrix: Blocks) -> np.ndarray:
    """Return the matrix as a full one."""
    count = len(matrix.diagonal)
    rows = np.repeat(np.arange(count), np.diff(matrix.pointers))
    full = np.zeros((count, 2, count, 2))
    full[rows, :, matrix.columns, :] = matrix.blocks.reshape(-1, 2, 2)
    full = full + full.transpose(2, 3, 0, 1)
    every = np.arange(count)
    full[every, :, every, :] = matrix.diagonal[:, [0, 1, 1, 2]].reshape(-1, 2, 2)
    return full.reshape(2 * count, 2 * count)


def chunked(matrix: Blocks, dtype: Any = float) -> Chunks:
    """Cut the rows of a matrix into chunks."""
    count = len(matrix.diagonal)
    chunks = CHUNKS if count >= CHUNKS * ROWS_PER_CHUNK else 1
    starts = np.linspace(0, count, chunks + 1).astype(np.int64)
    rows, columns, blocks = np.empty(0, np.int64), matrix.columns, matrix.blocks.astype(dtype, copy=chunks > 1)
    between = rows, rows, blocks[:0]
    if chunks > 1:
        ends = matrix.pointers[starts]
        crossing = np.concatenate(
            [begin + np.flatnonzero(columns[begin:end] >= stop) for begin, end, stop in zip(ends, ends[1:], starts[1:])]
        )
        rows = np.searchsorted(matrix.pointers, crossing, side="right") - 1
        between = rows, columns[crossing].astype(np.int64), blocks[crossing]
        # In their places are couplings of a row with itself, of nothing.
        columns = columns.copy()
        columns[crossing], blocks[crossing] = rows, 0
    nothing = rows[:0], np.empty((0, 2), dtype)
    return Chunks(starts, matrix.pointers, columns, blocks, matrix.diagonal, *between, *nothing)


def smoother(matrix: Blocks) -> Chunks:
    """Return what Gauss-Seidel sweeps need, in single precision; raise LinAlgError if a diagonal block is not positive.

    Chunks are coupled by Jacobi's method. Half the size of these couplings is added to the diagonal, which keeps any
    preconditioner positive definite (A. Baker, R. Falgout, T. Kolev and U. Yang, SIAM J. Sci. Comput. 33:2864, 2011).
    """
    chunks, added = chunked(matrix, np.float32), np.zeros((len(matrix.diagonal), 2))
    sizes = 0.5 * np.abs(chunks.blocks_between.astype(float).reshape(-1, 2, 2))
    np.add.at(added, chunks.rows_between, sizes.sum(axis=2))
    np.add.at(added, chunks.columns_between, sizes.sum(axis=1))
    near = np.flatnonzero(added.any(axis=1))
    xx, xy, yy = matrix.diagonal.T
    if (xx < 0).any() or (yy < 0).any() or ((xx * yy <= xy * xy) & ((xx * yy > 0) | (xy != 0))).any():
        raise LinAlgError("a particle or node without stiffness")
    xx, yy = xx + added[:, 0], yy + added[:, 1]
    # What is held has zeros, as its inverse has; a 1 stands for it in between.
    one, other = np.where(xx > 0, xx, 1.0), np.where(yy > 0, yy, 1.0)
    inverse = np.stack([(xx > 0) * other, -xy, (yy > 0) * one], axis=1) / (one * other - xy * xy)[:, None]
    return chunks._replace(diagonal=inverse.astype(np.float32), rows_added=near, added=added[near].astype(np.float32))


def first_grid(points: np.ndarray, coarsening: float) -> Grid:
    """Regular grid over points (n_points, 2) [m], with a spacing of so many times their mean distance."""
    lowest, extent = points.min(axis=0), np.ptp(points, axis=0)
    spacing = coarsening * np.sqrt(extent.prod() / len(points))
    count = np.maximum(1, np.round(extent / spacing)).astype(np.int32)
    at = (points - lowest) / (extent / count)
    cells = np.minimum(at.astype(np.int32), count - 1)
    return Grid(cells, (at - cells).astype(np.float32), (int(count[0]) + 1, int(count[1]) + 1))


def next_grid(shape: tuple[int, int]) -> Grid:
    """Grid of twice the spacing over the nodes of a regular one; a single row of cells stays one."""
    places = [np.arange(count) / (2.0 if count > 2 else 1.0) for count in shape]
    sizes = [max(1, count // 2) for count in shape]
    at = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, 2)
    cells = np.minimum(at.astype(np.int32), np.array(sizes, np.int32) - 1)
    return Grid(cells, (at - cells).astype(np.float32), (sizes[0] + 1, sizes[1] + 1))

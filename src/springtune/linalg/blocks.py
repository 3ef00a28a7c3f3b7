"""Symmetric matrices of 2 x 2 blocks, a row and a column a point of the plane."""

from typing import Any, NamedTuple

import numpy as np

CHUNKS = 8
"""Parts of the rows that threads share; fixed, so that results do not depend on the number of threads."""

ROWS_PER_CHUNK = 5_000
"""Rows below which threads cost more than they save."""


class Blocks(NamedTuple):
    """Symmetric matrix of 2 x 2 blocks, a row and a column a point; held directions have zeros.

    `blocks` (n_blocks, 4) are those right of the diagonal, row by row, with `columns` and, from row to row,
    `pointers`; `diagonal` (n_points, 3) holds xx, xy and yy.
    """

    pointers: np.ndarray
    columns: np.ndarray
    blocks: np.ndarray
    diagonal: np.ndarray


class Chunks(NamedTuple):
    """Rows of a matrix in chunks, the blocks that couple two of them apart."""

    starts: np.ndarray
    pointers: np.ndarray
    columns: np.ndarray
    blocks: np.ndarray
    between: tuple[np.ndarray, np.ndarray, np.ndarray]


def row_pointers(rows: np.ndarray, count: int) -> np.ndarray:
    """Where each row begins among sorted rows, shape (count + 1,)."""
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
    blocks, columns = matrix.blocks.astype(dtype, copy=chunks > 1), matrix.columns
    if chunks == 1:
        none = np.empty(0, np.int64)
        return Chunks(starts, matrix.pointers, columns, blocks, (none, none, blocks[:0]))
    ends = matrix.pointers[starts]
    crossing = np.concatenate(
        [begin + np.flatnonzero(columns[begin:end] >= stop) for begin, end, stop in zip(ends, ends[1:], starts[1:])]
    )
    rows = np.searchsorted(matrix.pointers, crossing, side="right") - 1
    between = rows, columns[crossing].astype(np.int64), blocks[crossing]
    # In their places are couplings of a row with itself, of nothing.
    columns = columns.copy()
    columns[crossing], blocks[crossing] = rows, 0
    return Chunks(starts, matrix.pointers, columns, blocks, between)

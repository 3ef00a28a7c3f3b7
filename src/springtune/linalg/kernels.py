"""Compiled loops over symmetric matrices of 2 x 2 blocks: products, Gauss-Seidel sweeps, and steps between grids.

A chunk of rows is written only by its own loop, and couplings between chunks follow by themselves: results are the same
with any number of threads. Fields are (rows, 2); `first` and `last` are the chunks of a thread.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy import ndarray as Field


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


class Grid(NamedTuple):
    """Cell of a regular grid that each point is in, its place there from 0 to 1, and the numbers of nodes."""

    cells: np.ndarray
    at: np.ndarray
    shape: tuple[int, int]


def row_pointers(rows: np.ndarray, count: int) -> np.ndarray:
    """Start of each row among sorted rows, shape (count + 1,)."""
    return np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=count))]).astype(np.int32)


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile on the first call, and cache on disk if possible."""
    try:
        return njit(cache=True, error_model="numpy", nogil=True)(function)
    except RuntimeError:  # no folder to keep it in
        return njit(error_model="numpy", nogil=True)(function)


@compiled
def _gather(matrix: Chunks, i: int, field: Field) -> tuple[float, float]:
    """Force on a row by the blocks right of its diagonal."""
    blocks, x, y = matrix.blocks, field[i, 0] * 0, field[i, 1] * 0
    for e in range(matrix.pointers[i], matrix.pointers[i + 1]):
        j = matrix.columns[e]
        x += blocks[e, 0] * field[j, 0] + blocks[e, 1] * field[j, 1]
        y += blocks[e, 2] * field[j, 0] + blocks[e, 3] * field[j, 1]
    return x, y


@compiled
def _scatter(matrix: Chunks, i: int, x: float, y: float, forces: Field) -> None:
    """Add the forces of a row's displacement by the transposes of these blocks."""
    blocks = matrix.blocks
    for e in range(matrix.pointers[i], matrix.pointers[i + 1]):
        j = matrix.columns[e]
        forces[j, 0] += blocks[e, 0] * x + blocks[e, 2] * y
        forces[j, 1] += blocks[e, 1] * x + blocks[e, 3] * y


@compiled
def multiply(
    first: int, last: int, matrix: Chunks, more: Field, scale: float, keep: float, u: Field, forces: Field, work: Field
) -> None:
    """Set ``u = scale more + keep u``, ``forces = A u``, and each chunk's `work`, forces times u."""
    for chunk in range(first, last):
        total = 0.0
        for i in range(matrix.starts[chunk + 1] - 1, matrix.starts[chunk] - 1, -1):
            x, y = scale * more[i, 0] + keep * u[i, 0], scale * more[i, 1] + keep * u[i, 1]
            u[i, 0], u[i, 1] = x, y
            px, py = _gather(matrix, i, u)
            xx, xy, yy = matrix.diagonal[i]
            forces[i, 0], forces[i, 1] = xx * x + xy * y + px, xy * x + yy * y + py
            _scatter(matrix, i, x, y, forces)
            total += x * (xx * x + xy * y + 2 * px) + y * (xy * x + yy * y + 2 * py)
        work[chunk] = total


@compiled
def advance(
    first: int, last: int, matrix: Chunks, length: float, fields: Any, scale: float, right: Field, squares: Field
) -> None:
    """Step along `u`, and set `right` to the new residual times a scale, `squares` to its squared norm by chunk."""
    u, forces, solution, residual = fields
    for chunk in range(first, last):
        total = 0.0
        for i in range(matrix.starts[chunk], matrix.starts[chunk + 1]):
            for a in range(2):
                solution[i, a] += length * u[i, a]
                residual[i, a] -= length * forces[i, a]
                right[i, a] = scale * residual[i, a]
                total += residual[i, a] * residual[i, a]
        squares[chunk] = total


@compiled
def sweep_down(first: int, last: int, matrix: Chunks, right: Field, u: Field, excess: Field) -> None:
    """Sweep once from zero, from the last row to the first; `excess` is ``A u - right``."""
    for chunk in range(first, last):
        for i in range(matrix.starts[chunk + 1] - 1, matrix.starts[chunk] - 1, -1):
            px, py = _gather(matrix, i, u)
            xx, xy, yy = matrix.diagonal[i]
            x, y = right[i, 0] - px, right[i, 1] - py
            x, y = xx * x + xy * y, xy * x + yy * y
            u[i, 0], u[i, 1] = x, y
            excess[i, 0] = excess[i, 1] = 0
            _scatter(matrix, i, x, y, excess)


@compiled
def sweep_up(first: int, last: int, matrix: Chunks, right: Field, u: Field, known: Field, work: Field) -> None:
    """Sweep once from `u`, from the first row to the last; `known` are forces of other chunks, `work` right times u."""
    for chunk in range(first, last):
        total = 0.0
        for i in range(matrix.starts[chunk], matrix.starts[chunk + 1]):
            px, py = _gather(matrix, i, u)
            xx, xy, yy = matrix.diagonal[i]
            x, y = right[i, 0] - known[i, 0] - px, right[i, 1] - known[i, 1] - py
            x, y = xx * x + xy * y, xy * x + yy * y
            u[i, 0], u[i, 1] = x, y
            _scatter(matrix, i, x, y, known)
            total += np.float64(right[i, 0]) * x + np.float64(right[i, 1]) * y
        work[chunk] = total


@compiled
def couple(matrix: Chunks, u: Field, forces: Field) -> float:
    """Add the forces between chunks, and return their work; a row's coupling with itself counts twice, as any other."""
    work = 0.0
    for e in range(len(matrix.rows_between)):
        i, j = matrix.rows_between[e], matrix.columns_between[e]
        xx, xy, yx, yy = matrix.blocks_between[e]
        x, y = xx * u[j, 0] + xy * u[j, 1], yx * u[j, 0] + yy * u[j, 1]
        work += 2.0 * (x * u[i, 0] + y * u[i, 1])
        forces[i, 0] += x
        forces[i, 1] += y
        forces[j, 0] += xx * u[i, 0] + yx * u[i, 1]
        forces[j, 1] += xy * u[i, 0] + yy * u[i, 1]
    return work


@compiled
def restrict(first: int, last: int, matrix: Chunks, grid: Grid, excess: Field, coarse: Field) -> None:
    """Sum the negative of `excess` at the nodes of a grid's cells, in an array of its own for each chunk."""
    height = grid.shape[1]
    for chunk in range(first, last):
        nodes = coarse[chunk]
        nodes[:] = 0
        for i in range(matrix.starts[chunk], matrix.starts[chunk + 1]):
            corner, right, up = grid.cells[i, 0] * height + grid.cells[i, 1], grid.at[i, 0], grid.at[i, 1]
            for a in range(2):
                high = -right * excess[i, a]
                low = -excess[i, a] - high
                nodes[corner, a] += low - up * low
                nodes[corner + 1, a] += up * low
                nodes[corner + height, a] += high - up * high
                nodes[corner + height + 1, a] += up * high


@compiled
def prolong(first: int, last: int, matrix: Chunks, grid: Grid, coarse: Field, u: Field, known: Field) -> None:
    """Add the interpolation from the nodes of a grid to `u`, and set `known` to zero."""
    height = grid.shape[1]
    for i in range(matrix.starts[first], matrix.starts[last]):
        corner, right, up = grid.cells[i, 0] * height + grid.cells[i, 1], grid.at[i, 0], grid.at[i, 1]
        for a in range(2):
            low = coarse[corner, a] + up * (coarse[corner + 1, a] - coarse[corner, a])
            corner_right = corner + height
            high = coarse[corner_right, a] + up * (coarse[corner_right + 1, a] - coarse[corner_right, a])
            u[i, a] += low + right * (high - low)
            known[i, a] = 0


@compiled
def _weights(grid: Grid, i: int, weights: Field) -> None:
    x, y = np.float64(grid.at[i, 0]), np.float64(grid.at[i, 1])
    weights[0], weights[1], weights[2], weights[3] = (1 - x) * (1 - y), (1 - x) * y, x * (1 - y), x * y


@compiled
def _add(sums: Field, weight: float, xx: float, xy: float, yx: float, yy: float) -> None:
    sums[0] += weight * xx
    sums[1] += weight * xy
    sums[2] += weight * yx
    sums[3] += weight * yy


@compiled
def coarsen(matrix: Blocks, grid: Grid, near: np.ndarray, far: np.ndarray, far_blocks: np.ndarray) -> int:
    """Sum Galerkin's matrix on the nodes of a grid, and return how many rows `far` must have.

    `near` (nodes, 13, 4) gets blocks of nodes up to two places apart, `far` those that long springs join.
    """
    height, here, there, count = grid.shape[1], np.empty(4), np.empty(4), 0
    for i in range(len(matrix.diagonal)):
        _weights(grid, i, here)
        corner = grid.cells[i, 0] * height + grid.cells[i, 1]
        xx, xy, yy = matrix.diagonal[i]
        for a in range(4):
            node = corner + (a >> 1) * height + (a & 1)
            for b in range(a, 4):
                slot = ((b >> 1) - (a >> 1)) * 5 + (b & 1) - (a & 1)
                _add(near[node, slot], here[a] * here[b], xx, xy, xy, yy)
        for e in range(matrix.pointers[i], matrix.pointers[i + 1]):
            j = matrix.columns[e]
            _weights(grid, j, there)
            over, above = grid.cells[j, 0] - grid.cells[i, 0], grid.cells[j, 1] - grid.cells[i, 1]
            close = abs(over) <= 1 and abs(above) <= 1
            xx, xy, yx, yy = matrix.blocks[e]
            for a in range(4):
                node = corner + (a >> 1) * height + (a & 1)
                for b in range(4):
                    weight, right, up = here[a] * there[b], over + (b >> 1) - (a >> 1), above + (b & 1) - (a & 1)
                    forward = right > 0 or right == 0 and up >= 0
                    low = node if forward else node + right * height + up
                    p, q = (xy, yx) if forward else (yx, xy)
                    if close:
                        _add(near[low, abs(right) * 5 + (up if forward else -up)], weight, xx, p, q, yy)
                        if right == 0 and up == 0:
                            _add(near[low, 0], weight, xx, q, p, yy)
                    else:
                        if count < len(far):
                            far[count, 0], far[count, 1] = low, low + abs(right * height + up)
                            far_blocks[count] = 0
                            _add(far_blocks[count], weight, xx, p, q, yy)
                        count += 1
    return count

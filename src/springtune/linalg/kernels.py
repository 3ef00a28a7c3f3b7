"""Compiled loops over symmetric matrices of 2 x 2 blocks: products, Gauss-Seidel sweeps, and steps between grids.

Rows are cut into chunks whose number does not depend on the threads. A chunk's loops read and write its own rows
alone, so results are the same with any number of threads; the few couplings between chunks follow by themselves.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile on the first call, and cache on disk if possible."""
    try:
        return njit(cache=True, error_model="numpy", nogil=True)(function)
    except RuntimeError:  # no folder to keep it in
        return njit(error_model="numpy", nogil=True)(function)


@compiled
def multiply(
    first: int,
    last: int,
    starts: np.ndarray,
    pointers: np.ndarray,
    columns: np.ndarray,
    blocks: np.ndarray,
    diagonal: np.ndarray,
    better: np.ndarray,
    scale: float,
    keep: float,
    direction: np.ndarray,
    forces: np.ndarray,
    work: np.ndarray,
) -> None:
    """Set ``direction = scale better + keep direction``, ``forces = A direction`` and `work`, their product a chunk.

    `blocks` (n_blocks, 4) are those right of the diagonal, by rows; `diagonal` (n, 3) holds xx, xy and yy.
    """
    for chunk in range(first, last):
        total = 0.0
        for i in range(starts[chunk + 1] - 1, starts[chunk] - 1, -1):
            x = scale * better[i, 0] + keep * direction[i, 0]
            y = scale * better[i, 1] + keep * direction[i, 1]
            direction[i, 0], direction[i, 1] = x, y
            px, py = 0.0, 0.0
            for e in range(pointers[i], pointers[i + 1]):
                j = columns[e]
                px += blocks[e, 0] * direction[j, 0] + blocks[e, 1] * direction[j, 1]
                py += blocks[e, 2] * direction[j, 0] + blocks[e, 3] * direction[j, 1]
                forces[j, 0] += blocks[e, 0] * x + blocks[e, 2] * y
                forces[j, 1] += blocks[e, 1] * x + blocks[e, 3] * y
            qx, qy = diagonal[i, 0] * x + diagonal[i, 1] * y, diagonal[i, 1] * x + diagonal[i, 2] * y
            forces[i, 0], forces[i, 1] = qx + px, qy + py
            total += x * (qx + 2.0 * px) + y * (qy + 2.0 * py)
        work[chunk] = total


@compiled
def advance(
    first: int,
    last: int,
    starts: np.ndarray,
    length: float,
    direction: np.ndarray,
    forces: np.ndarray,
    solution: np.ndarray,
    missing: np.ndarray,
    scale: float,
    right: np.ndarray,
    squares: np.ndarray,
) -> None:
    """Take a step of conjugate gradients; `right` is the scaled residual, `squares` its squared norm a chunk."""
    for chunk in range(first, last):
        total = 0.0
        for i in range(starts[chunk], starts[chunk + 1]):
            for a in range(2):
                solution[i, a] += length * direction[i, a]
                left = missing[i, a] - length * forces[i, a]
                missing[i, a] = left
                right[i, a] = scale * left
                total += left * left
        squares[chunk] = total


@compiled
def sweep_down(
    first: int,
    last: int,
    starts: np.ndarray,
    pointers: np.ndarray,
    columns: np.ndarray,
    blocks: np.ndarray,
    inverse: np.ndarray,
    right: np.ndarray,
    x: np.ndarray,
    excess: np.ndarray,
) -> None:
    """Sweep once from zero, from the last row to the first; `excess` is ``A x - right``."""
    for chunk in range(first, last):
        for i in range(starts[chunk + 1] - 1, starts[chunk] - 1, -1):
            rx, ry = right[i, 0], right[i, 1]
            for e in range(pointers[i], pointers[i + 1]):
                j = columns[e]
                rx -= blocks[e, 0] * x[j, 0] + blocks[e, 1] * x[j, 1]
                ry -= blocks[e, 2] * x[j, 0] + blocks[e, 3] * x[j, 1]
            vx, vy = inverse[i, 0] * rx + inverse[i, 1] * ry, inverse[i, 1] * rx + inverse[i, 2] * ry
            x[i, 0], x[i, 1] = vx, vy
            excess[i, 0], excess[i, 1] = np.float32(0), np.float32(0)
            for e in range(pointers[i], pointers[i + 1]):
                j = columns[e]
                excess[j, 0] += blocks[e, 0] * vx + blocks[e, 2] * vy
                excess[j, 1] += blocks[e, 1] * vx + blocks[e, 3] * vy


@compiled
def sweep_up(
    first: int,
    last: int,
    starts: np.ndarray,
    pointers: np.ndarray,
    columns: np.ndarray,
    blocks: np.ndarray,
    inverse: np.ndarray,
    right: np.ndarray,
    x: np.ndarray,
    known: np.ndarray,
    work: np.ndarray,
) -> None:
    """Sweep once from `x`, from the first row to the last; `known` holds forces of other chunks, `work` right x."""
    for chunk in range(first, last):
        total = 0.0
        for i in range(starts[chunk], starts[chunk + 1]):
            rx, ry = right[i, 0] - known[i, 0], right[i, 1] - known[i, 1]
            for e in range(pointers[i], pointers[i + 1]):
                j = columns[e]
                rx -= blocks[e, 0] * x[j, 0] + blocks[e, 1] * x[j, 1]
                ry -= blocks[e, 2] * x[j, 0] + blocks[e, 3] * x[j, 1]
            vx, vy = inverse[i, 0] * rx + inverse[i, 1] * ry, inverse[i, 1] * rx + inverse[i, 2] * ry
            x[i, 0], x[i, 1] = vx, vy
            for e in range(pointers[i], pointers[i + 1]):
                j = columns[e]
                known[j, 0] += blocks[e, 0] * vx + blocks[e, 2] * vy
                known[j, 1] += blocks[e, 1] * vx + blocks[e, 3] * vy
            total += np.float64(right[i, 0]) * vx + np.float64(right[i, 1]) * vy
        work[chunk] = total


@compiled
def couple(
    rows: np.ndarray,
    columns: np.ndarray,
    blocks: np.ndarray,
    near: np.ndarray,
    added: np.ndarray,
    x: np.ndarray,
    forces: np.ndarray,
) -> float:
    """Add to `forces` what couplings between chunks do to `x`, less `added` on the diagonal `near` them.

    It returns the work of the couplings.
    """
    work = 0.0
    for e in range(len(rows)):
        i, j = rows[e], columns[e]
        px, py = blocks[e, 0] * x[j, 0] + blocks[e, 1] * x[j, 1], blocks[e, 2] * x[j, 0] + blocks[e, 3] * x[j, 1]
        work += 2.0 * (px * x[i, 0] + py * x[i, 1])
        forces[i, 0] += px
        forces[i, 1] += py
        forces[j, 0] += blocks[e, 0] * x[i, 0] + blocks[e, 2] * x[i, 1]
        forces[j, 1] += blocks[e, 1] * x[i, 0] + blocks[e, 3] * x[i, 1]
    for k in range(len(near)):
        for a in range(2):
            forces[near[k], a] -= added[k, a] * x[near[k], a]
    return work


@compiled
def restrict(
    first: int,
    last: int,
    starts: np.ndarray,
    cells: np.ndarray,
    at: np.ndarray,
    height: int,
    excess: np.ndarray,
    coarse: np.ndarray,
) -> None:
    """Sum the negative of `excess` at the nodes of a grid's cells, in an array of its own for each chunk."""
    for chunk in range(first, last):
        target = coarse[chunk]
        target[:] = 0
        for i in range(starts[chunk], starts[chunk + 1]):
            corner, x, y = cells[i, 0] * height + cells[i, 1], at[i, 0], at[i, 1]
            for a in range(2):
                low, high = (x - np.float32(1)) * excess[i, a], -x * excess[i, a]
                target[corner, a] += low - y * low
                target[corner + 1, a] += y * low
                target[corner + height, a] += high - y * high
                target[corner + height + 1, a] += y * high


@compiled
def prolong(
    first: int,
    last: int,
    starts: np.ndarray,
    cells: np.ndarray,
    at: np.ndarray,
    height: int,
    coarse: np.ndarray,
    x: np.ndarray,
    known: np.ndarray,
) -> None:
    """Add what is interpolated from the nodes of a grid to `x`, and set `known` to zero."""
    for chunk in range(first, last):
        for i in range(starts[chunk], starts[chunk + 1]):
            corner, right, up = cells[i, 0] * height + cells[i, 1], at[i, 0], at[i, 1]
            for a in range(2):
                low = coarse[corner, a] + up * (coarse[corner + 1, a] - coarse[corner, a])
                corner_right = corner + height
                high = coarse[corner_right, a] + up * (coarse[corner_right + 1, a] - coarse[corner_right, a])
                x[i, a] += low + right * (high - low)
                known[i, a] = 0


@compiled
def _weights(at: np.ndarray, i: int, weights: np.ndarray) -> None:
    x, y = np.float64(at[i, 0]), np.float64(at[i, 1])
    weights[0], weights[1], weights[2], weights[3] = (1 - x) * (1 - y), (1 - x) * y, x * (1 - y), x * y


@compiled
def coarsen(
    pointers: np.ndarray,
    columns: np.ndarray,
    blocks: np.ndarray,
    diagonal: np.ndarray,
    cells: np.ndarray,
    at: np.ndarray,
    height: int,
    near: np.ndarray,
    far: np.ndarray,
    far_blocks: np.ndarray,
) -> int:
    """Sum Galerkin's matrix on the nodes of a grid, and return how many blocks `far` must have room for.

    `near` (nodes, 13, 4) holds the diagonal, and blocks of nodes up to two apart, those to larger numbers; `far` (n,
    2) the numbers of other nodes.
    """
    here, there, count = np.empty(4), np.empty(4), 0
    for i in range(len(diagonal)):
        _weights(at, i, here)
        corner = cells[i, 0] * height + cells[i, 1]
        xx, xy, yy = diagonal[i, 0], diagonal[i, 1], diagonal[i, 2]
        for a in range(4):
            node = corner + (a >> 1) * height + (a & 1)
            for b in range(a, 4):
                weight = here[a] * here[b]
                slot = ((b >> 1) - (a >> 1)) * 5 + (b & 1) - (a & 1)
                near[node, slot, 0] += weight * xx
                near[node, slot, 1] += weight * xy
                near[node, slot, 2] += weight * xy
                near[node, slot, 3] += weight * yy
        for e in range(pointers[i], pointers[i + 1]):
            j = columns[e]
            _weights(at, j, there)
            over, up = cells[j, 0] - cells[i, 0], cells[j, 1] - cells[i, 1]
            close = abs(over) <= 1 and abs(up) <= 1
            p, q, r, s = blocks[e, 0], blocks[e, 1], blocks[e, 2], blocks[e, 3]
            for a in range(4):
                node = corner + (a >> 1) * height + (a & 1)
                for b in range(4):
                    weight = here[a] * there[b]
                    right, above = over + (b >> 1) - (a >> 1), up + (b & 1) - (a & 1)
                    forward = right > 0 or right == 0 and above >= 0
                    low = node if forward else node + right * height + above
                    same = right == 0 and above == 0
                    u, v = (q, r) if forward else (r, q)
                    if close:
                        slot = abs(right) * 5 + (above if forward else -above)
                        near[low, slot, 0] += weight * p
                        near[low, slot, 1] += weight * u
                        near[low, slot, 2] += weight * v
                        near[low, slot, 3] += weight * s
                        if same:
                            near[low, 0, 0] += weight * p
                            near[low, 0, 1] += weight * v
                            near[low, 0, 2] += weight * u
                            near[low, 0, 3] += weight * s
                    else:
                        if count < len(far):
                            far[count, 0], far[count, 1] = low, low + abs(right * height + above)
                            far_blocks[count, 0], far_blocks[count, 1] = weight * p, weight * u
                            far_blocks[count, 2], far_blocks[count, 3] = weight * v, weight * s
                        count += 1
    return count

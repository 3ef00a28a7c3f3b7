"""Solves of large networks: conjugate gradients with multigrid on regular grids as preconditioner."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property, lru_cache, partialmethod
from typing import Any

import numba
import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.sparse import bsr_array, csr_array

from . import kernels
from .factors import Factor, SingularError
from .kernels import Blocks, Chunks, Grid, row_pointers

RESIDUAL = 1e-11  # residual over the right-hand side at which a solve ends

STEP_RESIDUAL = 1e-6  # residual at which a solve for a step of Newton's method ends

MAX_CG_ITERATIONS = 300

CERTAIN_RESIDUAL = 1e-7
"""Residual over a random right-hand side below which every direction has been met.

Of two million unknowns, with shares of deviation ``n**-0.5``, one is below this in one case of 10 000.
"""

FINEST_SPACING = 3.0
"""Spacing of the finest grid over the mesh size; of a grid of 2 the product takes longer than it saves steps."""

DENSE_UNKNOWNS = 500  # unknowns below which the coarsest matrix is factorized, as a dense one

MOST_BORROWED_ITERATIONS = 50  # iterations with another matrix's grids above which building own grids is faster

LEAST_DETERMINANT = 1e-14  # determinant of a particle's own stiffness over its diagonal's product; less is rounding

MOST_LEVELS = 16
"""Grids, each of a quarter of the cells of the last: a narrow body is longer than the coarsest ones have cells for."""

CHUNKS = 8  # parts of the rows that threads share; fixed, so that results do not depend on the number of threads

ROWS_PER_CHUNK = 5_000  # rows below which threads cost more than they save

THREADS: int = vars(numba.config)["NUMBA_NUM_THREADS"]
"""Threads of a solve: processors of this process, or the environment variable NUMBA_NUM_THREADS."""


class NotPositiveError(SingularError):
    """Conjugate gradients did not converge."""


class IndefiniteError(NotPositiveError):
    """Conjugate gradients met a direction without stiffness."""


_Level = tuple[Chunks, Grid, tuple[np.ndarray, np.ndarray, np.ndarray]]
"""Smoother of a matrix, the next coarser grid, and room for two fields and the forces on the grid's nodes."""


class Multigrid:
    """Conjugate gradients, preconditioned by multigrid on regular grids over the mesh; used like a `factors.Factor`.

    Node displacements are interpolated bilinearly, so rigid motions and even strains are exact; coarse matrices are
    Galerkin's. A cycle takes one Gauss-Seidel sweep down and one up, in single precision. Time and memory grow as the
    unknowns n, a factorization's as n^(3/2) and n log n. Method: J. Xu, The auxiliary space method and optimal
    multigrid preconditioning techniques for unstructured grids, Computing 56:215, 1996.

    `assemble` returns the matrix; it is called again if own grids are laid later, since keeping one takes much memory.
    `points` (n_points, 2) are in m, and `held` (n_points, 2) marks directions that cannot move. `besides` is a matrix
    (2 n_points, 2 n_points) added in products alone. `name` is ``"multigrid"``, or that of the factor that took over.
    """

    def __init__(
        self,
        assemble: Callable[[], Blocks],
        points: np.ndarray,
        held: np.ndarray,
        otherwise: Callable[[], Factor] | None = None,
        like: "Multigrid | None" = None,
        besides: csr_array | None = None,
    ) -> None:
        self._assemble, self._otherwise, self._points, self._besides = assemble, otherwise, points, besides
        matrix = assemble()
        self._held, self._places, self._product = held, np.flatnonzero(~held), cut_rows(matrix)
        self.name, self._certain = "multigrid", False
        self._direct: Factor | None = None
        self._levels: list[_Level] = like._levels if like else []
        self._coarsest: Any = like._coarsest if like else None
        self._borrowed = self._coarsest is not None
        if not self._borrowed:
            self._lay_grids(matrix)

    def _lay_grids(self, matrix: Blocks) -> None:
        """Make the levels and the dense factor of the coarsest one; none if the matrix is not positive definite."""
        self._borrowed, self._levels, self._coarsest = False, [], None
        grid, places = first_grid(self._points, FINEST_SPACING), self._places
        # Sweeps over positive diagonals, and a coarsest matrix with a factor, make a positive definite
        # preconditioner, whatever the matrix is. With another one conjugate gradients may end and have met nothing.
        if not (matrix.diagonal[:, ::2].ravel()[places] > 0).all():
            return
        try:
            while len(places) > DENSE_UNKNOWNS and len(self._levels) < MOST_LEVELS:
                coarse, chunks = galerkin(matrix, grid), smoother(matrix)
                nodes = np.zeros((len(chunks.starts) - 1, grid.shape[0] * grid.shape[1], 2), np.float32)
                fields = np.zeros((2, *grid.cells.shape), np.float32)
                self._levels.append((chunks, grid, (*fields, nodes)))
                matrix, grid = coarse, next_grid(grid.shape)
                places = np.flatnonzero(matrix.diagonal[:, ::2])
            self._coarsest = places, cho_factor(as_dense(matrix)[np.ix_(places, places)])
        except LinAlgError:
            self._levels = []

    def cycle(self, depth: int, right: np.ndarray) -> tuple[np.ndarray, float]:
        """Return a cycle's answer to a right-hand side, in an array that the next one overwrites, and their product."""
        if depth == len(self._levels):
            places, factor = self._coarsest
            solution = np.zeros(right.shape, dtype=np.float32)
            solution.ravel()[places] = cho_solve(factor, right.ravel()[places].astype(float), check_finite=False)
            return solution, float(np.vdot(solution, right))
        matrix, grid, (x, excess, nodes) = self._levels[depth]
        work = np.empty(len(nodes))
        run(kernels.sweep_down, matrix, right, x, excess)
        kernels.couple(matrix, x, excess)
        run(kernels.restrict, matrix, grid, excess, nodes)
        coarse, _ = self.cycle(depth + 1, nodes[0] if len(nodes) == 1 else nodes.sum(axis=0))
        run(kernels.prolong, matrix, grid, coarse, x, excess)
        kernels.couple(matrix, x, excess)
        run(kernels.sweep_up, matrix, right, x, excess, work)
        return x, float(work.sum())

    def solve(self, right: np.ndarray, tolerance: float = RESIDUAL) -> np.ndarray:
        """Solve for a right-hand side (unknowns,), to a residual relative to it."""
        if self._direct is None:
            field = np.zeros(self._points.shape)
            field.ravel()[self._places] = right
            try:
                return self._gradients(field, tolerance).ravel()[self._places]
            except NotPositiveError:
                if self._otherwise is None:
                    raise
                self._levels, self._direct = [], self._otherwise()
                self.name = self._direct.name
        return self._direct.solve(right)

    def _multiply(
        self, better: np.ndarray, scale: float, keep: float, direction: np.ndarray, forces: np.ndarray
    ) -> float:
        """Set the next direction and its forces, and return their product, see `kernels.multiply`."""
        matrix = self._product
        work = np.empty(len(matrix.starts) - 1)
        run(kernels.multiply, matrix, better, scale, keep, direction, forces, work)
        total = float(work.sum()) + kernels.couple(matrix, direction, forces)
        if self._besides is not None:
            more = (self._besides @ direction.ravel()).reshape(forces.shape)
            forces += more
            total += float(np.vdot(direction, more))
        return total

    def _gradients(self, missing: np.ndarray, tolerance: float) -> np.ndarray:
        """Solve by conjugate gradients; `missing` (n_points, 2) is used up.

        The first solve adds a random residual: if it vanishes too and all stiffnesses met are positive, the matrix
        counts as positive definite. A direction of stiffness ``-l``, over that in the preconditioner, has a share of
        about ``l / n**0.5``. With `RESIDUAL` and a million unknowns ``l > 1e-4`` is overlooked in one case of 10 000,
        ``l < 1e-8`` mostly. Trap: a part that turns about one particle, or hangs on a spring or two, counts as solved.
        """
        solution, size = np.zeros(missing.shape), float(np.linalg.norm(missing))
        if size == 0.0:
            return solution
        proves = not self._certain and tolerance <= CERTAIN_RESIDUAL
        if proves:
            xx, xy, yy = self._product.diagonal.T
            product = np.where(self._held[:, 0], 1.0, xx) * np.where(self._held[:, 1], 1.0, yy)
            if (abs(product - xy**2) <= LEAST_DETERMINANT * abs(product)).any():
                raise SingularError("a particle is free to move: its springs, if any, are in one line")
        if self._coarsest is None:
            raise IndefiniteError("a coarse matrix without stiffness: the tangent is singular or unstable")
        scale, forces = 1.0 / size, np.zeros(missing.shape)
        right, squares = np.zeros(missing.shape, np.float32), np.empty(len(self._product.starts) - 1)
        if proves:
            random = np.random.default_rng(0).standard_normal(len(self._places))
            right.ravel()[self._places] = random / np.linalg.norm(random)
            self._multiply(self.cycle(0, right)[0], size, 0.0, solution, forces)
            missing -= forces
        direction, length, weight = np.zeros(missing.shape), 0.0, np.inf
        for count in range(MAX_CG_ITERATIONS + 1):
            fields = direction, forces, solution, missing
            run(kernels.advance, self._product, length, fields, scale, right, squares)
            if squares.sum() ** 0.5 <= tolerance * size:
                self._certain |= proves
                return solution
            if self._borrowed and count == MOST_BORROWED_ITERATIONS:
                self._lay_grids(self._assemble())
                return solution + self._gradients(missing, tolerance * size / float(np.linalg.norm(missing)))
            # The weight is in units of the scaled residual, as the preconditioner is linear.
            before = weight
            better, weight = self.cycle(0, right)
            stiffness = self._multiply(better, size, weight / before, direction, forces)
            if not stiffness > 0 or not weight > 0:
                raise IndefiniteError("a direction without stiffness: the tangent is singular or unstable")
            length = weight * size * size / stiffness
        raise NotPositiveError(f"conjugate gradients did not end within {MAX_CG_ITERATIONS} iterations")

    step = partialmethod(solve, tolerance=STEP_RESIDUAL)  # as accurate as a step of Newton's method needs

    estimate = partialmethod(solve, tolerance=1e-2)

    @cached_property
    def negative_pivots(self) -> int:
        """Return 0 if the matrix is positive definite, else 1, or the count of a factor that took over."""
        if not self._certain and self._direct is None:
            try:
                self.solve(np.random.default_rng(1).standard_normal(len(self._places)), CERTAIN_RESIDUAL)
            except IndefiniteError:
                return 1
        return 0 if self._direct is None else self._direct.negative_pivots


@lru_cache
def _pool(process: int) -> ThreadPoolExecutor:
    """Threads of a process besides its main one; a forked process has none of its parent's."""
    return ThreadPoolExecutor(max(1, min(CHUNKS, THREADS) - 1))


def run(kernel: Callable[..., None], matrix: Chunks, *arguments: Any) -> None:
    """Run a kernel on all chunks of rows, in as many threads as numba would take."""
    chunks = len(matrix.starts) - 1
    threads = min(chunks, THREADS)
    ends = [chunks * thread // threads for thread in range(threads + 1)]
    begun = [_pool(os.getpid()).submit(kernel, *part, matrix, *arguments) for part in zip(ends[1:-1], ends[2:])]
    kernel(0, ends[1], matrix, *arguments)
    for one in begun:
        one.result()


def galerkin(matrix: Blocks, grid: Grid) -> Blocks:
    """Matrix of the nodes of a grid, for displacements that are bilinear in its cells."""
    nodes, height, count, found = grid.shape[0] * grid.shape[1], grid.shape[1], -1, 0
    while found > count:  # points far from each other are joined
        count = found
        near, far, far_blocks = np.zeros((nodes, 13, 4)), np.empty((count, 2), np.int64), np.empty((count, 4))
        found = kernels.coarsen(matrix, grid, near, far, far_blocks)
    diagonal = near[:, 0, [0, 1, 3]]
    right = np.repeat([0, 1, 2], [2, 5, 5]) * height + np.concatenate([[1, 2], range(-2, 3), range(-2, 3)])
    rows, slots = np.nonzero(near[:, 1:].any(axis=2))
    columns, blocks = rows + right[slots], near[rows, slots + 1]
    if count:
        keys = np.concatenate([rows * nodes + columns, far @ [nodes, 1]])
        order = np.argsort(keys, kind="stable")
        keys, blocks = keys[order], np.concatenate([blocks, far_blocks])[order]
        begin = np.flatnonzero(np.diff(keys, prepend=-1))
        blocks, (rows, columns) = np.add.reduceat(blocks, begin), np.divmod(keys[begin], nodes)
    return Blocks(row_pointers(rows, nodes), columns.astype(np.int32), blocks, diagonal)


def as_dense(matrix: Blocks) -> np.ndarray:
    """Return the matrix as a dense array."""
    count = len(matrix.diagonal)
    blocks = matrix.blocks.reshape(-1, 2, 2)
    right = bsr_array((blocks, matrix.columns, matrix.pointers), shape=(2 * count, 2 * count)).toarray()
    full, every = right + right.T, np.arange(count)
    full.reshape(count, 2, count, 2)[every, :, every, :] = matrix.diagonal[:, [0, 1, 1, 2]].reshape(-1, 2, 2)
    return full


def cut_rows(matrix: Blocks, dtype: Any = float) -> Chunks:
    """Cut the rows of a matrix into chunks."""
    count = len(matrix.diagonal)
    chunks = CHUNKS if count >= CHUNKS * ROWS_PER_CHUNK else 1
    starts = np.linspace(0, count, chunks + 1).astype(np.int64)
    ends, columns, blocks = matrix.pointers[starts], matrix.columns.copy(), matrix.blocks.astype(dtype)
    crossing = np.concatenate(
        [begin + np.flatnonzero(columns[begin:end] >= stop) for begin, end, stop in zip(ends, ends[1:], starts[1:])]
    )
    rows = np.searchsorted(matrix.pointers, crossing, side="right") - 1
    between = rows, columns[crossing].astype(np.int64), blocks[crossing]
    # In their places are couplings of a row with itself, of nothing.
    columns[crossing], blocks[crossing] = rows, 0
    return Chunks(starts, matrix.pointers, columns, blocks, matrix.diagonal, *between)


def smoother(matrix: Blocks) -> Chunks:
    """Return a matrix for Gauss-Seidel sweeps, in single precision; refuse indefinite diagonal blocks.

    Chunks are coupled by Jacobi's method. Half the size of these couplings is added to the diagonal, which keeps any
    preconditioner positive definite (A. Baker, R. Falgout, T. Kolev and U. Yang, SIAM J. Sci. Comput. 33:2864, 2011),
    and taken off again between the chunks.
    """
    xx, xy, yy = matrix.diagonal.T
    if (xx < 0).any() or (yy < 0).any() or ((xx * yy <= xy * xy) & ((xx * yy > 0) | (xy != 0))).any():
        raise LinAlgError("a particle or node without stiffness")
    chunks, added = cut_rows(matrix, np.float32), np.zeros((len(matrix.diagonal), 2))
    sizes = 0.5 * np.abs(chunks.blocks_between.astype(float).reshape(-1, 2, 2))
    np.add.at(added, chunks.rows_between, sizes.sum(axis=2))
    np.add.at(added, chunks.columns_between, sizes.sum(axis=1))
    near = np.flatnonzero(added.any(axis=1))
    taken_off = -0.5 * added[near, :, None] * np.eye(2)
    blocks = np.concatenate([chunks.blocks_between, taken_off.reshape(-1, 4)], dtype=np.float32)
    rows, columns = (np.concatenate([own, near]) for own in (chunks.rows_between, chunks.columns_between))
    xx, yy = xx + added[:, 0], yy + added[:, 1]
    # What is held has zeros, as its inverse has; a 1 stands for it in between.
    one, other = np.where(xx > 0, xx, 1.0), np.where(yy > 0, yy, 1.0)
    inverse = np.stack([(xx > 0) * other, -xy, (yy > 0) * one], axis=1) / (one * other - xy * xy)[:, None]
    return Chunks(*chunks[:4], inverse.astype(np.float32), rows, columns, blocks)


def first_grid(points: np.ndarray, coarsening: float) -> Grid:
    """Regular grid over points (n_points, 2) [m], whose spacing is `coarsening` times their mean distance."""
    lowest, extent = points.min(axis=0), np.ptp(points, axis=0)
    spacing = coarsening * np.sqrt(extent.prod() / len(points))
    counts = np.maximum(1, np.round(extent / spacing)).astype(np.int32)
    return _located((points - lowest) / (extent / counts), counts)


def next_grid(shape: tuple[int, int]) -> Grid:
    """Grid of twice the spacing over the nodes of a regular one; a single row of cells stays one."""
    places = [np.arange(count) / (2.0 if count > 2 else 1.0) for count in shape]
    at = np.stack(np.meshgrid(*places, indexing="ij"), axis=-1).reshape(-1, 2)
    return _located(at, np.maximum(1, np.array(shape, np.int32) // 2))


def _located(at: np.ndarray, counts: np.ndarray) -> Grid:
    """Grid of so many cells along x and y, by places (n_points, 2) in units of a cell."""
    cells = np.minimum(at.astype(np.int32), counts - 1)
    return Grid(cells, (at - cells).astype(np.float32), (int(counts[0]) + 1, int(counts[1]) + 1))

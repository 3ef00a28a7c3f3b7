"""Solves of large networks: conjugate gradients with multigrid on regular grids as preconditioner."""

from collections.abc import Callable
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.sparse import csr_array

from .factors import Factor, SingularError

RESIDUAL = 1e-11
"""Residual over the right-hand side at which a solve ends."""

STEP_RESIDUAL = 1e-6
"""The same for a step of Newton's method."""

MAX_CG_ITERATIONS = 300

CERTAIN = 1e-7
"""Residual over a random right-hand side below which every direction has been met.

Each of n unknowns has a normally distributed share of deviation ``n**-0.5``, below this in one case of 10 000 for two
million unknowns.
"""

COARSENING = 3.0
"""Spacing of the finest grid over the mesh size; of a grid of 2 the product takes longer than it saves steps."""

COARSEST = 500
"""Unknowns below which the coarsest matrix is factorized, as a dense one."""

MOST_BORROWED = 50
"""Iterations with another matrix's grids above which building own grids is faster."""

IN_LINE = 1e-14
"""Determinant of a particle's own stiffness over the product of its diagonal that counts as rounding."""

MOST_LEVELS = 16
"""Grids, each of a quarter of the cells of the last: a narrow body is longer than the coarsest ones have cells for."""


class NotPositiveError(SingularError):
    """Conjugate gradients did not converge."""


class IndefiniteError(NotPositiveError):
    """Conjugate gradients met a direction without stiffness."""


class _Level(NamedTuple):
    """A matrix, and the step from the next coarser grid to its unknowns and back, in single precision."""

    matrix: csr_array
    prolong: csr_array
    restrict: csr_array


class Multigrid:
    """Conjugate gradients, preconditioned by multigrid on regular grids laid over the mesh.

    It replaces a factor, see `springtune.linalg.factors.Factor`. Node displacements are interpolated bilinearly to
    the particles and from grid to grid, each twice as wide, so rigid motions and even strains are exact. Coarse
    matrices are Galerkin's; a cycle takes one Gauss-Seidel sweep down and one up, in single precision, enough to
    precondition. Time and memory are proportional to the unknowns n; a factorization's grow as n^(3/2) and n log n.
    Method: J. Xu, The auxiliary space method and optimal multigrid preconditioning techniques for unstructured grids,
    Computing 56:215, 1996.

    `matrix` is symmetric; `points` (n_points, 2) in m; `places` (unknowns,) is twice the particle's number, plus 1
    for y. `name` is ``"multigrid"``, or that of the factor that took over.
    """

    def __init__(
        self,
        matrix: csr_array,
        points: np.ndarray,
        places: np.ndarray,
        otherwise: Callable[[], Factor] | None = None,
        like: "Multigrid | None" = None,
    ) -> None:
        self._matrix, self._otherwise, self._points, self._places = matrix, otherwise, points, places
        self.name = "multigrid"
        self._direct: Factor | None = None
        self._certain = False
        self._levels: list[_Level] = []
        self._coarsest: Any = None
        if like is None or like._coarsest is None:
            self._lay_grids()
        else:
            self._borrowed, self._levels, self._coarsest = True, like._levels, like._coarsest

    def _lay_grids(self) -> None:
        """Levels and the factor of the coarsest one, of the matrix itself."""
        self._borrowed, self._levels, self._coarsest = False, [], None
        try:
            self._coarsest = self._coarsened(self._points, self._places)
        except LinAlgError:  # then the matrix is not positive definite either
            self._levels = []

    def _coarsened(self, points: np.ndarray, places: np.ndarray) -> Any:
        """Levels down to the coarsest one, whose dense factor is returned."""
        matrix = self._matrix
        spacing = COARSENING * np.sqrt(np.ptp(points, axis=0).prod() / len(points))
        while matrix.shape[0] > COARSEST and len(self._levels) < MOST_LEVELS:
            # Sweeps over positive diagonals, and a coarsest matrix with a factor, make a positive definite
            # preconditioner, whatever the matrix is. With another one conjugate gradients may end and have met nothing.
            if not matrix.diagonal().min() > 0:
                raise LinAlgError("a diagonal that is not positive")
            prolong, points = bilinear(points, places, spacing)
            # Of a node that moves nothing there is no equation.
            moving = np.bincount(prolong.indices, minlength=prolong.shape[1]) > 0
            places = np.flatnonzero(moving)
            if not moving.all():
                prolong = prolong[:, places]
            restrict = csr_array(prolong.T)
            coarse = restrict @ (matrix @ prolong)
            single = csr_array((matrix.data.astype(np.float32), matrix.indices, matrix.indptr), shape=matrix.shape)
            self._levels.append(_Level(single, prolong, restrict))
            matrix, spacing = coarse, 2.0 * spacing
        return cho_factor(matrix.toarray())

    def _give_up(self, error: NotPositiveError) -> Factor:
        """The factor that takes over."""
        if self._otherwise is None:
            raise error
        self._levels = []
        self._direct = self._otherwise()
        self.name = self._direct.name
        return self._direct

    def _precondition(self, right: np.ndarray) -> np.ndarray:
        """Apply a multigrid cycle to a right-hand side."""
        size = np.linalg.norm(right) or 1.0
        single = np.multiply(right, 1.0 / size, out=np.empty(len(right), dtype=np.float32), casting="same_kind")
        return np.multiply(self._cycle(0, single), size, dtype=float)

    def _cycle(self, depth: int, right: np.ndarray) -> np.ndarray:
        from pyamg.relaxation.relaxation import gauss_seidel

        if depth == len(self._levels):
            return cho_solve(self._coarsest, right.astype(float), check_finite=False).astype(np.float32)
        matrix, prolong, restrict = self._levels[depth]
        solution = np.zeros_like(right)
        gauss_seidel(matrix, solution, right)
        missing = matrix @ solution
        np.subtract(right, missing, out=missing)
        solution += prolong @ self._cycle(depth + 1, restrict @ missing)
        gauss_seidel(matrix, solution, right, sweep="backward")
        return solution

    def solve(self, right: np.ndarray, tolerance: float = RESIDUAL) -> np.ndarray:
        """Solve for a right-hand side (unknowns,), to a residual relative to it."""
        if self._direct is None:
            try:
                return self._gradients(np.array(right, dtype=float), tolerance)
            except NotPositiveError as error:
                self._give_up(error)
        assert self._direct is not None
        return self._direct.solve(right)

    def _gradients(self, missing: np.ndarray, tolerance: float) -> np.ndarray:
        """Solve by conjugate gradients.

        The first solve adds a random residual: if it vanishes too and all stiffnesses met are positive, the matrix
        counts as positive definite. A direction of negative stiffness never loses residual. The random part is ``A
        M^-1`` of a random vector, with the preconditioner M: a direction of stiffness ``-l``, over that in M, has a
        share of about ``l / n**0.5``. With `RESIDUAL` and a million unknowns ``l > 1e-4`` is overlooked in one case
        of 10 000, ``l < 1e-8`` mostly. Trap: directions of zero stiffness without load are found only for single
        particles here, and for parts without supports by the network. A part that turns about one particle, or hangs
        on a spring or two, counts as solved.
        """
        solution, scale = np.zeros(len(missing)), np.linalg.norm(missing)
        if scale == 0.0:
            return solution
        if self._coarsest is None:
            raise IndefiniteError("a coarse matrix without stiffness: the tangent is singular or unstable")
        proves = not self._certain and tolerance <= CERTAIN
        if proves:
            self._check_particles()
            random = np.random.default_rng(0).standard_normal(len(missing))
            solution = self._precondition(scale / np.linalg.norm(random) * random)
            missing -= self._matrix @ solution
        better = self._precondition(missing)
        direction, weight = better.copy(), missing @ better
        for count in range(MAX_CG_ITERATIONS):
            if self._borrowed and count == MOST_BORROWED:
                self._lay_grids()
                return solution + self._gradients(missing, float(tolerance * scale / np.linalg.norm(missing)))
            forces = self._matrix @ direction
            stiffness = direction @ forces
            if not stiffness > 0 or not weight > 0:
                raise IndefiniteError("a direction without stiffness: the tangent is singular or unstable")
            length = weight / stiffness
            forces *= length
            missing -= forces
            solution += np.multiply(direction, length, out=forces)
            if np.linalg.norm(missing) <= tolerance * scale:
                self._certain |= proves
                return solution
            better = self._precondition(missing)
            weight, before = missing @ better, weight
            direction *= weight / before
            direction += better
        raise NotPositiveError(f"conjugate gradients did not end within {MAX_CG_ITERATIONS} iterations")

    def _check_particles(self) -> None:
        """Refuse a matrix with a particle that moves without stiffness: all its springs are in one line."""
        stiffness, coupling = self._matrix.diagonal(), self._matrix.diagonal(1)
        x = np.flatnonzero(np.diff(self._places // 2) == 0)  # of particles that are free along y, too
        both = stiffness[x] * stiffness[x + 1]
        if not stiffness.all() or (abs(both - coupling[x] ** 2) <= IN_LINE * abs(both)).any():
            raise SingularError("a particle is free to move: its springs, if any, are in one line")

    def step(self, right: np.ndarray) -> np.ndarray:
        """As `solve`, so far as a step of Newton's method goes."""
        return self.solve(right, STEP_RESIDUAL)

    def estimate(self, right: np.ndarray) -> np.ndarray:
        """As `solve`, to a percent."""
        return self.solve(right, 1e-2)

    @cached_property
    def negative_pivots(self) -> int:
        """0 if the matrix is positive definite, else 1; only a factor that takes over counts them.

        A random residual has a part of every direction, too small in one case of 10 000, see `CERTAIN`; conjugate
        gradients cannot end without having met its stiffness.
        """
        if not self._certain and self._direct is None:
            try:
                self.solve(np.random.default_rng(1).standard_normal(self._matrix.shape[0]), CERTAIN)
            except IndefiniteError:
                return 1
        return 0 if self._direct is None else self._direct.negative_pivots


def bilinear(points: np.ndarray, places: np.ndarray, spacing: float) -> tuple[csr_array, np.ndarray]:
    """Return the bilinear interpolation from a regular grid of about `spacing` [m], and its nodes.

    `points` (n_points, 2) [m]; `places` (unknowns,) is twice the particle's number, plus 1 for y. The matrix is
    (unknowns, 2 n_nodes), x and y of each node in turn; nodes (n_nodes, 2) [m] have particles near by.
    """
    lowest, extent = points.min(axis=0), np.ptp(points, axis=0)
    cells = np.maximum(1, np.round(extent / spacing)).astype(np.int64)
    widths = extent / cells
    at = (points - lowest) / widths
    corner = np.minimum(at.astype(np.int64), cells - 1)
    (x, y), height = (at - corner).T, cells[1] + 1
    node = (corner[:, 0] * height + corner[:, 1])[:, None] + [0, 1, height, height + 1]
    weights = np.stack([(1 - x) * (1 - y), (1 - x) * y, x * (1 - y), x * y], axis=1).astype(np.float32)
    used = np.zeros((cells + 1).prod(), dtype=bool)
    used[node] = True
    node = (np.cumsum(used, dtype=np.int32) - np.int32(1))[node]
    particle, direction = np.divmod(places, 2)
    columns = 2 * node[particle] + direction[:, None].astype(np.int32)
    pointers = np.arange(0, 4 * len(places) + 1, 4, dtype=np.int32)
    nodes = lowest + np.stack(np.divmod(np.flatnonzero(used), height), axis=1) * widths
    prolong = csr_array((weights[particle].ravel(), columns.ravel(), pointers), shape=(len(places), 2 * len(nodes)))
    prolong.eliminate_zeros()
    return prolong, nodes

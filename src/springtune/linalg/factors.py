"""Factorized symmetric matrices: by CHOLMOD if available, else by SuperLU; orders of elimination.

CHOLMOD comes with the extra package cvxopt. Without it, or with the environment variable ``SPRINGTUNE_SOLVER`` set to
``superlu``, SuperLU factorizes, which takes three to five times as long.
"""

import os
from collections.abc import Sequence
from functools import cached_property
from typing import Any, Protocol

import numpy as np
from scipy.sparse import csc_array, csr_array, sparray
from scipy.sparse.linalg import splu

try:
    import cvxopt
    from cvxopt import cholmod
except ModuleNotFoundError:  # one that does not load is an error
    cholmod = None

CHOLESKY = cholmod is not None and os.environ.get("SPRINGTUNE_SOLVER") != "superlu"
"""Whether CHOLMOD is available and the default."""

SUPERLU: dict[str, Any] = {"relax": 4, "panel_size": 4, "options": {"SymmetricMode": True}}
"""Sizes of SuperLU's panels: for these matrices its own are a quarter slower."""


class SingularError(ArithmeticError):
    """A matrix could not be factorized."""


class Factor(Protocol):
    """Solver of one symmetric matrix: `SuperLUFactor`, `CholeskyFactor` or `Multigrid`."""

    name: str

    @property
    def negative_pivots(self) -> int:
        """Number of negative eigenvalues of the matrix; 0 where it is positive definite."""

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solve for right-hand sides, shape (unknowns,) or (unknowns, n)."""

    def step(self, right: np.ndarray) -> np.ndarray:
        """Solve as accurately as a step of Newton's method needs."""

    def estimate(self, right: np.ndarray) -> np.ndarray:
        """Estimate the solution."""


class SuperLUFactor:
    """Symmetric matrix factorized by SuperLU, see `Factor`."""

    name = "SuperLU"

    def __init__(self, matrix: csc_array, order: np.ndarray | None = None) -> None:
        self._order = slice(None) if order is None else order
        chosen = "MMD_AT_PLUS_A" if order is None else "NATURAL"
        try:
            self.lu = splu(matrix, permc_spec=chosen, diag_pivot_thresh=0.0, **SUPERLU)
        except RuntimeError as error:
            raise SingularError("the matrix is singular: some motion meets no resistance") from error

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solution of the factorized system, shape (unknowns,) or (unknowns, n)."""
        solution = np.empty_like(right)
        solution[self._order] = self.lu.solve(right[self._order])
        return solution

    step = estimate = solve

    @property
    def least_pivot(self) -> float:
        """Smallest pivot, whatever its sign."""
        return float(np.abs(self.lu.U.diagonal()).min(initial=np.inf))

    @cached_property
    def negative_pivots(self) -> int:
        """Number of negative eigenvalues of the matrix (Sylvester's law of inertia)."""
        if (self.lu.perm_r != self.lu.perm_c).any():
            raise SingularError("a zero pivot")
        return int((self.lu.U.diagonal() < 0).sum())


class Analysis:
    """Reusable symbolic factorization of all symmetric matrices of one sparsity; `spare` are unused factors.

    Supernodal Cholesky factorization (Chen, Davis, Hager and Rajamanickam, ACM Trans. Math. Softw. 35(3):22, 2008).
    """

    def __init__(self, indices: np.ndarray, pointers: np.ndarray, order: np.ndarray | None = None) -> None:
        size = len(pointers) - 1
        columns = np.repeat(np.arange(size), np.diff(pointers))
        self._lower = np.flatnonzero(indices >= columns)
        rows, columns = (cvxopt.matrix(part[self._lower].astype(np.int64)) for part in (indices, columns))
        self._matrix = cvxopt.spmatrix(np.zeros(len(self._lower)), rows, columns, (size, size))
        self._order = {} if order is None else {"p": cvxopt.matrix(order.astype(np.int64))}
        self.spare: list[Any] = []
        cholmod.options["supernodal"] = 2

    def factorize(self, data: np.ndarray) -> "CholeskyFactor | None":
        """Factorize the matrix of these entries (n_entries,); None if it is not positive definite."""
        self._matrix.V = cvxopt.matrix(data[self._lower])
        # A factor is made in the place of its symbolic one, and gives that back when nobody needs it any more.
        factor = self.spare.pop() if self.spare else cholmod.symbolic(self._matrix, uplo="L", **self._order)
        try:
            cholmod.numeric(self._matrix, factor)
        except ArithmeticError:
            self.spare.append(factor)
            return None
        return CholeskyFactor(factor, self.spare, self._matrix.size[0])


LOWER_HALF, UPPER_HALF = (7, 4), (5, 8)
"""CHOLMOD's systems with a permutation and the lower triangular factor, and with their transposes."""


class CholeskyFactor:
    """A factorized positive definite matrix, see `Factor`; made by `Analysis.factorize`."""

    name = "Cholesky"
    negative_pivots = 0

    def __init__(self, factor: object, spare: list[Any], size: int) -> None:
        self._factor, self._spare, self._size = factor, spare, size

    def __del__(self) -> None:
        self._spare.append(self._factor)

    def solve(self, right: np.ndarray, systems: Sequence[int] = (0,)) -> np.ndarray:
        """Solution of the factorized system, shape (unknowns,) or (unknowns, n), or of CHOLMOD's `systems` in turn."""
        solution = cvxopt.matrix(right)
        for system in systems:
            cholmod.solve(self._factor, solution, sys=system)
        return np.array(solution).reshape(right.shape)

    step = estimate = solve

    @property
    def least_pivot(self) -> float:
        """Smallest pivot."""
        return float(np.array(cholmod.diag(self._factor)).min(initial=np.inf)) ** 2

    def lower_columns(self, unknowns: np.ndarray) -> csc_array:
        """Few entries each: `LOWER_HALF` of the solution for a unit load at each of n unknowns, (unknowns, n)."""
        size, count = self._size, len(unknowns)
        units = cvxopt.spmatrix(1.0, cvxopt.matrix(unknowns), cvxopt.matrix(np.arange(count)), (size, count))
        found = cholmod.spsolve(self._factor, cholmod.spsolve(self._factor, units, sys=7), sys=4)
        pointers, indices, data = (np.array(part).ravel() for part in found.CCS)
        return csc_array((data, indices, pointers), shape=(size, count))


def factorize(matrix: sparray, solver: str | None = None) -> SuperLUFactor | CholeskyFactor:
    """Factorize a symmetric matrix of any sparsity."""
    matrix = csc_array(matrix)
    matrix.sort_indices()
    cholesky = solver == "Cholesky" or CHOLESKY and solver != "SuperLU"
    factor = Analysis(matrix.indices, matrix.indptr).factorize(matrix.data) if cholesky else None
    return factor or SuperLUFactor(matrix)


LEAST_SIGN_RATIO = 100.0  # smallest ratio of an eigenvalue of T to its error for which its sign counts

BACKWARD_ERROR = 1e-15  # residual over what rounding of the solution makes of it, above which a solve is corrected

PIN_STIFFNESS = 4.0  # stiffness of a pin over the largest entry of the diagonal


class PinnedFactor:
    r"""Factorized indefinite symmetric matrix with a few unknowns pinned, made by `factorize_pinned`.

    An unstable network gives way in a few long waves. With springs of stiffness s to the ground at the unknowns E,
    ``K + s E E'`` has a sparse Cholesky factor ``L L'``; then (M. A. Woodbury, Inverting modified matrices, 1950)

    .. math:: K^{-1} = L^{-T} (I + G T^{-1} G^T) L^{-1}, \qquad G = L^{-1} E, \qquad T = I / s - G^T G,

    and K has as many negative eigenvalues as the small matrix T (E. V. Haynsworth, Linear Algebra Appl. 1:73, 1968), if
    their signs are `certain`. A pin costs half a solve; SuperLU takes several times the time and memory.
    """

    name = "pinned Cholesky"

    def __init__(self, matrix: csc_array, factor: CholeskyFactor, pins: np.ndarray, stiffness: float) -> None:
        self._matrix, self._factor = matrix, factor
        self._columns = factor.lower_columns(pins)
        small = np.eye(len(pins)) / stiffness - (self._columns.T @ self._columns).toarray()
        values, vectors = np.linalg.eigh(small)
        self.negative_pivots = int((values < 0).sum())
        self._size = float(np.abs(matrix.data).max())
        # Of the mode next to zero, w = P^-1 E v: what the factor leaves of E v moves the eigenvalue by its work on w.
        least = np.abs(values).argmin()
        mode = factor.solve(self._columns @ vectors[:, least], UPPER_HALF)
        left = -(matrix @ mode)
        left[pins] += vectors[:, least] - stiffness * mode[pins]
        error = abs(mode @ left) + np.finfo(float).eps * self._size * (mode @ mode)
        self.certain = abs(values[least]) > LEAST_SIGN_RATIO * error
        self._inverse = (vectors / values) @ vectors.T if self.certain else vectors

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Solution of the system, shape (unknowns,) or (unknowns, n); corrected as long as that halves its residual."""
        if right.ndim == 2:
            return np.stack([self.solve(column) for column in right.T], axis=1)
        solution = self.estimate(right)
        missing = right - self._matrix @ solution
        while (left := np.abs(missing).max()) > BACKWARD_ERROR * self._size * np.abs(solution).max():
            better = solution + self.estimate(missing)
            missing = right - self._matrix @ better
            if not np.abs(missing).max() <= 0.5 * left:
                break
            solution = better
        return solution

    step = solve

    def estimate(self, right: np.ndarray) -> np.ndarray:
        """Solve for one right-hand side without a correction."""
        half = self._factor.solve(right, LOWER_HALF)
        return self._factor.solve(half + self._columns @ (self._inverse @ (self._columns.T @ half)), UPPER_HALF)


def factorize_pinned(matrix: csc_array, analysis: Analysis, choices: Sequence[np.ndarray]) -> PinnedFactor | None:
    """Factorize an indefinite matrix with a full diagonal and ascending rows; None if no choice of pins helps."""
    stiffness = PIN_STIFFNESS * float(np.abs(matrix.diagonal()).max())
    for pins in choices:
        pinned = matrix.copy()
        pinned[pins, pins] = matrix.diagonal()[pins] + stiffness
        factor = analysis.factorize(pinned.data)
        if factor is not None:
            found = PinnedFactor(matrix, factor, pins, stiffness)
            return found if found.certain else None
    return None


def entry_places(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return rows and columns of the entries of matrices over unknowns (n, ...), one matrix after another."""
    unknowns = numbers.reshape(len(numbers), -1)
    width = unknowns.shape[1]
    return np.repeat(unknowns, width, axis=1).ravel(), np.tile(unknowns, width).ravel()


PART_PARTICLES = 48  # particles of a part that is not cut any more


def nested_dissection(points: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return an elimination order of particles at `points` (n_points, 2) [m] with little fill-in, every cut last.

    Cuts halve the longer side (A. George, SIAM J. Numer. Anal. 10:345, 1973). `edges` (n_edges, 2) share matrix
    entries.
    """
    count, joined = len(points), _joined(len(points), edges)
    order, low = np.empty(count, dtype=np.int64), np.zeros(count, dtype=bool)
    waiting = [(np.arange(count), 0)]
    while waiting:
        part, start = waiting.pop()
        if len(part) <= PART_PARTICLES:
            order[start : start + len(part)] = part
            continue
        x, y = points[part, 0], points[part, 1]
        along, across = (x, y) if x.max() - x.min() >= y.max() - y.min() else (y, x)
        middle = np.partition(along, len(part) // 2)[len(part) // 2]
        below = along < middle if middle > along.min() else along <= middle  # half of them may be on the first line
        left, right = part[below], part[~below]
        low[left] = True
        touches = joined[right] @ low
        low[left] = False
        separator, right = right[touches], right[~touches]
        separator = separator[np.argsort(across[~below][touches], kind="stable")]
        order[start + len(part) - len(separator) : start + len(part)] = separator
        waiting += [(left, start), (right, start + len(left))]
    return order


def _joined(count: int, edges: np.ndarray) -> csr_array:
    """Whether two particles are neighbours, both ways."""
    first, second = edges.T
    ones = np.ones(2 * len(edges), dtype=bool)
    return csr_array((ones, (np.r_[first, second], np.r_[second, first])), shape=(count, count))


def narrow_order(count: int, edges: np.ndarray) -> np.ndarray:
    """Return reversed Cuthill-McKee's order if it at least halves the bandwidth, else the numbers unchanged."""
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    order = reverse_cuthill_mckee(_joined(count, edges), symmetric_mode=True)
    place = np.argsort(order)
    before, after = (int(np.abs(numbers[:, 0] - numbers[:, 1]).max(initial=0)) for numbers in (edges, place[edges]))
    return order if 2 * after <= before else np.arange(count)


def spread_particles(points: np.ndarray, count: int) -> np.ndarray:
    """Return up to `count` particles spread over a mesh, in ascending order."""
    parts = [np.arange(len(points))]
    while len(parts) < count and len(points) >= 2 * len(parts):
        halves = []
        for part in parts:
            along = points[part, np.ptp(points[part], axis=0).argmax()]
            order, middle = np.argsort(along, kind="stable"), len(part) // 2
            halves += [part[order[:middle]], part[order[middle:]]]
        parts = halves
    middles = (part[((points[part] - points[part].mean(axis=0)) ** 2).sum(axis=1).argmin()] for part in parts)
    return np.unique(list(middles))

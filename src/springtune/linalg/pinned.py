r"""Cholesky factorization of indefinite symmetric matrices, with a few unknowns pinned.

An unstable network gives way in a few long waves. Pins, springs to the ground, hold them: with stiffness s at each
unknown that E chooses, ``K + s E E'`` has a Cholesky factor ``L L'``, as sparse as K's. The pins are taken off again
(M. A. Woodbury, Inverting modified matrices, Princeton, 1950):

.. math:: K^{-1} = L^{-T} (I + G T^{-1} G^T) L^{-1}, \qquad G = L^{-1} E, \qquad T = I / s - G^T G,

and K has as many negative eigenvalues as the small matrix T (E. V. Haynsworth, Linear Algebra Appl. 1:73, 1968). It
costs one factorization and half a solve a pin; SuperLU takes several times the time and memory.
"""

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csc_array

from .factors import Analysis, CholeskyFactor

CLEAR = 100.0
"""Smallest ratio of an eigenvalue of T to its error for which its sign counts."""

BACKWARD_ERROR = 1e-15
"""Residual over what rounding of the solution makes of it, above which a solve is corrected."""


PIN = 4.0
"""Stiffness of a pin over the largest entry of the diagonal."""


class UncertainError(ArithmeticError):
    """The sign of an eigenvalue is within its error."""


class PinnedFactor:
    """Factorized indefinite symmetric matrix with pinned unknowns, made by `factorize_pinned`."""

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
        mode = factor.upper(self._columns @ vectors[:, least])
        left = -(matrix @ mode)
        left[pins] += vectors[:, least] - stiffness * mode[pins]
        error = abs(mode @ left) + np.finfo(float).eps * self._size * (mode @ mode)
        if not abs(values[least]) > CLEAR * error:
            raise UncertainError(f"an eigenvalue of {values[least]:.1e}, uncertain by {error:.1e}")
        self._inverse = (vectors / values) @ vectors.T

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
        """As `solve`, of one right-hand side and without a correction."""
        half = self._factor.lower(right)
        return self._factor.upper(half + self._columns @ (self._inverse @ (self._columns.T @ half)))


def factorize_pinned(matrix: csc_array, analysis: Analysis, choices: Sequence[np.ndarray]) -> PinnedFactor | None:
    """Factorize an indefinite matrix with a full diagonal and ascending rows; None if no choice of pins helps.

    Examples
    --------
    >>> matrix = csc_array(np.array([[1.0, 2.0], [2.0, 1.0]]))
    >>> factor = factorize_pinned(matrix, Analysis(matrix.indices, matrix.indptr), [np.array([0])])
    >>> factor.negative_pivots, factor.solve(np.array([3.0, 3.0]))
    (1, array([1., 1.]))
    """
    columns = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    diagonal = np.flatnonzero(matrix.indices == columns)
    stiffness = PIN * float(np.abs(matrix.data[diagonal]).max())
    for pins in choices:
        data = matrix.data.copy()
        data[diagonal[pins]] += stiffness
        factor = analysis.factorize(data)
        if factor is not None:
            try:
                return PinnedFactor(matrix, factor, pins, stiffness)
            except UncertainError:
                return None
    return None

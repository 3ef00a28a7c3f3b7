"""Solves of large networks: conjugate gradients with algebraic multigrid as preconditioner."""

from functools import cached_property

import numpy as np
from scipy.sparse import csr_array, csr_matrix, sparray

from .factors import SingularError

RESIDUAL = 1e-11
"""Residual over the right-hand side at which a solve ends."""

MAX_CG_ITERATIONS = 300

CERTAIN = 1e-7
"""Residual over a random right-hand side below which every direction has been met: of a million unknowns each has a
share of about 1e-3."""


class NotPositiveError(SingularError):
    """Conjugate gradients came to no end."""


class IndefiniteError(NotPositiveError):
    """Conjugate gradients met a direction without stiffness."""


class Multigrid:
    """Smoothed aggregation, whose coarse spaces hold the rigid motions of the sheet.

    It stands in the place of a factor, see `springtune.linalg.factors.Factor`.
    Time and memory grow in proportion to the number of unknowns, where those of a factorization grow with its power 3/2
    and n log n. Method: Vanek, Mandel and Brezina, Computing 56:179, 1996; by the library pyamg.

    Parameters
    ----------
    matrix : sparse array, shape (unknowns, unknowns)
        Symmetric.
    motions : ndarray of float, shape (unknowns, 3)
        Rigid motions.
    """

    name = "multigrid"

    def __init__(self, matrix: sparray, motions: np.ndarray) -> None:
        from pyamg import smoothed_aggregation_solver

        self._matrix = csr_array(matrix)
        sweep = ("gauss_seidel", {"sweep": "symmetric"})
        # pyamg takes matrices of the older kind only.
        hierarchy = smoothed_aggregation_solver(
            csr_matrix(matrix), B=motions, presmoother=sweep, postsmoother=sweep, max_coarse=500
        )
        self._precondition = hierarchy.aspreconditioner(cycle="V").matvec

    def solve(self, right: np.ndarray, tolerance: float = RESIDUAL) -> np.ndarray:
        """Solution of the system.

        Parameters
        ----------
        right : ndarray of float, shape (unknowns,)
        tolerance : float, optional
            Residual over the right-hand side at which it ends [1].

        Returns
        -------
        ndarray of float, shape (unknowns,)

        Raises
        ------
        IndefiniteError
            If a direction without stiffness is met.
        NotPositiveError
            If it does not end.
        """
        solution, missing = np.zeros(len(right)), np.array(right, dtype=float)
        target = tolerance * np.linalg.norm(right)
        if target == 0.0:
            return solution
        better = self._precondition(missing)
        direction, weight = better.copy(), missing @ better
        for _ in range(MAX_CG_ITERATIONS):
            forces = self._matrix @ direction
            stiffness = direction @ forces
            if not stiffness > 0:
                raise IndefiniteError("a direction without stiffness: the tangent is singular or unstable")
            length = weight / stiffness
            solution += length * direction
            missing -= length * forces
            if np.linalg.norm(missing) <= target:
                return solution
            better = self._precondition(missing)
            weight, before = missing @ better, weight
            direction = better + weight / before * direction
        raise NotPositiveError(f"conjugate gradients did not end within {MAX_CG_ITERATIONS} iterations")

    def estimate(self, right: np.ndarray) -> np.ndarray:
        """As `solve`, to a percent."""
        return self.solve(right, 1e-2)

    @cached_property
    def negative_pivots(self) -> int:
        """0 where the matrix is positive definite, else 1: they are not counted.

        Conjugate gradients cannot end in a direction of which the right-hand side has a part without having met its
        stiffness, and a random one has a part of every direction.
        """
        try:
            self.solve(np.random.default_rng(0).standard_normal(self._matrix.shape[0]), CERTAIN)
        except IndefiniteError:
            return 1
        return 0

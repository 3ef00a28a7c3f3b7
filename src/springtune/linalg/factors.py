"""Factorised symmetric matrices: by Cholesky's method where CHOLMOD is at hand, else by SuperLU.

CHOLMOD comes with the package cvxopt, an extra. Where it is not installed, or where the environment variable
``SPRINGTUNE_SOLVER`` is ``superlu``, SuperLU factorises, which takes three to five times as long. What is not positive
definite has no Cholesky factor, and SuperLU then counts its negative pivots.
"""

import os
from functools import cached_property
from importlib.util import find_spec

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

CHOLESKY = find_spec("cvxopt") is not None and os.environ.get("SPRINGTUNE_SOLVER") != "superlu"
"""Whether CHOLMOD is there and wanted."""

SUPERLU = {"relax": 4, "panel_size": 4, "options": {"SymmetricMode": True}}
"""Sizes of SuperLU's panels: for these matrices its own are a quarter slower."""


class SingularError(ArithmeticError):
    """A matrix could not be factorised."""


class Factor:
    """A symmetric matrix factorised by SuperLU: solves, and counts negative eigenvalues (Sylvester's law of inertia).

    Parameters
    ----------
    matrix : csc_array, shape (unknowns, unknowns)
    order : ndarray of int, optional
        Unknowns in the order in which the matrix has them, which is that of elimination; SuperLU's own (minimum degree)
        without.

    Raises
    ------
    SingularError
        If it is singular.
    """

    name = "SuperLU"

    def __init__(self, matrix, order=None):
        self._order = slice(None) if order is None else order
        chosen = "MMD_AT_PLUS_A" if order is None else "NATURAL"
        try:
            self._lu = splu(matrix, permc_spec=chosen, diag_pivot_thresh=0.0, **SUPERLU)
        except RuntimeError as error:
            raise SingularError(str(error)) from error

    def solve(self, right):
        """Solution of the factorised system, shape (unknowns,) or (unknowns, n)."""
        solution = np.empty_like(right)
        solution[self._order] = self._lu.solve(right[self._order])
        return solution

    def estimate(self, right):
        """As `solve`, where an estimate would do."""
        return self.solve(right)

    @cached_property
    def negative_pivots(self):
        """Number of negative eigenvalues of the matrix; 0 where the equilibrium is stable.

        Raises
        ------
        SingularError
            If a pivot on the diagonal is zero and the factorisation went beside it: its signs then say nothing.
        """
        if (self._lu.perm_r != self._lu.perm_c).any():
            raise SingularError("a zero pivot")
        return int((self._lu.U.diagonal() < 0).sum())


class Analysis:
    """Symbolic factorisation of all symmetric matrices of one sparsity, done once and used again.

    Method: supernodal Cholesky factorisation (Chen, Davis, Hager and Rajamanickam, ACM Trans. Math. Softw. 35(3):22,
    2008).

    Parameters
    ----------
    indices, pointers : ndarray of int
        Rows of the entries of each column, ascending, and column pointers, as in `scipy.sparse.csc_array`.
    order : ndarray of int, optional
        Order of elimination; CHOLMOD's own (minimum degree) without.
    """

    def __init__(self, indices, pointers, order=None):
        from cvxopt import cholmod, matrix, spmatrix

        size = len(pointers) - 1
        columns = np.repeat(np.arange(size), np.diff(pointers))
        self._lower = np.flatnonzero(indices >= columns)
        rows, columns = (matrix(part[self._lower].astype(np.int64)) for part in (indices, columns))
        self._matrix = spmatrix(np.zeros(len(self._lower)), rows, columns, (size, size))
        self._order = {} if order is None else {"p": matrix(order.astype(np.int64))}
        self._spare = []
        cholmod.options["supernodal"] = 2

    def factorise(self, data):
        """Factor of the matrix of these entries; None where it is not positive definite."""
        from cvxopt import cholmod, matrix

        self._matrix.V = matrix(data[self._lower])
        # A factor is made in the place of its symbolic one, and gives that back when nobody needs it any more.
        factor = self._spare.pop() if self._spare else cholmod.symbolic(self._matrix, uplo="L", **self._order)
        try:
            cholmod.numeric(self._matrix, factor)
        except ArithmeticError:
            self._spare.append(factor)
            return None
        return CholeskyFactor(factor, self._spare)


class CholeskyFactor:
    """A factorised positive definite matrix; as `Factor`."""

    name = "Cholesky"
    negative_pivots = 0

    def __init__(self, factor, spare):
        self._factor, self._spare = factor, spare

    def __del__(self):
        self._spare.append(self._factor)

    def solve(self, right):
        """Solution of the factorised system, shape (unknowns,) or (unknowns, n)."""
        from cvxopt import cholmod, matrix

        solution = matrix(right)
        cholmod.solve(self._factor, solution)
        return np.array(solution).reshape(right.shape)

    def estimate(self, right):
        """As `solve`, where an estimate would do."""
        return self.solve(right)


def factorised(matrix):
    """Factor of a symmetric matrix of any sparsity.

    Parameters
    ----------
    matrix : sparse array, shape (n, n)

    Returns
    -------
    Factor or CholeskyFactor

    Raises
    ------
    SingularError
        If it is singular.
    """
    matrix = csc_array(matrix)
    matrix.sort_indices()
    factor = Analysis(matrix.indices, matrix.indptr).factorise(matrix.data) if CHOLESKY else None
    return factor or Factor(matrix)

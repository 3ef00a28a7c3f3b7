"""Linear algebra: sparse factorizations, their orders of elimination, and multigrid."""

SOLVERS = ("Cholesky", "SuperLU", "multigrid")
"""Solvers of linear systems."""

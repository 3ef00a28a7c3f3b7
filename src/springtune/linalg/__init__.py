"""Linear algebra: sparse factorisations, their orderings and multigrid."""

SOLVERS = ("Cholesky", "SuperLU", "multigrid")
"""Solvers of linear systems."""

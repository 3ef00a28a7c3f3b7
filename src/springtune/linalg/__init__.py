"""Linear algebra: sparse factorizations, their orders of elimination, and multigrid."""

SOLVERS = ("Cholesky", "SuperLU", "multigrid")  # names of linear solvers

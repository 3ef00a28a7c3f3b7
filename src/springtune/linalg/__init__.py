"""Linear algebra: sparse factorizations, their orders of elimination, and multigrid."""

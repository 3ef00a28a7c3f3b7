"""Converged finite-element references for the networks, one module a kind."""

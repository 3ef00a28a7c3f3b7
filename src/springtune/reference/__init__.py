"""Converged finite-element references for the networks; `calculix` is a second opinion."""

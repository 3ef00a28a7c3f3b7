"""Mechanics of networks: equilibria, paths, motion, contact and moduli.

`network` and `energies` have forces and tangents, `newton` finds one equilibrium and `statics` those of a growing load.
`series` and `expansion` follow a path by power series, `continuation` by arc length. `dynamics` is a network in motion,
with the steps of `stepping`, `integrators` and `kernels`.
"""

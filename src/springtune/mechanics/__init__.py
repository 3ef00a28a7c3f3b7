"""Mechanics of networks: equilibria, paths, motion, contact and moduli."""

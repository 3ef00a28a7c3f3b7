"""Projective dynamics: Liu, Bargteil, O'Brien and Kavan, Fast simulation of mass-spring systems, ACM TOG 32(6), 2013.

An iteration turns each spring of rest length into its direction, and solves a linear system ``M / h^2 + L``, factorized
once, with the Laplacian L of the stiffnesses. Both together are ``x - (M / h^2 + L)^-1 g`` with g the gradient of the
step's energy (Liu, Bouaziz and Kavan, Quasi-Newton methods for real-time simulation of hyperelastic materials, ACM TOG
36(3), 2017). The energy falls fast where springs are stretched and slowly where they turn, as in bending.
"""

import numpy as np
from scipy.sparse import coo_array, csc_array, diags_array
from scipy.sparse.linalg import SuperLU, splu

from ..handover.net import SpringNet
from ..linalg.factors import SUPERLU
from ..linalg.kernels import compiled
from .base import Setting, Textbook, engine, refuse_pushing_springs, spring_between, stretch_spring


@compiled
def _descent(x, y, inertia, free, springs, lengths, stiffness, descent):  # type: ignore[no-untyped-def]
    """Negative gradient of a step's energy into `descent`; `free` is 0 where held, and 1 elsewhere."""
    for i in range(len(x)):
        for d in range(2):
            descent[i, d] = free[i, d] * inertia[i] * (y[i, d] - x[i, d])
    for e in range(len(lengths)):
        i, j = springs[e]
        dx, dy, length, _ = spring_between(x, free, i, j)
        stretch_spring(descent, free, i, j, dx, dy, stiffness[e] * (lengths[e] - length))


@engine("projective", order=30, measured="1e-6, twenty scenes", source="Liu 2013")
class Projective(Textbook):
    """Projective dynamics: local directions of springs, and a global linear system that is factorized once."""

    def __init__(self, net: SpringNet, setting: Setting, damping: float) -> None:
        refuse_pushing_springs(net, "the global step needs a positive one")
        super().__init__(net, setting, damping)
        self.free = (~net.held).astype(self.dtype)
        self.descent = np.empty_like(self.x, order="F")  # as the factors take it
        alike = np.array_equal(net.held[:, 0], net.held[:, 1])
        axes = [slice(0, 2)] if alike else [slice(0, 1), slice(1, 2)]
        self.systems = [(self._factor(self.free[:, one.start]), one) for one in axes]

    def _factor(self, free: np.ndarray) -> SuperLU:
        """Factorized system of a direction, a unit matrix where particles are held."""
        links = coo_array((self.stiffness, self.springs.T), shape=(len(free), len(free)))
        links = links + links.T
        whole = diags_array(self.inertia + links.sum(axis=1)) - links
        matrix = diags_array(free) @ whole @ diags_array(free) + diags_array(1 - free)
        return splu(csc_array(matrix, dtype=self.dtype), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, **SUPERLU)

    def solve(self, y: np.ndarray) -> np.ndarray:
        """Iterate from the inertial positions."""
        x, of_springs = y.copy(), (self.springs, self.lengths, self.stiffness)
        for _ in range(self.iterations):
            _descent(x, y, self.inertia, self.free, *of_springs, self.descent)
            for factor, axes in self.systems:
                x[:, axes] += factor.solve(self.descent[:, axes])
        return x

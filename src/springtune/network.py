"""Particles and springs: forces, tangent and the factorised tangent of a network.

A spring e of stiffness k_e and rest length L_e between particles i and j, now at distance vector d and length l, pulls
with ``k_e (l - L_e) d / l``. Its exact tangent is ``k_e [(1 - L_e/l) I + (L_e/l) n n^T]`` with ``n = d / l``.

Stiffnesses enter a network as multiples of one reference stiffness and loads as force over that stiffness [m]: a
network of uniform stiffness k under a force F deforms by F/k alone, so one solution serves all pairs of equal F/k.
"""

from functools import cached_property

import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from .mesh.triangles import signed_areas


class Network:
    """Particles joined by springs, some of their directions held.

    Parameters
    ----------
    mesh : TriangleMesh
        Its points are the particles, its edges the springs.
    held : ndarray of bool, shape (n_points, 2)
        True where a particle cannot move in x or y.
    stiffness : ndarray of float, shape (n_springs,)
        Stiffness of each spring as a multiple of the reference stiffness [1].
    """

    def __init__(self, mesh, held, stiffness):
        self.mesh = mesh
        self.held = held
        self.stiffness = stiffness
        self.first, self.second = mesh.edges.T
        self.rest_vectors = mesh.points[self.second] - mesh.points[self.first]
        self.rest_lengths = mesh.edge_lengths

    # -- unknowns ---------------------------------------------------------------------------------------------------

    @cached_property
    def _pattern(self):
        return _Pattern(self.mesh.edges, self.held)

    @property
    def unknowns(self):
        """Number of directions that are free to move."""
        return self._pattern.size

    def expand(self, unknowns):
        """Displacement of every particle [m], shape (n_points, 2), from the vector of unknowns."""
        return self._pattern.expand(unknowns)

    def reduce(self, vectors):
        """Entries of a field of shape (n_points, 2) that belong to unknowns."""
        return self._pattern.reduce(vectors)

    def stretch(self, displacements):
        """Difference of the displacements of each spring's ends [m], shape (n_springs, 2)."""
        return displacements[self.second] - displacements[self.first]

    def gather(self, forces):
        """Unknowns' share of spring forces, shape (n_springs, 2), that pull the first end towards the second."""
        return self._pattern.gather(forces)

    # -- mechanics --------------------------------------------------------------------------------------------------

    def resistance(self, displacements):
        """Force with which the springs resist displacements, over the reference stiffness [m], shape (unknowns,).

        The elongation is taken as ``(l^2 - L^2) / (l + L)``: subtracting lengths would lose as many digits as the
        strain is small.
        """
        relative = self.stretch(displacements)
        vectors = self.rest_vectors + relative
        lengths = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
        squares = np.einsum("ij,ij->i", self.rest_vectors + vectors, relative)
        with np.errstate(divide="ignore", invalid="ignore"):
            pull = self.stiffness * squares / ((lengths + self.rest_lengths) * lengths)
        return -self.gather(pull[:, None] * vectors)

    def linear_resistance(self, displacements):
        """As `resistance`, of springs whose elongation is linear in the displacements."""
        normals = self.rest_vectors / self.rest_lengths[:, None]
        pull = self.stiffness * np.einsum("ij,ij->i", normals, self.stretch(displacements))
        return -self.gather(pull[:, None] * normals)

    def energy(self, displacements):
        """Energy of the springs over the reference stiffness [m2]."""
        relative = self.stretch(displacements)
        vectors = self.rest_vectors + relative
        lengths = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
        elongations = np.einsum("ij,ij->i", self.rest_vectors + vectors, relative) / (lengths + self.rest_lengths)
        return 0.5 * float(self.stiffness @ elongations**2)

    def tangent(self, displacements=None):
        """Derivative of the resistance by the unknowns [1], a sparse symmetric matrix.

        Parameters
        ----------
        displacements : ndarray of float, shape (n_points, 2), optional
            Where it is taken; at rest without.
        """
        if displacements is None:
            vectors, ratio = self.rest_vectors, np.ones(len(self.rest_lengths))
            squares = self.rest_lengths**2
        else:
            vectors = self.rest_vectors + self.stretch(displacements)
            squares = np.einsum("ij,ij->i", vectors, vectors)
            ratio = self.rest_lengths / np.sqrt(squares)
        along = self.stiffness * ratio / squares
        across = self.stiffness * (1.0 - ratio)
        xx = across + along * vectors[:, 0] ** 2
        xy = along * vectors[:, 0] * vectors[:, 1]
        yy = across + along * vectors[:, 1] ** 2
        return self._pattern.assemble(xx, xy, yy)

    def factorize(self, displacements=None):
        """Factorised tangent.

        Returns
        -------
        Factor

        Raises
        ------
        SingularError
            If the tangent is singular.
        """
        matrix = self.tangent(displacements)
        try:
            lu = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        except RuntimeError as error:
            raise SingularError(str(error)) from error
        return Factor(lu)

    def inverted(self, displacements):
        """Whether any triangle of the mesh is turned inside out."""
        return bool((signed_areas(self.mesh.points + displacements, self.mesh.triangles) <= 0).any())


class SingularError(ArithmeticError):
    """A tangent could not be factorised."""


class Factor:
    """A factorised symmetric matrix: solves, and counts its negative eigenvalues (Sylvester's law of inertia)."""

    def __init__(self, lu):
        self._lu = lu

    def solve(self, right):
        """Solution of the factorised system, shape (unknowns,)."""
        return self._lu.solve(right)

    @cached_property
    def negative_pivots(self):
        """Number of negative eigenvalues of the matrix; 0 where the equilibrium is stable."""
        return int((self._lu.U.diagonal() < 0).sum())


class _Pattern:
    """Numbering of the unknowns and sparsity of the tangent: what depends on topology alone."""

    def __init__(self, springs, held):
        self.springs = springs
        self.shape = held.shape
        self.places = np.flatnonzero(~held.ravel())
        self.size = len(self.places)
        number = np.full(held.size, -1)
        number[self.places] = np.arange(self.size)
        # Each spring has 4 x 4 entries: its two ends, each with two directions.
        local = number.reshape(-1, 2)[springs].reshape(-1, 4)
        rows, columns = np.repeat(local, 4, axis=1).ravel(), np.tile(local, (1, 4)).ravel()
        self.kept = np.flatnonzero((rows >= 0) & (columns >= 0))
        codes, self.slots = np.unique(columns[self.kept] * self.size + rows[self.kept], return_inverse=True)
        columns, rows = np.divmod(codes, self.size)
        self.indices = rows.astype(np.int32)
        self.pointers = np.searchsorted(columns, np.arange(self.size + 1)).astype(np.int32)

    def expand(self, unknowns):
        full = np.zeros(self.shape)
        full.ravel()[self.places] = unknowns
        return full

    def reduce(self, vectors):
        return vectors.ravel()[self.places]

    def gather(self, forces):
        first, second = self.springs.T
        count = self.shape[0]
        total = np.empty(self.shape)
        for axis in range(2):
            weights = forces[:, axis]
            total[:, axis] = np.bincount(first, weights, count) - np.bincount(second, weights, count)
        return self.reduce(total)

    def assemble(self, xx, xy, yy):
        block = np.stack([xx, xy, xy, yy], axis=1).reshape(-1, 2, 2)
        entries = np.empty((len(xx), 2, 2, 2, 2))  # spring, end, direction, end, direction
        entries[:, 0, :, 0, :] = entries[:, 1, :, 1, :] = block
        entries[:, 0, :, 1, :] = entries[:, 1, :, 0, :] = -block
        data = np.bincount(self.slots, entries.ravel()[self.kept], len(self.indices))
        return csc_array((data, self.indices, self.pointers), shape=(self.size, self.size))

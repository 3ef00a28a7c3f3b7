"""Particles and springs: forces, tangent and the factorised tangent of a network.

A spring e of stiffness k_e and rest length L_e between particles i and j, now at distance vector d and length l, pulls
with ``k_e (l - L_e) d / l``. Its exact tangent is ``k_e [(1 - L_e/l) I + (L_e/l) n n^T]`` with ``n = d / l``.

Stiffnesses enter a network as multiples of one reference stiffness and loads as force over that stiffness [m]: a
network of uniform stiffness k under a force F deforms by F/k alone, so one solution serves all pairs of equal F/k.

A network may have energies besides its springs, see `springtune.mechanics.energies`; what has none pays nothing for
them.
"""

from functools import cached_property

import numpy as np
from scipy.sparse import csc_array

from ..linalg import factors
from ..linalg.factors import Factor, SingularError
from ..linalg.ordering import nested_dissection
from ..mesh.cells import DIAGONALS, SIDES

LARGE = 200_000
"""Unknowns beyond which multigrid takes the place of SuperLU: there it is as fast, and takes a third of the memory."""

LARGEST = 2_500_000
"""Unknowns beyond which it takes the place of a Cholesky factorisation, which is faster but needs 2 kB an unknown."""

DISSECTED = 100_000
"""Unknowns beyond which a Cholesky factorisation is faster in the order of nested dissection."""


class Network:
    """Particles joined by springs, some of their directions held.

    Parameters
    ----------
    mesh : Mesh
        Its points are the particles, its edges the springs.
    held : ndarray of bool, shape (n_points, 2)
        True where a particle cannot move in x or y.
    stiffness : ndarray of float, shape (n_springs,)
        Stiffness of each spring as a multiple of the reference stiffness [1].
    energies : sequence of Energy, optional
        Energies besides the springs'.
    like : Network, optional
        A network with the same mesh and the same directions held, whose numbering this one takes over.
    """

    def __init__(self, mesh, held, stiffness, energies=(), like=None):
        self.mesh = mesh
        self.held = held
        self.stiffness = stiffness
        self.energies = tuple(energies)
        self.has_springs = bool(np.any(stiffness)) or not self.energies
        if like is not None:
            self._pattern = like._pattern
        self.first, self.second = mesh.edges.T
        self.rest_vectors = mesh.points[self.second] - mesh.points[self.first]
        self.rest_lengths = mesh.edge_lengths

    # -- unknowns ---------------------------------------------------------------------------------------------------

    @cached_property
    def _pattern(self):
        return _Pattern(self.mesh, self.held)

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
        return self.reduce(self._pattern.sum_springs(forces))

    # -- mechanics --------------------------------------------------------------------------------------------------

    def resistance(self, displacements):
        """Force with which the springs resist displacements, over the reference stiffness [m], shape (unknowns,)."""
        resistance = np.zeros(self.unknowns)
        if self.has_springs:
            resistance -= self.gather(self._pulls(displacements))
        for energy in self.energies:
            resistance += self.reduce(self._pattern.sum_cells(energy.corners, energy.forces(displacements)))
        return resistance

    def _pulls(self, displacements):
        """Force of each spring on its first end, over the reference stiffness [m], shape (n_springs, 2).

        The elongation is taken as ``(l^2 - L^2) / (l + L)``: subtracting lengths would lose as many digits as the
        strain is small.
        """
        relative = self.stretch(displacements)
        vectors = self.rest_vectors + relative
        lengths = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
        squares = np.einsum("ij,ij->i", self.rest_vectors + vectors, relative)
        with np.errstate(divide="ignore", invalid="ignore"):
            pull = self.stiffness * squares / ((lengths + self.rest_lengths) * lengths)
        return pull[:, None] * vectors

    def spring_forces(self, displacements, linear=False):
        """Axial force of each spring over the reference stiffness, energies' part left out.

        Parameters
        ----------
        displacements : ndarray of float, shape (n_points, 2)
            [m]
        linear : bool, optional
            Whether the network is linear in the displacements.

        Returns
        -------
        ndarray of float, shape (n_springs,)
            Positive in tension [m].
        """
        relative = self.stretch(displacements)
        if linear:
            return self.stiffness * np.einsum("ij,ij->i", self.rest_vectors, relative) / self.rest_lengths
        vectors = self.rest_vectors + relative
        lengths = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
        squares = np.einsum("ij,ij->i", self.rest_vectors + vectors, relative)
        return self.stiffness * squares / (lengths + self.rest_lengths)

    def rounding(self, displacements, linear=False):
        """Size of the rounding errors in the resistance to displacements [m], shape (unknowns,).

        The forces of a spring on its two ends are equal but for their sign, and those of a cell balance to rounding:
        what is left is the rounding of their sums at each particle.

        Parameters
        ----------
        displacements : ndarray of float, shape (n_points, 2)
            [m]
        linear : bool, optional
            Whether it is `linear_resistance` that is meant.
        """
        total = np.zeros(self.held.shape)
        if linear:
            normals = self.rest_vectors / self.rest_lengths[:, None]
            apart = self.stretch(displacements)
            sizes = np.abs((self.stiffness * np.einsum("ij,ij->i", normals, apart))[:, None] * normals)
            if self.energies:
                sizes = sizes + np.einsum("abn,bn->na", np.abs(self._rest_couplings), np.abs(apart.T))
        else:
            sizes = np.abs(self._pulls(displacements)) if self.has_springs else np.zeros(self.rest_vectors.shape)
            for energy in self.energies:
                total += self._pattern.sum_cells(energy.corners, np.abs(energy.forces(displacements)))
        total += self._pattern.sum_springs(sizes, -sizes)
        return np.finfo(float).eps * self.reduce(total)

    def linear_resistance(self, displacements):
        """As `resistance`, of a network that is linear in the displacements."""
        return self.reduce(self.linear_forces(displacements))

    def linear_forces(self, displacements):
        """Forces with which a linear network resists, of held directions, too, shape (n_points, 2)."""
        normals = self.rest_vectors / self.rest_lengths[:, None]
        apart = self.stretch(displacements)
        pull = self.stiffness * np.einsum("ij,ij->i", normals, apart)
        resistance = -self._pattern.sum_springs(pull[:, None] * normals)
        if self.energies:
            apart = apart.T
            at_first = np.einsum("abn,bn->na", self._rest_couplings, apart)
            at_second = np.einsum("ban,bn->na", self._rest_couplings, apart)
            resistance += self._pattern.sum_springs(at_first, at_second)
        return resistance

    @cached_property
    def _rest_couplings(self):
        return self._pattern.cell_couplings(self.energies)

    def energy(self, displacements):
        """Energy of the network over the reference stiffness [m2]."""
        relative = self.stretch(displacements)
        vectors = self.rest_vectors + relative
        lengths = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
        elongations = np.einsum("ij,ij->i", self.rest_vectors + vectors, relative) / (lengths + self.rest_lengths)
        springs = 0.5 * float(self.stiffness @ elongations**2)
        return springs + sum(energy.value(displacements) for energy in self.energies)

    def tangent(self, displacements=None, follower=None):
        """Derivative of the resistance by the unknowns [1], a sparse matrix, symmetric but for a pressure's part.

        Parameters
        ----------
        displacements : ndarray of float, shape (n_points, 2), optional
            Where it is taken; at rest without.
        follower : tuple of float and FollowerPressure, optional
            A pressure and what it acts on, whose own derivative is taken off.
        """
        couplings = self._spring_couplings(displacements) if self.has_springs else 0.0
        if self.energies:
            at_rest = displacements is None
            of_cells = self._rest_couplings if at_rest else self._pattern.cell_couplings(self.energies, displacements)
            couplings = couplings + of_cells
        data = self._pattern.coupling_entries(couplings)
        if follower is not None:
            s, load = follower
            data -= s * self._pattern.entries(load.edges, load.derivative)
        return self._pattern.matrix(data)

    def _spring_couplings(self, displacements):
        """Blocks of the tangent that couple the ends of each spring, shape (2, 2, n_springs)."""
        if displacements is None:
            vectors, ratio = self.rest_vectors, np.ones(len(self.rest_lengths))
            squares = self.rest_lengths**2
        else:
            vectors = self.rest_vectors + self.stretch(displacements)
            squares = np.einsum("ij,ij->i", vectors, vectors)
            ratio = self.rest_lengths / np.sqrt(squares)
        along = self.stiffness * ratio / squares
        across = self.stiffness * (1.0 - ratio)
        x, y = vectors.T
        couplings = np.empty((2, 2, len(along)))
        couplings[0, 0] = -across - along * x * x
        couplings[0, 1] = couplings[1, 0] = -along * x * y
        couplings[1, 1] = -across - along * y * y
        return couplings

    @cached_property
    def local_stiffness(self):
        """Sums of stiffness about each direction of each particle over the reference stiffness, shape (n_points, 2).

        No eigenvalue of the stiffness over the masses is above the largest of them over its mass: by Gershgorin's
        theorem, in blocks of particles for springs, in rows of the rest tangent where there are other energies.
        """
        if self.energies:
            return self.expand(np.asarray(abs(self.tangent()).sum(axis=1)).ravel())
        count, size = len(self.held), np.abs(self.stiffness)
        sums = 2 * (np.bincount(self.first, size, count) + np.bincount(self.second, size, count))
        return np.repeat(sums[:, None], 2, axis=1)

    def stiffness_of(self, particles, matrices):
        """Sparse matrix [as `matrices`] of stiffnesses of groups of joined particles, in the place of the tangent's.

        Parameters
        ----------
        particles : ndarray of int, shape (n, m)
            Particles of each group, any two of which are joined by a spring.
        matrices : ndarray of float, shape (n, 2 m, 2 m)
        """
        return self._pattern.matrix(self._pattern.entries(particles, matrices))

    @cached_property
    def rest_factor(self):
        """Tangent factorised at rest."""
        return self.factorize()

    def factorize(self, displacements=None, follower=None):
        """Factorised tangent.

        Parameters
        ----------
        displacements : ndarray of float, shape (n_points, 2), optional
            Where it is taken; at rest without.
        follower : tuple of float and FollowerPressure, optional
            As in `tangent`.

        Returns
        -------
        Factor

        Raises
        ------
        SingularError
            If the tangent is singular.
        """
        return self.factorized(self.tangent(displacements, follower), symmetric=follower is None)

    def factorized(self, matrix, symmetric=True, solver=None):
        """Factor of a matrix over the unknowns with the tangent's sparsity, such as `stiffness_of` gives or a sum of.

        Parameters
        ----------
        matrix : sparse array, shape (unknowns, unknowns)
        symmetric : bool, optional
            Whether the matrix is symmetric.
        solver : str, optional
            One of `springtune.linalg.SOLVERS`; by what is installed and the number of unknowns without.

        Returns
        -------
        Factor, CholeskyFactor or Multigrid
            Cholesky's only where the matrix is positive definite.

        Raises
        ------
        SingularError
            If it is singular.
        """
        cholesky = factors.CHOLESKY and symmetric and self.unknowns <= LARGEST
        if solver == "Cholesky" or solver is None and cholesky:
            factor = self._pattern.analysis.factorise(matrix.data)
            if factor is not None:
                return factor
        if solver == "multigrid" or solver is None and self.unknowns > LARGE:
            return self._multigrid(matrix)
        order, places, indices, pointers = self._pattern.elimination
        return Factor(csc_array((matrix.data[places], indices, pointers), shape=matrix.shape), order)

    def is_stable(self, displacements):
        """Whether the tangent at displacements is positive definite; asks less than a factorisation for use.

        Parameters
        ----------
        displacements : ndarray of float, shape (n_points, 2)
        """
        matrix = self.tangent(displacements)
        if factors.CHOLESKY and self.unknowns <= LARGEST:
            return self._pattern.analysis.factorise(matrix.data) is not None
        try:
            return self.factorized(matrix).negative_pivots == 0
        except SingularError:
            return False

    def _multigrid(self, matrix):
        from ..linalg.multigrid import Multigrid

        # About the middle and over the extent, so that all three are of one size.
        points = (self.mesh.points - self.mesh.points.mean(axis=0)) / np.ptp(self.mesh.points, axis=0).max()
        ones, zeros = np.ones(len(points)), np.zeros(len(points))
        fields = ((ones, zeros), (zeros, ones), (-points[:, 1], points[:, 0]))
        motions = np.stack([self.reduce(np.stack(field, axis=1)) for field in fields], axis=1)
        return Multigrid(matrix, motions)

    def largest_stretch(self, displacements):
        """Largest change of a spring's length over that at rest [1]."""
        vectors = self.rest_vectors + self.stretch(displacements)
        return float(np.abs(np.sqrt(np.einsum("ij,ij->i", vectors, vectors)) / self.rest_lengths - 1.0).max())

    def largest_change(self, displacements):
        """Largest change of a spring's vector over its length at rest [1]."""
        changes = self.stretch(displacements)
        return float(np.sqrt(np.einsum("ij,ij->i", changes, changes) / self.rest_lengths**2).max())

    def inverted(self, displacements):
        """Whether any cell of the mesh is turned inside out."""
        return self.mesh.inverted(self.mesh.points + displacements)


class _Pattern:
    """Numbering of the unknowns, sparsity of the tangent and order of elimination: what depends on the mesh alone.

    All particles of a cell are joined by springs, so the springs' entries are all there are.
    """

    def __init__(self, mesh, held):
        self.mesh, self.springs = mesh, mesh.edges
        self.first, self.second = (np.ascontiguousarray(ends) for ends in self.springs.T)
        self.shape = held.shape
        self.places = np.flatnonzero(~held.ravel())
        self.size = len(self.places)
        number = np.full(held.size, -1)
        number[self.places] = np.arange(self.size)
        self.number = number.reshape(-1, 2)
        self.indices, self.pointers, self.sources = self._sparsity()

    def _sparsity(self):
        """Rows and column pointers of the matrix; for each entry its place in what `coupling_entries` puts together.

        Block by block of two directions each: sorting those is a sixth of the work of sorting entries.
        """
        count, joined = self.shape[0], len(self.springs)
        first, second, own = self.first, self.second, np.arange(self.shape[0])
        columns, rows = np.concatenate([second, first, own]), np.concatenate([first, second, own])
        order = np.argsort(columns * count + rows)
        columns, rows = columns[order], rows[order]
        sizes = np.bincount(columns, minlength=count)
        # Place of entry (0, 0) of each block in what it comes from, and the steps to the next row and column of it.
        place = np.concatenate([np.arange(joined), np.arange(joined), 4 * joined + own])[order]
        down = np.repeat([2 * joined, joined, 2 * count], [joined, joined, count])[order]
        right = np.repeat([joined, 2 * joined, count], [joined, joined, count])[order]
        before = np.cumsum(sizes) - sizes
        # Entry (a, d) of a block stands in column d of its particle's two, each twice as high as the blocks are many.
        corner = 4 * before[columns] + 2 * (np.arange(len(order)) - before[columns])
        height = 2 * sizes[columns]
        row_of, source = np.empty((2, 4 * len(order)), dtype=np.int64)
        kept = np.empty(4 * len(order), dtype=bool)
        for a in range(2):
            for d in range(2):
                at = corner + d * height + a
                row_of[at] = row = self.number[rows, a]
                kept[at] = (row >= 0) & (self.number[columns, d] >= 0)
                source[at] = place + a * down + d * right
        ends = np.repeat(2 * sizes, 2).cumsum()
        filled = np.concatenate([[0], np.cumsum(kept)[ends - 1]])
        pointers = filled[np.concatenate([[True], self.number.ravel() >= 0])].astype(np.int32)
        return row_of[kept].astype(np.int32), pointers, source[kept]

    @cached_property
    def codes(self):
        """One number for the place of each entry, ascending."""
        return np.repeat(np.arange(self.size), np.diff(self.pointers)) * self.size + self.indices

    @cached_property
    def order(self):
        """Unknowns in the order of elimination."""
        order = self.number[nested_dissection(self.mesh.points, self.springs)].ravel()
        return order[order >= 0]

    @cached_property
    def analysis(self):
        """Symbolic Cholesky factorisation; in an order of CHOLMOD's own where ours would not gain what it costs."""
        return factors.Analysis(self.indices, self.pointers, self.order if self.size > DISSECTED else None)

    @cached_property
    def elimination(self):
        """Unknowns in the order of elimination; place and row of each entry in that order, and column pointers."""
        order = self.order
        rank = np.empty(self.size, dtype=np.int64)
        rank[order] = np.arange(self.size)
        sizes = np.diff(self.pointers)[order]
        pointers = np.concatenate([[0], np.cumsum(sizes)])
        places = np.repeat(self.pointers[order] - pointers[:-1], sizes) + np.arange(pointers[-1])
        # The library sorts rows within columns several times faster than numpy does all entries.
        numbered = csc_array((places.astype(float), rank[self.indices[places]], pointers), shape=(self.size, self.size))
        numbered.sort_indices()
        indices, pointers = numbered.indices.astype(np.int32), pointers.astype(np.int32)
        return order, numbered.data.astype(np.int64), indices, pointers

    def _codes(self, particles):
        """Which entries of the matrices of groups of particles are kept, and one number for the place of each."""
        local = self.number[particles].reshape(len(particles), -1)
        width = local.shape[1]
        rows, columns = np.repeat(local, width, axis=1).ravel(), np.tile(local, (1, width)).ravel()
        kept = np.flatnonzero((rows >= 0) & (columns >= 0))
        return kept, columns[kept] * self.size + rows[kept]

    def expand(self, unknowns):
        full = np.zeros(self.shape)
        full.ravel()[self.places] = unknowns
        return full

    def reduce(self, vectors):
        return vectors.ravel()[self.places]

    def sum_springs(self, at_first, at_second=None):
        """Sum over springs of what is added at their first ends and taken off at their second, by default the same."""
        count = self.shape[0]
        at_second = at_first if at_second is None else at_second
        total = np.empty(self.shape)
        for axis in range(2):
            total[:, axis] = np.bincount(self.first, at_first[:, axis], count)
            total[:, axis] -= np.bincount(self.second, at_second[:, axis], count)
        return total

    def sum_cells(self, corners, forces):
        places = corners.T.ravel()
        total = [np.bincount(places, forces[:, :, axis].T.ravel(), self.shape[0]) for axis in range(2)]
        return np.stack(total, axis=1)

    def cell_couplings(self, energies, displacements=None):
        """Blocks of the tangent of energies that couple the ends of each spring, shape (2, 2, n_springs)."""
        count = len(self.springs)
        total = np.zeros((2, 2, count))
        for energy in energies:
            places = self._cell_springs[energy.corners.shape[1]]
            blocks = np.ascontiguousarray(energy.couplings(displacements).transpose(1, 2, 0, 3))
            for a in range(2):
                for d in range(2):
                    ours, turned = np.bincount(places, blocks[a, d].ravel(), 2 * count).reshape(2, count)
                    total[a, d] += ours
                    total[d, a] += turned
        return total

    @cached_property
    def _cell_springs(self):
        """Spring of each pair of corners by number of corners, beyond the last one where it runs the other way."""
        found = {}
        for count, corners in self.mesh.cells.items():
            first, second = np.transpose(SIDES[count] + DIAGONALS[count])
            turned = corners[:, first] > corners[:, second]
            found[count] = (self.mesh.cell_edges[count] + len(self.springs) * turned).T.ravel()
        return found

    def coupling_entries(self, couplings):
        """Entries of the tangent from its blocks that couple the ends of each spring, shape (2, 2, n_springs).

        A common displacement costs nothing: the block of a particle is what its springs' blocks lack to that.
        """
        count = self.shape[0]
        own = np.empty((2, 2, count))
        for a in range(2):
            for d in range(a, 2):
                own[a, d] = -np.bincount(self.first, couplings[a, d], count)
                own[a, d] -= np.bincount(self.second, couplings[d, a], count)
        own[1, 0] = own[0, 1]
        return np.concatenate([couplings.ravel(), own.ravel()])[self.sources]

    def entries(self, particles, matrices):
        """Entries of matrices of groups of joined particles, shape (n, 2 m, 2 m)."""
        kept, codes = self._codes(particles)
        return np.bincount(np.searchsorted(self.codes, codes), matrices.ravel()[kept], len(self.indices))

    def matrix(self, data):
        return csc_array((data, self.indices, self.pointers), shape=(self.size, self.size))

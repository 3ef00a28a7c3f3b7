"""Numbering of the unknowns of networks on one mesh, sparsity of their matrices, and order of elimination."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import bsr_array, csc_array, csr_array

from ..linalg.factors import Analysis, entry_places, nested_dissection, spread_particles
from ..mesh.cells import DIAGONALS, SIDES, Mesh
from .energies import Energy

if TYPE_CHECKING:
    from ..linalg.kernels import Blocks

DISSECTION_FROM_UNKNOWNS = 100_000
"""Unknowns beyond which a Cholesky factorization is faster in the order of nested dissection."""

PIN_COUNTS = (8, 32)  # particles to pin in an indefinite matrix; the second number is tried if the first fails


class Pattern:
    """Sparsity of one mesh's matrices, rows ascending; `number` (n_points, 2) is a direction's unknown, -1 if held."""

    def __init__(self, mesh: Mesh, held: np.ndarray) -> None:
        self.mesh, self.springs = mesh, mesh.edges
        self.first, self.second = (np.ascontiguousarray(ends) for ends in self.springs.T)
        self.shape = held.shape
        self.places = np.flatnonzero(~held.ravel())
        self.size = len(self.places)
        number = np.full(held.size, -1)
        number[self.places] = np.arange(self.size)
        self.number = number.reshape(-1, 2)

    @cached_property
    def _sparsity(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return rows, column pointers, and each entry's place in the sums of `coupling_entries`."""
        count, joined = self.shape[0], len(self.springs)
        # Particles that are held in both directions have no blocks.
        free = self.number.max(axis=1) >= 0
        moving, springs = np.flatnonzero(free), np.flatnonzero(free[self.first] & free[self.second])
        place = np.cumsum(free, dtype=np.int32) - 1
        first, second, own = place[self.first[springs]], place[self.second[springs]], place[moving]
        # What a block is made of: of the springs, once as it is and once turned, and of the particles.
        made_of = np.concatenate([springs, 4 * joined + moving, springs], dtype=np.int32, casting="same_kind")
        columns, rows = np.concatenate([second, own, first]), np.concatenate([first, own, second])
        blocks = csr_array((made_of, (columns, rows)), shape=(len(moving), len(moving)))
        rows, place = blocks.indices, blocks.data
        columns = np.repeat(own, np.diff(blocks.indptr))
        # Steps to the next row and column of it; where a spring runs the other way its block is transposed.
        way = np.sign(columns - rows)  # 1 where it is as it is, -1 where it is turned, 0 of a particle
        down, right = np.array([[2 * count, 2 * joined, joined], [count, joined, 2 * joined]], dtype=np.int32)[:, way]
        made_of = np.empty((len(rows), 2, 2), dtype=np.int32)
        made_of[:, 0, 0], made_of[:, 0, 1], made_of[:, 1, 0] = place, place + down, place + right
        made_of[:, 1, 1] = place + down + right
        entries = bsr_array((made_of, rows, blocks.indptr), shape=(2 * len(moving), 2 * len(moving))).tocsr()
        if self.size < 2 * len(moving):
            places = np.flatnonzero(self.number[moving].ravel() >= 0)
            entries = entries[places][:, places]
        indices, pointers = (part.astype(np.int32, copy=False) for part in (entries.indices, entries.indptr))
        return indices, pointers, entries.data.astype(np.int64)

    def moved(self, mesh: Mesh) -> Pattern:
        """Return the pattern of a mesh with the same cells at other points."""
        found = copy(self)
        found.mesh = mesh
        for name in ("order", "elimination", "pins", *(["analysis"] if self.size > DISSECTION_FROM_UNKNOWNS else [])):
            found.__dict__.pop(name, None)
        return found

    @cached_property
    def codes(self) -> np.ndarray:
        """One number for the place of each entry, ascending."""
        return np.repeat(np.arange(self.size), np.diff(self._empty.indptr)) * self.size + self._empty.indices

    @cached_property
    def order(self) -> np.ndarray:
        """Unknowns in the order of elimination, shape (size,)."""
        order = self.number[nested_dissection(self.mesh.points, self.springs)].ravel()
        return order[order >= 0]

    @cached_property
    def analysis(self) -> Analysis:
        """Symbolic Cholesky factorization; in CHOLMOD's own order for meshes too small for nested dissection."""
        order = self.order if self.size > DISSECTION_FROM_UNKNOWNS else None
        return Analysis(self._empty.indices, self._empty.indptr, order)

    @cached_property
    def pins(self) -> list[np.ndarray]:
        """Unknowns to pin where the matrix is indefinite: those of particles spread over the mesh."""
        chosen = (self.number[spread_particles(self.mesh.points, count)].ravel() for count in PIN_COUNTS)
        return [pins[pins >= 0] for pins in chosen]

    @cached_property
    def elimination(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Unknowns in the order of elimination; place and row of each entry in that order, and column pointers."""
        order, sparsity = self.order, self._empty
        rank = np.empty(self.size, dtype=np.int64)
        rank[order] = np.arange(self.size)
        sizes = np.diff(sparsity.indptr)[order]
        pointers = np.concatenate([[0], np.cumsum(sizes)])
        places = np.repeat(sparsity.indptr[order] - pointers[:-1], sizes) + np.arange(pointers[-1])
        # The library sorts rows within columns several times faster than numpy does all entries.
        numbered = csc_array((places.astype(float), rank[sparsity.indices[places]], pointers), shape=sparsity.shape)
        numbered.sort_indices()
        indices, pointers = numbered.indices.astype(np.int32), pointers.astype(np.int32)
        return order, numbered.data.astype(np.int64), indices, pointers

    def expand(self, unknowns: np.ndarray) -> np.ndarray:
        """Field of shape (n_points, 2) from the vector of unknowns, 0 where a direction is held."""
        full = np.zeros(self.shape)
        full.ravel()[self.places] = unknowns
        return full

    def reduce(self, vectors: np.ndarray) -> np.ndarray:
        """Entries of a field of shape (n_points, 2) that belong to unknowns."""
        return vectors.ravel()[self.places]

    def sum_springs(self, at_first: np.ndarray, at_second: np.ndarray | None = None) -> np.ndarray:
        """Sum values of springs at particles: added at first ends, subtracted at second ends, by default the same."""
        count = self.shape[0]
        at_second = at_first if at_second is None else at_second
        total = np.empty(self.shape)
        for axis in range(2):
            total[:, axis] = np.bincount(self.first, at_first[:, axis], count)
            total[:, axis] -= np.bincount(self.second, at_second[:, axis], count)
        return total

    def sum_cells(self, corners: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Sum values at the corners of cells, shape (n_cells, m, 2), at particles."""
        places = corners.T.ravel()
        total = [np.bincount(places, forces[:, :, axis].T.ravel(), self.shape[0]) for axis in range(2)]
        return np.stack(total, axis=1)

    def cell_couplings(self, energies: Sequence[Energy], displacements: np.ndarray | None = None) -> np.ndarray:
        """Blocks of the tangent of energies that couple the ends of each spring, shape (2, 2, n_springs)."""
        count = len(self.springs)
        total = np.zeros((2, 2, count))
        for energy in energies:
            places = self._springs_of(energy.corners)
            blocks = energy.couplings(displacements)
            for a in range(2):
                for d in range(2):
                    ours, turned = np.bincount(places, blocks[:, a, d].ravel(), 2 * count).reshape(2, count)
                    total[a, d] += ours
                    total[d, a] += turned
        return total

    @cached_property
    def _cell_springs(self) -> dict[int, np.ndarray]:
        """Spring of each pair of corners by number of corners, beyond the last one where it runs the other way."""
        edges = self.mesh.cell_edges
        return {count: self._directed(corners, edges[count]) for count, corners in self.mesh.cells.items()}

    def _springs_of(self, corners: np.ndarray) -> np.ndarray:
        """Return the springs of some cells as in `_cell_springs`: parts have energies of their own."""
        count = corners.shape[1]
        if len(corners) == len(self.mesh.cells[count]):
            return self._cell_springs[count]
        ends = np.sort(corners[:, SIDES[count] + DIAGONALS[count]], axis=2)
        scale = [self.shape[0], 1]
        return self._directed(corners, np.searchsorted(self.mesh.edges @ scale, ends @ scale))

    def _directed(self, corners: np.ndarray, edges: np.ndarray) -> np.ndarray:
        first, second = np.transpose(SIDES[corners.shape[1]] + DIAGONALS[corners.shape[1]])
        turned = corners[:, first] > corners[:, second]
        return (edges + len(self.springs) * turned).T.ravel()

    def coupling_entries(self, couplings: np.ndarray) -> np.ndarray:
        """Return the tangent's entries from blocks (2, 2, n_springs) that couple the ends of each spring."""
        own = self._own(couplings)
        return np.concatenate([couplings.ravel(), *own[[0, 1, 1, 2]]])[self._sparsity[2]]

    def _own(self, couplings: np.ndarray) -> np.ndarray:
        """Return xx, xy and yy of each particle's own block, shape (3, n_points)."""
        own = np.empty((3, self.shape[0]))
        for place, (a, d) in enumerate([(0, 0), (0, 1), (1, 1)]):
            own[place] = -np.bincount(self.first, couplings[a, d], self.shape[0])
            own[place] -= np.bincount(self.second, couplings[d, a], self.shape[0])
        return own

    def row_sums(self, couplings: np.ndarray) -> np.ndarray:
        """Sums of the sizes of a row's entries in the tangent, from blocks as above, shape (n_points, 2)."""
        free: np.ndarray = self.number >= 0
        sizes, (xx, xy, yy) = np.abs(couplings), np.abs(self._own(couplings))
        at_first = np.einsum("abn,nb->na", sizes, free[self.second])
        at_second = np.einsum("ban,nb->na", sizes, free[self.first])
        own = np.stack([xx + xy * free[:, 1], yy + xy * free[:, 0]], axis=1)
        return free * (own + self.sum_springs(at_first, -at_second))

    def blocks(self, couplings: np.ndarray) -> Blocks:
        """Return the tangent in blocks, as `coupling_entries`, with zeros where directions are held."""
        from ..linalg.kernels import Blocks, row_pointers  # here: few networks are so large

        free: np.ndarray = self.number >= 0
        blocks = np.ascontiguousarray(couplings.reshape(4, -1).T)
        diagonal = np.ascontiguousarray(self._own(couplings).T)
        held = np.flatnonzero(~(free[:, 0] & free[:, 1]))
        diagonal[held] *= np.stack([free[held, 0], free[held].all(axis=1), free[held, 1]], axis=1)
        near = np.flatnonzero(np.isin(self.springs, held).any(axis=1))
        blocks[near] *= (free[self.first[near], :, None] & free[self.second[near], None, :]).reshape(-1, 4)
        return Blocks(row_pointers(self.first, self.shape[0]), self.second.astype(np.int32), blocks, diagonal)

    def entries(self, particles: np.ndarray, matrices: np.ndarray) -> np.ndarray:
        """Entries of matrices of groups of joined particles, shape (n, 2 m, 2 m)."""
        rows, columns = entry_places(self.number[particles])
        kept = np.flatnonzero((rows >= 0) & (columns >= 0))
        places = np.searchsorted(self.codes, columns[kept] * self.size + rows[kept])
        return np.bincount(places, matrices.ravel()[kept], len(self._empty.indices))

    def loose_entries(self, particles: np.ndarray, matrices: np.ndarray) -> csr_array:
        """Matrix over all directions (2 n_points, 2 n_points) of groups of particles, without those that are held."""
        rows, columns = entry_places(2 * particles[:, :, None] + [0, 1])
        free: np.ndarray = self.number.ravel() >= 0
        values = np.where(free[rows] & free[columns], matrices.ravel(), 0.0)
        return csr_array((values, (rows, columns)), shape=(self.number.size, self.number.size))

    def matrix(self, data: np.ndarray) -> csc_array:
        """Sparse matrix of these entries."""
        found = copy(self._empty)  # without the checks of a new one
        found.data = data
        return found

    @cached_property
    def _empty(self) -> csc_array:
        indices, pointers, _ = self._sparsity
        return csc_array((np.zeros(len(indices)), indices, pointers), shape=(self.size, self.size))

"""Energies that a network may have besides its springs: of areas, of angles, and of squared edge lengths.

An energy is a sum over cells of the mesh. It gives its value, the forces with which it resists displacements and its
exact tangent, cell by cell; a network adds them to those of its springs. Changes of areas, angles and squared lengths
are taken from the displacements: subtracting two states would lose as many digits as the strain is small. Moduli are
multiples of the network's reference stiffness.

Inside, fields are held corner by corner, shape (2, m, n_cells): arithmetic on whole rows of cells is several times
faster than on their short vectors.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256

import numpy as np

from ..mesh.cells import DIAGONALS, SIDES


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product of plane vectors in the first axis."""
    return a[0] * b[1] - a[1] * b[0]


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar product of plane vectors in the first axis."""
    return a[0] * b[0] + a[1] * b[1]


def following(field: np.ndarray) -> np.ndarray:
    """Values at the next corner of each."""
    return np.roll(field, -1, axis=-2)


def preceding(field: np.ndarray) -> np.ndarray:
    """Values at the corner before each."""
    return np.roll(field, 1, axis=-2)


class Energy(ABC):
    """Base of the energies.

    Attributes
    ----------
    points : ndarray of float, shape (n_points, 2)
        Rest positions of the particles [m].
    corners : ndarray of int, shape (n_cells, m)
        Particles of each cell, counter-clockwise: all cells of a mesh with so many corners, or some.
    """

    points: np.ndarray
    corners: np.ndarray

    @abstractmethod
    def _moduli(self) -> tuple[np.ndarray, ...]:
        """Moduli over the reference stiffness, each with a row for each cell."""

    @abstractmethod
    def _values(self, moved: np.ndarray) -> np.ndarray:
        """Energy of each cell [m2] at displacements of its corners."""

    @abstractmethod
    def _forces(self, moved: np.ndarray) -> np.ndarray:
        """Its derivative by the corners' positions [m], shape (2, m, n_cells)."""

    @abstractmethod
    def _couplings(self, moved: np.ndarray) -> np.ndarray:
        """Its second derivatives by two corners, as of `couplings`."""

    def value(self, displacements: np.ndarray) -> float:
        """Energy over the reference stiffness [m2] at displacements of shape (n_points, 2)."""
        return float(self._values(self._at_corners(displacements)).sum())

    def forces(self, displacements: np.ndarray) -> np.ndarray:
        """Derivative of the energy by the corners' positions [m], shape (n_cells, m, 2)."""
        return self._forces(self._at_corners(displacements)).transpose(2, 1, 0)

    def couplings(self, displacements: np.ndarray | None = None) -> np.ndarray:
        """Blocks of the tangent that couple two corners of a cell [1], shape (n_pairs, 2, 2, n_cells).

        Pairs are in the order of `Mesh.cell_edges`; first axes: pair, direction at its first corner, at its second. An
        energy does not change with a common displacement, so these are all there is to know of the tangent. At rest
        without displacements.
        """
        moved = np.zeros(self._rest.shape) if displacements is None else self._at_corners(displacements)
        return self._couplings(moved)

    def tangent(self, displacements: np.ndarray | None = None) -> np.ndarray:
        """Second derivative by the corners' positions [1], shape (n_cells, 2 m, 2 m); at rest without displacements."""
        count, corners = self.corners.shape
        tangent = np.zeros((count, corners, 2, corners, 2))
        for (a, b), block in zip(self._pairs, self.couplings(displacements).transpose(0, 3, 1, 2)):
            turned = block.transpose(0, 2, 1)
            tangent[:, a, :, b], tangent[:, b, :, a] = block, turned
            tangent[:, a, :, a] -= block
            tangent[:, b, :, b] -= turned
        return tangent.reshape(count, 2 * corners, 2 * corners)

    @property
    def key(self) -> bytes:
        """Bytes that tell energies of one mesh apart."""
        moduli = (np.ascontiguousarray(part).tobytes() for part in self._moduli())
        return type(self).__name__.encode() + self._cells + b"".join(moduli)

    @cached_property
    def _cells(self) -> bytes:
        """Digest of the cells, which need not be all of the mesh."""
        return sha256(np.ascontiguousarray(self.corners).tobytes()).digest()

    @property
    def _pairs(self) -> tuple[tuple[int, int], ...]:
        return SIDES[self.corners.shape[1]] + DIAGONALS[self.corners.shape[1]]

    @cached_property
    def _rest(self) -> np.ndarray:
        return self._at_corners(self.points)

    def _at_corners(self, field: np.ndarray) -> np.ndarray:
        return np.take(np.ascontiguousarray(field.T), self.corners.T, axis=1)


@dataclass(frozen=True)
class AreaEnergy(Energy):
    r"""Energy of the area of each cell, a triangle or any polygon.

    .. math:: W = \tfrac{1}{2} \kappa (A - A_0)^2 / A_0

    Parameters
    ----------
    points, corners
        As in `Energy`.
    modulus : ndarray of float, shape (n_cells,)
        Modulus kappa over the reference stiffness [1].
    """

    points: np.ndarray
    corners: np.ndarray
    modulus: np.ndarray

    def _moduli(self) -> tuple[np.ndarray, ...]:
        return (self.modulus,)

    @staticmethod
    def _slopes(positions: np.ndarray) -> np.ndarray:
        """Derivative of the area by each corner: half the vector between its neighbours, turned outwards."""
        x, y = 0.5 * (following(positions) - preceding(positions))
        return np.stack([y, -x])

    @cached_property
    def _rest_slopes(self) -> np.ndarray:
        return self._slopes(self._rest)

    @cached_property
    def _stiffness(self) -> np.ndarray:
        return self.modulus / (0.5 * dot(self._rest - self._rest[:, :1], self._rest_slopes).sum(axis=0))

    def _growth(self, moved: np.ndarray) -> np.ndarray:
        moved = moved - moved[:, :1]
        # The area is quadratic in the positions.
        return (dot(self._rest_slopes, moved) + 0.5 * cross(moved, following(moved))).sum(axis=0)

    def _values(self, moved: np.ndarray) -> np.ndarray:
        return 0.5 * self._stiffness * self._growth(moved) ** 2

    def _forces(self, moved: np.ndarray) -> np.ndarray:
        return self._stiffness * self._growth(moved) * self._slopes(self._rest + moved)

    def _couplings(self, moved: np.ndarray) -> np.ndarray:
        slopes, pull = self._slopes(self._rest + moved), 0.5 * self._stiffness * self._growth(moved)
        scaled = self._stiffness * slopes
        blocks = np.stack([scaled[:, None, a] * slopes[None, :, b] for a, b in self._pairs])
        sides = len(SIDES[self.corners.shape[1]])
        blocks[:sides, 0, 1] += pull
        blocks[:sides, 1, 0] -= pull
        return blocks


@dataclass(frozen=True)
class AngleEnergy(Energy):
    r"""Energy of the three angles of each triangle.

    .. math:: W = \tfrac{1}{2} \beta \sum_i (\theta_i - \theta_{i,0})^2

    Parameters
    ----------
    points, corners
        As in `Energy`; triangles.
    modulus : ndarray of float, shape (n_cells,)
        Modulus beta over the reference stiffness [m2].
    """

    points: np.ndarray
    corners: np.ndarray
    modulus: np.ndarray

    def _moduli(self) -> tuple[np.ndarray, ...]:
        return (self.modulus,)

    def _change(self, moved: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Change of each angle [rad], and the vectors from each corner to the next and to the one before."""
        (a, b), (da, db) = ((following(field) - field, preceding(field) - field) for field in (self._rest, moved))
        sine, cosine = cross(a, b), dot(a, b)
        more_sine = cross(da, b) + cross(a, db) + cross(da, db)
        more_cosine = dot(da, b) + dot(a, db) + dot(da, db)
        change = np.arctan2(
            more_sine * cosine - more_cosine * sine, (sine + more_sine) * sine + (cosine + more_cosine) * cosine
        )
        return change, a + da, b + db

    def _values(self, moved: np.ndarray) -> np.ndarray:
        change, _, _ = self._change(moved)
        return 0.5 * self.modulus * (change**2).sum(axis=0)

    @staticmethod
    def _slopes(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivative of each angle by the position of its next corner and of the one before, shape (2, 3, n_cells)."""
        # The direction of a vector r changes by its turn over r^2.
        (ax, ay), (bx, by) = a / dot(a, a), b / dot(b, b)
        return np.stack([ay, -ax]), np.stack([-by, bx])

    def _forces(self, moved: np.ndarray) -> np.ndarray:
        change, a, b = self._change(moved)
        to_next, to_last = (self.modulus * change * slope for slope in self._slopes(a, b))
        return preceding(to_next) + following(to_last) - to_next - to_last

    def _couplings(self, moved: np.ndarray) -> np.ndarray:
        change, a, b = self._change(moved)
        to_next, to_last = self._slopes(a, b)
        own = -to_next - to_last
        pull = self.modulus * change
        blocks = np.empty((3, 2, 2, len(self.modulus)))
        # Side (j, k): corners j and k have their own angles there, and that of the corner opposite, i, sees both.
        for i, (j, k) in enumerate(self._pairs):
            for c in range(2):
                for d in range(2):
                    blocks[i, c, d] = self.modulus * (
                        own[c, j] * to_next[d, j] + to_last[c, k] * own[d, k] + to_next[c, i] * to_last[d, i]
                    )
            x, y = a[:, j]
            bend = (pull[j] - pull[k]) / (x * x + y * y) ** 2
            off, diagonal = bend * (y * y - x * x), bend * (2 * x * y)
            blocks[i, 0, 0] += diagonal
            blocks[i, 0, 1] += off
            blocks[i, 1, 0] += off
            blocks[i, 1, 1] -= diagonal
        return blocks


@dataclass(frozen=True)
class BiquadraticEnergy(Energy):
    r"""Energy of the squared lengths of each triangle's sides, coupled or not.

    With :math:`q_i = l_i^2 - L_i^2` of the side opposite corner i,

    .. math:: W = \sum_i \tfrac{k_i}{4} q_i^2 + \sum_{i<j} \tfrac{\gamma_{ij}}{2} q_i q_j

    Parameters
    ----------
    points, corners
        As in `Energy`; triangles.
    tensile : ndarray of float, shape (n_cells, 3)
        Stiffnesses k_i over the reference stiffness [1/m2].
    coupling : ndarray of float, shape (n_cells, 3), or None
        Stiffnesses gamma of the two sides that meet in each corner, over the reference stiffness [1/m2].
    """

    points: np.ndarray
    corners: np.ndarray
    tensile: np.ndarray
    coupling: np.ndarray | None = None

    def _moduli(self) -> tuple[np.ndarray, ...]:
        return (self.tensile,) if self.coupling is None else (self.tensile, self.coupling)

    @staticmethod
    def _sides(field: np.ndarray) -> np.ndarray:
        """Side opposite each corner: from the next corner to the one before."""
        return preceding(field) - following(field)

    @cached_property
    def _halves(self) -> tuple[np.ndarray, np.ndarray | None]:
        """Half the stiffnesses, row by row."""
        coupling = None if self.coupling is None else 0.5 * np.ascontiguousarray(self.coupling.T)
        return 0.5 * np.ascontiguousarray(self.tensile.T), coupling

    def _stresses(self, moved: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Sides, change of their squared lengths, and derivative of the energy by the latter."""
        rest, relative = self._sides(self._rest), self._sides(moved)
        change = dot(2 * rest + relative, relative)
        tensile, coupling = self._halves
        pull = tensile * change
        if coupling is not None:
            # Corner i couples the sides opposite i + 1 and i + 2.
            pull += preceding(coupling * following(following(change))) + following(coupling * following(change))
        return rest + relative, change, pull

    def _values(self, moved: np.ndarray) -> np.ndarray:
        _, change, pull = self._stresses(moved)
        return 0.5 * (change * pull).sum(axis=0)

    def _forces(self, moved: np.ndarray) -> np.ndarray:
        sides, _, pull = self._stresses(moved)
        along = 2 * pull * sides
        return following(along) - preceding(along)

    def _couplings(self, moved: np.ndarray) -> np.ndarray:
        sides, _, pull = self._stresses(moved)
        tensile, coupling = self._halves
        blocks = np.empty((3, 2, 2, sides.shape[2]))
        for i, (j, k) in enumerate(self._pairs):
            # Side i runs from corner j to corner k, side j from k to i, side k from i to j.
            for c in range(2):
                for d in range(2):
                    block = -tensile[i] * sides[c, i] * sides[d, i]
                    if coupling is not None:
                        block -= coupling[i] * sides[c, k] * sides[d, j]
                        block += coupling[j] * sides[c, k] * sides[d, i]
                        block += coupling[k] * sides[c, i] * sides[d, j]
                    blocks[i, c, d] = 4 * block
                    if c == d:
                        blocks[i, c, d] -= 2 * pull[i]
        return blocks

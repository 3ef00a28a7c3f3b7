"""Energies that a network may have besides its springs: of areas, of angles, and of squared edge lengths.

An energy is a sum over cells of the mesh. It gives its value, the forces with which it resists displacements and its
exact tangent, cell by cell; a network adds them to those of its springs. Changes of areas, angles and squared lengths
are taken from the displacements: subtracting two states would lose as many digits as the strain is small. Moduli are
multiples of the network's reference stiffness.
"""

from dataclasses import dataclass

import numpy as np

TURN = np.array([[0.0, -1.0], [1.0, 0.0]])
"""Rotation by a right angle, counter-clockwise."""


def cross(a, b):
    """Cross product of plane vectors in the last axis."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


class Energy:
    """Base of the energies.

    Attributes
    ----------
    points : ndarray of float, shape (n_points, 2)
        Rest positions of the particles [m].
    corners : ndarray of int, shape (n_cells, m)
        Particles of each cell, counter-clockwise.
    """

    def value(self, displacements):
        """Energy over the reference stiffness [m2] at displacements of shape (n_points, 2)."""
        return float(self._values(displacements[self.corners]).sum())

    def forces(self, displacements):
        """Derivative of the energy by the corners' positions [m], shape (n_cells, m, 2)."""
        return self._forces(displacements[self.corners])

    def tangent(self, displacements=None):
        """Second derivative by the corners' positions [1], shape (n_cells, 2 m, 2 m); at rest without displacements."""
        count = self.corners.shape[1]
        moved = np.zeros((*self.corners.shape, 2)) if displacements is None else displacements[self.corners]
        return self._tangent(moved).reshape(-1, 2 * count, 2 * count)

    @property
    def key(self):
        """Bytes that tell energies of one mesh apart."""
        return type(self).__name__.encode() + b"".join(np.ascontiguousarray(part).tobytes() for part in self._moduli())


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

    def _moduli(self):
        return (self.modulus,)

    def _slopes(self, positions):
        """Derivative of the area by each corner: half the vector between its neighbours, turned outwards."""
        return 0.5 * (np.roll(positions, -1, axis=1) - np.roll(positions, 1, axis=1)) @ TURN

    def _change(self, moved):
        rest = self.points[self.corners]
        slopes = self._slopes(rest)
        area = 0.5 * np.einsum("nia,nia->n", rest - rest[:, :1], slopes)
        moved = moved - moved[:, :1]
        # The area is quadratic in the positions.
        growth = np.einsum("nia,nia->n", slopes, moved) + 0.5 * cross(moved, np.roll(moved, -1, axis=1)).sum(axis=1)
        return growth, self.modulus / area

    def _values(self, moved):
        growth, stiffness = self._change(moved)
        return 0.5 * stiffness * growth**2

    def _forces(self, moved):
        growth, stiffness = self._change(moved)
        return (stiffness * growth)[:, None, None] * self._slopes(self.points[self.corners] + moved)

    def _tangent(self, moved):
        growth, stiffness = self._change(moved)
        slopes = self._slopes(self.points[self.corners] + moved)
        tangent = stiffness[:, None, None, None, None] * slopes[:, :, :, None, None] * slopes[:, None, None, :, :]
        count = self.corners.shape[1]
        for i in range(count):
            for j, half in (((i + 1) % count, 0.5), ((i - 1) % count, -0.5)):
                tangent[:, i, :, j, :] += (stiffness * growth)[:, None, None] * (half * TURN.T)
        return tangent


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

    def _moduli(self):
        return (self.modulus,)

    def _rays(self, field):
        """Vectors from each corner to the next and to the one before."""
        return np.roll(field, -1, axis=1) - field, np.roll(field, 1, axis=1) - field

    def _change(self, moved):
        (a, b), (da, db) = self._rays(self.points[self.corners]), self._rays(moved)
        sine, cosine = cross(a, b), (a * b).sum(axis=2)
        more_sine = cross(da, b) + cross(a, db) + cross(da, db)
        more_cosine = (da * b).sum(axis=2) + (a * db).sum(axis=2) + (da * db).sum(axis=2)
        change = np.arctan2(
            more_sine * cosine - more_cosine * sine, (sine + more_sine) * sine + (cosine + more_cosine) * cosine
        )
        return change, a + da, b + db

    def _values(self, moved):
        change, _, _ = self._change(moved)
        return 0.5 * self.modulus * (change**2).sum(axis=1)

    def _slopes(self, a, b):
        """Derivative of each angle by each corner, shape (n_cells, 3, 3, 2)."""
        # The direction of a vector r changes by its turn over r^2.
        to_next = -(a @ TURN.T) / (a * a).sum(axis=2)[..., None]
        to_last = (b @ TURN.T) / (b * b).sum(axis=2)[..., None]
        slopes = np.empty((len(a), 3, 3, 2))
        for i in range(3):
            slopes[:, i, i] = -to_next[:, i] - to_last[:, i]
            slopes[:, i, (i + 1) % 3] = to_next[:, i]
            slopes[:, i, (i + 2) % 3] = to_last[:, i]
        return slopes

    def _forces(self, moved):
        change, a, b = self._change(moved)
        return np.einsum("ni,nija->nja", self.modulus[:, None] * change, self._slopes(a, b))

    def _tangent(self, moved):
        change, a, b = self._change(moved)
        slopes = self._slopes(a, b).reshape(-1, 3, 6)
        tangent = (self.modulus[:, None, None] * slopes.transpose(0, 2, 1)) @ slopes
        tangent = tangent.reshape(-1, 3, 2, 3, 2)
        pull = self.modulus[:, None] * change
        if pull.any():
            for i in range(3):
                for j, vector, sign in (((i + 1) % 3, a, -1.0), ((i + 2) % 3, b, 1.0)):
                    bend = sign * pull[:, i, None, None] * _direction_bend(vector[:, i])
                    tangent[:, j, :, j, :] += bend
                    tangent[:, i, :, i, :] += bend
                    tangent[:, j, :, i, :] -= bend
                    tangent[:, i, :, j, :] -= bend
        return tangent


def _direction_bend(vectors):
    """Second derivative of the direction of vectors, shape (n, 2, 2)."""
    x, y = vectors.T
    r4 = (x * x + y * y) ** 2
    off = (y * y - x * x) / r4
    diagonal = 2 * x * y / r4
    return np.stack([np.stack([diagonal, off], axis=1), np.stack([off, -diagonal], axis=1)], axis=1)


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

    def _moduli(self):
        return (self.tensile,) if self.coupling is None else (self.tensile, self.coupling)

    def _sides(self, field):
        """Side opposite each corner, shape (n_cells, 3, 2)."""
        return np.roll(field, -2, axis=1) - np.roll(field, -1, axis=1)

    def _stresses(self, moved):
        """Sides, change of their squared lengths, and derivative of the energy by the latter."""
        rest, relative = self._sides(self.points[self.corners]), self._sides(moved)
        change = ((2 * rest + relative) * relative).sum(axis=2)
        pull = 0.5 * self.tensile * change
        if self.coupling is not None:
            # Corner i couples the sides opposite i + 1 and i + 2.
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                pull[:, j] += 0.5 * self.coupling[:, i] * change[:, k]
                pull[:, k] += 0.5 * self.coupling[:, i] * change[:, j]
        return rest + relative, change, pull

    def _values(self, moved):
        _, change, pull = self._stresses(moved)
        return 0.5 * (change * pull).sum(axis=1)

    def _forces(self, moved):
        sides, _, pull = self._stresses(moved)
        along = 2 * pull[..., None] * sides
        return np.roll(along, 2, axis=1) - np.roll(along, 1, axis=1)

    def _tangent(self, moved):
        sides, _, pull = self._stresses(moved)
        # Derivative of the squared length of side i by corner j: twice the side, +1 at its end, -1 at its start.
        ends = np.array([[(j == (i + 2) % 3) - (j == (i + 1) % 3) for j in range(3)] for i in range(3)], dtype=float)
        slopes = 2 * ends[None, :, :, None] * sides[:, :, None, :]
        matrix = np.zeros((len(self.corners), 3, 3))
        matrix[:, range(3), range(3)] = 0.5 * self.tensile
        if self.coupling is not None:
            for i in range(3):
                j, k = (i + 1) % 3, (i + 2) % 3
                matrix[:, j, k] = matrix[:, k, j] = 0.5 * self.coupling[:, i]
        tangent = np.einsum("nij,niac,njbd->nacbd", matrix, slopes, slopes, optimize=True)
        # Twice the pull times the second derivative of half the squared length.
        geometric = np.einsum("ni,ia,ib->nab", 2 * pull, ends, ends, optimize=True)
        tangent[:, :, 0, :, 0] += geometric
        tangent[:, :, 1, :, 1] += geometric
        return tangent

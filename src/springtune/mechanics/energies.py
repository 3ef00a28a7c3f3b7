"""Energies besides springs: of areas, of angles, of squared edge lengths, and of rubber.

Each is a sum over cells, with forces and an exact tangent; moduli are over the network's reference stiffness. Changes
of areas, angles and lengths come from displacements: subtracting two states would lose digits at small strain. Inside,
fields have shape (2, m, n_cells), several times faster in numpy than short vectors.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields, replace
from functools import cached_property
from hashlib import sha256
from typing import Any

import numpy as np

from ..mesh.cells import DIAGONALS, SIDES

CELLS_AT_ONCE = 100_000  # most cells whose forces and couplings are computed together


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross product of plane vectors in the first axis."""
    return a[0] * b[1] - a[1] * b[0]


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Scalar product of plane vectors in the first axis."""
    return a[0] * b[0] + a[1] * b[1]


def next_of(field: np.ndarray) -> np.ndarray:
    """Values at the next corner of each corner."""
    return field.take(range(1 - field.shape[-2], 1), axis=-2)


def previous_of(field: np.ndarray) -> np.ndarray:
    """Values at the previous corner of each corner."""
    return field.take(range(-1, field.shape[-2] - 1), axis=-2)


def _products(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Products of all components of two vectors in the first axis, shape (2, 2, ...)."""
    return a[:, None] * b[None]


def area_slopes(positions: np.ndarray) -> np.ndarray:
    """Derivative of each cell's area by each corner: half the vector between its neighbours, turned outwards."""
    x, y = 0.5 * (next_of(positions) - previous_of(positions))
    return np.stack([y, -x])


@dataclass(frozen=True)
class Energy(ABC):
    """Base of the energies of cells, with rest `points` [m] and `corners` (n_cells, m), counter-clockwise."""

    points: np.ndarray
    corners: np.ndarray

    @abstractmethod
    def _values(self, moved: np.ndarray) -> np.ndarray:
        """Energy of each cell [m2] at displacements of its corners."""

    @abstractmethod
    def _forces(self, moved: np.ndarray) -> np.ndarray:
        """Derivative of the energy by the corners' positions [m], shape (2, m, n_cells)."""

    @abstractmethod
    def _couplings(self, moved: np.ndarray) -> np.ndarray:
        """Second derivatives of the energy by two corners, see `couplings`."""

    def value(self, displacements: np.ndarray) -> float:
        """Energy over the reference stiffness [m2] at displacements of shape (n_points, 2)."""
        return float(self._values(self._at_corners(displacements)).sum())

    def forces(self, displacements: np.ndarray) -> np.ndarray:
        """Derivative of the energy by the corners' positions [m], shape (n_cells, m, 2)."""
        field = np.asfortranarray(displacements)  # as `_at_corners` reads it, so that no part copies it
        parts = [part._forces(part._at_corners(field)) for _, part in self._parts]
        return np.concatenate(parts, axis=-1).transpose(2, 1, 0)

    def couplings(self, displacements: np.ndarray | None = None) -> np.ndarray:
        """Return tangent blocks of pairs of corners [1], (n_pairs, 2, 2, n_cells), as `Mesh.cell_edges` orders them."""
        field = np.asfortranarray(np.zeros(self.points.shape) if displacements is None else displacements)
        blocks = np.empty((len(self._pairs), 2, 2, len(self.corners)))
        for rows, part in self._parts:
            blocks[..., rows] = part._couplings(part._at_corners(field))
        return blocks

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

    def objection(self, displacements: np.ndarray) -> str:
        """Why the answer at displacements (n_points, 2) [m] is doubtful, or an empty string."""
        return ""

    @property
    def moduli(self) -> dict[str, Any]:
        """Moduli by name."""
        return {one.name: getattr(self, one.name) for one in fields(self)[2:]}

    @property
    def key(self) -> bytes:
        """Bytes that distinguish energies of one mesh."""
        content = (np.ascontiguousarray(part).tobytes() for part in self.moduli.values() if part is not None)
        return type(self).__name__.encode() + self._cells + b"".join(content)

    @cached_property
    def _cells(self) -> bytes:
        """Digest of the cells, which may be a part of the mesh."""
        return sha256(np.ascontiguousarray(self.corners).tobytes()).digest()

    @property
    def _pairs(self) -> tuple[tuple[int, int], ...]:
        return SIDES[self.corners.shape[1]] + DIAGONALS[self.corners.shape[1]]

    @cached_property
    def _parts(self) -> list[tuple[slice, "Energy"]]:
        """Energies of `CELLS_AT_ONCE` cells each, with their rows: fields of millions of cells take gigabytes."""
        own = {one.name: value for one in fields(self)[1:] if np.ndim(value := getattr(self, one.name))}
        parts = [slice(start, start + CELLS_AT_ONCE) for start in range(0, len(self.corners), CELLS_AT_ONCE)]
        return [(rows, replace(self, **{name: value[rows] for name, value in own.items()})) for rows in parts]

    @cached_property
    def _rest(self) -> np.ndarray:
        return self._at_corners(self.points)

    @cached_property
    def _rest_slopes(self) -> np.ndarray:
        return area_slopes(self._rest)

    @cached_property
    def _rest_area(self) -> np.ndarray:
        return 0.5 * dot(self._rest - self._rest[:, :1], self._rest_slopes).sum(axis=0)

    def _growth(self, moved: np.ndarray) -> np.ndarray:
        """Growth of each cell's area [m2], which is quadratic in the positions."""
        moved = moved - moved[:, :1]
        return (dot(self._rest_slopes, moved) + 0.5 * cross(moved, next_of(moved))).sum(axis=0)

    def _at_corners(self, field: np.ndarray) -> np.ndarray:
        return np.take(np.ascontiguousarray(field.T), self.corners.T, axis=1)


@dataclass(frozen=True)
class AreaEnergy(Energy):
    r"""Energy of the area of each cell; `modulus` (n_cells,) is kappa over the reference stiffness [1].

    .. math:: W = \tfrac{1}{2} \kappa (A - A_0)^2 / A_0
    """

    modulus: np.ndarray

    @cached_property
    def _stiffness(self) -> np.ndarray:
        return self.modulus / self._rest_area

    def _values(self, moved: np.ndarray) -> np.ndarray:
        return 0.5 * self._stiffness * self._growth(moved) ** 2

    def _forces(self, moved: np.ndarray) -> np.ndarray:
        return self._stiffness * self._growth(moved) * area_slopes(self._rest + moved)

    def _couplings(self, moved: np.ndarray) -> np.ndarray:
        slopes, pull = area_slopes(self._rest + moved), 0.5 * self._stiffness * self._growth(moved)
        scaled = self._stiffness * slopes
        blocks = np.stack([_products(scaled[:, a], slopes[:, b]) for a, b in self._pairs])
        sides = len(SIDES[self.corners.shape[1]])
        blocks[:sides, 0, 1] += pull
        blocks[:sides, 1, 0] -= pull
        return blocks


@dataclass(frozen=True)
class AngleEnergy(Energy):
    r"""Energy of triangles' angles; `modulus` (n_cells,) or (n_cells, 3) is beta over the reference stiffness [m2].

    .. math:: W = \tfrac{1}{2} \sum_i \beta_i (\theta_i - \theta_{i,0})^2
    """

    modulus: np.ndarray

    @cached_property
    def _stiffness(self) -> np.ndarray:
        """Modulus of each corner, shape (3, n_cells)."""
        return np.ascontiguousarray(np.broadcast_to(self.modulus.T, (3, len(self.modulus))))

    def _change(self, moved: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Change of each angle [rad], and the vectors from each corner to the next and to the one before."""
        (a, b), (da, db) = ((next_of(field) - field, previous_of(field) - field) for field in (self._rest, moved))
        sine, cosine = cross(a, b), dot(a, b)
        more_sine = cross(da, b) + cross(a, db) + cross(da, db)
        more_cosine = dot(da, b) + dot(a, db) + dot(da, db)
        along = (sine + more_sine) * sine + (cosine + more_cosine) * cosine
        return np.arctan2(more_sine * cosine - more_cosine * sine, along), a + da, b + db

    def _values(self, moved: np.ndarray) -> np.ndarray:
        return 0.5 * (self._stiffness * self._change(moved)[0] ** 2).sum(axis=0)

    @staticmethod
    def _slopes(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivative of each angle by the position of its next corner and of the one before, shape (2, 3, n_cells)."""
        # The direction of a vector r changes by its turn over r^2.
        (ax, ay), (bx, by) = a / dot(a, a), b / dot(b, b)
        return np.stack([ay, -ax]), np.stack([-by, bx])

    def _forces(self, moved: np.ndarray) -> np.ndarray:
        change, a, b = self._change(moved)
        to_next, to_last = (self._stiffness * change * slope for slope in self._slopes(a, b))
        return previous_of(to_next) + next_of(to_last) - to_next - to_last

    def _couplings(self, moved: np.ndarray) -> np.ndarray:
        change, a, b = self._change(moved)
        to_next, to_last = self._slopes(a, b)
        own = -to_next - to_last
        stiffness, pull = self._stiffness, self._stiffness * change
        blocks = np.empty((3, 2, 2, len(self.modulus)))
        # Side (j, k): corners j and k have their own angles there, and that of the corner opposite, i, sees both.
        for i, (j, k) in enumerate(self._pairs):
            blocks[i] = stiffness[j] * _products(own[:, j], to_next[:, j])
            blocks[i] += stiffness[k] * _products(to_last[:, k], own[:, k])
            blocks[i] += stiffness[i] * _products(to_next[:, i], to_last[:, i])
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
    r"""Energy of the squared lengths of each triangle's sides, :math:`q_i = l_i^2 - L_i^2` opposite corner i.

    .. math:: W = \sum_i \tfrac{k_i}{4} q_i^2 + \sum_{i<j} \tfrac{\gamma_{ij}}{2} q_i q_j

    `tensile` k and `coupling` gamma (of sides that meet there) are (n_cells, 3), over the reference stiffness [1/m2].
    """

    tensile: np.ndarray
    coupling: np.ndarray | None = None

    @staticmethod
    def _sides(field: np.ndarray) -> np.ndarray:
        """Side opposite each corner: from the next corner to the one before."""
        return previous_of(field) - next_of(field)

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
            pull += previous_of(coupling * next_of(next_of(change))) + next_of(coupling * next_of(change))
        return rest + relative, change, pull

    def _values(self, moved: np.ndarray) -> np.ndarray:
        _, change, pull = self._stresses(moved)
        return 0.5 * (change * pull).sum(axis=0)

    def _forces(self, moved: np.ndarray) -> np.ndarray:
        sides, _, pull = self._stresses(moved)
        along = 2 * pull * sides
        return next_of(along) - previous_of(along)

    def _couplings(self, moved: np.ndarray) -> np.ndarray:
        sides, _, pull = self._stresses(moved)
        tensile, coupling = self._halves
        blocks = np.empty((3, 2, 2, sides.shape[2]))
        for i, (j, k) in enumerate(self._pairs):
            # Side i runs from corner j to corner k, side j from k to i, side k from i to j.
            at_i, at_j, at_k = (sides[:, side] for side in (i, j, k))
            block = _products(-tensile[i] * at_i, at_i)
            if coupling is not None:
                block -= _products(coupling[i] * at_k, at_j)
                block += _products(coupling[j] * at_k, at_i)
                block += _products(coupling[k] * at_i, at_j)
            np.multiply(4, block, out=blocks[i])
            blocks[i, [0, 1], [0, 1]] -= 2 * pull[i]
        return blocks


@dataclass(frozen=True)
class _SheetEnergy(Energy):
    """Base of isotropic rubber laws: functions of the area ratio J of a triangle and of D.

    .. math:: D = tr C - 2 J = (F_{11} - F_{22})^2 + (F_{12} + F_{21})^2

    Both terms are linear in the displacements, so nothing cancels near rest. ``tr C A_0`` is half the sum over the
    sides of the opposite angle's cotangent times the squared length. Flat or inverted triangles have no finite energy.
    """

    @abstractmethod
    def _law(self, distortion: np.ndarray, growth: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return the energy over the rest area and its derivatives by D, J, DD, DJ and JJ, at D and J - 1 > -1."""

    def _state(self, moved: np.ndarray) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, ...]]:
        """Derivatives of D and of J by each corner's position [1/m], and the law; NaN for inverted triangles."""
        area, (along, across) = self._rest_area, self._rest_slopes
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            first, second, growth = self._distortions(moved)
            law = self._law(first**2 + second**2, growth)
        by_x, by_y = first * along + second * across, second * along - first * across
        return 2 * np.stack([by_x, by_y]) / area, area_slopes(self._rest + (moved - moved[:, :1])) / area, law

    def _distortions(self, moved: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """F11 - F22 and F12 + F21, whose squares make D, and J - 1, NaN where a triangle is flat or inside out."""
        (x, y), (along, across), area = moved - moved[:, :1], self._rest_slopes, self._rest_area
        growth = self._growth(moved) / area
        first, second = (x * along - y * across).sum(axis=0) / area, (x * across + y * along).sum(axis=0) / area
        return first, second, np.where(growth > -1.0, growth, np.nan)

    def _values(self, moved: np.ndarray) -> np.ndarray:
        energy = self._state(moved)[2][0]
        return np.where(np.isnan(energy), np.inf, self._rest_area * energy)

    def _forces(self, moved: np.ndarray) -> np.ndarray:
        by_distortion, by_area, law = self._state(moved)
        return self._rest_area * (law[1] * by_distortion + law[2] * by_area)

    def _couplings(self, moved: np.ndarray) -> np.ndarray:
        d, j, (_, first_d, first_j, dd, dj, jj) = self._state(moved)
        along, across = self._rest_slopes
        area = self._rest_area
        d_pull, j_pull = area * (dd * d + dj * j), area * (dj * d + jj * j)
        blocks = np.stack([_products(d_pull[:, a], d[:, b]) + _products(j_pull[:, a], j[:, b]) for a, b in self._pairs])
        bend = 2 * first_d / area
        for (a, b), block in zip(self._pairs, blocks):
            turned = bend * (across[a] * along[b] - along[a] * across[b])
            block[[0, 1], [0, 1]] += bend * (along[a] * along[b] + across[a] * across[b])
            block[0, 1] += turned + 0.5 * first_j
            block[1, 0] -= turned + 0.5 * first_j
        return blocks


def _dilation(growth: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The function 2 J + J^-2 - 3 of J - 1, and its derivatives, without cancellation near J = 1."""
    ratio = 1.0 + growth
    value = growth * growth * (3.0 + 2.0 * growth) / ratio**2
    return value, 2.0 * growth * (3.0 + growth * (3.0 + growth)) / ratio**3, 6.0 / ratio**4


@dataclass(frozen=True)
class YeohEnergy(_SheetEnergy):
    r"""Energy of an incompressible sheet in plane stress (O. H. Yeoh, Rubber Chem. Technol. 63:792, 1990).

    .. math:: W = A_0 \sum_{n \ge 1} c_n (I_1 - 3)^n, \quad I_1 = tr C + J^{-2}

    One term alone is neo-Hookean, ``c_1 = mu t / 2``. `coefficients` (n_cells, n) are times the thickness over the
    reference stiffness [1]; beyond `largest`, I_1 - 3 of the fitted test, the law extrapolates.
    """

    coefficients: np.ndarray
    largest: float | np.ndarray = np.inf

    def objection(self, displacements: np.ndarray) -> str:
        """Say how many triangles are stretched beyond the test data, or return an empty string."""
        if not np.isfinite(self.largest).any():
            return ""
        with np.errstate(invalid="ignore"):
            first, second, growth = self._distortions(self._at_corners(displacements))
            excess = first**2 + second**2 + _dilation(growth)[0]
        over = excess > self.largest
        if not over.any():
            return ""
        worst = int(np.argmax(np.where(over, excess, 0.0)))
        end = np.broadcast_to(self.largest, excess.shape)[worst]
        at = f"to I1 - 3 = {excess[worst]:.3g} where the data end at {end:.3g}"
        return f"extrapolated: {over.sum()} of {len(excess)} triangles are stretched beyond the test data, {at}"

    def _law(self, distortion: np.ndarray, growth: np.ndarray) -> tuple[np.ndarray, ...]:
        dilation, first_j, second_j = _dilation(growth)
        excess = distortion + dilation  # I_1 - 3
        value = first = second = np.zeros_like(excess)
        for coefficient in self.coefficients.T[::-1]:  # Horner's rule of (I_1 - 3) times the polynomial
            second = second * excess + 2.0 * first
            first = first * excess + value
            value = value * excess + coefficient
        first, second, value = value + first * excess, 2.0 * first + second * excess, value * excess
        mixed = second * first_j
        return value, first, first * first_j, second, mixed, mixed * first_j + first * second_j


@dataclass(frozen=True)
class StableNeoHookeEnergy(_SheetEnergy):
    r"""Energy of the neo-Hookean membrane that engines have.

    .. math:: W = A_0 \left[ \tfrac{\mu}{2} (tr C - 2 J) + \tfrac{\lambda + \mu}{2} (J - 1)^2 \right]

    But for a constant the law of Smith, de Goes and Kim (Stable neo-Hookean flesh simulation, ACM TOG 37(2), 2018) in
    the plane. No sheet of rubber has this law: its thickness plays no part. `shear` and `first` (n_cells,) are Lame's
    constants times the thickness over the reference stiffness [1].
    """

    shear: np.ndarray
    first: np.ndarray

    def _law(self, distortion: np.ndarray, growth: np.ndarray) -> tuple[np.ndarray, ...]:
        half, bulk, none = 0.5 * self.shear, self.first + self.shear, np.zeros_like(growth)
        return half * distortion + 0.5 * bulk * growth**2, half, bulk * growth, none, none, bulk


LOG_LEAST_VOLUME = np.log(0.5)
"""Logarithm of the smallest volume with an equilibrium across the sheet in `NeoHookeEnergy`."""

MOST_VOLUME_STEPS = 60  # steps of Newton's method, or halvings, for the volume of a cell: a handful are taken


@dataclass(frozen=True)
class NeoHookeEnergy(_SheetEnergy):
    r"""Energy of the compressible neo-Hookean sheet in plane stress of CalculiX and Abaqus.

    .. math:: W = A_0 \min_z \left[ \tfrac{\mu}{2} (J_3^{-2/3} (tr C + z^2) - 3) + \tfrac{K}{2} (J_3 - 1)^2 \right],
        \quad J_3 = z J

    Newton's method finds the stretch z across the sheet. With ``v = ln J_3`` and ``y = ln J - 2 v / 3`` the bracket is
    :math:`\tfrac{\mu}{2} (e^{y} / J \, D + 2 e^y + e^{-2 y} - 3) + \tfrac{K}{2} (e^v - 1)^2`. A sheet pressed to less
    than half of its volume collapses across its thickness and has no energy. `shear` and `bulk` (n_cells,) are mu and K
    at small strain times the thickness over the reference stiffness [1]; for infinite K use `YeohEnergy`.
    """

    shear: np.ndarray
    bulk: np.ndarray

    def _volume(self, distortion: np.ndarray, area: np.ndarray) -> np.ndarray:
        """Logarithm v of the volume, of D and of ln J; NaN where there is no equilibrium across the sheet."""
        half, bulk = 0.5 * self.shear, self.bulk

        def imbalance(v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            """Imbalance across the sheet, which falls with v, and its derivative."""
            y, grown = area - v / 1.5, np.exp(v)
            pull = distortion * np.exp(-v / 1.5)
            off = half * (pull + 4 * np.exp(-0.5 * y) * np.sinh(1.5 * y)) - 1.5 * bulk * grown * np.expm1(v)
            slope = -half * (pull + 2 * np.exp(y) + 4 * np.exp(-2 * y)) / 1.5 - 1.5 * bulk * grown * (2 * grown - 1)
            return off, slope

        low, high = np.full_like(area, LOG_LEAST_VOLUME), np.full_like(area, 30.0)
        v = np.clip(3 * self.shear * area / (2 * self.shear + 1.5 * bulk), 0.9 * LOG_LEAST_VOLUME, 1.0)
        for _ in range(MOST_VOLUME_STEPS):
            off, slope = imbalance(v)
            low, high = np.where(off > 0, v, low), np.where(off > 0, high, v)
            step = -off / slope
            inside = (v + step >= low) & (v + step <= high)
            step = np.where(inside, step, 0.5 * (low + high) - v)
            v = v + step
            if not (np.abs(step) > 1e-15 + 1e-14 * np.abs(v)).any():
                break
        return np.where(imbalance(np.full_like(area, LOG_LEAST_VOLUME))[0] > 0, v, np.nan)

    def _law(self, distortion: np.ndarray, growth: np.ndarray) -> tuple[np.ndarray, ...]:
        area = np.log1p(growth)
        v = self._volume(distortion, area)
        y, grown, half = area - v / 1.5, np.exp(v), 0.5 * self.shear
        pull = half * np.exp(-v / 1.5)
        value = pull * distortion + half * _dilation(np.expm1(y))[0] + 0.5 * self.bulk * np.expm1(v) ** 2
        # By ln J, y eliminated; in equilibrium what changes with the volume has no part in the first derivative.
        first = half * 4 * np.exp(-0.5 * y) * np.sinh(1.5 * y)
        bend = half * (2 * np.exp(y) + 4 * np.exp(-2 * y))
        press = pull * distortion + 2.25 * self.bulk * grown * (2 * grown - 1)
        total, ratio = press + bend, 1.0 + growth
        second = press * bend / total
        by_both, by_area = -pull * bend / total / ratio, (second - first) / ratio**2
        return value, pull, first / ratio, -(pull**2) / total, by_both, by_area

r"""Reference at finite strain: a rubber sheet by quadratic finite elements, neo-Hookean or of Yeoh's law.

The neo-Hookean energy is that of CalculiX and Abaqus, with mu and K of the material at small strain,

.. math:: W = \tfrac{\mu}{2} (J^{-2/3} I_1 - 3) + \tfrac{K}{2} (J - 1)^2.

In plane stress the stretch across the sheet is eliminated in every point; for nu = 0.5 then
:math:`W = \mu/2 (I_1 + J^{-2} - 3)` in the plane, and Yeoh's law is a polynomial of this bracket.

If the force acts across the loaded side, half of the beam is solved, which does not buckle; else the whole, since large
rotations break the symmetry.
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.polynomial import Polynomial
from scipy.interpolate import krogh_interpolate
from scipy.sparse import csc_array, csr_array
from skfem import Basis, ElementQuad2, FacetBasis, MeshQuad

from ..linalg.factors import SingularError, SuperLUFactor, entry_places
from ..problem.loads import BOTTOM, FACE, LEFT, LoadKind
from ..problem.materials import Material, Rubber
from ..problem.shapes import Beam
from .answers import BeamField
from .small_strain import ReferenceNotConvergedError

ELEMENT_COUNTS = (5, 8)  # elements over half the height of the two meshes that are solved; the second is the answer

GRADING_POWER = 3  # power law of the elements' coordinates towards the corners

TOLERANCE = 1e-6
"""Last step of Newton's method over the displacements; the error that it leaves is about its square, or rounding."""

FARTHEST_STEP = 2.0  # largest step of Newton's method over the size of the sheet

MAX_ITERATIONS = 10

MOST_ELEMENT_RATIO = 10
"""Most elements along a bent beam over those of half the height: where it is slender, it bends evenly."""

SMALLEST_STEP = 1 / 64

PATH_TOLERANCE = 0.01  # difference of two meshes' displacements within which they are on the same path

LARGEST_BEND = 0.1  # largest bend of the way between two equilibria, as `springtune.mechanics.statics.LARGEST_BEND`


class FiniteStrainError(ReferenceNotConvergedError):
    """A reference did not converge; the message gives the reached load."""


@dataclass(frozen=True)
class FiniteStrainSolution(BeamField):
    """Displacements of a beam at finite strain; `profile` [m], along the force, at `positions` on the loaded side.

    `error_estimate` is the relative difference to the coarser mesh, several times the error, plus the errors of
    Newton's method and rounding; under pressure twice the larger one of the middle and the mean.
    """

    positions: np.ndarray
    profile: np.ndarray


def solve_finite_strain(
    beam: Beam, material: Material, force: float, kind: LoadKind = FACE, plane: str = "", follower: bool = False
) -> FiniteStrainSolution:
    """Solve for the displacements of a beam of rubber, see `law_of`, under a `force` [N], positive outwards."""
    law = law_of(material, plane or material.plane)
    stress = force / (kind.side_length(beam) * beam.thickness * material.young_modulus)
    sheets = [_Sheet(beam.length / beam.height, law, count, kind, follower) for count in ELEMENT_COUNTS]
    name = f"{beam.name}, {material.name}"
    coarse, fine = (sheet.solve(stress, name, watched) for sheet, watched in zip(sheets, (True, False)))
    # The finer mesh may have snapped where the coarser one has not.
    if not abs(coarse.mean_displacement - fine.mean_displacement) <= PATH_TOLERANCE * abs(fine.mean_displacement):
        fine = sheets[1].solve(stress, name)
    # Lengths are over half the height.
    lengths = ("displacement", "mean_displacement", "profile", "x", "y", "displacements")
    scaled = {name: beam.height / 2 * getattr(fine, name) for name in lengths}
    return replace(fine, error_estimate=_mesh_difference(coarse, fine, kind) + fine.error_estimate, **scaled)


def _mesh_difference(coarse: FiniteStrainSolution, fine: FiniteStrainSolution, kind: LoadKind) -> float:
    """Relative change from a mesh to a finer one, an estimate of the error that is left."""
    middle = float(abs(coarse.displacement / fine.displacement - 1))
    mean = float(abs(coarse.mean_displacement / fine.mean_displacement - 1))
    # The middle of a pressed side changes its sign of error with the beam's shape: by chance it agrees on both meshes.
    # Twice: near such a chance the larger of the two came to 0.55 times the error, of 300 loads and shapes.
    return 2 * max(middle, mean) if kind.pressed else middle


class Body:
    """Problem at finite strain: elements with a law, supports and a growing load.

    `gradients` (elements, points, 2, functions) and `weights` (elements, points), times the unit of stress, are at
    points of integration; `load`, `held` and `given` are (functions, 2); `turning` is the load by displacements.
    """

    law: "Law"
    nodes_of: np.ndarray
    gradients: np.ndarray
    weights: np.ndarray
    load: np.ndarray
    held: np.ndarray
    given: np.ndarray
    turning: csr_array
    extent: float

    def equilibrium_under(self, stress: float, name: str, watched: bool = True) -> tuple[np.ndarray, float]:
        """Return the equilibrium under `stress` times the load, reached in steps, and its relative rounding error."""
        path, step = [(0.0, np.zeros(self.load.shape))], 1.0
        while path[-1][0] < 1:
            done = path[-1][0]
            step = min(step, 1 - done)
            guess = _extrapolate(path, done + step)
            if len(path) == 1 and self.given.any():
                guess = stress * step * self._slope
            found = self.equilibrium(guess, stress * (done + step))
            if found is not None and found[2] and (not watched or self._joined(path, done + step, found[0], stress)):
                moved, uncertain, _ = found
                path, step = [*path[-2:], (done + step, moved)], 1.5 * step
            elif step <= SMALLEST_STEP:
                what = "equilibrium" if found is None else "stable path"
                raise FiniteStrainError(f"reference of {name}: no {what} beyond {100 * done:.3g} % of the load")
            else:
                step /= 2
        return moved, uncertain

    def _joined(self, path: list[tuple[float, np.ndarray]], share: float, moved: np.ndarray, stress: float) -> bool:
        """Whether no snap lies between a stable equilibrium and the last one: the middle is stable, too."""
        middle = 0.5 * (path[-1][0] + share)
        if self._is_stable(_extrapolate([*path, (share, moved)], middle), stress * middle):
            return True
        # The straight way from rest shortens what turns; the parabola that begins as the linear solution does not.
        bent = 0.25 * (moved - stress * share * self._slope)
        little = np.linalg.norm(bent) <= LARGEST_BEND * np.linalg.norm(moved)
        return bool(len(path) == 1 and little and self._is_stable(0.5 * moved - bent, stress * middle))

    def _is_stable_by_factor(self, factor: SuperLUFactor, moved: np.ndarray, stress: float) -> bool:
        """Whether an equilibrium is stable, judged by the factor of its tangent."""
        try:
            negative = factor.negative_pivots
        except SingularError:  # pivots beside the diagonal
            return self._is_stable(moved, stress)
        # Of a tangent that is not symmetric only an odd number says something.
        return not (negative % 2 if self.turning.nnz else negative)

    def _is_stable(self, moved: np.ndarray, stress: float) -> bool:
        """Whether the symmetric part of the tangent is positive definite: no real eigenvalue is negative then."""
        gradient = self._gradient(moved)
        with np.errstate(all="ignore"):
            tangent = self._tangent(gradient, self.law.response(strain_of(gradient))) - stress * self.turning
        free = ~self.held.ravel()
        try:
            return not SuperLUFactor(csc_array((0.5 * (tangent + tangent.T))[free][:, free])).negative_pivots
        except (SingularError, ValueError):
            return False

    @cached_property
    def _slope(self) -> np.ndarray:
        """Linear solution for a stress of 1."""
        rest, free = np.zeros(self.load.shape), ~self.held.ravel()
        gradient = self._gradient(rest)
        tangent = self._tangent(gradient, self.law.response(strain_of(gradient)))
        rest[~self.held] = SuperLUFactor(csc_array(tangent[free][:, free])).solve(self.load.ravel()[free])
        return rest

    def equilibrium(self, moved: np.ndarray, stress: float) -> tuple[np.ndarray, float, bool] | None:
        """Return the equilibrium, its relative rounding error, and whether it is stable; None if there is none.

        Strains at integration points are separate unknowns (Magisano, Leonetti and Garcea, Int. J. Numer. Meth. Engng
        109:1237, 2017): otherwise slender beams that turn would need small steps.
        """
        free, strain = ~self.held.ravel(), None
        moved = np.where(self.held, stress * self.given, moved)
        for _ in range(MAX_ITERATIONS):
            gradient = self._gradient(moved)
            found = strain_of(gradient)
            strain = found if strain is None else strain
            turning = stress * self.turning
            external = stress * self.load + (turning @ moved.ravel()).reshape(-1, 2)
            with np.errstate(all="ignore"):
                state = self.law.response(strain)
                pull = state.stress + (state.tangent @ (found - strain)[..., None])[..., 0]
            residual = (external - self._forces(gradient, pull)).ravel()[free]
            if not np.isfinite(residual).all():
                return None
            step = np.zeros(moved.shape)
            try:
                factor = SuperLUFactor(csc_array((self._tangent(gradient, state) - turning)[free][:, free]))
            except SingularError:
                return None
            step[~self.held] = factor.solve(residual)
            if not np.abs(step).max() <= FARTHEST_STEP * self.extent:
                return None
            strain = found + _strain_change(gradient, self._gradient(step))
            moved = moved + step
            if np.abs(step).max() <= TOLERANCE * np.abs(moved).max():
                return moved, self._last_change(step, moved), self._is_stable_by_factor(factor, moved, stress)
        return None

    def _gradient(self, moved: np.ndarray) -> np.ndarray:
        """Derivatives of displacements (component, axis) in the points of integration, (elements, points, 2, 2)."""
        return np.swapaxes(self.gradients @ moved[self.nodes_of][:, None], 2, 3)

    def _forces(self, gradient: np.ndarray, stress: np.ndarray) -> np.ndarray:
        """Internal forces of second Piola-Kirchhoff stresses xx, yy, xy."""
        first = (gradient + np.eye(2)) @ matrix_of(stress) * self.weights[..., None, None]
        count, points = self.weights.shape
        forces = np.swapaxes(self.gradients, 2, 3).transpose(0, 2, 1, 3).reshape(count, -1, 2 * points)
        forces = forces @ np.swapaxes(first, 2, 3).reshape(count, 2 * points, 2)
        total = np.zeros(self.load.shape)
        np.add.at(total, self.nodes_of, forces)
        return total

    def _tangent(self, gradient: np.ndarray, state: "Response") -> csr_array:
        """Derivative of the internal forces by displacements."""
        count, points, _, shapes = self.gradients.shape
        deformation, by_x, by_y = gradient + np.eye(2), self.gradients[:, :, 0], self.gradients[:, :, 1]
        # Changes of strains xx, yy and 2 xy with each unknown.
        changes = np.empty((count, points, 3, shapes, 2))
        for axis in range(2):
            f_x, f_y = deformation[:, :, axis, 0, None], deformation[:, :, axis, 1, None]
            changes[:, :, 0, :, axis] = f_x * by_x
            changes[:, :, 1, :, axis] = f_y * by_y
            changes[:, :, 2, :, axis] = f_x * by_y + f_y * by_x
        by_unknown = changes.reshape(count, points, 3, 2 * shapes)
        stresses = state.tangent * self.weights[..., None, None] @ by_unknown
        blocks = np.swapaxes(by_unknown.reshape(count, 3 * points, -1), 1, 2) @ stresses.reshape(count, 3 * points, -1)
        held = self.gradients.reshape(count, 2 * points, shapes)
        turned = matrix_of(state.stress) * self.weights[..., None, None] @ self.gradients
        stretched = np.swapaxes(held, 1, 2) @ turned.reshape(count, 2 * points, shapes)
        for axis in range(2):
            blocks[:, axis::2, axis::2] += stretched
        return csr_array((blocks.ravel(), self._places), shape=(self.load.size, self.load.size))

    @cached_property
    def _places(self) -> tuple[np.ndarray, np.ndarray]:
        """Rows and columns of the entries of all elements' matrices."""
        return entry_places(2 * self.nodes_of[:, :, None] + np.arange(2))

    def _last_change(self, step: np.ndarray, moved: np.ndarray) -> float:
        """Change of the load's displacement in the last step, relative [1]."""
        return float(abs((self.load * step).sum() / (self.load * moved).sum()))


class _Sheet(Body):
    """Problem of a sheet of height 2 with E = 1; half of it if the load is symmetric."""

    def __init__(self, aspect_ratio: float, law: "PlaneLaw", count: int, kind: LoadKind, follower: bool) -> None:
        self.kind, self.law = kind, law
        length = 2 * aspect_ratio
        self.extent = max(length, 2.0)
        along, across = _element_ends(length, count, kind)
        mesh = MeshQuad.init_tensor(along, across)
        basis = Basis(mesh, ElementQuad2(), intorder=4)
        axis, component, place = kind.normal, kind.axis, kind.loaded.place(along[-1], across[-1])
        facets = mesh.facets_satisfying(lambda x: np.isclose(x[axis], place), boundaries_only=True)
        side = FacetBasis(mesh, ElementQuad2(), facets=facets, intorder=4)
        places = self.nodes_at = basis.doflocs.T
        # Coordinates of the nodes: ends and middles of elements. Those of one line differ by rounding.
        ends = along, across
        self.axes = [np.interp(np.arange(2 * len(one) - 1) / 2, np.arange(len(one)), one) for one in ends]
        self.held, self.given = np.zeros(places.shape, dtype=bool), np.zeros(places.shape)
        for where, axes in kind.half_held if kind.symmetric else kind.held:
            there = np.isclose(places[:, where.axis], where.place(along[-1], across[-1]))
            self.held[np.ix_(there, axes)] = True

        # Of each element and its points of integration: gradients of shape functions, (elements, points, 2, shapes).
        self.nodes_of = basis.element_dofs.T
        self.gradients = np.stack([one[0].grad for one in basis.basis], axis=-1).transpose(1, 2, 0, 3)
        self.weights = basis.dx
        self.load = np.zeros(places.shape)
        shapes = np.stack([np.asarray(one[0]) * side.dx for one in side.basis])
        np.add.at(self.load[:, component], side.element_dofs, shapes.sum(axis=2))
        slopes = np.stack([one[0].grad[kind.along] for one in side.basis])
        blocks = np.einsum("iep,jep->eij", shapes, slopes) * (1 if kind.along == 0 else -1)
        turning = turning_of(blocks, side.element_dofs.T, places.size)
        self.turning = turning if follower else csr_array(turning.shape)

    def solve(self, stress: float, name: str, watched: bool = True) -> FiniteStrainSolution:
        """Equilibrium under the whole load, reached in watched steps; lengths are over half the height."""
        moved, uncertain = self.equilibrium_under(stress, name, watched)
        mean = float((self.load * moved).sum() / self.load.sum())
        kind, (x, y, field) = self.kind, self._field(moved)
        places = (x, y)[kind.along]
        positions = places / places[-1]
        profile = field.take(-1 if kind.loaded.far else 0, axis=kind.normal)[:, kind.axis]
        displacement = float(np.interp(0.5, positions, profile)) if kind.pressed else mean
        return FiniteStrainSolution(displacement, mean, uncertain, x, y, field, positions, profile)

    def _field(self, moved: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return coordinates of a grid over the whole sheet, from 0 on, and displacements at its nodes."""
        x, y = self.axes
        field = np.empty((len(x), len(y), 2))
        at = self.nodes_at.T
        field[*(np.searchsorted((axis[1:] + axis[:-1]) / 2, one) for axis, one in zip((x, y), at))] = moved
        if not self.kind.symmetric:
            return x, y, field
        if self.kind.cut == BOTTOM:  # the upper half
            whole = np.concatenate([field[:, :0:-1] * [1, -1], field], axis=1)
            return x, 1 + np.concatenate([-y[:0:-1], y]), whole
        whole = np.concatenate([field, field[-2::-1] * [-1, 1]])
        return np.concatenate([x, 2 * x[-1] - x[-2::-1]]), y, whole


def turning_of(blocks: np.ndarray, numbers: np.ndarray, size: int) -> csr_array:
    """Derivative of a following pressure's forces by displacements: cofactor of the deformation times the normal.

    `blocks` (n, m, m) are integrals of the functions `numbers` (n, m) of a side times the pressure and their slopes.
    """
    rows, columns = entry_places(2 * numbers)
    parts = [(-blocks.ravel(), (rows, columns + 1)), (blocks.ravel(), (rows + 1, columns))]
    return sum(csr_array(part, shape=(size, size)) for part in parts)


def strain_of(gradient: np.ndarray) -> np.ndarray:
    """Green's strains xx, yy and 2 xy."""
    x, y = gradient[..., 0], gradient[..., 1]  # derivatives by x and by y
    parts = [x[..., 0] + (x * x).sum(-1) / 2, y[..., 1] + (y * y).sum(-1) / 2, x[..., 1] + y[..., 0] + (x * y).sum(-1)]
    return np.stack(parts, axis=-1)


def _strain_change(gradient: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Derivative of Green's strains along a change of the gradient of displacements."""
    x, y, by_x, by_y = gradient[..., 0], gradient[..., 1], change[..., 0], change[..., 1]
    parts = [
        by_x[..., 0] + (x * by_x).sum(-1),
        by_y[..., 1] + (y * by_y).sum(-1),
        by_x[..., 1] + by_y[..., 0] + (x * by_y).sum(-1) + (y * by_x).sum(-1),
    ]
    return np.stack(parts, axis=-1)


def matrix_of(stress: np.ndarray) -> np.ndarray:
    """Symmetric matrices of xx, yy, xy."""
    return stress[..., [[0, 2], [2, 1]]]


def _element_ends(length: float, count: int, kind: LoadKind) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the elements along x and along y: of half of a symmetric beam, see `LoadKind.cut`, else of the whole."""
    near = np.linspace(0, 1, count + 1) ** GRADING_POWER
    both = np.concatenate([near, 2 - near[-2::-1]])
    half = _graded_coordinates(near, length / 2, count)
    ends = np.concatenate([half, length - half[-2::-1]])
    if kind.along == 0:
        return half if kind.symmetric else ends, both
    if all(side == LEFT for side, _ in kind.held):  # no corners at the loaded end
        ends = _graded_coordinates(near, length, count, np.inf if kind.symmetric else MOST_ELEMENT_RATIO)
    return ends, 1 - near[::-1] if kind.symmetric else both


def _graded_coordinates(near: np.ndarray, length: float, count: int, most: float = np.inf) -> np.ndarray:
    """Coordinates from 0 to length, graded within 1 of 0 and even beyond, there with at most `most` elements."""
    if length <= 1:
        return near * length
    columns = int(min(max(1, round(count * (length - 1) / 2)), most * count))
    return np.concatenate([near, np.linspace(1, length, 1 + columns)[1:]])


def _extrapolate(path: list[tuple[float, np.ndarray]], share: float) -> np.ndarray:
    """Displacements at a share of the load, by the polynomial through those before."""
    shares, moved = zip(*path)
    return np.asarray(krogh_interpolate(shares, np.array(moved), share))


_Derivatives = tuple[Sequence[np.ndarray], Sequence[np.ndarray]]
"""First derivatives of an energy by t and d, and second ones by tt, td, dd."""


class Law(Protocol):
    """Interface of a law: stress and tangent at Green's strains xx, yy and 2 xy, shape (..., 3), over E."""

    def response(self, strain: np.ndarray) -> "Response":
        """Stress and tangent."""

    def energy(self, strain: np.ndarray) -> np.ndarray:
        """Energy."""


class PlaneLaw(ABC):
    """Energy of a sheet with E = 1, of the trace and the determinant of C in the plane."""

    @abstractmethod
    def derivatives(self, trace: np.ndarray, d: np.ndarray) -> _Derivatives:
        """First derivatives by t and d, and second ones by tt, td, dd."""

    @abstractmethod
    def value(self, trace: np.ndarray, d: np.ndarray) -> np.ndarray:
        """Energy of t and d."""

    def energy(self, strain: np.ndarray) -> np.ndarray:
        """Energy at Green's strains xx, yy and 2 xy, shape (..., 3) [1]."""
        x, y, angle = 1 + 2 * strain[..., 0], 1 + 2 * strain[..., 1], strain[..., 2]
        return self.value(x + y, x * y - angle**2)

    def response(self, strain: np.ndarray) -> "Response":
        """Return stress and tangent at Green's strains xx, yy and 2 xy, shape (..., 3) [1].

        The energy depends on t = tr C and d = det C, C = 1 + 2 E: with C's cofactor a, S = 2 (W_t 1 + W_d a).
        """
        c = np.stack([1 + 2 * strain[..., 0], 1 + 2 * strain[..., 1], strain[..., 2]], axis=-1)
        determinant = c[..., 0] * c[..., 1] - c[..., 2] ** 2
        turned = np.stack([c[..., 1], c[..., 0], -c[..., 2]], axis=-1)
        first, second = self.derivatives(c[..., 0] + c[..., 1], determinant)
        unit = np.array([1.0, 1.0, 0.0])
        stress = 2 * (first[0][..., None] * unit + first[1][..., None] * turned)
        mixed = unit[:, None] * turned[..., None, :]
        # The derivative of a by xx, yy and xy of C, where xy stands for both of its places.
        bend = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -0.5]])
        tangent = 4 * (
            second[0][..., None, None] * np.multiply.outer(unit, unit)
            + second[1][..., None, None] * (mixed + np.swapaxes(mixed, -1, -2))
            + second[2][..., None, None] * turned[..., :, None] * turned[..., None, :]
            + first[1][..., None, None] * bend
        )
        return Response(stress, tangent)


class Yeoh(PlaneLaw):
    """Yeoh's law of an incompressible sheet in plane stress, with E = 1."""

    def __init__(self, coefficients: Sequence[float]) -> None:
        self._energy = Polynomial([0.0, *coefficients])
        self._slopes = self._energy.deriv(1), self._energy.deriv(2)

    def value(self, trace: np.ndarray, d: np.ndarray) -> np.ndarray:
        """Energy of t and d."""
        return self._energy(trace + 1 / d - 3)

    def derivatives(self, trace: np.ndarray, d: np.ndarray) -> _Derivatives:
        """Derivatives of W = sum_n c_n x^n with x = t + 1/d - 3."""
        excess = trace + 1 / d - 3
        first, second = (slope(excess) for slope in self._slopes)
        by_d = -1 / d**2
        return (first, first * by_d), (second, second * by_d, second * by_d**2 + 2 * first / d**3)


class NeoHooke(PlaneLaw):
    """Compressible neo-Hookean energy of a sheet with E = 1; `nu` < 0.5 is Poisson's ratio at small strain."""

    def __init__(self, nu: float, plane: str) -> None:
        self.shear, self.bulk, self.plane = 1 / (2 * (1 + nu)), 1 / (3 * (1 - 2 * nu)), plane

    def derivatives(self, trace: np.ndarray, d: np.ndarray) -> _Derivatives:
        """Derivatives of the module's energy; in plane stress the stretch z across is eliminated."""
        z = self._across(trace, d)
        parts = self._parts(trace, d, z)
        second = [parts["tt"], parts["td"], parts["dd"]]
        if self.plane == "stress":
            pairs = ("tz", "tz"), ("tz", "dz"), ("dz", "dz")
            second = [of - parts[one] * parts[other] / parts["zz"] for of, (one, other) in zip(second, pairs)]
        return (parts["t"], parts["d"]), second

    def value(self, trace: np.ndarray, d: np.ndarray) -> np.ndarray:
        """Energy of t and d."""
        z = self._across(trace, d)
        volume = z * np.sqrt(d)
        isochoric = volume ** (-2 / 3) * (trace + z**2) - 3
        return np.asarray(0.5 * self.shear * isochoric + 0.5 * self.bulk * (volume - 1) ** 2)

    def _across(self, trace: np.ndarray, d: np.ndarray) -> np.ndarray:
        """Stretch across the sheet."""
        z = np.ones_like(d)
        if self.plane == "stress":
            z = 1 / np.sqrt(d)
            for _ in range(30):
                parts = self._parts(trace, d, z)
                step = parts["z"] / parts["zz"]
                z = np.maximum(z - step, 0.2 * z)
                if np.nanmax(np.abs(step)) < 1e-14:
                    break
        return z

    def _parts(self, t: np.ndarray, d: np.ndarray, z: np.ndarray) -> dict[str, np.ndarray]:
        """Derivatives of mu/2 (p (t + z^2) - 3) + K/2 (J - 1)^2 with J = z sqrt(d), p = J^(-2/3)."""
        half, bulk = self.shear / 2, self.bulk
        volume = z * np.sqrt(d)
        p, trace, growth = volume ** (-2 / 3), t + z**2, volume - 1
        return {
            "t": half * p,
            "d": -half * p / (3 * d) * trace + bulk * growth * volume / (2 * d),
            "z": half * p * (2 * z - 2 / (3 * z) * trace) + bulk * growth * volume / z,
            "tt": np.zeros_like(p),
            "td": -half * p / (3 * d),
            "tz": -half * p * 2 / (3 * z),
            "dd": half * p * 4 / (9 * d**2) * trace + bulk * (volume - growth) * volume / (4 * d**2),
            "dz": half * p / (3 * d) * (2 / (3 * z) * trace - 2 * z) + bulk * (volume + growth) * volume / (2 * d * z),
            "zz": half * p * (10 / (9 * z**2) * trace - 8 / 3 + 2) + bulk * (volume / z) ** 2,
        }


class StVenant:
    """St. Venant-Kirchhoff's law of any sheet: stresses are linear in Green's strains, by `stiffness` (3, 3)."""

    def __init__(self, stiffness: np.ndarray) -> None:
        self.stiffness = stiffness

    def energy(self, strain: np.ndarray) -> np.ndarray:
        """Evaluate the law, see `Law`."""
        return np.asarray(0.5 * (strain @ self.stiffness * strain).sum(axis=-1))

    def response(self, strain: np.ndarray) -> "Response":
        """Evaluate the law, see `Law`."""
        return Response(strain @ self.stiffness, np.broadcast_to(self.stiffness, (*strain.shape, 3)))


def law_of(material: Material, plane: str = "stress") -> PlaneLaw:
    """Return Yeoh's law of a tested rubber, else the neo-Hookean law: one term of Yeoh's where nu = 1/2."""
    modulus, nu = material.young_modulus, material.poisson_ratio
    if isinstance(material, Rubber):
        return Yeoh([one / modulus for one in material.coefficients])
    if nu < 0.5:
        return NeoHooke(nu, plane)
    if plane == "strain":
        raise FiniteStrainError(f"plane strain of '{material.name}' needs a Poisson's ratio below 0.5, such as 0.4999")
    return Yeoh([1 / (4 * (1 + nu))])


class Response(NamedTuple):
    """Second Piola-Kirchhoff `stress` xx, yy, xy over E, (..., 3), and `tangent` (..., 3, 3) by Green's strains."""

    stress: np.ndarray
    tangent: np.ndarray

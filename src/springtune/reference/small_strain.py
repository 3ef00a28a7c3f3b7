"""Reference for a beam: linear elasticity at small strain, plane stress, by finite elements.

Half of each beam is solved, along its axis of symmetry or antisymmetry: the upper half if an end is loaded, else the
left one. The kind ``"face"`` is shear with a force along y and no rollers.

The stress is singular where a clamp meets a free edge. Rectangles shrink geometrically towards the corners, and their
degree grows with the number of layers: the error falls exponentially (hp version), to 1e-6 with some thousand unknowns.
"""

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from math import ceil, log

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.sparse import block_array, coo_array, csc_array, csr_array, diags_array, kron

from ..linalg.factors import factorize
from ..problem.loads import AXIAL, BOTTOM, LEFT, RIGHT, TOP, LoadKind
from ..problem.materials import Material
from ..problem.shapes import Beam
from .answers import BeamField, rotation_and_strain, unit_problem, unit_scales

#: First and last level tried. Level p has polynomials of degree p and p layers of elements at a corner.
FIRST_LEVEL, LAST_LEVEL = 3, 9

#: Size of a layer of elements over that of the next one outwards. In one dimension (sqrt(2) - 1)^2 = .17 is best (Gui,
#: Babuska 1986); of .1, .15, .2 and .3, .2 has the least error here.
SHRINKAGE = 0.2

#: Largest ratio of neighbouring elements away from the corners, where the solution is smooth.
ELEMENT_GROWTH = 3.0

#: Extended precision, in which elements and residuals are evaluated: 64 bits of mantissa on x86, 53 where a platform
#: has no more; estimates of rounding follow.
EXTENDED_DTYPE = np.longdouble

#: Relative rounding of a displacement at which refinement stops.
REFINED_ROUNDING = 5e-14

#: Most corrections of a solution.
MOST_CORRECTIONS = 40

#: Relative error of a displacement from the twelve digits of a unit problem's aspect ratio, whose cube it may contain.
ASPECT_ROUNDING = 2e-12

#: Largest ratio of the sides of a body that bends, see `_largest_ratio`. Beyond some ratio the corrections do not
#: converge; which one depends on the processor's arithmetic. On all that were tried it is at least 15 % above this one.
MOST_BENT_RATIO = 7000.0

#: Relative shift of a matrix's diagonal before it is factorized.
DIAGONAL_SHIFT = 1e-15

#: Approximate number of points of the returned field.
FIELD_POINTS = 3000

SLENDER_REASON = "such slender shapes are for beam theory"


class ReferenceNotConvergedError(RuntimeError):
    """The error estimate of a reference stays above its tolerance."""


@dataclass(frozen=True)
class ReferenceSolution(BeamField):
    """Converged displacements of a beam, with `rotation` [rad] and `strain` [1] as limits of small strain."""

    rotation: float
    strain: float
    unknowns: int

    def scaled(self, factor: float, length: float = 1.0) -> "ReferenceSolution":
        """Scale displacements by `factor` and the beam by `length` [1]: small strain is linear."""
        names = {"displacement": factor, "mean_displacement": factor, "displacements": factor, "x": length, "y": length}
        names |= {"rotation": abs(factor) / length, "strain": abs(factor) / length}
        return replace(self, **{name: getattr(self, name) * by for name, by in names.items()})


def solve_small_strain(
    beam: Beam, material: Material, force: float, tolerance: float = 1e-4, kind: LoadKind = AXIAL
) -> ReferenceSolution:
    r"""Solve a beam under a load [N], axial tension positive, by hp finite elements at small strain.

    The mean displacement of the loaded side is twice the elastic energy over the force. The spaces of levels are
    nested, so its values :math:`J_p` rise towards the exact one (Ritz), and the error is the sum of all later steps.
    With :math:`u \sim r^\lambda` at a corner one more layer scales the missing energy of the innermost element by
    :math:`.2^{2\lambda}`, one more degree similarly. For a clamped edge that meets a free one at a right angle (M.
    Williams, J. Appl. Mech. 19:526, 1952)

    .. math:: \sin^2(\lambda\pi/2) = \frac{4}{(3-\nu)(1+\nu)} - \frac{1+\nu}{3-\nu}\lambda^2,

    so lambda = .69 at nu = .5 and .76 at .3, factors of .11 and .09; measured .07 to .12. While each step is at most
    half of the last, all later ones together are at most the last one, which is the error estimate; steps must be seen
    to halve. It exceeds the true error some tenfold.

    The middle of a pressed side is no energy. Its own last step counts, too, but its steps change sign, and one may be
    small by chance: the estimate is no bound then. Of 540 bodies with aspect ratios from .2 to 30 the error exceeds it
    in eight, at worst 2e-7 instead of 5e-9. All errors are below 2e-5 at the tolerance 1e-4.
    """
    if not kind.mirrored:
        raise ValueError(f"supports of '{kind}' are not symmetric; half of a beam is solved")
    length, displacement = unit_scales(beam, material, kind)
    return solve_unit(*unit_problem(beam, material, kind), tolerance).scaled(force * displacement, length)


def solve_unit(aspect_ratio: float, nu: float, kind: LoadKind, tolerance: float = 1e-4) -> ReferenceSolution:
    """Solve a beam of height 2 with E = 1 under traction 1, see `springtune.reference.answers`."""
    level, estimate = _converge(aspect_ratio, nu, kind, tolerance)
    x, y, field = level.field()
    limits = rotation_and_strain(x, y, field)
    return ReferenceSolution(level.measured, level.displacement, estimate, x, y + 1.0, field, *limits, level.unknowns)


def _converge(aspect_ratio: float, nu: float, kind: LoadKind, tolerance: float) -> tuple["UnitLevel", float]:
    """First level whose error estimate meets the tolerance, and the estimate."""
    values, middle, slenderness = [], 0.0, _bending_ratio(aspect_ratio, kind)
    for degree in range(FIRST_LEVEL, LAST_LEVEL + 1):
        where = f"{kind} reference, {aspect_ratio:.6g} times as long as high, nu = {nu:g}: relative"
        if slenderness > (most := _largest_ratio(nu, degree)) * (1 + 1e-9):  # the ratio is rounded
            why = f"is unknown at level {degree} if a body that bends has sides of more than {most:.0f} : 1"
            raise ReferenceNotConvergedError(f"{where} rounding error {why}; {SLENDER_REASON}")
        level = UnitLevel(2 * aspect_ratio, nu, degree, kind)  # in half heights
        at = f"at level {degree} ({level.unknowns} unknowns)"
        if not level.round_off <= tolerance:
            missed = f"rounding error {level.round_off:.1e} {at}, the tolerance is {tolerance:.1e}"
            raise ReferenceNotConvergedError(f"{where} {missed}; {SLENDER_REASON}")
        values.append(level.displacement)
        middle, middle_before = level.measured, middle
        if len(values) < 3:
            continue
        before, last = np.abs(np.diff(values[-3:])) / level.displacement
        # The middle of a pressed side is no energy: its own step counts, too.
        estimate = float(max(last, abs(middle - middle_before) / middle) + level.round_off + ASPECT_ROUNDING)
        if estimate <= tolerance and (last <= before / 2 or before <= level.round_off):
            return level, estimate
    missed = f"error estimate {estimate:.1e} {at}, the last one"
    raise ReferenceNotConvergedError(f"{where} {missed}, the tolerance is {tolerance:.1e}")


def _bending_ratio(aspect_ratio: float, kind: LoadKind) -> float:
    """Length of the bending side over that of the side along the force; 0 if supports on one resist the force."""
    if any(side.axis == kind.axis and kind.axis in axes for side, axes in kind.held):
        return 0.0
    return aspect_ratio if kind.axis == 1 else 1 / aspect_ratio


def _largest_ratio(nu: float, degree: int) -> float:
    """Return the largest ratio of sides that a level can solve."""
    return MOST_BENT_RATIO * min(1.0, 2 * (1 + nu)) ** 0.5 * (2 / 3) ** max(degree - 6, 0)


class UnitLevel:
    r"""Half of a beam of height 2 with E = 1 under traction 1, solved on one level.

    `length` is over half the height [1]. `displacement` is the loaded side's mean along the force, `measured` the
    displacement of the load, and `round_off` bounds the relative rounding error of both [1]. The basis is a product of
    one along x and one along y, so matrices are Kronecker products.

    In double precision a slender cantilever loses digits with the fourth power of its aspect ratio. So conjugate
    gradients refine the solution with residuals :math:`r = l - A u` in extended precision (Higham, Accuracy and
    Stability of Numerical Algorithms, 2002, chapter 12). These come from strains, stresses and forces, not from the
    matrix :math:`A = B^T C B`: large displacements then cancel once, in the strains. The energy is

    .. math:: l^T A^{-1} l = l^T u + u^T r + r^T A^{-1} r,

    of which the last term is left out; its size follows from the factor. A count of operations times the unit round-off
    bounds each rounding (section 3.1), and the displacement's by that times the work :math:`|\sigma|^T |B| |u|`.
    `round_off` is the sum of both.
    """

    def __init__(self, length: float, nu: float, degree: int, kind: LoadKind = AXIAL) -> None:
        self._grid = grid = _Grid(length, degree, kind)
        solution, energy, measured, self.round_off = grid.solve(nu)
        self.displacement = energy / (length / 2 if kind.along == 0 else 1.0)  # over the half of the side
        self.unknowns = len(solution)
        self._coefficients = grid.fields(solution)
        self.measured = self.displacement if measured is None else measured

    def displacements(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return displacements on a grid, shape (n_x, n_y, 2); x from 0 to the length, y from -1 to 1 [1]."""
        signs, places, at_x, at_y = self._grid.values(x, y)
        parts = ((at_x @ part @ at_y.T)[places] for part in self._coefficients)
        return np.stack([sign * part for sign, part in zip(signs, parts)], axis=2)

    def field(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return x from 0 to the length, y from -1 to 1, and displacements (n_x, n_y, 2) on the output grid [1]."""
        x, y = self._grid.plot_points
        return x, y, self.displacements(x, y)


@lru_cache(maxsize=2 * LAST_LEVEL)  # grids are shared by references that differ in Poisson's ratio alone
class _Grid:
    """Elements of one level, and the parts of its matrix and load that do not depend on Poisson's ratio."""

    def __init__(self, length: float, degree: int, kind: LoadKind) -> None:
        self._length, self._kind = length, kind
        self._x, self._y = (_Line(points, degree) for points in _element_ends(length, degree, kind))
        self._unknowns = self._free_unknowns()
        self._direct, self._lateral, self._shear = self._matrices()
        self._split = len(self._unknowns[0][0]) * len(self._unknowns[0][1])
        # Along x and along y factors of the integrals over the loaded side of what moves along the force.
        lines, numbers = (self._x, self._y), self._unknowns[kind.axis]
        loaded, across = [line.integrals[of] for line, of in zip(lines, numbers)], lines[kind.normal]
        loaded[kind.normal] = numbers[kind.normal] == (across.last if kind.loaded.far else across.first)
        self.load = self._along_force(np.kron(*loaded))
        self.middle = None
        if kind.pressed:
            # The middle of the side is the end of its half that lies on the axis of symmetry.
            line = lines[kind.along]
            loaded[kind.along] = numbers[kind.along] == (line.last if kind.cut.far else line.first)
            self.middle = self._along_force(np.kron(*loaded)).astype(float)

    def _free_unknowns(self) -> list[list[np.ndarray]]:
        """Unknowns of u_x and of u_y along x and along y, without clamps, rollers and symmetry."""
        ends = {LEFT: self._x.first, RIGHT: self._x.last, BOTTOM: self._y.first, TOP: self._y.last}
        lines = self._x, self._y
        held = [[[ends[side] for side, axes in self._kind.half_held if side.axis == across and axis in axes]
                 for across in range(2)] for axis in range(2)]  # fmt: skip
        return [[line.all[~np.isin(line.all, there)] for line, there in zip(lines, sides)] for sides in held]

    def _along_force(self, part: np.ndarray) -> np.ndarray:
        """Values of all unknowns; those across the force are zero."""
        parts = [np.zeros(len(along) * len(across), EXTENDED_DTYPE) for along, across in self._unknowns]
        parts[self._kind.axis][:] = part
        return np.concatenate(parts)

    def _matrices(self) -> tuple[csc_array, ...]:
        """Parts of the stiffness matrix: direct strains, lateral contraction, shear."""
        (first, second), x, y = self._unknowns, self._x, self._y

        def product(of_x: np.ndarray, of_y: np.ndarray, rows: list[np.ndarray], columns: list[np.ndarray]) -> coo_array:
            # Slices of so small matrices are cheaper dense.
            return kron(*(coo_array(of[np.ix_(*ends)]) for of, *ends in zip((of_x, of_y), rows, columns)))

        lateral, turning = product(x.mixed, y.mixed.T, first, second), product(x.mixed.T, y.mixed, first, second)
        along, across = product(x.slope, y.mass, first, first), product(x.mass, y.slope, second, second)
        of_first, of_second = product(x.mass, y.slope, first, first), product(x.slope, y.mass, second, second)
        direct, shear = [[along, None], [None, across]], [[of_first, turning], [turning.T, of_second]]
        return tuple(block_array(one, format="csc") for one in (direct, [[None, lateral], [lateral.T, None]], shear))

    def solve(self, nu: float) -> tuple[np.ndarray, float, float | None, float]:
        """Return unknowns, energy, displacement of a pressed side's middle or None, and the relative rounding error."""
        one = EXTENDED_DTYPE(1)
        direct, shear = one / (1 - one * nu * nu), one / (2 * (1 + one * nu))
        matrix = float(direct) * (self._direct + nu * self._lateral) + float(shear) * self._shear
        # Rounding must not make the factor of a slender beam an indefinite one.
        factor, load = factorize(matrix + DIAGONAL_SHIFT * diags_array(matrix.diagonal())), self.load
        solution = factor.solve(load.astype(float)).astype(EXTENDED_DTYPE)
        # Roundings of a term: entries, products along x and y there and back, moduli, sums and the load.
        unit = (8 * self._x.degree + 30) * float(np.finfo(EXTENDED_DTYPE).eps)
        direction, before, norm, softest = 0.0, np.inf, 0.0, 1.0
        for _ in range(MOST_CORRECTIONS):
            forces, work = self._forces(solution, direct, nu, shear)
            residual = load - forces
            correction = factor.solve(residual.astype(float))
            gain, size = residual @ correction, load @ solution
            lacking = 2 * abs(float(gain / size / softest))
            rounding = float(unit * work / size)
            enough = max(REFINED_ROUNDING, rounding)
            if not lacking > enough:
                break
            turn = gain / before
            direction, norm, before = correction + turn * direction, gain + turn**2 * norm, gain
            curvature = direction @ self._forces(direction, direct, nu, shear)[0]
            solution, softest = solution + gain / curvature * direction, min(softest, curvature / norm)
        # What is lacking below `enough` is itself rounding, another one on another processor.
        round_off = rounding + max(lacking, enough) + 2 * np.finfo(float).eps
        energy, refined = float(load @ solution + solution @ residual), (solution + correction).astype(float)
        if self.middle is None:
            return refined, energy, None, round_off
        # Not the energy: its error is the rounded forces' work on the displacements under a unit force there.
        measured = float(self.middle @ refined)
        _, work = self._forces(solution, direct, nu, shear, factor.solve(self.middle).astype(EXTENDED_DTYPE))
        return refined, energy, measured, max(round_off, float(unit * work / measured))

    def _forces(
        self, solution: np.ndarray, direct: np.floating, nu: float, shear: np.floating, other: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.floating]:
        """Return internal forces in extended precision, and the unsigned work of stresses on strains.

        Never by the matrix: so only the large displacements of a slender beam cancel, not its forces.
        """
        u, v = self.fields(solution)
        (x, x_slope), (y, y_slope) = self._x.series, self._y.series
        weights = np.multiply.outer(self._x.weights, self._y.weights)
        xx, yy, xy = x_slope @ u @ y.T, x @ v @ y_slope.T, x @ u @ y_slope.T + x_slope @ v @ y.T
        stresses = direct * (xx + nu * yy), direct * (yy + nu * xx), shear * xy
        of_x, of_y, turned = (weights * stress for stress in stresses)
        forces = x_slope.T @ of_x @ y + x.T @ turned @ y_slope, x.T @ of_y @ y_slope + x_slope.T @ turned @ y
        u, v = (np.abs(part) for part in (self.fields(other) if other is not None else (u, v)))
        x, x_slope, y, y_slope = (abs(part) for part in (x, x_slope, y, y_slope))
        terms = x_slope @ u @ y.T, x @ v @ y_slope.T, x @ u @ y_slope.T + x_slope @ v @ y.T
        xx, yy, xy = (np.abs(strain) for strain in (xx, yy, xy))
        sizes = direct * (xx + abs(nu) * yy), direct * (yy + abs(nu) * xx), shear * xy
        work = sum((weights * size * term).sum() for size, term in zip(sizes, terms))
        return np.concatenate([part[np.ix_(*ends)].ravel() for part, ends in zip(forces, self._unknowns)]), work

    def fields(self, solution: np.ndarray) -> np.ndarray:
        """Coefficients of all products of polynomials, shape (2, n along x, n along y)."""
        fields = np.zeros((2, len(self._x.all), len(self._y.all)), solution.dtype)
        for field, ends, part in zip(fields, self._unknowns, (solution[: self._split], solution[self._split :])):
            field[np.ix_(*ends)] = part.reshape(len(ends[0]), -1)
        return fields

    def values(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, ...], np.ndarray, np.ndarray]:
        """Return signs of the displacements on a grid, places of its points in the half, and matrices along x and y."""
        signs = np.ones((2, len(x), len(y)))
        odd = 1 - self._kind.axis
        if self._kind.along == 0:
            signs[odd] = np.sign(self._length / 2 - x)[:, None]
            x, y = np.minimum(x, self._length - x), y + 1
        else:
            signs[odd] = np.sign(y)
            y = np.abs(y)
        (x, of_x), (y, of_y) = (np.unique(points, return_inverse=True) for points in (x, y))
        return signs, np.ix_(of_x, of_y), self._x.values(x), self._y.values(y)

    @cached_property
    def plot_points(self) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates along x and y of the points of the returned field."""
        spacing = (2 * self._length / FIELD_POINTS) ** 0.5
        x, half = _plot_points(self._length / 2, spacing), 1 - _plot_points(1.0, spacing)[::-1]
        return np.concatenate([x, self._length - x[-2::-1]]), np.concatenate([-half[:0:-1], half])


class _Line:
    r"""Polynomials of one degree on the elements of a line, and their matrices, in extended precision.

    Those of an element's ends and :math:`\sqrt{(2k - 1)/2} \int_{-1}^{\xi} P_{k-1}`, k = 2 to the degree (Szabo and
    Babuska, Finite Element Analysis, 1991, section 3.1). `mass`, `slope` and `mixed` are the integrals of v w, v' w'
    and v' w (v: row, w: column), `integrals` those of v.
    """

    def __init__(self, points: np.ndarray, degree: int) -> None:
        self.points, self.degree = points, degree
        count, size = len(points) - 1, degree + 1
        # Element after element: its first end, its inner polynomials; the last end is the next one's first.
        self._numbers = degree * np.arange(count)[:, None] + np.array([0, degree, *range(1, degree)])
        self.all = np.arange(count * degree + 1)
        self.first, self.last = self.all[0], self.all[-1]
        # Of values and slopes, on an element from -1 to 1, the coefficients of Legendre polynomials.
        self._value, slope = np.zeros((2, size, size), EXTENDED_DTYPE)
        self._value[:2, :2] = [[0.5, -0.5], [0.5, 0.5]]
        slope[:2, 0] = [-0.5, 0.5]
        for k in range(2, size):
            norm = np.sqrt(EXTENDED_DTYPE(2 * k - 1) / 2)
            self._value[k, [k, k - 2]] = norm / (2 * k - 1), -norm / (2 * k - 1)
            slope[k, k - 1] = norm
        half = np.diff(points.astype(EXTENDED_DTYPE)) / 2
        # The same of the whole line, element after element, and the integrals of the polynomials' squares.
        terms = np.repeat(np.arange(count * size).reshape(count, 1, size), size, axis=1).ravel()
        numbers = np.repeat(self._numbers, size)
        ones = np.ones_like(half)
        self.series = value, slope = [
            csr_array((np.multiply.outer(by, of).ravel(), (terms, numbers)), shape=(count * size, len(self.all)))
            for by, of in ((ones, self._value), (1 / half, slope))
        ]
        self.weights = np.multiply.outer(half, 2 / (2 * np.arange(size, dtype=EXTENDED_DTYPE) + 1)).ravel()
        weighted = [self.weights[:, None] * of.toarray() for of in (value, slope)]
        pairs = (value, weighted[0]), (slope, weighted[1]), (slope, weighted[0])
        self.mass, self.slope, self.mixed = (np.asarray(of.T @ by, float) for of, by in pairs)
        self.integrals = value.T @ (self.weights * (np.arange(count * size) % size == 0))

    def values(self, points: np.ndarray) -> np.ndarray:
        """Matrix that takes coefficients to values at points of the line."""
        element = np.clip(np.searchsorted(self.points, points, side="right") - 1, 0, len(self.points) - 2)
        start, end = self.points[element], self.points[element + 1]
        local = ((points - start) - (end - points)) / (end - start)
        found = np.zeros((len(points), len(self.all)))
        found[np.arange(len(points))[:, None], self._numbers[element]] = legvander(
            local, self.degree
        ) @ self._value.T.astype(float)
        return found


def _element_ends(length: float, layers: int, kind: LoadKind) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the elements of half a beam along x and along y."""
    if kind.along == 0:  # the left half, from y = 0 to 2
        return _graded(length / 2, min(length / 2, 1.0), layers), _graded_both(2.0, layers)
    # The upper half; its free edge, where corners are, is at y = 1. At an end that is pulled evenly and not held there
    # is no singularity to grade towards.
    reach = min(length, 1.0)
    pulled = kind.direct and all(side == LEFT for side, _ in kind.held)
    along = _graded(length, reach, layers) if pulled else _graded_both(length, layers)
    return along, 1 - _graded(1.0, reach, layers)[::-1]


def _graded(length: float, reach: float, layers: int) -> np.ndarray:
    """Ends of elements from 0 to length: `layers` that shrink towards 0 within its reach, and few beyond."""
    near = reach * SHRINKAGE ** np.arange(layers - 1, -1, -1.0)
    count = ceil(log(length / reach, ELEMENT_GROWTH))  # none where the reach is the length
    return np.concatenate([[0.0], near, np.geomspace(reach, length, count + 1)[1:]])


def _graded_both(length: float, layers: int) -> np.ndarray:
    """Ends of elements from 0 to length, as `_graded` towards either end."""
    half = _graded(length / 2, min(length / 2, 1.0), layers)
    return np.concatenate([half, length - half[-2::-1]])


def _plot_points(length: float, spacing: float) -> np.ndarray:
    """Points from 0 to length, evenly spaced but for the first interval, which is halved repeatedly towards 0."""
    even = np.linspace(0, length, max(2, ceil(length / spacing)) + 1)
    return np.concatenate([[0.0], even[1] / [16, 8, 4, 2], even[1:]])

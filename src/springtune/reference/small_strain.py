"""Reference for a beam under traction: linear elasticity at small strain, plane stress, by finite elements.

::

          ____________________________ ->
        //|                            |->
        //|                            |->   force / (height * thickness) on every point of the right end
        //|- - - - - - - - - - - - - - |->   axis of symmetry: only the upper half is solved
        //|                            |->
        //|____________________________|->
       u = 0                        mean of u_x

The stress is singular where the clamp meets the free edges, the more so the larger Poisson's ratio, and quadratic
elements of even size creep towards the answer. The elements here are rectangles whose sides shrink geometrically
towards those corners, and their polynomial degree grows with the number of layers: the error then falls exponentially
(hp version), to 1e-6 with some thousand unknowns.
"""

from dataclasses import dataclass, replace
from math import ceil, log

import numpy as np
from scipy.sparse import block_array, csc_array, kron
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementLinePp, LinearForm, MeshLine

from ..geometry import Beam
from ..materials import Material

#: First and last level tried. Level p has polynomials of degree p and p layers of elements at a corner.
FIRST_LEVEL, LAST_LEVEL = 3, 8

#: Size of a layer of elements over that of the next one outwards. In one dimension (sqrt(2) - 1)^2 = .17 is best (Gui,
#: Babuska 1986); of .1, .15, .2 and .3, .2 has the least error here.
SHRINKAGE = 0.2

#: Largest ratio of neighbouring elements away from the corners, where the solution is smooth.
GROWTH = 3.0

#: Round-off of a displacement, relative, is below this times (1 + aspect ratio squared): measured with nu = 0, where
#: every level contains the exact answer.
ROUND_OFF = 5e-11

#: Number of points of the field that is handed out, about.
FIELD_POINTS = 3000


class ReferenceNotConvergedError(RuntimeError):
    """The error estimate of a reference stays above its tolerance."""


@dataclass(frozen=True)
class ReferenceSolution:
    """Converged displacements of a beam.

    Attributes
    ----------
    displacement : float
        Mean axial displacement of the right end [m], positive in tension.
    error_estimate : float
        Bound on the relative error of `displacement` [1].
    points : ndarray of float, shape (n_points, 2)
        Where the field is given [m]; closer to each other near the clamp and the free edges.
    triangles : ndarray of int, shape (n_triangles, 3)
        Counter-clockwise triangulation of the points, for plots and for interpolation. It is not the mesh of the
        solution: that has few, large elements of high degree.
    displacements : ndarray of float, shape (n_points, 2)
        Displacement at the points [m].
    unknowns : int
        Number of unknowns of the finest level, of the half that is solved.
    """

    displacement: float
    error_estimate: float
    points: np.ndarray
    triangles: np.ndarray
    displacements: np.ndarray
    unknowns: int

    def scaled(self, factor: float) -> "ReferenceSolution":
        """The solution under `factor` times the force; exact, since small strain is linear."""
        return replace(self, displacement=self.displacement * factor, displacements=self.displacements * factor)


def solve_small_strain(beam: Beam, material: Material, force: float, tolerance: float = 1e-4) -> ReferenceSolution:
    r"""Displacements of a beam clamped at its left end and pulled at its right end.

    Parameters
    ----------
    beam : Beam
        Rectangle and thickness [m].
    material : Material
        Young's modulus [Pa] and Poisson's ratio [1], -1 < nu <= 0.5.
    force : float
        Force [N], spread evenly over the right end; positive in tension.
    tolerance : float
        Largest relative error estimate to accept [1].

    Returns
    -------
    ReferenceSolution

    Raises
    ------
    ValueError
        If Poisson's ratio is outside its range.
    ReferenceNotConvergedError
        If the last level does not meet the tolerance.

    Notes
    -----
    Lengths over half the height and stresses over the traction leave a problem of the aspect ratio and of nu alone, so
    the displacement is exactly proportional to ``force / (E t)``.

    The mean displacement of the loaded end is twice the elastic energy over the force. The spaces of successive levels
    are nested, so its values :math:`J_p` rise towards the exact :math:`J` (Ritz), and what is missing is the sum of all
    later steps :math:`d_p = J_p - J_{p-1}`. These fall geometrically: with :math:`u \sim r^\lambda` at a corner one
    more layer takes the energy that the innermost element cannot represent down by :math:`.2^{2\lambda}`, and one more
    degree that of the other elements by much the same. For a clamped edge that meets a free one at a right angle
    (Williams 1952)

    .. math:: \sin^2(\lambda\pi/2) = \frac{4}{(3-\nu)(1+\nu)} - \frac{1+\nu}{3-\nu}\lambda^2,

    so lambda = .69 at nu = .5 and .76 at .3, factors of .11 and .09; measured .07 to .12. As long as a step is at most
    half of the one before, all later steps together are at most the last one: that step is the error estimate, and a
    solution is taken only where the steps are seen to halve. It exceeds the true error some tenfold.

    Examples
    --------
    >>> from springtune.geometry import Beam
    >>> from springtune.materials import Material
    >>> solution = solve_small_strain(Beam("200x40", 0.2, 0.04, 0.001), Material("steel", 210e9, 0.3), 400e3)
    >>> round(solution.displacement * 1e3, 3)
    9.501
    """
    nu = material.poisson_ratio
    if not -1 < nu <= 0.5:
        raise ValueError(f"Poisson's ratio of {material.name!r} is {nu}: isotropic materials have -1 < nu <= 0.5")
    level, estimate = _converge(2 * beam.length / beam.height, nu, tolerance, f"{beam.name}, {material.name}")
    points, triangles, field = level.field()
    scale = force / (2 * material.young_modulus * beam.thickness)
    half_height = beam.height / 2
    return ReferenceSolution(
        displacement=scale * level.displacement,
        error_estimate=estimate,
        points=half_height * (points + np.array([0.0, 1.0])),
        triangles=triangles,
        displacements=scale * field,
        unknowns=level.unknowns,
    )


def _converge(length, nu, tolerance, name):
    """First level whose error estimate meets the tolerance, and the estimate."""
    round_off = ROUND_OFF * (1 + length**2 / 4)  # the length is in half heights
    values = []
    for degree in range(FIRST_LEVEL, LAST_LEVEL + 1):
        level = UnitLevel(length, nu, degree)
        values.append(level.displacement)
        if len(values) < 3:
            continue
        before, last = np.abs(np.diff(values[-3:])) / level.displacement
        estimate = float(max(last, round_off))
        if estimate <= tolerance and (last <= before / 2 or before <= round_off):
            return level, estimate
    raise ReferenceNotConvergedError(
        f"reference of {name}: relative error estimate {estimate:.1e} at level {degree} ({level.unknowns} unknowns), "
        f"the last one, the tolerance is {tolerance:.1e}"
    )


class UnitLevel:
    """Upper half, of height 1, of a beam with E = 1 under traction 1, solved on one level.

    Parameters
    ----------
    length : float
        Length over half the height [1].
    nu : float
        Poisson's ratio [1].
    degree : int
        Level: degree of the polynomials along each axis, and number of layers at a corner.

    Attributes
    ----------
    displacement : float
        Mean axial displacement of the right end [1].
    unknowns : int
        Number of unknowns.

    Notes
    -----
    On a grid of rectangles the basis is the products of one along x and one along y, and the matrices in the plane are
    Kronecker products of those on the two lines: milliseconds, for any degree.
    """

    def __init__(self, length, nu, degree):
        reach = min(length, 1.0)
        self._x = x = _Line(_graded(length, reach, degree), degree)
        # Reversed: the singular corner is at y = 1, the axis of symmetry at y = 0.
        self._y = y = _Line(1 - _graded(1.0, reach, degree)[::-1], degree)
        # u_x vanishes on the clamp alone, u_y on the axis of symmetry also.
        free_x, free_y, all_y = x.all[x.all != x.first], y.all[y.all != y.first], y.all

        direct, shear = 1 / (1 - nu**2), 1 / (2 * (1 + nu))
        mass_x, slope_x, mixed_x = (_part(matrix, free_x, free_x) for matrix in (x.mass, x.slope, x.mixed))
        mass_y, slope_y = (_part(matrix, free_y, free_y) for matrix in (y.mass, y.slope))
        mixed_y, mixed_y_transposed = (_part(matrix, all_y, free_y) for matrix in (y.mixed, y.mixed.T))
        xx = direct * kron(slope_x, y.mass) + shear * kron(mass_x, y.slope)
        yy = direct * kron(mass_x, slope_y) + shear * kron(slope_x, mass_y)
        xy = nu * direct * kron(mixed_x, mixed_y_transposed) + shear * kron(mixed_x.T, mixed_y)
        matrix = block_array([[xx, xy], [xy.T, yy]], format="csc")

        end = (free_x == x.last).astype(float)
        load = np.concatenate([np.kron(end, y.integrals), np.zeros(yy.shape[0])])
        factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        solution = factor.solve(load)

        self.displacement = float(load @ solution)
        self.unknowns = len(load)
        self._coefficients = np.zeros((2, len(x.all), len(y.all)))
        split = len(free_x) * len(all_y)
        self._coefficients[0][free_x] = solution[:split].reshape(len(free_x), -1)
        self._coefficients[1][np.ix_(free_x, free_y)] = solution[split:].reshape(len(free_x), -1)

    def displacements(self, x, y):
        """Displacements on the grid of the coordinates x (0 to length) and y (-1 to 1), shape (n_x, n_y, 2)."""
        at_x, at_y = self._x.values(x), self._y.values(np.abs(y))
        axial, lateral = (at_x @ coefficients @ at_y.T for coefficients in self._coefficients)
        return np.stack([axial, np.sign(y) * lateral], axis=2)

    def field(self):
        """Points of the whole beam (y from -1 to 1), triangles and displacements; see `ReferenceSolution`."""
        length = self._x.points[-1]
        spacing = (2 * length / FIELD_POINTS) ** 0.5
        x = _plot_points(length, spacing)
        half = 1 - _plot_points(1.0, spacing)[::-1]
        y = np.concatenate([-half[:0:-1], half])
        points = np.stack(np.meshgrid(x, y, indexing="ij"), axis=2).reshape(-1, 2)
        corner = (np.arange(len(x) - 1)[:, None] * len(y) + np.arange(len(y) - 1)).ravel()
        right, up = corner + len(y), corner + 1
        opposite = right + 1
        # Diagonals are mirrored at the axis, as the solution is.
        lower = np.tile(y[:-1] < 0, len(x) - 1)[:, None]
        first = np.where(lower, np.stack([corner, right, up], 1), np.stack([corner, right, opposite], 1))
        second = np.where(lower, np.stack([right, opposite, up], 1), np.stack([corner, opposite, up], 1))
        return points, np.concatenate([first, second]), self.displacements(x, y).reshape(-1, 2)


class _Line:
    """Polynomials of one degree on the elements of a line, and their matrices.

    `mass`, `slope` and `mixed` hold the integrals of v w, v' w' and v' w (v: row, w: column), `integrals` those of v.
    """

    def __init__(self, points, degree):
        self.points, self.degree = points, degree
        basis = self._basis()
        self.mass, self.slope, self.mixed = (form.assemble(basis) for form in (_mass, _slope, _mixed))
        self.integrals = _integral.assemble(basis)
        self.all = np.arange(basis.N)
        # MeshLine numbers vertices as they are given.
        self.first, self.last = basis.nodal_dofs[0, [0, -1]]

    def _basis(self):
        return Basis(MeshLine(self.points), ElementLinePp(self.degree), intorder=2 * self.degree)

    def values(self, points):
        """Matrix that takes coefficients to values at points of the line."""
        basis = self._basis()
        # An ElementLinePp hands out its last values again when asked about as many other points: use a fresh one.
        basis.elem = ElementLinePp(self.degree)
        return basis.probes(points[None, :])


@BilinearForm
def _mass(u, v, _):
    return u * v


@BilinearForm
def _slope(u, v, _):
    return u.grad[0] * v.grad[0]


@BilinearForm
def _mixed(u, v, _):
    return u * v.grad[0]


@LinearForm
def _integral(v, _):
    return v


def _part(matrix, rows, columns):
    return csc_array(matrix)[rows][:, columns]


def _graded(length, reach, layers):
    """Ends of elements from 0 to length: `layers` that shrink towards 0 within its reach, and few beyond."""
    near = reach * SHRINKAGE ** np.arange(layers - 1, -1, -1.0)
    count = ceil(log(length / reach, GROWTH))  # none where the reach is the length
    return np.concatenate([[0.0], near, np.geomspace(reach, length, count + 1)[1:]])


def _plot_points(length, spacing):
    """Points from 0 to length, evenly spaced but for the first interval, which is halved some times towards 0."""
    even = np.linspace(0, length, max(2, ceil(length / spacing)) + 1)
    return np.concatenate([[0.0], even[1] / [16, 8, 4, 2], even[1:]])

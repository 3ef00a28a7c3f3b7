"""Reference for a beam: linear elasticity at small strain, plane stress, by finite elements.

Kinds of load are those of `springtune.loads`. Of each beam half is solved; the dashed line is its axis of symmetry or
antisymmetry::

        axial                          bending                            shear
          ____________________ ->        ____________________            o  o  o  o  o  o
        //|                  |->       //|                  |^          +-------:-------+ ->
        //|- - - - - - - - - |->       //|- - - - - - - - - ||          |       :       | ->
        //|__________________|->       //|__________________||          +-------:-------+
                                                                        ///////////////

The kind ``"face"`` is that of shear with a force along y and no rollers, symmetric.

The stress is singular where a clamp meets a free edge, the more so the larger Poisson's ratio, and quadratic elements
of even size creep towards the answer. The elements here are rectangles whose sides shrink geometrically towards the
corners, and their polynomial degree grows with the number of layers: the error then falls exponentially (hp version),
to 1e-6 with some thousand unknowns.
"""

from dataclasses import dataclass, replace
from math import ceil, log

import numpy as np
from scipy.sparse import block_array, csc_array, kron
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementLinePp, LinearForm, MeshLine

from ..geometry import Beam
from ..loads import KINDS
from ..materials import Material
from .field import interpolate

#: First and last level tried. Level p has polynomials of degree p and p layers of elements at a corner.
FIRST_LEVEL, LAST_LEVEL = 3, 8

#: Size of a layer of elements over that of the next one outwards. In one dimension (sqrt(2) - 1)^2 = .17 is best (Gui,
#: Babuska 1986); of .1, .15, .2 and .3, .2 has the least error here.
SHRINKAGE = 0.2

#: Largest ratio of neighbouring elements away from the corners, where the solution is smooth.
GROWTH = 3.0

#: Round-off of a displacement, relative, is below this times (1 + aspect ratio squared), its fourth power in bending:
#: measured with nu = 0, where every level contains the exact answer, and by levels far beyond convergence.
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
        Mean displacement of the loaded side along the force [m]; of a face, that of its middle.
    mean_displacement : float
        Mean displacement of the loaded side along the force [m].
    error_estimate : float
        Bound on the relative error of `displacement` [1].
    x : ndarray of float, shape (n_x,)
    y : ndarray of float, shape (n_y,)
        Coordinates of a grid on which the field is given [m]; closer to each other near the outline.
    displacements : ndarray of float, shape (n_x, n_y, 2)
        Displacement there [m].
    unknowns : int
        Number of unknowns of the finest level, of the half that is solved.
    """

    displacement: float
    mean_displacement: float
    error_estimate: float
    x: np.ndarray
    y: np.ndarray
    displacements: np.ndarray
    unknowns: int

    def scaled(self, factor: float) -> "ReferenceSolution":
        """The solution under `factor` times the force; exact, since small strain is linear."""
        names = ("displacement", "mean_displacement", "displacements")
        return replace(self, **{name: getattr(self, name) * factor for name in names})

    def at(self, points: np.ndarray) -> np.ndarray:
        """Displacements at points of the beam [m], shape (n, 2); see `springtune.reference.field.interpolate`."""
        return interpolate(self.x, self.y, self.displacements, points)


def solve_small_strain(
    beam: Beam, material: Material, force: float, tolerance: float = 1e-4, kind: str = "axial"
) -> ReferenceSolution:
    r"""Displacements of a beam under a load.

    Parameters
    ----------
    beam : Beam
        Rectangle and thickness [m].
    material : Material
        Young's modulus [Pa] and Poisson's ratio [1], -1 < nu <= 0.5.
    force : float
        Force [N], spread evenly over the loaded side; axial ones are positive in tension.
    tolerance : float
        Largest relative error estimate to accept [1].
    kind : str
        Kind of load, one of `springtune.loads.KINDS`.

    Returns
    -------
    ReferenceSolution

    Raises
    ------
    ValueError
        If Poisson's ratio is outside its range, or the kind of load unknown.
    ReferenceNotConvergedError
        If the last level does not meet the tolerance.

    Notes
    -----
    Lengths over half the height and stresses over the traction leave a problem of the aspect ratio and of nu alone, so
    the displacement is exactly proportional to ``force / (E t)``.

    The mean displacement of the loaded side is twice the elastic energy over the force. The spaces of successive levels
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
    if kind not in KINDS:
        raise ValueError(f"unknown kind of load {kind!r}; known: {', '.join(KINDS)}")
    name = f"{beam.name}, {material.name}"
    level, estimate = _converge(2 * beam.length / beam.height, nu, tolerance, name, kind)
    half_height = beam.height / 2
    side = beam.length if kind in ("shear", "face") else beam.height
    scale = half_height * force / (side * beam.thickness * material.young_modulus)
    x, y, field = level.field()
    return ReferenceSolution(
        displacement=scale * level.measured,
        mean_displacement=scale * level.displacement,
        error_estimate=estimate,
        x=half_height * x,
        y=half_height * (y + 1.0),
        displacements=scale * field,
        unknowns=level.unknowns,
    )


def _converge(length, nu, tolerance, name, kind):
    """First level whose error estimate meets the tolerance, and the estimate."""
    aspect_ratio = length / 2  # the length is in half heights
    round_off = ROUND_OFF * (1 + aspect_ratio ** (4 if kind == "bending" else 2))
    values, middle = [], 0.0
    for degree in range(FIRST_LEVEL, LAST_LEVEL + 1):
        level = UnitLevel(length, nu, degree, kind)
        values.append(level.displacement)
        middle, middle_before = level.measured, middle
        if len(values) < 3:
            continue
        before, last = np.abs(np.diff(values[-3:])) / level.displacement
        # The middle of a face is no energy: its own step counts, too.
        estimate = float(max(last, abs(middle - middle_before) / middle, round_off))
        if estimate <= tolerance and (last <= before / 2 or before <= round_off):
            return level, estimate
    raise ReferenceNotConvergedError(
        f"reference of {name}: relative error estimate {estimate:.1e} at level {degree} ({level.unknowns} unknowns), "
        f"the last one, the tolerance is {tolerance:.1e}"
    )


class UnitLevel:
    """Half of a beam of height 2 with E = 1 under traction 1, solved on one level.

    Parameters
    ----------
    length : float
        Length over half the height [1].
    nu : float
        Poisson's ratio [1].
    degree : int
        Level: degree of the polynomials along each axis, and number of layers at a corner.
    kind : str
        Kind of load, one of `springtune.loads.KINDS`.

    Attributes
    ----------
    displacement : float
        Mean displacement of the loaded side along the force [1].
    measured : float
        The displacement of the load: as `displacement`, of a face that of its middle.
    unknowns : int
        Number of unknowns.

    Notes
    -----
    On a grid of rectangles the basis is the products of one along x and one along y, and the matrices in the plane are
    Kronecker products of those on the two lines: milliseconds, for any degree. Each side is held as a whole, so the
    unknowns of a component are products of those on the lines, too.
    """

    def __init__(self, length, nu, degree, kind="axial"):
        self._length, self._kind = length, kind
        if kind in ("shear", "face"):  # the left half, from y = 0 to 2
            along, across = _graded(length / 2, min(length / 2, 1.0), degree), _graded_both(2.0, degree)
        else:  # the upper half; its free edge, where corners are, is at y = 1
            reach = min(length, 1.0)
            along = _graded(length, reach, degree) if kind == "axial" else _graded_both(length, degree)
            across = 1 - _graded(1.0, reach, degree)[::-1]
        self._x, self._y = x, y = _Line(along, degree), _Line(across, degree)
        # Unknowns of u_x and of u_y along x and along y: what clamp, rollers and symmetry leave.
        x_held, y_held = {
            "axial": (((x.first,), ()), ((x.first,), (y.first,))),
            "bending": (((x.first,), (y.first,)), ((x.first,), ())),
            "shear": (((), (y.first,)), ((x.last,), (y.first, y.last))),
            "face": (((x.last,), (y.first,)), ((), (y.first,))),
        }[kind]
        (x_1, y_1), (x_2, y_2) = (
            [line.all[~np.isin(line.all, ends)] for line, ends in zip((x, y), sides)] for sides in (x_held, y_held)
        )
        direct, shear = 1 / (1 - nu**2), 1 / (2 * (1 + nu))

        def product(of_x, of_y, rows, columns):
            return kron(_part(of_x, rows[0], columns[0]), _part(of_y, rows[1], columns[1]))

        first, second = (x_1, y_1), (x_2, y_2)
        xx = direct * product(x.slope, y.mass, first, first) + shear * product(x.mass, y.slope, first, first)
        yy = direct * product(x.mass, y.slope, second, second) + shear * product(x.slope, y.mass, second, second)
        xy = nu * direct * product(x.mixed, y.mixed.T, first, second)
        xy = xy + shear * product(x.mixed.T, y.mixed, first, second)
        matrix = block_array([[xx, xy], [xy.T, yy]], format="csc")

        load = np.zeros(matrix.shape[0])
        split = len(x_1) * len(y_1)
        if kind == "axial":
            load[:split] = np.kron(x_1 == x.last, y.integrals[y_1])
        elif kind == "bending":
            load[split:] = np.kron(x_2 == x.last, y.integrals[y_2])
        elif kind == "shear":
            load[:split] = np.kron(x.integrals[x_1], y_1 == y.last)
        else:
            load[split:] = np.kron(x.integrals[x_2], y_2 == y.last)
        factor = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        solution = factor.solve(load)

        self.displacement = float(load @ solution) / (length / 2 if kind in ("shear", "face") else 1.0)
        self.unknowns = len(load)
        self._coefficients = np.zeros((2, len(x.all), len(y.all)))
        self._coefficients[0][np.ix_(x_1, y_1)] = solution[:split].reshape(len(x_1), -1)
        self._coefficients[1][np.ix_(x_2, y_2)] = solution[split:].reshape(len(x_2), -1)
        self.measured = self.displacement
        if kind == "face":
            self.measured = float(self.displacements(np.array([length / 2]), np.array([1.0]))[0, 0, 1])

    def displacements(self, x, y):
        """Displacements on the grid of the coordinates x (0 to length) and y (-1 to 1), shape (n_x, n_y, 2)."""
        signs = np.ones((2, len(x), len(y)))
        if self._kind in ("shear", "face"):
            signs[1 if self._kind == "shear" else 0] = np.sign(self._length / 2 - x)[:, None]
            x, y = np.minimum(x, self._length - x), y + 1
        else:
            signs[0 if self._kind == "bending" else 1] = np.sign(y)
            y = np.abs(y)
        at_x, at_y = self._x.values(x), self._y.values(y)
        return np.stack([sign * (at_x @ part @ at_y.T) for sign, part in zip(signs, self._coefficients)], axis=2)

    def field(self):
        """Coordinates along x (0 to length) and y (-1 to 1) of a grid, and displacements; see `ReferenceSolution`."""
        spacing = (2 * self._length / FIELD_POINTS) ** 0.5
        x, half = _plot_points(self._length / 2, spacing), 1 - _plot_points(1.0, spacing)[::-1]
        x = np.concatenate([x, self._length - x[-2::-1]])
        y = np.concatenate([-half[:0:-1], half])
        return x, y, self.displacements(x, y)


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


def _graded_both(length, layers):
    """Ends of elements from 0 to length, as `_graded` towards either end."""
    half = _graded(length / 2, min(length / 2, 1.0), layers)
    return np.concatenate([half, length - half[-2::-1]])


def _plot_points(length, spacing):
    """Points from 0 to length, evenly spaced but for the first interval, which is halved some times towards 0."""
    even = np.linspace(0, length, max(2, ceil(length / spacing)) + 1)
    return np.concatenate([[0.0], even[1] / [16, 8, 4, 2], even[1:]])

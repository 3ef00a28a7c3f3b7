"""Mechanics of networks written a second time, to audit the library's.

Energies are those of the definitions' papers, in plain differences of positions; the library takes everything from
displacements, in forms that keep digits. Digits come from the 80-bit numbers in which forces are evaluated here.
Tangents are complex-step derivatives of the forces (no differences, so exact to rounding), factors LAPACK's of band
matrices, and eigenvalues those of dense matrices or Rayleigh quotients in 80 bits: nothing of the library's assembly,
ordering, factorizations or pivots is used. From the library come points, cells and the springs' stiffnesses alone.
"""

import math

import numpy as np
from scipy.linalg import LinAlgError, cholesky_banded, solve_banded

LONG = np.longdouble
STEP = 1e-40
"""Imaginary step: its square is nothing beside 1."""


NEAR = 0.02
"""Change of an edge over its length between where a step of a path was to lead and where it led."""

CROSSED = 2.0**-12
"""Share of the load between a stable and an unstable point of a path, within which it loses its stability."""


def dot(a, b):
    """Scalar product along the last axis; a sum of two terms is several times faster than a reduction."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]


def spring_forces(x, k, rest):
    """Derivative of ``k/2 (l - L)^2`` by both ends."""
    d = x[:, 1] - x[:, 0]
    length = np.sqrt(dot(d, d))
    pull = (k * (length - rest) / length)[:, None] * d
    return np.stack([-pull, pull], axis=1)


def area_of(x):
    """Area of polygons by the shoelace formula."""
    following = np.roll(x, -1, axis=1)
    return 0.5 * (x[..., 0] * following[..., 1] - following[..., 0] * x[..., 1]).sum(axis=1)


def area_forces(x, modulus, rest):
    """Derivative of ``K/2 (A - A0)^2 / A0``."""
    across = 0.5 * (np.roll(x, -1, axis=1) - np.roll(x, 1, axis=1))
    slope = np.stack([across[..., 1], -across[..., 0]], axis=2)
    return (modulus * (area_of(x) - rest) / rest)[:, None, None] * slope


def angles_of(x):
    """Angles of triangles, and the vectors from each corner to the next one and to the one before."""
    a, b = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    sine, cosine = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0], dot(a, b)
    half = 2 * np.arctan(np.ones(1, x.real.dtype))[0]
    return half - np.arctan(cosine / sine), a, b


def angle_forces(x, modulus, rest):
    """Derivative of ``sum beta/2 (theta - theta0)^2``: a side's direction changes by its turn over its square."""
    angles, a, b = angles_of(x)
    moment = (modulus * (angles - rest))[..., None]
    by_next = moment * np.stack([a[..., 1], -a[..., 0]], axis=2) / dot(a, a)[..., None]
    by_last = moment * np.stack([-b[..., 1], b[..., 0]], axis=2) / dot(b, b)[..., None]
    return np.roll(by_next, 1, axis=1) + np.roll(by_last, -1, axis=1) - by_next - by_last


def sides_of(x):
    """Side opposite each corner of triangles."""
    return np.roll(x, 1, axis=1) - np.roll(x, -1, axis=1)


def squares_forces(x, k, rest):
    """Derivative of ``sum k_i/4 (l_i^2 - L_i^2)^2``, side i opposite corner i."""
    sides = sides_of(x)
    pull = (k * (dot(sides, sides) - rest))[..., None] * sides
    return np.roll(pull, -1, axis=1) - np.roll(pull, 1, axis=1)


def factor_forces(x, modulus, rest):
    """Derivative of ``M/2 ((V - V0) / V0)^2``, V the sum of the squared sides."""
    sides = sides_of(x)
    pull = 2 * (modulus * (dot(sides, sides).sum(axis=1) - rest) / rest**2)[:, None, None] * sides
    return np.roll(pull, -1, axis=1) - np.roll(pull, 1, axis=1)


def _gradient(x, inverse):
    """Deformation gradient of linear triangles."""
    return np.stack([x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]], axis=2) @ inverse


def _second(green, first, second):
    """Second Piola-Kirchhoff stress of plane stress: lambda tr(E) I + 2 mu E."""
    trace = green[:, 0, 0] + green[:, 1, 1]
    return (first * trace)[:, None, None] * np.eye(2) + (2 * second)[:, None, None] * green


def element_forces(x, inverse, area, first, second):
    """Derivative of the St. Venant-Kirchhoff energy of linear triangles, which Delingette's springs equal."""
    gradient = _gradient(x, inverse)
    nominal = gradient @ _second(0.5 * (gradient.swapaxes(1, 2) @ gradient - np.eye(2)), first, second)
    columns = area[:, None, None] * nominal @ inverse.swapaxes(1, 2)
    return np.stack([-columns.sum(axis=2), columns[..., 0], columns[..., 1]], axis=1)


def slip_forces(x, inverse, sides, stiffness):
    """Derivative of ``sum k/2 (L n.E.s)^2`` over the sides of triangles, E Green's strain and s across n."""
    gradient = _gradient(x, inverse)
    green = 0.5 * (gradient.swapaxes(1, 2) @ gradient - np.eye(2))
    second = np.zeros(green.shape, green.dtype)
    for side in sides.swapaxes(0, 1):
        across = np.stack([-side[:, 1], side[:, 0]], axis=1) / np.sqrt(dot(side, side))[:, None]
        both = side[:, :, None] * across[:, None, :]
        slip = (green * both).sum(axis=(1, 2))
        second = second + 0.5 * (stiffness * slip)[:, None, None] * (both + both.swapaxes(1, 2))
    columns = gradient @ second @ inverse.swapaxes(1, 2)
    return np.stack([-columns.sum(axis=2), columns[..., 0], columns[..., 1]], axis=1)


def rubber_forces(x, inverse, area, shear, bulk):
    """Derivative of the neo-Hookean energy of linear triangles, by the thickness that leaves no stress across them.

    ``mu/2 (J^(-2/3) I_1 - 3) + K/2 (J - 1)^2`` per volume; no bulk modulus stands for an incompressible sheet.
    """
    gradient = _gradient(x, inverse)
    (a, b), (c, d) = gradient[:, 0].T, gradient[:, 1].T
    ratio, squares = a * d - b * c, a * a + b * b + c * c + d * d
    cofactor = np.stack([np.stack([d, -c], axis=1), np.stack([-b, a], axis=1)], axis=1)
    if not np.any(bulk):
        nominal = shear[:, None, None] * (gradient - cofactor / (ratio**3)[:, None, None])
    else:
        with np.errstate(invalid="ignore"):  # a cell that is turned inside out has no force: NaN
            thickness = 1 / np.sqrt(ratio)
        for _ in range(40):  # Newton's method, its slope by the same formula
            volume = ratio * thickness
            power, sum_ = volume ** (-2 / 3), squares + thickness**2
            pull = shear * power * (thickness - sum_ / (3 * thickness)) + bulk * (volume - 1) * ratio
            of_power = -2 * power / (3 * thickness)
            slope = shear * (
                of_power * (thickness - sum_ / (3 * thickness)) + power * (1 / 3 + sum_ / (3 * thickness**2))
            )
            thickness = thickness - pull / (slope + bulk * ratio**2)
        volume = ratio * thickness
        power = volume ** (-2 / 3)
        by_ratio = bulk * (volume - 1) * thickness - shear * power * (squares + thickness**2) / (3 * ratio)
        nominal = (shear * power)[:, None, None] * gradient + by_ratio[:, None, None] * cofactor
    columns = area[:, None, None] * nominal @ inverse.swapaxes(1, 2)
    return np.stack([-columns.sum(axis=2), columns[..., 0], columns[..., 1]], axis=1)


def follower_forces(x, share):
    """Forces of a unit total on the two ends of edges that carry a pressure: minus, to be a derivative."""
    e = x[:, 1] - x[:, 0]
    half = 0.5 * share[:, None] * np.stack([-e[:, 1], e[:, 0]], axis=1)
    return -np.stack([half, half], axis=1)


class Part:
    """Groups of particles with a law of forces; parameters are kept in 80 and in 64 bits."""

    def __init__(self, corners, forces, *parameters):
        self.corners, self.forces = corners, forces
        self.parameters = {LONG: [np.asarray(p, LONG) for p in parameters]}
        self.parameters[np.float64] = [p.astype(float) for p in self.parameters[LONG]]
        # All directions of a tangent are taken at once, corner by corner but the first.
        self.steps = 2 * (corners.shape[1] - 1)
        self.repeated = [np.concatenate([p] * self.steps) for p in self.parameters[np.float64]]

    def __call__(self, positions):
        x = positions[self.corners]
        return self.forces(x, *self.parameters[x.real.dtype.type])

    def tangent(self, positions):
        """Derivative of the forces, shape (m, 2 c, 2 c); what one corner lacks, a common motion has."""
        count, corners = self.corners.shape
        x = np.repeat(positions[self.corners][None].astype(complex), self.steps, axis=0)
        for step in range(self.steps):
            x[step, :, 1 + step // 2, step % 2] += 1j * STEP
        columns = self.forces(x.reshape(-1, corners, 2), *self.repeated).imag / STEP
        columns = columns.reshape(corners - 1, 2, count, corners, 2).transpose(2, 3, 4, 0, 1)
        tangent = np.concatenate([-columns.sum(axis=3, keepdims=True), columns], axis=3)
        return tangent.reshape(count, 2 * corners, 2 * corners)


class Body:
    """A mesh with springs and energies, held and loaded.

    Parameters
    ----------
    points : ndarray of float, shape (n, 2)
    held : ndarray of bool, shape (n, 2)
    pattern : ndarray of float, shape (n, 2)
        Dead forces of total 1; not used where there is a follower.
    parts : list of Part
    follower : Part, optional
    given : ndarray of float, shape (n, 2), optional
        Displacements of held directions for a force of 1; zero without.
    """

    def __init__(self, points, held, pattern, parts, follower=None, given=0.0):
        self.rest, self.pattern, self.parts, self.follower = points.astype(LONG), pattern, parts, follower
        self.given = given
        along = int(np.argmax(np.ptp(points, axis=0)))
        free = np.flatnonzero(~held.ravel())
        place = np.repeat(points, 2, axis=0)[free]
        self.free = free[np.lexsort((free, place[:, 1 - along], place[:, along]))]
        self.size = len(self.free)
        number = np.full(held.size, -1)
        number[self.free] = np.arange(self.size)
        self.places, self.band = [], 0
        for part in [*parts, *([follower] if follower else [])]:
            of = number[(2 * part.corners[:, :, None] + np.arange(2)).reshape(len(part.corners), -1)]
            rows, columns = np.broadcast_arrays(of[:, :, None], of[:, None, :])
            kept = (rows >= 0) & (columns >= 0)
            rows, columns = rows[kept], columns[kept]
            self.band = max(self.band, int(np.abs(rows - columns).max(initial=0)))
            self.places.append((kept, rows, columns))
        self.places = [(kept, (self.band + i - j) * self.size + j) for kept, i, j in self.places]

    # -- forces -----------------------------------------------------------------------------------------------------

    def sum(self, positions, parts):
        total = np.zeros(positions.size, positions.dtype)
        for part in parts:
            places = 2 * part.corners[:, :, None] + np.arange(2)
            np.add.at(total, places.ravel(), part(positions).ravel())
        return total

    def field(self, unknowns):
        field = np.zeros(self.rest.size, unknowns.dtype)
        field[self.free] = unknowns
        return field.reshape(-1, 2)

    def positions(self, unknowns, force):
        return self.rest + force * self.given + self.field(unknowns)

    def missing(self, unknowns, force):
        """Load less resistance, shape (unknowns,), in the precision of the unknowns."""
        positions = self.positions(unknowns, force)
        inner = self.sum(positions, self.parts)[self.free]
        if self.follower is None:
            return force * self.pattern.ravel()[self.free] - inner
        return -force * self.sum(positions, [self.follower])[self.free] - inner

    def along(self, unknowns, force, direction):
        """Tangent times a direction, in 80 bits."""
        return -self.missing(unknowns + 1j * LONG(STEP) * direction, force).imag / LONG(STEP)

    # -- matrices ---------------------------------------------------------------------------------------------------

    def tangent(self, unknowns, force):
        """Tangent in LAPACK's form of band matrices, shape (2 band + 1, unknowns)."""
        positions = self.positions(unknowns, force).astype(float)
        total = np.zeros((2 * self.band + 1) * self.size)
        parts = [(part, 1.0) for part in self.parts] + ([(self.follower, force)] if self.follower else [])
        for (part, factor), (kept, places) in zip(parts, self.places):
            total += np.bincount(places, factor * part.tangent(positions)[kept], len(total))
        return total.reshape(-1, self.size)

    def dense(self, matrix):
        full = np.zeros((self.size, self.size))
        for row, line in enumerate(matrix):
            below = row - self.band  # i - j
            j = np.arange(max(0, -below), min(self.size, self.size - below))
            full[j + below, j] = line[j]
        return full

    def solve(self, matrix, right):
        return solve_banded((self.band, self.band), matrix, right.astype(float), check_finite=False)

    def lowest(self, unknowns, force, matrix=None):
        """Sign-true smallest eigenvalue over the largest element of the tangent, which is symmetric; and its vector.

        Cholesky's method tells whether an eigenvalue is clearly negative. One within its rounding is nearest to zero,
        so inverse iteration finds it, and a Rayleigh quotient in 80 bits has its sign: its error is that of the vector
        squared.
        """
        matrix = self.tangent(unknowns, force) if matrix is None else matrix
        size = np.abs(matrix).max()
        vector = np.random.default_rng(0).standard_normal(self.size)
        try:
            for _ in range(4):
                vector = self.solve(matrix, vector)
                vector /= np.linalg.norm(vector)
        except LinAlgError:
            return 0.0, vector
        vector = vector.astype(LONG)
        value = float(vector @ self.along(unknowns, force, vector) / (vector @ vector)) / size
        if value > 0 and not self.above(matrix, -1):
            value = float(np.linalg.eigvalsh(self.dense(matrix), UPLO="L")[0]) / size
        return value, vector

    def above(self, matrix, sign):
        """Whether all eigenvalues are above what rounding may do to them, times a sign, by Cholesky's method."""
        lower = matrix[self.band :].copy()
        lower[0] -= sign * 1e-14 * math.sqrt(self.size) * np.abs(matrix).max()
        try:
            cholesky_banded(lower, lower=True, check_finite=False)
        except LinAlgError:
            return False
        return True

    def stable(self, unknowns, force):
        """Whether no eigenvalue is negative."""
        matrix = self.tangent(unknowns, force)
        if self.above(matrix, 1):
            return True
        return self.above(matrix, -1) and self.lowest(unknowns, force, matrix)[0] > 0

    def modes(self, unknowns, force, masses):
        """Eigenvalues of the tangent over the masses, which is not symmetric under a follower, over the largest."""
        root = 1 / np.sqrt(np.repeat(masses, 2)[self.free])
        values = np.linalg.eigvals(root[:, None] * self.dense(self.tangent(unknowns, force)) * root)
        return values[np.argsort(values.real)] / np.abs(values).max()

    # -- equilibria -------------------------------------------------------------------------------------------------

    def newton(self, start, force, most=12, tolerance=1e-12):
        """Equilibrium by full Newton steps, the tangent in 64 and all else in 80 bits; None where there is none near.

        Returns
        -------
        unknowns : ndarray of longdouble, or None
        """
        unknowns = start.astype(LONG)
        before = np.inf
        with np.errstate(all="ignore"):
            for _ in range(most):
                try:
                    step = self.solve(self.tangent(unknowns, force), self.missing(unknowns, force))
                except (LinAlgError, ValueError):
                    return None
                unknowns = unknowns + step
                size = float(np.linalg.norm(step) / (np.linalg.norm(unknowns.astype(float)) or 1.0))
                if not np.isfinite(size):
                    return None
                if size <= tolerance or (size <= 1e-9 and size > 0.3 * before):
                    return unknowns
                before = size
        return None

    def linear(self, force):
        """Displacements of the linear network, by iterative refinement in 80 bits."""
        rest = np.zeros(self.size, LONG)
        matrix = self.tangent(rest, 0.0)
        load = force * self.pattern.ravel()[self.free].astype(LONG)
        unknowns = rest
        for _ in range(12):
            step = self.solve(matrix, load - self.along(rest, 0.0, unknowns))
            unknowns = unknowns + step
            if np.linalg.norm(step) <= 1e-12 * float(np.linalg.norm(unknowns.astype(float))):
                return unknowns
        return None

    def change(self, unknowns):
        """Largest change of an edge's vector over its length [1], of all parts with two or more corners."""
        field = self.field(np.asarray(unknowns, float))
        rest = self.rest.astype(float)
        largest = 0.0
        for part in self.parts:
            for corner in range(1, part.corners.shape[1]):
                ends = part.corners[:, [0, corner]]
                moved, here = np.diff(field[ends], axis=1)[:, 0], np.diff(rest[ends], axis=1)[:, 0]
                largest = max(largest, float(np.sqrt((moved**2).sum(axis=1) / (here**2).sum(axis=1)).max()))
        return largest

    def inside_out(self, unknowns, cells, force=0.0):
        positions = self.positions(unknowns, force).astype(float)
        return any((area_of(positions[corners]) <= 0).any() for corners in cells)

    def follow(self, force, judge=None):
        """The path from rest in small load steps, as far as it is stable.

        A step is taken again at half its length where Newton's method fails, where an edge ends further than `NEAR` of
        its length from where the last two points of the path say, or where the equilibrium found is unstable: a path
        that turns sharply, as that of a column not quite straight, is not to be left for another one.

        Returns
        -------
        unknowns : ndarray of longdouble
            At the end of the path.
        share : float
            Share of the load there.
        why : str
            Empty where the whole load is reached; else ``"unstable"`` or ``"no equilibrium"``.
        """
        judge = judge or self.stable
        last = before = np.zeros(self.size, LONG)
        done, step, last_step = 0.0, 0.125, None
        while done < 1:
            step = min(step, 1 - done)
            if last_step is None:
                guess = last + self.solve(self.tangent(last, 0.0), self.missing(last, force * step))
            else:
                guess = last + (last - before) * (step / last_step)
            found = self.newton(guess, force * (done + step), most=8, tolerance=1e-9)
            if found is None or self.change(found - guess) > NEAR:
                step /= 2
                if step < 2.0**-18:
                    return last, done, "no equilibrium"
                continue
            if not judge(found, force * (done + step)):
                if step <= CROSSED:
                    return last, done, "unstable"
                step /= 2
                continue
            before, last, last_step = last, found, step
            done = 1.0 if done + step > 1 - 1e-9 else done + step
            step *= 1.5
        return last, 1.0, ""

    def critical(self, force, judge=None):
        """Load nearest to rest, of the sign of `force`, at which the path loses its stability; None where it does not.

        `force` is a guess from above. Between the last good point of the path and the first bad one it is bisected.
        """
        judge = judge or self.stable
        last, low, why = self.follow(force, judge=judge)
        if not why:
            return None
        high = min(1.0, low + 2 * CROSSED)
        while high - low > 1e-9 * high:
            middle = 0.5 * (low + high)
            found = self.newton(last, force * middle)
            if found is not None and self.change(found - last) <= 0.1 and judge(found, force * middle):
                low, last = middle, found
            else:
                high = middle
        return force * 0.5 * (low + high)

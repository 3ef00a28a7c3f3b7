"""The equilibrium path of a network from rest, as power series of its load or of a way along it, and curves from it.

With ``s = F / k`` a uniform network's path u(s) is analytic, so every stiffness k of a sensitivity curve lies on one
path. A series costs one factorisation and one back-substitution an order (asymptotic numerical method: Cochelin,
Damil and Potier-Ferry, Revue europeenne des elements finis 3(2):281, 1994); Pade approximants continue it past its
poles. The nearest of these is the buckling load, even for a beam in tension.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import brentq
from scipy.sparse.linalg import LinearOperator, eigsh

from ..linalg.factors import SingularError

ORDER = 14
"""Order of a series that gives a whole curve, as a rule."""

HIGH_ORDER = 16
"""Order of one that the rule does not serve."""

CURVE_TOLERANCE = 1e-7
"""Largest estimated relative error of a displacement on a sensitivity curve."""

STRETCH = 0.1
"""Change of a spring's length over that at rest from one tangent that is looked at to the next: networks pulled to
three times their length lose their stability and gain it again within .25."""

STEP = 1e-3
"""Difference of two approximants over the way from the point that ends a step along the path."""

WAY_ORDER = 10
"""Order of a series along the path."""

MAX_SERIES = 3
"""Series of the load, that about rest with them."""

MAX_CORRECTIONS = 4
"""Steps of Newton's method with one tangent that bring a prediction to an equilibrium."""

MOST_UNKNOWNS = 4000
"""Unknowns beyond which the path is followed to single loads alone: a curve's few samples next to buckling would take
longer than all others."""

MAX_STEPS = 60
"""Steps along the path beyond the series about rest."""

LIMIT = 1e-3
"""Share of the load that a path may still rise to a limit point where it is left."""

GROWTH = 8
"""Power of the way along a series with which its error is taken to grow; that of order 10 grows faster."""

MAX_HALVINGS = 6
"""Of a step at whose end there is no stable equilibrium."""

MAX_FACTORISATIONS = 5
"""Of a solve from a prediction: from near the path one or two do."""

NEAR = 0.02
"""Distance of a spring's vector from its prediction, over its length, beyond which a solve found another path."""


class Expansion:
    """Power series of the equilibrium path about one of its points.

    With a parameter ``sigma`` displacements, loads, a spring's vector d, its length l and ``w = 1/l`` are power series.
    From ``l^2 = d.d``, ``w l = 1`` and the force ``k (d - L w d)``, order n follows from lower orders by one solve with
    the tangent at the point. The parameter is the growth of the load; or, where the load may turn, the way along the
    path: the displacements' share of their first derivative v, ``sigma = (u - u_0).v / v.v``, as the first order of
    the load is 1 either way.

    Parameters
    ----------
    network : Network
    load : ndarray of float, shape (unknowns,)
        Load pattern [1].
    s : float
        Force over the reference stiffness at the point [m].
    displacements : ndarray of float, shape (n_points, 2), or None
        Equilibrium at the point [m]; None at rest.
    factor : Factor
        Tangent factorised there.
    order : int, optional
    turning : bool, optional
        Whether the parameter is the way along the path.

    Attributes
    ----------
    coefficients : ndarray of float, shape (order + 1, n_points, 2)
        The displacements are ``sum_n coefficients[n] sigma^n``.
    loads : ndarray of float, shape (order + 1,)
        The loads are ``sum_n loads[n] sigma^n`` [m].
    """

    def __init__(self, network, load, s, displacements, factor, order=ORDER, turning=False):
        self.s, self.order, self.turning = s, 0, turning
        self._network, self._load, self._factor = network, load, factor
        self.coefficients = np.zeros((1, *network.held.shape))
        if displacements is not None:
            self.coefficients[0] = displacements
        self.loads = np.array([s, 1.0])
        # Component by component, shape (order + 1, 2, n_springs): sums over orders are then of whole rows.
        self._d = (network.rest_vectors + network.stretch(self.coefficients[0])).T[None].copy()
        self._length = np.sqrt(np.einsum("nji,nji->ni", self._d, self._d))
        self._inverse = 1.0 / self._length
        self._first = None
        self.extend(order)

    def extend(self, order):
        """Add the orders up to one."""
        network = self._network
        d, length, inverse, coefficients = (
            _grown(array, order + 1) for array in (self._d, self._length, self._inverse, self.coefficients)
        )
        loads = np.zeros(order + 1)
        loads[: len(self.loads)] = self.loads[: order + 1]
        weight = network.stiffness * network.rest_lengths
        for n in range(self.order + 1, order + 1):
            right, length[n], inverse[n] = self._load, 0.0, 0.0
            if n > 1:
                # What lower orders give of order n, as if d[n] were 0.
                square = np.einsum("nji,nji->i", d[1:n], d[n - 1 : 0 : -1])
                square -= np.einsum("ni,ni->i", length[1:n], length[n - 1 : 0 : -1])
                length[n] = 0.5 * square * inverse[0]
                inverse[n] = -inverse[0] * np.einsum("ni,ni->i", length[1 : n + 1], inverse[n - 1 :: -1])
                known = np.einsum("ni,nji->ji", inverse[1 : n + 1], d[n - 1 :: -1])
                right = -network.gather((weight * known).T)
            change = self._factor.solve(right)
            if n == 1:
                self._first = change
            elif self.turning:
                loads[n] = -(change @ self._first) / (self._first @ self._first)
                change += loads[n] * self._first
            coefficients[n] = network.expand(change)
            d[n] = network.stretch(coefficients[n]).T
            along = np.einsum("ji,ji->i", d[0], d[n]) * inverse[0]
            length[n] += along
            inverse[n] -= inverse[0] ** 2 * along
        self._d, self._length, self._inverse, self.coefficients, self.order = d, length, inverse, coefficients, order
        self.loads = loads
        for name in ("_products", "_radius"):
            self.__dict__.pop(name, None)
        self._denominators = {}

    def predict(self, s):
        """Displacements at ``s`` [m], shape (n_points, 2), from the series cut off before its smallest term."""
        powers = (s - self.s) ** np.arange(self.order + 1.0)
        sizes = np.abs(powers[1:]) * np.linalg.norm(self.coefficients[1:].reshape(self.order, -1), axis=1)
        kept = 2 + int(np.argmin(sizes))
        return np.tensordot(powers[:kept], self.coefficients[:kept], axes=1)

    @cached_property
    def _products(self):
        """Scalar products of the coefficients, shape (order + 1, order + 1)."""
        flat = self.coefficients.reshape(self.order + 1, -1)
        with np.errstate(over="ignore", invalid="ignore"):
            return flat @ flat.T

    @cached_property
    def _radius(self):
        """Value of the parameter that makes the last term as large as the first [m]."""
        sizes = np.sqrt(np.diag(self._products))
        return float((sizes[1] / sizes[-1]) ** (1.0 / (self.order - 1))) if sizes[-1] else 1.0

    def _denominator(self, lower):
        """Coefficients of a denominator whose product with the series has least orders beyond the numerator's.

        In powers of the parameter over the radius.
        """
        if lower not in self._denominators:
            powers = self._radius ** np.arange(self.order + 1.0)
            scaled = self._products * np.outer(powers, powers)
            matrix, right = np.zeros((lower, lower)), np.zeros(lower)
            for n in range(self.order - lower + 1, self.order + 1):
                rows = np.arange(n - 1, max(n - 1 - lower, 0), -1)
                matrix[: len(rows), : len(rows)] += scaled[np.ix_(rows, rows)]
                right[: len(rows)] -= scaled[rows, n]
            solution = np.linalg.lstsq(matrix, right, rcond=1e-14)[0]
            self._denominators[lower] = np.concatenate([[1.0], solution])
        return self._denominators[lower]

    def _shares(self, sigma, less=0):
        """Factors of the coefficients in their approximant of one denominator, shape (order + 1,).

        The denominator is of half the order, or of a degree `less`. The numerator has the rest where the series is
        asked for far beyond its radius, and all orders where the path may turn within it.
        """
        lower = self.order // 2 - less
        upper = self.order if self.turning else self.order - lower
        sums = np.zeros(self.order + 1)
        sums[: lower + 1] = self._denominator(lower) * (sigma / self._radius) ** np.arange(lower + 1.0)
        sums = np.cumsum(sums)
        shares = np.zeros(self.order + 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            shares[: upper + 1] = sums[upper::-1] / sums[-1] * sigma ** np.arange(upper + 1.0)
        shares[0] = 1.0
        return shares

    def at(self, sigma):
        """Load [m] and displacements [m], shape (n_points, 2), at a value of the parameter: a vector Pade approximant.

        All components share one denominator (Cochelin, Damil and Potier-Ferry, Int. J. Num. Meth. Eng. 37:1187, 1994).
        """
        shares = self._shares(sigma)
        return float(shares @ self.loads), np.tensordot(shares, self.coefficients, axes=1)

    def reach(self, sign):
        """How far the series is good to start a solve, 0 where it is not; and whether the load turns there.

        Returns
        -------
        sigma : float
            Parameter [m].
        turns : bool
            Whether the load is largest there: a limit point of the path.
        """
        if not np.isfinite(self._products).all():  # next to a singular point
            return 0.0, False
        sigma = 2.0 * sign * self._radius
        for _ in range(40):
            shares = self._shares(sigma)
            apart = shares - self._shares(sigma, 1)
            way = np.concatenate([[0.0], shares[1:]])
            close = apart @ self._products @ apart <= STEP**2 * (way @ self._products @ way)
            if close and abs(apart @ self.loads) <= STEP * abs(way @ self.loads):
                break
            sigma *= 0.75
        loads = [sign * (self._shares(part * sigma) @ self.loads) for part in np.linspace(0.0, 1.0, 33)]
        falls = np.flatnonzero(np.diff(loads) <= 0)
        return (sigma * (falls[0] / 32.0), True) if len(falls) else (sigma, False)

    def parameter(self, s, farthest, less=0):
        """Parameter of a load that lies between the point and that of the parameter `farthest`."""
        if not self.turning:
            return s - self.s
        apart = [self._shares(sigma, less) @ self.loads - s for sigma in (0.0, farthest)]
        if apart[0] * apart[1] >= 0:  # the last one but for rounding, or for what the approximants differ by
            return farthest
        return brentq(lambda sigma: self._shares(sigma, less) @ self.loads - s, 0.0, farthest, xtol=1e-300, rtol=1e-14)

    def value(self, weights, s, farthest):
        """Weighted sum of the displacements at a load up to that of a parameter, and the estimated relative error."""
        series = np.tensordot(self.coefficients, weights, axes=2)
        best, second, third = (self._shares(self.parameter(s, farthest, less), less) @ series for less in range(3))
        error = max(abs(best - second), abs(second - third)) / abs(best) if best else np.inf
        return best, error if np.isfinite(error) else np.inf

    def measure(self, weights, s):
        """Weighted sum of the displacements at each of many ``s``, by Pade approximants.

        Parameters
        ----------
        weights : ndarray of float, shape (n_points, 2)
        s : ndarray of float, shape (n,)
            Force over the reference stiffness [m].

        Returns
        -------
        values : ndarray of float, shape (n,)
        errors : ndarray of float, shape (n,)
            Largest difference to the approximants of the two lower orders, relative to the value.
        """
        series = np.tensordot(self.coefficients, weights, axes=2)
        sigma = np.asarray(s) - self.s
        # Scaled so that all coefficients are of one size: the equations of an approximant are then well-conditioned.
        scaled = series[1:] * self._radius ** np.arange(1.0, self.order + 1)
        x = sigma / self._radius
        half = (self.order - 1) // 2
        orders = ((half, half + 1), (half, half), (half - 1, half))
        best, second, third = (series[0] + x * _pade(scaled, *order)(x) for order in orders)
        with np.errstate(divide="ignore", invalid="ignore"):
            errors = np.maximum(np.abs(best - second), np.abs(second - third)) / np.abs(best)
        return best, np.where(np.isfinite(errors), errors, np.inf)


def _grown(array, length):
    """The array with room for more along its first axis."""
    grown = np.empty((length, *array.shape[1:]))
    grown[: len(array)] = array
    return grown


def _pade(series, upper, lower):
    """Pade approximant of a series: numerator of degree `upper` over denominator of degree `lower`, as a function."""
    padded = np.concatenate([np.zeros(lower), series])
    matrix = np.array([padded[upper + row : upper + row + lower][::-1] for row in range(1, lower + 1)])
    # Least squares: where the series needs fewer poles the matrix is singular, and the smallest solution is right.
    solution = np.linalg.lstsq(matrix, -series[upper + 1 : upper + lower + 1], rcond=1e-14)[0]
    denominator = np.concatenate([[1.0], solution])
    numerator = np.convolve(denominator, series)[: upper + 1]
    return lambda x: np.polyval(numerator[::-1], x) / np.polyval(denominator[::-1], x)


def trace(problem, weights, targets):
    """Weighted displacement at many loads on one equilibrium path.

    Parameters
    ----------
    problem : StaticProblem
        Of springs alone, under dead loads.
    weights : ndarray of float, shape (n_points, 2)
        Weights of the displacements to sum.
    targets : ndarray of float, shape (n,)
        Force over the reference stiffness, all of one sign [m].

    Returns
    -------
    values : ndarray of float, shape (n,)
        NaN where no equilibrium was found: the path from rest does not get there.
    stable : ndarray of bool, shape (n,)
        Whether the path from rest gets there and is stable all the way; other values are of equilibria that the beam
        leaves or does not come to.
    """
    path = StablePath(problem, weights, targets)
    return path.values, path.stable


@dataclass(frozen=True)
class _Point:
    """A predicted point, corrected; the tangent is that of the prediction."""

    displacements: np.ndarray
    factor: object
    stable: bool
    value: float
    error: float
    converged: bool


class StablePath:
    """The stable part of an equilibrium path from rest, as far as many loads need it.

    It begins with the series about rest. Where that does not serve, since the path turns away from where it points, as
    that of a beam of an unsymmetric mesh does next to buckling, the path is followed in steps: a series along it
    predicts a point, and a solve finds it.

    Between two stable points of one series the path is taken for stable if no spring's length changes by more than
    `STRETCH` of that at rest. Inertia changes at singular points alone, so the lowest eigenvalue would have to pass
    zero twice in between. What was once lost is not regained: stable equilibria beyond are not what the beam comes to.

    Parameters
    ----------
    problem : StaticProblem
        Of springs alone, under dead loads.
    weights : ndarray of float, shape (n_points, 2)
        Weights of the displacements to sum.
    targets : ndarray of float, shape (n,)
        Force over the reference stiffness, all of one sign [m].

    Attributes
    ----------
    values : ndarray of float, shape (n,)
        Weighted displacements at the targets, as of `trace`.
    stable : ndarray of bool, shape (n,)
        As of `trace`.
    stable_to : float
        Largest load, without its sign, that the path is known to carry [m].
    end : str
        Why the path ends before the last target; empty where it does not, or was not followed that far.
    """

    def __init__(self, problem, weights, targets):
        self.problem, self.weights = problem, weights
        targets = np.asarray(targets, dtype=float)
        self._sign = np.sign(targets[0])
        loads, places = np.unique(np.abs(targets), return_inverse=True)
        self._last_load, loads = loads[-1], self._sign * loads
        self._series, self._pieces, self._turns = [], [], False
        self.stable_to, self._unstable_from, self.end = 0.0, np.inf, ""
        values, good, count = self._by_series(loads)
        stable = np.zeros(len(loads), dtype=bool)
        stable[: self._count_stable(loads[:count])] = True
        self._check_between(loads, values, stable)
        found = stable.copy()
        found[:count] = True
        if stable.sum() == count:
            self._follow(loads, values, good, stable, found)
        else:
            self.end = "unstable"
        self._check_others(loads, values, good, found)
        values[~found] = np.nan
        self.values, self.stable = values[places], stable[places]

    def value(self, s):
        """Weighted displacement at a load on the stable path; NaN where it does not get there."""
        load = abs(s)
        series = self._series_of(load)
        if series is None:
            return self._reach(load)
        return float(series.measure(self.weights, np.array([s]))[0][0]) if self._is_stable(load) else np.nan

    # -- series of the load -----------------------------------------------------------------------------------------

    def _by_series(self, loads):
        """Displacements by the series about rest, and by some about points that it gives where all beyond need them.

        Returns
        -------
        values : ndarray of float, shape (n,)
        good : ndarray of bool, shape (n,)
            Whether the estimated error of the series about rest is small.
        count : int
            How many of the loads the series serve, proved at the last one of each.
        """
        rest = series = self.problem.rest
        values, errors = rest.measure(self.weights, loads)
        if rest.order < HIGH_ORDER and (errors > CURVE_TOLERANCE).any():
            rest.extend(HIGH_ORDER)
            values, errors = rest.measure(self.weights, loads)
        good, count, served, before = errors <= CURVE_TOLERANCE, 0, errors <= CURVE_TOLERANCE, None
        for _ in range(MAX_SERIES):
            number = len(served) if served.all() else int(np.argmin(served))
            while number > 0:
                point = self._point(series, loads[count + number - 1], values[count + number - 1])
                if point is not None and point.error <= CURVE_TOLERANCE:
                    break
                number -= 1 + number // 8
            if number <= 0:
                break
            count += number
            self._series.append((series, abs(loads[count - 1])))
            self._far = point
            self._bracket(abs(loads[count - 1]), point, before)
            if count == len(loads) or self._unstable_from < np.inf:
                break
            if before is None and good[count:].any() and self._elsewhere(loads[np.flatnonzero(good)[-1]]):
                self._turns = True
                break
            try:
                factor = self.problem.network.factorize(point.displacements)
            except SingularError:
                break
            displacements = before = point.displacements
            series = Expansion(
                self.problem.network, self.problem.load, loads[count - 1], displacements, factor, HIGH_ORDER
            )
            values[count:], errors = series.measure(self.weights, loads[count:])
            served = errors <= CURVE_TOLERANCE
        return values, good, count

    def _series_of(self, load):
        """The series that serves a load; None where none does."""
        return next((series for series, last in self._series if load <= last), None)

    def _point(self, series, s, value):
        """The point at a load that a series predicts; None where there is none."""
        network = self.problem.network
        displacements = series.at(s - series.s)[1]
        if not np.isfinite(displacements).all() or network.inverted(displacements):
            return None
        try:
            factor = network.factorize(displacements)
            return self._corrected(s, value, displacements, factor, factor.negative_pivots == 0)
        except SingularError:
            return None

    def _corrected(self, s, value, displacements, factor, stable):
        """A predicted point, corrected by steps with one tangent; its error is that of a value."""
        network = self.problem.network
        size = before = np.inf
        for _ in range(MAX_CORRECTIONS):
            with np.errstate(over="ignore", invalid="ignore"):
                missing = s * self.problem.load - network.resistance(displacements)
                step = network.expand(factor.solve(missing))
                before, size = size, np.linalg.norm(step) / np.linalg.norm(displacements)
            if not size < before:
                break
            displacements = displacements + step
            if size <= 0.01 * CURVE_TOLERANCE:
                break
        better = float(np.tensordot(displacements, self.weights, axes=2))
        error = abs(better - value) / abs(better) if size <= CURVE_TOLERANCE else np.inf
        return _Point(displacements, factor, stable, better, error, size <= 0.01 * CURVE_TOLERANCE)

    def _bracket(self, last, point, before):
        """Look at the stability between the point up to which the path is stable and the last of a series."""
        first = self.stable_to
        steps = 1 + int(self._stretched(point.displacements, 0.0 if before is None else before) / STRETCH)
        for load in np.linspace(first, last, steps + 1)[1:]:
            if not (point.stable if load == last else self._stable_at(load)):
                self._unstable_from = load
                break
            self.stable_to = load

    def _stretched(self, displacements, before):
        """Largest change of a spring's length from one place to another, over that at rest [1]."""
        network = self.problem.network
        lengths = [
            np.linalg.norm(network.rest_vectors + network.stretch(np.broadcast_to(field, network.held.shape)), axis=1)
            for field in (before, displacements)
        ]
        return float((np.abs(lengths[1] - lengths[0]) / network.rest_lengths).max())

    def _stable_at(self, load):
        """Whether the point that a series of the load predicts is stable."""
        series = self._series_of(load)
        return self.problem.network.is_stable(series.at(self._sign * load - series.s)[1])

    def _is_stable(self, load):
        """Whether the path is stable up to a load that a series serves."""
        if self.stable_to < load < self._unstable_from:
            if self._stable_at(load):
                self.stable_to = load
            else:
                self._unstable_from = load
        return load <= self.stable_to

    def _count_stable(self, loads):
        """How many loads are on the stable path, by bisection."""
        least, most = 0, len(loads)
        while least < most:
            middle = (least + most + 1) // 2
            if self._is_stable(abs(loads[middle - 1])):
                least = middle
            else:
                most = middle - 1
        return least

    def _check_between(self, loads, values, stable):
        """Correct values that differ from what those on both sides say: an approximant may have a pole beside a zero.

        A factor from near by is good enough to see it.
        """
        count = int(stable.sum())
        doubtful = np.abs(left_out(loads[:count], values[:count])) > CURVE_TOLERANCE * np.abs(values[:count])
        for place in np.flatnonzero(doubtful):
            s = loads[place]
            series = self._series_of(abs(s))
            guess = series.at(s - series.s)[1]
            point = self._corrected(s, values[place], guess, self._far.factor, True)
            if not point.error <= CURVE_TOLERANCE:
                values[place] = point.value if point.converged else self._solved(s, guess)
                stable[place] = np.isfinite(values[place])

    def _check_others(self, loads, values, good, found):
        """Keep values of the series about rest beyond the stable path: of equilibria, though not of that path."""
        rest, others = self.problem.rest, np.flatnonzero(good & ~found)
        for group in np.split(others, np.flatnonzero(np.diff(others) > 1) + 1):
            while len(group):
                last = self._point(rest, loads[group[-1]], values[group[-1]])
                if last is not None and last.error <= CURVE_TOLERANCE:
                    break
                group = group[: -1 - len(group) // 8]
            for start, place in enumerate(group):  # the nearest to the path's turn is the worst
                s = loads[place]
                if self._corrected(s, values[place], rest.at(s)[1], last.factor, False).error <= CURVE_TOLERANCE:
                    found[group[start:]] = True
                    break

    # -- beyond it --------------------------------------------------------------------------------------------------

    def _follow(self, loads, values, good, stable, found):
        """Values at the loads that the series about rest does not serve, as far as the path is stable."""
        if self._turns and self.problem.network.unknowns > MOST_UNKNOWNS:
            return
        for place in np.flatnonzero(~found):
            if self._turns and good[place] and self._elsewhere(loads[place]):
                return
            values[place] = self._reach(abs(loads[place]))
            found[place] = stable[place] = np.isfinite(values[place])
            if self.end and abs(loads[place]) > self.stable_to:
                return

    def _elsewhere(self, s):
        """Whether the series about rest is by now of another path, which the beam would leave."""
        network, displacements = self.problem.network, self.problem.rest.at(s)[1]
        missing = s * self.problem.load - network.resistance(displacements)
        near = np.linalg.norm(missing) <= 1e-3 * abs(s) * self.problem.load_norm
        return near and not network.is_stable(displacements)

    def _reach(self, load):
        """Weighted displacement at a load beyond the series; NaN where the stable path does not get there."""
        while self.stable_to < load and not self.end:
            self._advance(load)
        if load > self.stable_to:
            return np.nan
        series, farthest, _, missed = next(piece for piece in self._pieces if piece[2] >= load)
        s = self._sign * load
        value, error = series.value(self.weights, s, farthest)
        sigma = series.parameter(s, farthest)
        if max(error, missed * (sigma / farthest) ** GROWTH) <= 0.1 * CURVE_TOLERANCE:
            return value
        return self._solved(s, series.at(sigma)[1])

    def _missed(self, displacements, guess):
        """Relative error of the weighted displacement of a guess."""
        value = np.tensordot(displacements, self.weights, axes=2)
        return abs(np.tensordot(guess, self.weights, axes=2) / value - 1.0)

    def _solve(self, s, guess):
        """Displacements of the equilibrium next to a guess and its tangent factorised; None where there is none.

        Returns
        -------
        displacements : ndarray of float, shape (n_points, 2), or None
        factor : Factor or None
            None where it is unstable.
        """
        network = self.problem.network
        if network.inverted(guess):
            return None, None
        found = self.problem.newton(s, guess, MAX_FACTORISATIONS)
        if not found.converged or network.largest_change(found.displacements - guess) > NEAR:
            return None, None
        try:
            return found.displacements, found.factor if found.factor.negative_pivots == 0 else None
        except SingularError:
            return found.displacements, None

    def _solved(self, s, guess):
        """Weighted displacement of the stable equilibrium next to a guess; NaN where there is none."""
        displacements, factor = self._solve(s, guess)
        return np.nan if factor is None else float(np.tensordot(displacements, self.weights, axes=2))

    def _advance(self, load):
        """One more step along the path, towards a load."""
        network = self.problem.network
        if self._pieces:
            s, displacements, factor = self._last
        else:
            s, displacements, factor = 0.0, None, self.problem.rest_factor
            if self.stable_to:
                s = self._sign * self.stable_to
                displacements, factor = self._solve(s, self._far.displacements)
                if factor is None:
                    self.end = "no stable equilibrium found"
                    return
        series = Expansion(network, self.problem.load, s, displacements, factor, WAY_ORDER, turning=True)
        farthest, turns = series.reach(self._sign)
        most = abs(series.at(farthest)[0])
        if turns and most - abs(s) <= LIMIT * most and load >= most:
            self.end = "limit point"
            return
        if load < most or not turns:
            farthest = series.parameter(self._sign * (load if turns else min(self._last_load, most)), farthest)
        else:
            farthest *= 0.9
        start = 0.0 if displacements is None else displacements
        while self._stretched(series.at(farthest)[1], start) > STRETCH:
            farthest *= 0.75
        unstable = np.inf
        for _ in range(MAX_HALVINGS):
            s, guess = series.at(farthest)
            displacements, factor = self._solve(s, guess) if farthest else (None, None)
            if factor is not None:
                self._pieces.append((series, farthest, abs(s), self._missed(displacements, guess)))
                self._last, self.stable_to = (s, displacements, factor), abs(s)
                break
            if displacements is not None:
                unstable = abs(s)
            farthest *= 0.5
        if factor is None or unstable <= (1.0 + LIMIT) * self.stable_to:
            self.end = "no stable equilibrium found" if unstable == np.inf else "unstable"
        elif len(self._pieces) == MAX_STEPS:
            self.end = "too many steps"


class LinearPath:
    """As `StablePath`, of a network with linear kinematics, whose displacements are in proportion to the load."""

    end = ""

    def __init__(self, problem, weights, targets):
        self._slope = float(np.tensordot(problem.slope, weights, axes=2))
        self.values, self.stable = self._slope * targets, np.ones(len(targets), dtype=bool)
        self.stable_to = np.inf

    def value(self, s):
        """Weighted displacement at a load."""
        return self._slope * s


def left_out(x, y):
    """What values differ by from the polynomials through three neighbours on either side.

    Parameters
    ----------
    x, y : ndarray of float, shape (n,)
        Places, ascending or descending, and values.

    Returns
    -------
    ndarray of float, shape (n,)
        0 where there are fewer neighbours.
    """
    result = np.zeros(len(x))
    if len(x) < 7:
        return result
    offsets = np.array([-3, -2, -1, 1, 2, 3])
    places = np.arange(3, len(x) - 3)
    nodes, values = x[places[:, None] + offsets], y[places[:, None] + offsets]
    apart, among = x[places][:, None] - nodes, nodes[:, :, None] - nodes[:, None, :]
    diagonal = np.arange(6)
    ratios = np.broadcast_to(apart[:, None, :], among.shape).copy()
    ratios[:, diagonal, diagonal] = among[:, diagonal, diagonal] = 1.0
    result[places] = y[places] - ((ratios / among).prod(axis=2) * values).sum(axis=1)
    return result


def smallest_share(network, first, second, factor=None):
    """Where on the line from one tangent to another the first eigenvalue vanishes: 0 at the first, 1 at the second.

    The tangent there is ``K1 + x (K2 - K1)``, singular first at one over the largest eigenvalue of
    ``(K1 - K2) v = mu K1 v``.

    Parameters
    ----------
    network : Network
    first, second : ndarray of float, shape (n_points, 2)
        Displacements [m]; None at rest.
    factor : Factor, optional
        First tangent factorised.

    Returns
    -------
    float
        Infinite where there is no such place.
    """
    here, there = network.tangent(first), network.tangent(second)
    factor = factor or network.factorize(first)
    inverse = LinearOperator(here.shape, factor.solve, dtype=float)
    # A fixed start, across the beam, since buckling bends it: the same numbers in every run.
    start = network.reduce(network.mesh.points[:, ::-1] ** 2 * [0.0, 1.0] + 1e-3 * network.mesh.points)
    largest = eigsh(here - there, 1, here, which="LA", Minv=inverse, v0=start, tol=1e-4, return_eigenvectors=False)[0]
    return 1.0 / largest if largest > 0 else np.inf

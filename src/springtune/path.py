"""The equilibrium path of a network as a power series of its load, and sensitivity curves from it.

With ``s = F / k`` a uniform network's path u(s) is analytic, so every stiffness k of a sensitivity curve lies on one
path. A series costs one factorisation and one back-substitution an order (asymptotic numerical method: Cochelin,
Damil and Potier-Ferry, Revue europeenne des elements finis 3(2):281, 1994); Pade approximants of the measured
displacement continue it past its poles. The nearest of these is the buckling load, even for a beam in tension.
"""

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

from .factors import SingularError

ORDER = 14
"""Order of a series that gives a whole curve, as a rule."""

HIGH_ORDER = 16
"""Order of one that the rule does not serve."""

CURVE_TOLERANCE = 1e-7
"""Largest estimated relative error of a displacement on a sensitivity curve."""

MAX_SOLVES = 3
"""Nonlinear solves that a curve may add to the series about rest."""

MAX_STEPS = 4
"""Factorisations of each of them: from near the path one or two do, and next to buckling none suffice."""


class Expansion:
    """Power series of the equilibrium path about one of its points.

    With ``sigma = s - s_0`` displacements, a spring's vector d, its length l and ``w = 1/l`` are power series. From
    ``l^2 = d.d``, ``w l = 1`` and the force ``k (d - L w d)``, order n follows from lower orders by one solve with the
    tangent at the point.

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

    Attributes
    ----------
    coefficients : ndarray of float, shape (order + 1, n_points, 2)
        The displacements are ``sum_n coefficients[n] sigma^n``.
    """

    def __init__(self, network, load, s, displacements, factor, order=ORDER):
        self.s, self.order = s, 0
        self._network, self._load, self._factor = network, load, factor
        self.coefficients = np.zeros((1, *network.held.shape))
        if displacements is not None:
            self.coefficients[0] = displacements
        # Component by component, shape (order + 1, 2, n_springs): sums over orders are then of whole rows.
        self._d = (network.rest_vectors + network.stretch(self.coefficients[0])).T[None].copy()
        self._length = np.sqrt(np.einsum("nji,nji->ni", self._d, self._d))
        self._inverse = 1.0 / self._length
        self.extend(order)

    def extend(self, order):
        """Add the orders up to one."""
        network = self._network
        d, length, inverse, coefficients = (
            _grown(array, order + 1) for array in (self._d, self._length, self._inverse, self.coefficients)
        )
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
            coefficients[n] = network.expand(self._factor.solve(right))
            d[n] = network.stretch(coefficients[n]).T
            change = np.einsum("ji,ji->i", d[0], d[n]) * inverse[0]
            length[n] += change
            inverse[n] -= inverse[0] ** 2 * change
        self._d, self._length, self._inverse, self.coefficients, self.order = d, length, inverse, coefficients, order

    def predict(self, s):
        """Displacements at ``s`` [m], shape (n_points, 2), from the series cut off before its smallest term."""
        powers = (s - self.s) ** np.arange(self.order + 1.0)
        sizes = np.abs(powers[1:]) * np.linalg.norm(self.coefficients[1:].reshape(self.order, -1), axis=1)
        kept = 2 + int(np.argmin(sizes))
        return np.tensordot(powers[:kept], self.coefficients[:kept], axes=1)

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
        # Scaled to the largest argument, or the powers of small displacements underflow.
        scale = np.abs(sigma).max() or 1.0
        scaled = series[1:] * scale ** np.arange(1.0, self.order + 1)
        x = sigma / scale
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

    From the series about rest; where its error estimate exceeds `CURVE_TOLERANCE`, from a series about a nonlinear
    solution in the midst of the loads that are left, at most `MAX_SOLVES` of them.

    Parameters
    ----------
    problem : StaticProblem
    weights : ndarray of float, shape (n_points, 2)
        Weights of the displacements to sum.
    targets : ndarray of float, shape (n,)
        Force over the reference stiffness, all of one sign [m].

    Returns
    -------
    values : ndarray of float, shape (n,)
        NaN where no equilibrium near the path was found: next to a buckling load there may be none.
    errors : ndarray of float, shape (n,)
        Estimated relative error.
    """
    targets = np.asarray(targets, dtype=float)
    values, errors = problem.rest.measure(weights, targets)
    if (errors > CURVE_TOLERANCE).any():
        problem.rest.extend(HIGH_ORDER)
        values, errors = problem.rest.measure(weights, targets)
    by_load = np.argsort(np.abs(targets))
    refused = np.zeros(len(targets), dtype=bool)
    for _ in range(MAX_SOLVES):
        left = by_load[((errors > CURVE_TOLERANCE) & ~refused)[by_load]]
        if not len(left):
            break
        middle = left[len(left) // 2]
        found = problem.newton(targets[middle], problem.rest.predict(targets[middle]), MAX_STEPS)
        refused[middle] = True
        if not found.converged:  # nor will loads beyond it; nearer ones may
            refused |= np.abs(targets) >= np.abs(targets[middle])
            continue
        values[middle], errors[middle] = np.tensordot(found.displacements, weights, axes=2), found.residual
        if len(left) > 1:
            try:
                factor = problem.network.factorize(found.displacements)
            except SingularError:
                continue
            local = Expansion(problem.network, problem.load, targets[middle], found.displacements, factor, HIGH_ORDER)
            better_values, better_errors = local.measure(weights, targets)
            better = better_errors < errors
            values[better], errors[better] = better_values[better], better_errors[better]
    values[errors > CURVE_TOLERANCE] = np.nan
    return values, errors


def stable_until(problem, targets):
    """Which loads of a path leave the beam stable, taking instability once begun to stay.

    A linear buckling analysis says where to look; the number of negative pivots of the tangent decides.

    Parameters
    ----------
    problem : StaticProblem
    targets : ndarray of float, shape (n,)
        Force over the reference stiffness, all of one sign [m].

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    by_load = np.argsort(np.abs(targets))
    loads = np.abs(targets)[by_load]
    share = smallest_share(problem.network, None, problem.rest.predict(targets[by_load[-1]]), problem.rest_factor)
    critical = share * loads[-1]
    result = np.zeros(len(targets), dtype=bool)
    if critical > 2.0 * loads[-1]:
        result[:] = True
        return result

    def stable(place):
        try:
            tangent = problem.network.factorize(problem.rest.predict(targets[by_load[place]]))
            return tangent.negative_pivots == 0
        except SingularError:
            return False

    count = int(np.searchsorted(loads, critical))  # of stable loads
    if count and not stable(count - 1):
        count -= 1
        while count and not stable(count - 1):
            count -= 1
    else:
        while count < len(loads) and stable(count):
            count += 1
    result[by_load[:count]] = True
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

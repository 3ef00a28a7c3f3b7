"""Power series of an equilibrium path about one of its points.

The path u(s) of ``s = F / k`` is analytic. A series costs one factorization and one back-substitution an order
(asymptotic numerical method: Cochelin, Damil and Potier-Ferry, Revue europeenne des elements finis 3(2):281, 1994).
Pade approximants continue it past its poles; the nearest pole is the buckling load, even for a beam in tension.
"""

from collections.abc import Callable
from copy import copy
from functools import cached_property

import numpy as np

from ..linalg.factors import Factor
from .network import Network

SERIES_ORDER = 14
"""Default order of a series for a whole curve."""

STEP_TOLERANCE = 1e-3
"""Difference of two approximants over the way from the point that ends a step along the path."""


class Expansion:
    """Power series of the equilibrium path about one of its points.

    Displacements, loads, a spring's vector d, its length l and ``w = 1/l`` are power series of ``sigma``: the growth of
    the load or, where the load may turn, the way along the path. From ``l^2 = d.d``, ``w l = 1`` and the force
    ``k (d - L w d)``, order n follows from lower orders by one solve with the tangent.

    `load` (unknowns,) is the pattern [1]; `s` [m] and `displacements` (None at rest) are the point. Displacements are
    ``sum_n coefficients[n] sigma^n``, shape (order + 1, n_points, 2), and loads ``sum_n loads[n] sigma^n`` [m].
    """

    def __init__(
        self,
        network: Network,
        load: np.ndarray,
        s: float,
        displacements: np.ndarray | None,
        factor: Factor,
        order: int = SERIES_ORDER,
        turning: bool = False,
        rough: bool = False,
    ) -> None:
        self.s, self.order, self.turning = s, 0, turning
        self._network, self._load = network, load
        self._solve = factor.step if rough else factor.solve
        self.coefficients = np.zeros((1, *network.held.shape))
        if displacements is not None:
            self.coefficients[0] = displacements
        self.loads = np.array([s, 1.0])
        # Component by component, shape (order + 1, 2, n_springs): sums over orders are then of whole rows.
        self._d = (network.rest_vectors + network.end_differences(self.coefficients[0])).T[None].copy()
        self._length = np.sqrt(np.einsum("nji,nji->ni", self._d, self._d))
        self._inverse = 1.0 / self._length
        self._first = np.zeros(0)
        self._extend(order)

    def extended(self, order: int) -> "Expansion":
        """Return the series up to a higher order; this one does not change."""
        longer = copy(self)
        longer._extend(order)
        return longer

    def _extend(self, order: int) -> None:
        network = self._network
        d, length, inverse, coefficients, loads = (
            _grown(array, order + 1) for array in (self._d, self._length, self._inverse, self.coefficients, self.loads)
        )
        weight = network.stiffness * network.rest_lengths
        for n in range(self.order + 1, order + 1):
            right = self._load
            if n > 1:
                # What lower orders give of order n, as if d[n] were 0.
                square = np.einsum("nji,nji->i", d[1:n], d[n - 1 : 0 : -1])
                square -= np.einsum("ni,ni->i", length[1:n], length[n - 1 : 0 : -1])
                length[n] = 0.5 * square * inverse[0]
                inverse[n] = -inverse[0] * np.einsum("ni,ni->i", length[1 : n + 1], inverse[n - 1 :: -1])
                known = np.einsum("ni,nji->ji", inverse[1 : n + 1], d[n - 1 :: -1])
                right = -network.gather((weight * known).T)
            change = self._solve(right)
            if n == 1:
                self._first = change
            elif self.turning:
                loads[n] = -(change @ self._first) / (self._first @ self._first)
                change += loads[n] * self._first
            coefficients[n] = network.expand(change)
            d[n] = network.end_differences(coefficients[n]).T
            along = np.einsum("ji,ji->i", d[0], d[n]) * inverse[0]
            length[n] += along
            inverse[n] -= inverse[0] ** 2 * along
        self._d, self._length, self._inverse, self.coefficients, self.order = d, length, inverse, coefficients, order
        self.loads = loads
        for name in ("_products", "_radius"):
            self.__dict__.pop(name, None)
        self._denominators: dict[int, np.ndarray] = {}

    def predict(self, s: float) -> np.ndarray:
        """Displacements at ``s`` [m], shape (n_points, 2), from the series cut off before its smallest term."""
        powers = (s - self.s) ** np.arange(self.order + 1.0)
        sizes = np.abs(powers[1:]) * np.linalg.norm(self.coefficients[1:].reshape(self.order, -1), axis=1)
        kept = 2 + int(np.argmin(sizes))
        return np.tensordot(powers[:kept], self.coefficients[:kept], axes=1)

    @cached_property
    def _products(self) -> np.ndarray:
        """Scalar products of the coefficients, shape (order + 1, order + 1)."""
        flat = self.coefficients.reshape(self.order + 1, -1)
        with np.errstate(over="ignore", invalid="ignore"):
            return flat @ flat.T

    @cached_property
    def _radius(self) -> float:
        """Value of the parameter that makes the last term as large as the first [m]."""
        sizes = np.sqrt(np.diag(self._products))
        return float((sizes[1] / sizes[-1]) ** (1.0 / (self.order - 1))) if sizes[-1] else 1.0

    def _denominator(self, lower: int) -> np.ndarray:
        """Return the denominator, over the radius, whose product with the series is smallest beyond the numerator."""
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

    def _shares(self, sigma: float, less: int = 0) -> np.ndarray:
        """Return the factors (order + 1,) of the coefficients in their approximant with one denominator."""
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

    def at(self, sigma: float) -> tuple[float, np.ndarray]:
        """Return load [m] and displacements [m], shape (n_points, 2), at sigma: a vector Pade approximant.

        All components share one denominator (Cochelin, Damil and Potier-Ferry, Int. J. Num. Meth. Eng. 37:1187, 1994).
        """
        shares = self._shares(sigma)
        return float(shares @ self.loads), np.tensordot(shares, self.coefficients, axes=1)

    def reach(self, sign: float) -> tuple[float, bool]:
        """Return the largest sigma [m] from which a solve can start, or 0, and whether the load turns there."""
        if not np.isfinite(self._products).all():  # next to a singular point
            return 0.0, False
        sigma = 2.0 * sign * self._radius
        for _ in range(40):
            shares = self._shares(sigma)
            apart = shares - self._shares(sigma, 1)
            way = np.concatenate([[0.0], shares[1:]])
            close = apart @ self._products @ apart <= STEP_TOLERANCE**2 * (way @ self._products @ way)
            if close and abs(apart @ self.loads) <= STEP_TOLERANCE * abs(way @ self.loads):
                break
            sigma *= 0.75
        loads = [sign * (self._shares(part * sigma) @ self.loads) for part in np.linspace(0.0, 1.0, 33)]
        falls = np.flatnonzero(np.diff(loads) <= 0)
        return (sigma * (falls[0] / 32.0), True) if len(falls) else (sigma, False)

    def parameter(self, s: float, farthest: float, less: int = 0) -> float:
        """Parameter of a load that lies between the point and that of the parameter `farthest`."""
        if not self.turning:
            return s - self.s
        apart = [self._shares(sigma, less) @ self.loads - s for sigma in (0.0, farthest)]
        if apart[0] * apart[1] >= 0:  # the last one but for rounding, or for what the approximants differ by
            return farthest
        from scipy.optimize import brentq  # here: the import takes as long as many scenes, which do without

        return brentq(lambda sigma: self._shares(sigma, less) @ self.loads - s, 0.0, farthest, xtol=1e-300, rtol=1e-14)

    def value(self, weights: np.ndarray, s: float, farthest: float) -> tuple[float, float]:
        """Weighted sum of the displacements at a load up to that of a parameter, and the estimated relative error."""
        series = np.tensordot(self.coefficients, weights, axes=2)
        best, second, third = (self._shares(self.parameter(s, farthest, less), less) @ series for less in range(3))
        error = max(abs(best - second), abs(second - third)) / abs(best) if best else np.inf
        return float(best), error if np.isfinite(error) else np.inf

    def measure(self, weights: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the weighted displacement at each ``s`` [m] by Pade approximants, and an error estimate."""
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


def _grown(array: np.ndarray, length: int) -> np.ndarray:
    """The array with zeros behind it along its first axis."""
    grown = np.zeros((length, *array.shape[1:]))
    grown[: len(array)] = array
    return grown


def _pade(series: np.ndarray, upper: int, lower: int) -> Callable[[np.ndarray], np.ndarray]:
    """Pade approximant of a series: numerator of degree `upper` over denominator of degree `lower`, as a function."""
    padded = np.concatenate([np.zeros(lower), series])
    matrix = np.array([padded[upper + row : upper + row + lower][::-1] for row in range(1, lower + 1)])
    # Least squares: where the series needs fewer poles the matrix is singular, and the smallest solution is right.
    solution = np.linalg.lstsq(matrix, -series[upper + 1 : upper + lower + 1], rcond=1e-14)[0]
    denominator = np.concatenate([[1.0], solution])
    numerator = np.convolve(denominator, series)[: upper + 1]
    return lambda x: np.polyval(numerator[::-1], x) / np.polyval(denominator[::-1], x)

"""Equilibria of a network under a growing load: linear, nonlinear, and along the whole path.

The load is ``s`` times a fixed pattern of forces of total 1; ``s = F / k`` is force over reference stiffness [m]. So
one path serves every force, material and uniform stiffness of a mesh.

The path u(s) is analytic. Its power series, an `Expansion`, costs one factorization and one back-substitution an order
(asymptotic numerical method: Cochelin, Damil and Potier-Ferry, Revue europeenne des elements finis 3(2):281, 1994).
Pade approximants continue it past its poles; the nearest is the buckling load, even for a beam in tension.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np

from ..linalg.factors import Factor
from ..linalg.factors import SingularError as SingularError
from ..problem.quantities import Status
from .continuation import continue_path
from .network import Network
from .newton import Equilibrium, LoadedNetwork, uncertainty

FAR_STRETCH = 0.15  # stretch of a spring beyond which an equilibrium is sought along the path from rest

FAR_CHANGE = 0.3  # change of a spring's vector over its length above which this applies too

UNSNAPPED_CHANGE = 1e-3  # change of a spring's vector over its length below which no path turns back

SURPRISING_CHANGE = 0.1
"""Distance of a spring's vector from its prediction, over its length, above which a load step is halved."""

SMALLEST_STEP = 1 / 64  # load step in which Newton's method has to converge, over the load

SHORTEST_STEP = 1 / 2048  # smallest load step that distinguishes springs that turn fast from springs that snap

LARGEST_BEND = 0.1  # largest distance of a parabola's middle from the straight way's, over its length, to use it

FORESEEN_SHARE, WORK_SHARE = 0.25, 0.02
"""Limits without a snap: distance from the guess over the way, and work of out-of-balance forces in its middle over the
load's. Of 153 snaps of arches the smallest values are 0.35 and 0.05."""

WAY_INCREMENTS = 8
"""Increments of a path behind a limit point, over the straight way from there to a stable equilibrium."""

HIGH_ORDER = 16  # order of a series if the default order fails

START_ORDER = 3  # orders of the series that starts Newton's method: together they cost half of a factorization


SERIES_ORDER = 14  # default order of a series for a whole curve

STEP_TOLERANCE = 1e-3  # difference of two approximants over the way from the point that ends a step along the path


class Expansion:
    """Power series of the equilibrium path about one of its points.

    Displacements, loads, a spring's vector d, its length l and ``w = 1/l`` are power series of ``sigma``: the growth of
    the load or, where the load may turn, the way along the path. From ``l^2 = d.d``, ``w l = 1`` and the force
    ``k (d - L w d)``, order n follows from lower orders by one solve with the tangent.

    `load` (unknowns,) is the pattern [1]; `s` [m] and `displacements` (None at rest) are the point. Displacements are
    ``sum_n coefficients[n] sigma^n``, shape (order + 1, n_points, 2), and loads ``sum_n loads[n] sigma^n`` [m].
    `known` is a shorter series about the same point, whose orders are taken over.
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
        known: "Expansion | None" = None,
    ) -> None:
        self.s, self.order, self.turning = s, order, turning
        solve = factor.step if rough else factor.solve
        self.coefficients = coefficients = np.zeros((order + 1, *network.held.shape))
        if displacements is not None:
            coefficients[0] = displacements
        self.loads = np.array([s, 1.0, *np.zeros(order - 1)])
        self._denominators: dict[int, np.ndarray] = {}
        # Component by component: sums over orders are then of whole rows.
        d = np.zeros((order + 1, 2, len(network.rest_lengths)))
        length, inverse = np.zeros((2, order + 1, d.shape[2]))
        d[0] = (network.rest_vectors + network.end_differences(coefficients[0])).T
        length[0] = np.sqrt(np.einsum("ji,ji->i", d[0], d[0]))
        inverse[0] = 1.0 / length[0]
        self._of_springs = () if rough else (d, length, inverse)  # only a start: these take 32 bytes a spring and order
        if known is not None:
            for longer, one in zip((coefficients, d, length, inverse), (known.coefficients, *known._of_springs)):
                longer[: len(one)] = one
        weight = network.stiffness * network.rest_lengths
        for n in range(1 if known is None else known.order + 1, order + 1):
            right = load
            if n > 1:
                # What lower orders give of order n, as if d[n] were 0.
                square = np.einsum("nji,nji->i", d[1:n], d[n - 1 : 0 : -1])
                square -= np.einsum("ni,ni->i", length[1:n], length[n - 1 : 0 : -1])
                length[n] = 0.5 * square * inverse[0]
                inverse[n] = -inverse[0] * np.einsum("ni,ni->i", length[1 : n + 1], inverse[n - 1 :: -1])
                known = np.einsum("ni,nji->ji", inverse[1 : n + 1], d[n - 1 :: -1])
                right = -network.gather((weight * known).T)
            change = solve(right)
            if turning and n > 1:
                first = network.reduce(coefficients[1])
                self.loads[n] = -(change @ first) / (first @ first)
                change += self.loads[n] * first
            coefficients[n] = network.expand(change)
            d[n] = network.end_differences(coefficients[n]).T
            along = np.einsum("ji,ji->i", d[0], d[n]) * inverse[0]
            length[n] += along
            inverse[n] -= inverse[0] ** 2 * along

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


def _pade(series: np.ndarray, upper: int, lower: int) -> Callable[[np.ndarray], np.ndarray]:
    """Pade approximant of a series: numerator of degree `upper` over denominator of degree `lower`, as a function."""
    padded = np.concatenate([np.zeros(lower), series])
    matrix = np.array([padded[upper + row : upper + row + lower][::-1] for row in range(1, lower + 1)])
    # Least squares: where the series needs fewer poles the matrix is singular, and the smallest solution is right.
    solution = np.linalg.lstsq(matrix, -series[upper + 1 : upper + lower + 1], rcond=1e-14)[0]
    denominator = np.concatenate([[1.0], solution])
    numerator = np.convolve(denominator, series)[: upper + 1]
    return lambda x: np.polyval(numerator[::-1], x) / np.polyval(denominator[::-1], x)


class StaticProblem(LoadedNetwork):
    """Network under a load `pattern` of forces [1] and `given` displacements, both scaled by ``s``.

    `dead` is the part that keeps its direction; `load_norm`, which residuals are over, includes reactions to `given`.
    """

    @cached_property
    def start(self) -> Expansion:
        """Short series about rest: where Newton's method starts."""
        return Expansion(self.network, self.load, 0.0, None, self.network.rest_factor, order=START_ORDER, rough=True)

    @cached_property
    def rest(self) -> Expansion:
        """Long series about rest, for a whole curve."""
        return Expansion(self.network, self.load, 0.0, None, self.network.rest_factor)

    @cached_property
    def long_rest(self) -> Expansion:
        """Series about rest of higher order."""
        return Expansion(self.network, self.load, 0.0, None, self.network.rest_factor, HIGH_ORDER, known=self.rest)

    def linear(self, s: float) -> Equilibrium:
        """Return the equilibrium with linear kinematics."""
        slope, residual, error = self._slope
        reason = uncertainty(error)
        return Equilibrium(s * slope, not reason, 1, residual, self.network.rest_factor, reason, error)

    def judge(self, s: float, found: Equilibrium) -> tuple[Status, str, float]:
        """Return status, message and negative pivots of an equilibrium; NaN pivots if it has no regular tangent."""
        share = f"{100 * found.unstable_share:.3g} %"
        if found.limit_share < 1 and not found.unstable_share < found.limit_share:
            at = f"{100 * found.limit_share:.3g} % of the load"
            at += "; after a snap the body reaches a stable equilibrium that carries the load" * found.snapped
            return Status.UNSTABLE, f"limit point: the path from rest turns back and becomes unstable at {at}", np.nan
        if found.unstable_share < 1 and not found.converged:
            return Status.UNSTABLE, f"buckled: the path from rest is unstable at {share} of the load", np.nan
        if not found.converged:
            too_large = found.load_share < 1 and "ill-conditioned" not in found.reason
            remedy = "; take a smaller force or linear kinematics" if too_large else ""
            return Status.NOT_CONVERGED, f"{found.reason}; last residual {found.residual:.1e}{remedy}", np.nan
        assert found.factor is not None  # of what converged
        try:
            pivots, flutters = self.stability(s, found.displacements, found.factor)
        except SingularError:
            return Status.UNSTABLE, "limit point: the tangent is singular", np.nan
        if pivots:
            counted = f"{pivots} negative pivot{'s' if pivots > 1 else ''}"
            return Status.UNSTABLE, f"buckled: this equilibrium is unstable ({counted})", pivots
        if flutters:
            return Status.UNSTABLE, "it flutters: two modes have merged into a complex pair", pivots
        if found.unstable_share < 1:
            return Status.UNSTABLE, f"buckled: the path to this equilibrium is unstable at {share} of the load", pivots
        objections = (energy.objection(found.displacements) for energy in self.network.energies)
        return Status.SOLVED, "; ".join(filter(None, objections)), pivots

    def nonlinear(self, s: float) -> Equilibrium:
        """Return the equilibrium with the springs' full length law, on the path from rest.

        Newton's method starts from the series about rest; if it fails, from the linear solution. Load steps replace
        what fails, what goes beyond `FAR_STRETCH` or `FAR_CHANGE`, and what has an unstable point half-way from rest.
        """
        iterations = 0
        starts: list[Callable[[float], np.ndarray]] = [lambda s: s * self.slope]
        if not self.network.energies and self.follower is None and self.given is None:
            # The series is of springs under dead loads.
            starts.insert(0, lambda s: self.start.predict(s))
        for start in starts:
            found = self.newton(s, start(s))
            iterations += found.iterations
            if found.converged:
                network, moved = self.network, found.displacements
                change = network.largest_change(moved)  # never below the stretch
                near = change <= FAR_STRETCH or change <= FAR_CHANGE and network.largest_stretch(moved) <= FAR_STRETCH
                if near and (
                    change <= UNSNAPPED_CHANGE
                    or self._has_no_snap(0.0, 0 * moved, s, moved, s * self.slope)
                    or self._is_unstable(s, found)
                ):
                    return replace(found, iterations=iterations)
                break
        return self._solve_in_steps(s, found, iterations)

    def departure(self, displacements: np.ndarray) -> str:
        """Return why the path from rest does not lead to a stable equilibrium under the load; mostly empty."""
        network = self.network
        if network.largest_change(displacements) <= UNSNAPPED_CHANGE or self.holds(0.5, 0.5 * displacements):
            return ""
        found = self.nonlinear(1.0)
        status, message, _ = self.judge(1.0, found)
        if status is Status.SOLVED:
            apart = network.largest_change(displacements - found.displacements) > SURPRISING_CHANGE
            return "the path from rest leads to another stable equilibrium" if apart else ""
        return message if found.limit_share < 1 else ""

    def _has_no_snap(
        self, s: float, here: np.ndarray, to: float, there: np.ndarray, guess: np.ndarray, bend: float = 0.25
    ) -> bool:
        """Return whether the way from one equilibrium to the next, bent towards a guess, is stable in its middle."""
        network = self.network
        middle, off, way = 0.5 * (here + there), there - guess, there - here
        if bend * np.linalg.norm(off) <= LARGEST_BEND * np.linalg.norm(way):
            middle = middle - bend * off
        half = 0.5 * (s + to)
        if self.given is None and network.largest_change(off) <= FORESEEN_SHARE * network.largest_change(way):
            along = network.reduce(way)
            work = (to - s) * float(self.load_at(there) @ along)
            if abs(float(self.balance(half, middle)[0] @ along)) <= WORK_SHARE * abs(work):
                return True
        return self.holds(half, middle)

    def _is_unstable(self, s: float, found: Equilibrium) -> bool:
        """Return whether a path leaves an equilibrium; flutter does not count."""
        assert found.factor is not None  # of what converged
        try:
            return self.stability(s, found.displacements, found.factor)[0] > 0
        except SingularError:
            return True

    def _solve_in_steps(self, s: float, direct: Equilibrium, iterations: int) -> Equilibrium:
        """Load steps from rest, each started from the last two equilibria, halved where Newton's method fails."""
        done, step = 0.0, 0.25  # of the load
        last = before = np.zeros(self.network.held.shape)
        last_step, unstable = 0.0, np.nan
        while True:
            step = min(step, 1.0 - done)
            here, there = done * s, (done + step) * s
            guess = last + (last - before) * (step / last_step) if last_step else there * self.slope
            found = self.newton(there, guess)
            iterations += found.iterations
            # Where springs are far from where the path pointed, some of them have snapped.
            missed = self.network.largest_change(found.displacements - guess) > SURPRISING_CHANGE
            looked_at = found.converged and np.isnan(unstable)
            leaves = looked_at and self._is_unstable(there, found)
            bend = 0.25 * step / (step + last_step)
            way = here, last, there, found.displacements, guess, bend
            apart = looked_at and not leaves and not self._has_no_snap(*way)
            limit, inverts, failed = np.nan, False, apart or not found.converged
            if failed and step <= SMALLEST_STEP and last_step:
                limit, lost, end, inverts = continue_path(self, here, last, before, there)
                if np.isnan(unstable) and not limit / s <= lost / s:
                    unstable = lost / s
                if end is not None and np.isnan(lost):
                    guess = self.network.expand(end.u)
                    near = self.newton(there, guess)
                    close = self.network.largest_change(near.displacements - guess) <= SURPRISING_CHANGE
                    if near.converged and close and not self._is_unstable(there, near):
                        found, failed, missed = near, False, False
            if not failed and (step <= SHORTEST_STEP or not missed):
                if leaves or missed and np.isnan(unstable):
                    unstable = done + step if leaves else done
                before, last, last_step = last, found.displacements, step
                done += step
                if done >= 1.0:
                    return replace(found, iterations=iterations, unstable_share=unstable)
                step *= 1.5
            elif failed and (
                step <= SHORTEST_STEP or not np.isnan(limit) or not found.converged and step <= SMALLEST_STEP
            ):
                reason = "cells turn inside out" if inverts else found.reason or "no stable path"
                reason += f" beyond {100 * done:.3g} % of the load"
                snapped = not np.isnan(limit) and self._snaps(s, direct, here, last, before)
                found = replace(found, converged=False, iterations=iterations, reason=reason, unstable_share=unstable)
                return replace(found, load_share=done, last=last, limit_share=limit / s, snapped=snapped)
            else:
                step *= 0.5

    def _snaps(self, s: float, direct: Equilibrium, here: float, last: np.ndarray, before: np.ndarray) -> bool:
        """Return whether a path that turns back beyond a load regains the whole load in a stable equilibrium."""
        if not direct.converged or self._is_unstable(s, direct):
            return False
        way = float(np.linalg.norm(self.network.reduce(direct.displacements - last)))
        return continue_path(self, here, last, before, s, way / WAY_INCREMENTS).end is not None

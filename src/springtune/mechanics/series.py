"""Sensitivity curves: the displacement under many loads ``s = F / k`` from one equilibrium path, by power series."""

from bisect import bisect_left
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from ..linalg.factors import Factor, SingularError
from .statics import HIGH_ORDER, Expansion, StaticProblem

CURVE_TOLERANCE = 1e-7  # largest estimated relative error of a displacement on a sensitivity curve

CHECKED_STRETCH = 0.1
"""Largest relative length change of a spring between two checked tangents; stability can vary within 0.25."""

PATH_ORDER = 10  # order of a series along the path

MAX_SERIES = 3  # most series in the load, including that about rest

MAX_CORRECTIONS = 4  # steps of Newton's method with one tangent that bring a prediction to an equilibrium

MOST_UNKNOWNS = 4000
"""Unknowns above which each load is solved alone: samples next to buckling would take longer than all others."""

MAX_STEPS = 60  # steps along the path beyond the series about rest

LIMIT_LOAD_TOLERANCE = 1e-3  # share of the load by which a path may still rise to a limit point when it is abandoned

ERROR_POWER = 8  # power of the way along a series with which its error is taken to grow; that of order 10 grows faster

MAX_STEP_HALVINGS = 6  # most halvings of a step whose end is not a stable equilibrium

FEW_FACTORIZATIONS = 5  # most factorizations of a solve from a prediction; one or two suffice near the path

PATH_DISTANCE = 0.02
"""Distance of a spring's vector from its prediction, over its length, beyond which a solve found another path."""


class _Point(NamedTuple):
    """A predicted point, corrected; the tangent is that of the prediction."""

    displacements: np.ndarray
    factor: Factor
    stable: bool
    value: float
    error: float
    converged: bool


class StablePath:
    """Stable part of an equilibrium path from rest, as far as some loads need it.

    `values` are the weighted displacements at `targets`, loads of one sign [m], and `stable` tells where it is stable.

    It begins with the series about rest. Where that fails, as for a beam of an unsymmetric mesh next to buckling, a
    series predicts a point and a solve corrects it. Between two stable points of one series the path counts as stable
    if no spring's length changes by more than `CHECKED_STRETCH`. Stability that was lost is not regained.

    `stable_to` is the largest load, without its sign, known to be carried [m]; `end` is why the path ends early.
    """

    def __init__(self, problem: StaticProblem, weights: np.ndarray, targets: np.ndarray) -> None:
        self.problem, self.weights = problem, weights
        targets = np.asarray(targets, dtype=float)
        self._sign = np.sign(targets[0])
        loads, places = np.unique(np.abs(targets), return_inverse=True)
        self._last_load, loads = loads[-1], self._sign * loads
        self._series: list[tuple[Expansion, float]] = []
        self._pieces: list[tuple[Expansion, float, float, float]] = []
        self._turns = False
        self.stable_to, self._unstable_from, self.end = 0.0, np.inf, ""
        values, good, count = self._by_series(loads)
        stable = np.zeros(len(loads), dtype=bool)
        stable[: bisect_left(loads[:count], True, key=lambda s: not self._is_stable(abs(s)))] = True
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

    def value(self, s: float) -> float:
        """Return the weighted displacement [m] at a load [m] on the stable path, or NaN beyond it."""
        load = abs(s)
        if not self._series or load > self._series[-1][1]:
            return self._value_beyond(load)
        if not self._is_stable(load):
            return np.nan
        return float(self._series_of(load).measure(self.weights, np.array([s]))[0][0])

    # -- series of the load -----------------------------------------------------------------------------------------

    def _by_series(self, loads: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
        """Return displacements by series, whether that about rest is accurate, and the number of proved loads."""
        self._rest = series = self.problem.rest
        values, errors = series.measure(self.weights, loads)
        if (errors > CURVE_TOLERANCE).any():
            self._rest = series = self.problem.long_rest
            values, errors = series.measure(self.weights, loads)
        good, count, served, before = errors <= CURVE_TOLERANCE, 0, errors <= CURVE_TOLERANCE, None
        for _ in range(MAX_SERIES):
            end = count + int(np.argmin([*served, False]))
            number, point = self._served(series, loads[count:end], values[count:end])
            if point is None:
                break
            count += number
            self._series.append((series, abs(loads[count - 1])))
            self._far = point
            self._bracket(abs(loads[count - 1]), point, before)
            if count == len(loads) or self._unstable_from < np.inf:
                break
            if before is None and good[count:].any() and self._is_on_other_path(loads[np.flatnonzero(good)[-1]]):
                self._turns = True
                break
            try:
                factor = self.problem.network.factorize_tangent(point.displacements)
            except SingularError:
                break
            before, problem = point.displacements, self.problem
            series = Expansion(problem.network, problem.load, loads[count - 1], before, factor, HIGH_ORDER)
            values[count:], errors = series.measure(self.weights, loads[count:])
            served = errors <= CURVE_TOLERANCE
        return values, good, count

    def _served(self, series: Expansion, loads: np.ndarray, values: np.ndarray) -> tuple[int, _Point | None]:
        """Return how many of successive loads a series serves, and the corrected point at the last of them."""
        network, number = self.problem.network, len(loads)
        while number > 0:
            s, value = loads[number - 1], values[number - 1]
            displacements = series.at(s - series.s)[1]
            if np.isfinite(displacements).all() and not network.inverted(displacements):
                with suppress(SingularError):
                    factor = network.factorize_tangent(displacements)
                    point = self._corrected(s, value, displacements, factor, factor.negative_pivots == 0)
                    if point.error <= CURVE_TOLERANCE:
                        return number, point
            number -= 1 + number // 8
        return 0, None

    def _series_of(self, load: float) -> Expansion:
        """The first series that serves a load."""
        return next(series for series, last in self._series if load <= last)

    def _corrected(self, s: float, value: float, displacements: np.ndarray, factor: Factor, stable: bool) -> _Point:
        """Correct a predicted point by steps with one tangent; its error is that of a value."""
        network = self.problem.network
        size = before = np.inf
        for _ in range(MAX_CORRECTIONS):
            with np.errstate(over="ignore", invalid="ignore"):
                missing = s * self.problem.load - network.free_forces_over_k(displacements)
                step = network.expand(factor.solve(missing))
                before, size = size, float(np.linalg.norm(step) / np.linalg.norm(displacements))
            if not size < before:
                break
            displacements = displacements + step
            if size <= 0.01 * CURVE_TOLERANCE:
                break
        better = float(np.tensordot(displacements, self.weights, axes=2))
        error = abs(better - value) / abs(better) if size <= CURVE_TOLERANCE else np.inf
        return _Point(displacements, factor, stable, better, error, size <= 0.01 * CURVE_TOLERANCE)

    def _bracket(self, last: float, point: _Point, before: np.ndarray | None) -> None:
        """Look at the stability between the point up to which the path is stable and the last of a series."""
        first = self.stable_to
        steps = 1 + int(self._stretch_between(point.displacements, 0.0 if before is None else before) / CHECKED_STRETCH)
        for load in np.linspace(first, last, steps + 1)[1:]:
            if not (point.stable if load == last else self._stable_at(load)):
                self._unstable_from = load
                break
            self.stable_to = load

    def _stretch_between(self, displacements: np.ndarray, before: np.ndarray | float) -> float:
        """Largest change of a spring's length from one place to another, over that at rest [1]."""
        network = self.problem.network
        fields = np.broadcast_to(before, network.held.shape), displacements
        first, second = (np.linalg.norm(network.rest_vectors + network.end_differences(one), axis=1) for one in fields)
        return float((np.abs(second - first) / network.rest_lengths).max())

    def _stable_at(self, load: float) -> bool:
        """Whether the point that a series of the load predicts is stable."""
        series = self._series_of(load)
        return self.problem.network.is_stable(series.at(self._sign * load - series.s)[1])

    def _is_stable(self, load: float) -> bool:
        """Whether the path is stable up to a load that a series serves."""
        if self.stable_to < load < self._unstable_from:
            if self._stable_at(load):
                self.stable_to = load
            else:
                self._unstable_from = load
        return load <= self.stable_to

    def _check_between(self, loads: np.ndarray, values: np.ndarray, stable: np.ndarray) -> None:
        """Correct values off their neighbours' trend: an approximant may have a pole next to a zero."""
        count = int(stable.sum())
        doubtful = np.abs(trend_deviation(loads[:count], values[:count])) > CURVE_TOLERANCE * np.abs(values[:count])
        for place in np.flatnonzero(doubtful):
            s = loads[place]
            series = self._series_of(abs(s))
            guess = series.at(s - series.s)[1]
            point = self._corrected(s, values[place], guess, self._far.factor, True)
            if not point.error <= CURVE_TOLERANCE:
                values[place] = point.value if point.converged else self._solved_value(s, guess)
                stable[place] = np.isfinite(values[place])

    def _check_others(self, loads: np.ndarray, values: np.ndarray, good: np.ndarray, found: np.ndarray) -> None:
        """Keep series values beyond the stable path: equilibria, though not on that path."""
        rest, others = self._rest, np.flatnonzero(good & ~found)
        for group in np.split(others, np.flatnonzero(np.diff(others) > 1) + 1):
            number, last = self._served(rest, loads[group], values[group])
            for start, place in enumerate(group[:number]):  # the nearest to the path's turn is the worst
                assert last is not None
                s = loads[place]
                if self._corrected(s, values[place], rest.at(s)[1], last.factor, False).error <= CURVE_TOLERANCE:
                    found[group[start:number]] = True
                    break

    # -- beyond it --------------------------------------------------------------------------------------------------

    def _follow(
        self, loads: np.ndarray, values: np.ndarray, good: np.ndarray, stable: np.ndarray, found: np.ndarray
    ) -> None:
        """Values at the loads that the series about rest does not serve, as far as the path is stable."""
        if self._turns and self.problem.network.unknowns > MOST_UNKNOWNS:
            return
        for place in np.flatnonzero(~found):
            if self._turns and good[place] and self._is_on_other_path(loads[place]):
                return
            values[place] = self._value_beyond(abs(loads[place]))
            found[place] = stable[place] = np.isfinite(values[place])
            if self.end and abs(loads[place]) > self.stable_to:
                return

    def _is_on_other_path(self, s: float) -> bool:
        """Return whether the series about rest now follows another, unstable path."""
        displacements = self._rest.at(s)[1]
        near = self.problem.balance(s, displacements)[1] <= 1e-3
        return near and not self.problem.network.is_stable(displacements)

    def _value_beyond(self, load: float) -> float:
        """Return the weighted displacement at a load beyond the series, or NaN off the stable path."""
        while self.stable_to < load and not self.end:
            self._advance(load)
        if load > self.stable_to:
            return np.nan
        series, farthest, _, missed = next(piece for piece in self._pieces if piece[2] >= load)
        s = self._sign * load
        value, error = series.value(self.weights, s, farthest)
        sigma = series.parameter(s, farthest)
        if max(error, missed * (sigma / farthest) ** ERROR_POWER) <= 0.1 * CURVE_TOLERANCE:
            return value
        return self._solved_value(s, series.at(sigma)[1])

    def _solve(self, s: float, guess: np.ndarray) -> tuple[np.ndarray | None, Factor | None]:
        """Return displacements (n_points, 2) and factor of the equilibrium next to a guess; None if there is none."""
        network = self.problem.network
        if network.inverted(guess):
            return None, None
        found = self.problem.newton(s, guess, FEW_FACTORIZATIONS)
        near = found.converged and network.largest_change(found.displacements - guess) <= PATH_DISTANCE
        if not near or found.factor is None:
            return None, None
        try:
            return found.displacements, found.factor if found.factor.negative_pivots == 0 else None
        except SingularError:
            return found.displacements, None

    def _solved_value(self, s: float, guess: np.ndarray) -> float:
        """Weighted displacement of the stable equilibrium next to a guess; NaN where there is none."""
        displacements, factor = self._solve(s, guess)
        if displacements is None or factor is None:
            return np.nan
        return float(np.tensordot(displacements, self.weights, axes=2))

    def _last_point(self) -> tuple[float, np.ndarray | None, Factor | None]:
        """Load, displacements (None at rest) and tangent of the last point; no tangent where it is not stable."""
        if self._pieces:
            return self._last
        if not self.stable_to:
            return 0.0, None, self.problem.network.rest_factor
        s = self._sign * self.stable_to
        return s, *self._solve(s, self._far.displacements)

    def _advance(self, load: float) -> None:
        """Take one more step along the path, towards a load."""
        s, displacements, factor = self._last_point()
        if factor is None:
            self.end = "no stable equilibrium found"
            return
        series = Expansion(self.problem.network, self.problem.load, s, displacements, factor, PATH_ORDER, turning=True)
        farthest, turns = series.reach(self._sign)
        most = abs(series.at(farthest)[0])
        if turns and most - abs(s) <= LIMIT_LOAD_TOLERANCE * most and load >= most:
            self.end = "limit point"
            return
        if load < most or not turns:
            farthest = series.parameter(self._sign * (load if turns else min(self._last_load, most)), farthest)
        else:
            farthest *= 0.9
        start = 0.0 if displacements is None else displacements
        while self._stretch_between(series.at(farthest)[1], start) > CHECKED_STRETCH:
            farthest *= 0.75
        self._end_step(series, farthest)

    def _end_step(self, series: Expansion, farthest: float) -> None:
        """Find the stable equilibrium at the end of a step, halved until there is one."""
        unstable = np.inf
        for _ in range(MAX_STEP_HALVINGS):
            s, guess = series.at(farthest)
            displacements, factor = self._solve(s, guess) if farthest else (None, None)
            if displacements is not None and factor is not None:
                value, guessed = (np.tensordot(one, self.weights, axes=2) for one in (displacements, guess))
                self._pieces.append((series, farthest, abs(s), float(abs(guessed / value - 1.0))))
                self._last, self.stable_to = (s, displacements, factor), abs(s)
                break
            if displacements is not None:
                unstable = abs(s)
            farthest *= 0.5
        if factor is None or unstable <= (1.0 + LIMIT_LOAD_TOLERANCE) * self.stable_to:
            self.end = "no stable equilibrium found" if unstable == np.inf else "unstable"
        elif len(self._pieces) == MAX_STEPS:
            self.end = "too many steps"


class LinearPath:
    """Path of a network in linear kinematics, with the interface of `StablePath`."""

    end = ""

    def __init__(self, problem: StaticProblem, weights: np.ndarray, targets: np.ndarray) -> None:
        self._slope = float(np.tensordot(problem.slope, weights, axes=2))
        self.values, self.stable = self._slope * targets, np.ones(len(targets), dtype=bool)
        self.stable_to = np.inf

    def value(self, s: float) -> float:
        """Weighted displacement [m] at a load [m]."""
        return self._slope * s


def trend_deviation(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the distance of `y` (n,) from polynomials in sorted `x` through three neighbours on either side, or 0."""
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

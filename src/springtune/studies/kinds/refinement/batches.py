"""Values of a refinement: in batches, where the error changes its sign or crosses a tolerance.

Values have places from 0 to 1 between the two ends. The first batch is evenly spaced. Every further one halves the
intervals in which the error crosses zero or the tolerance and which are wider than the resolution. So places do not
depend on how many values a study allows.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Rule:
    """Ends of a refinement, and how it adds values.

    `points` is the size of the first batch, `most` the largest number of values. Intervals up to `resolution` [1], a
    share of the distance of the ends, are not halved. `tolerance` is the size of the error that matters [1].

    Examples
    --------
    >>> rule = Rule(1.0, 100.0, 3, True, 0.01, 0.1, 9)
    >>> [round(rule.value(place), 6) for place in (0, 0.5, 1)]
    [1.0, 10.0, 100.0]
    """

    first: float
    last: float
    points: int
    logarithmic: bool
    tolerance: float
    resolution: float
    most: int

    def value(self, place: float) -> float:
        """Value at a place from 0 to 1."""
        if place in (0, 1):
            return self.last if place else self.first
        if self.logarithmic:
            return float(f"{self.first * (self.last / self.first) ** place:.12g}")
        return float(f"{self.first + place * (self.last - self.first):.12g}")

    @property
    def levels(self) -> tuple[float, float, float]:
        """Errors whose crossings matter [1]."""
        return 0.0, self.tolerance, -self.tolerance


@dataclass(frozen=True)
class Crossing:
    """Value at which the error is `level` [1], by a straight line between two values.

    `width` is the distance of these values, `change` the change of the error between them.
    """

    level: float
    value: float
    width: float
    change: float


def value_key(file: str, value: float) -> str:
    """Key of a value's result in the file of its refinement."""
    return f"{file} {value:.12g}"


def refine(
    rule: Rule, solve: Callable[[list[float]], Sequence[float] | None]
) -> tuple[list[float], list[int], list[float]]:
    """Places of values, their batches and errors, batch after batch.

    `solve` returns the errors of a batch of values [1], NaN where there is none, or None to end here.

    Examples
    --------
    >>> rule = Rule(0.0, 1.0, 3, False, 10.0, 0.1, 100)
    >>> places, batches, errors = refine(rule, lambda values: [value - 0.3 for value in values])
    >>> places, batches
    ([0.0, 0.5, 1.0, 0.25, 0.375, 0.3125], [0, 0, 0, 1, 2, 3])
    """
    known: dict[float, tuple[int, float]] = {}
    wanted, batch = [step / (rule.points - 1) for step in range(rule.points)], 0
    while wanted:
        errors = solve([rule.value(place) for place in wanted])
        if errors is None:
            break
        known |= {place: (batch, float(error)) for place, error in zip(wanted, errors)}
        wanted, batch = _halved(rule, known)[: rule.most - len(known)], batch + 1
    return list(known), [batch for batch, _ in known.values()], [error for _, error in known.values()]


def _halved(rule: Rule, known: dict[float, tuple[int, float]]) -> list[float]:
    """Middles of the intervals to halve, the widest first."""
    places, found = sorted(known), []
    for low, high in zip(places, places[1:]):
        ends = known[low][1], known[high][1]
        if high - low > rule.resolution and any(_crosses(*ends, level) for level in rule.levels):
            found.append((low - high, (low + high) / 2))
    return [middle for _, middle in sorted(found)]


SAME = 1e-9
"""Largest difference of equal errors [1]: rounding decides the sign for an exact definition."""


def _crosses(one: float, other: float, level: float) -> bool:
    """Whether two errors are on different sides of a level; a missing one is on no side."""
    return bool(np.isfinite([one, other]).all()) and (one >= level - SAME) != (other >= level - SAME)


def crossings(rule: Rule, places: Sequence[float], errors: Sequence[float]) -> list[Crossing]:
    """Values at which the error is zero or the tolerance.

    Examples
    --------
    >>> rule = Rule(0.0, 2.0, 3, False, 0.5, 0.1, 3)
    >>> [(one.level, one.value, one.width) for one in crossings(rule, [0, 0.5, 1], [-0.25, 0.25, 0.75])]
    [(0.0, 0.5, 1.0), (0.5, 1.5, 1.0)]
    """
    found = []
    known = sorted(zip(places, errors))
    for (low, one), (high, other) in zip(known, known[1:]):
        for level in rule.levels:
            if _crosses(one, other, level):
                share = float(np.clip((level - one) / (other - one), 0.0, 1.0))
                width = rule.value(high) - rule.value(low)
                found.append(Crossing(level, rule.value(low + share * (high - low)), width, other - one))
    return sorted(found, key=lambda crossing: crossing.value)

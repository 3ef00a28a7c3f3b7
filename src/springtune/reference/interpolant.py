r"""Tensor Chebyshev interpolant of a unit problem: thousands of beams for tens of solves.

The unit problem is analytic in :math:`(\log a, \nu)`, with the aspect ratio a. Logarithms of its answers are
interpolated; coefficients and error fall geometrically (Trefethen, Approximation Theory and Approximation Practice,
2013, theorem 8.2). Solves between nodes decide: the largest difference, times a factor, enters the error estimate.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from ..problem.loads import LoadKind

TOLERANCE = 2e-5  # largest relative error estimate of an interpolant by default [1], a fifth of that of a reference

NODE_SHARE = 0.5  # share of the tolerance that the error estimates of nodes may take

SAFETY_FACTOR = 3.0  # factor on the largest difference at the checks, since tens of checks hardly meet the maximum

CHECKS_INSIDE, CHECKS_ON_EDGE = 12, 3
"""Points inside the box and on each edge where solves check an interpolant; corners are nodes."""

CHECKS_SEED = 20  # seed of the places of these points

MOST_NODES = 65  # most nodes along an axis

LIMITS_TOLERANCE = 0.05
"""Largest relative difference of rotation and strain at the checks; they jump by a percent with the grid."""

BOX_TOLERANCE = 1e-9
"""How far beyond its box, relative to its width, an interpolant is evaluated: aspect ratios have twelve digits."""


class NotCertifiedError(RuntimeError):
    """No interpolant over a box meets its tolerance; solve the unit problems one by one."""


class Answers(NamedTuple):
    """Answers of unit problems: over half the height and over the traction over Young's modulus."""

    displacement: np.ndarray
    mean_displacement: np.ndarray
    rotation: np.ndarray
    strain: np.ndarray
    error_estimate: float


ANSWER_NAMES = Answers._fields[:-1]


@dataclass(frozen=True)
class Interpolant:
    """Answers of the unit problems of one kind of load over a box of aspect ratios and Poisson's ratios.

    - `values` (4, n_aspect, n_nu): At the nodes, last to first: logarithms of displacement, mean displacement, 1 plus
      rotation over strain (rotation can be zero), and strain.
    - `error_estimate`: Bound on the relative error of each displacement [1]: `SAFETY_FACTOR` times the largest
      difference at the checks, plus the largest error estimate of the solves.
    - `solves`: Number of unit problems solved, with checks.
    """

    kind: LoadKind
    aspect_range: tuple[float, float]
    nu_range: tuple[float, float]
    values: np.ndarray
    error_estimate: float
    solves: int

    @classmethod
    def build(
        cls,
        kind: LoadKind,
        aspect_range: tuple[float, float],
        nu_range: tuple[float, float],
        tolerance: float = TOLERANCE,
    ) -> Self:
        """Build an interpolant over a box of aspect ratios and Poisson's ratios, with as many solves as it needs."""
        box = _Box(kind, aspect_range, nu_range, tolerance)
        values, error_estimate = box.certified()
        return cls(kind, aspect_range, nu_range, values, error_estimate, len(box.solved))

    def evaluate(self, aspect_ratio: ArrayLike, nu: ArrayLike) -> Answers:
        """Return the answers at aspect ratios and Poisson's ratios [1], broadcast against each other."""
        aspects, nus = np.broadcast_arrays(np.asarray(aspect_ratio, float), np.asarray(nu, float))
        places = _place(np.log(aspects), np.log(self.aspect_range)), _place(nus, self.nu_range)
        outside = ~np.all([np.abs(place) <= 1 + BOX_TOLERANCE for place in places], axis=0)
        if outside.any():
            asked = f"aspect ratio {aspects[outside].flat[0]:.6g} with nu = {nus[outside].flat[0]:.6g}"
            known = f"aspect ratios {_ends(self.aspect_range)} and nu = {_ends(self.nu_range)}"
            raise ValueError(f"{asked} is outside the interpolant of '{self.kind}' over {known}; solve it")
        at = [np.clip(place.ravel(), -1, 1) for place in places]
        along, across = map(lagrange_values, at, self.values.shape[1:])
        found = np.einsum("pa,qan,pn->qp", along, self.values, across, optimize=True).reshape(4, *aspects.shape)
        strain = np.exp(found[3])
        return Answers(np.exp(found[0]), np.exp(found[1]), np.expm1(found[2]) * strain, strain, self.error_estimate)

    def arrays(self) -> dict[str, Any]:
        """Return numbers and arrays to store, from which `from_arrays` makes the interpolant again."""
        ranges = {name: np.array(getattr(self, name)) for name in ("aspect_range", "nu_range")}
        return vars(self) | ranges | {"kind": self.kind.name}

    @classmethod
    def from_arrays(cls, kind: LoadKind, arrays: Mapping[str, Any]) -> Self:
        """Interpolant from the arrays that `arrays` returned."""
        (first, last), (least, largest) = (np.asarray(arrays[name]).tolist() for name in ("aspect_range", "nu_range"))
        error_estimate, solves = float(arrays["error_estimate"]), int(arrays["solves"])
        return cls(kind, (first, last), (least, largest), np.asarray(arrays["values"]), error_estimate, solves)


@dataclass
class _Box:
    """Solves and results for an interpolant over a box."""

    kind: LoadKind
    aspect_range: tuple[float, float]
    nu_range: tuple[float, float]
    tolerance: float
    #: Answers in the order of `ANSWER_NAMES`, and error estimates, by place in the box (-1 to 1 on each axis).
    solved: dict[tuple[float, float], tuple[np.ndarray, float]] = field(default_factory=dict)

    def certified(self) -> tuple[np.ndarray, float]:
        """Values at the nodes and the error estimate."""
        wide = [last > first for first, last in (self.aspect_range, self.nu_range)]
        checks, counts = self._checks(*wide), [3 if along else 1 for along in wide]
        while True:
            places = [chebyshev_points(count) for count in counts]
            answers, estimate = self._solve([(along, across) for along in places[0] for across in places[1]])
            values = _interpolated_values(answers).reshape(4, *counts)
            promised = [_expected_error(np.moveaxis(values[:2], axis, 1)) for axis in (1, 2)]
            goal = (1 - NODE_SHARE) * self.tolerance / SAFETY_FACTOR
            if max(promised) <= goal:
                error_estimate = self._error_at_checks(values, checks, estimate)
                if error_estimate <= self.tolerance:
                    return values, error_estimate
            axis = max(range(2), key=lambda axis: (wide[axis], promised[axis]))
            counts[axis] = 2 * counts[axis] - 1
            if not wide[axis] or counts[axis] > MOST_NODES:
                found = max(promised) if max(promised) > goal else error_estimate
                raise self._failure(f"error estimate {found:.1e} with {len(answers)} nodes")

    def _checks(self, wide: bool, high: bool) -> list[tuple[float, float]]:
        """Points inside the box and on its edges; of a box without a width along an axis, in the middle of it."""
        random = np.random.default_rng(CHECKS_SEED)
        inside, edges = random.uniform(-1, 1, (CHECKS_INSIDE, 2)), random.uniform(-1, 1, (4, CHECKS_ON_EDGE))
        points = [(along, across) for along, across in inside]
        points += [(end, at) for end, edge in zip((-1.0, 1.0), edges[:2]) for at in edge]
        points += [(at, end) for end, edge in zip((-1.0, 1.0), edges[2:]) for at in edge]
        return list(dict.fromkeys((float(one[0]) * wide, float(one[1]) * high) for one in points))

    def _solve(self, places: list[tuple[float, float]]) -> tuple[np.ndarray, float]:
        """Return answers (n_places, 4) and their largest error estimate; each place is solved once."""
        from .small_strain import ReferenceNotConvergedError, solve_unit  # here: reading one does without scipy

        # Elements are shared by those of one aspect ratio, which follow each other.
        for along, across in places:
            if (along, across) not in self.solved:
                aspect = float(np.exp(_value_at_place(along, np.log(self.aspect_range))))
                nu = float(np.clip(_value_at_place(across, self.nu_range), *self.nu_range))
                try:
                    found = solve_unit(aspect, nu, self.kind, NODE_SHARE * self.tolerance)
                except ReferenceNotConvergedError as error:
                    raise self._failure(str(error)) from error
                answers = np.array([getattr(found, name) for name in ANSWER_NAMES])
                self.solved[along, across] = answers, found.error_estimate
        found_here = [self.solved[place] for place in places]
        return np.array([answers for answers, _ in found_here]), max(estimate for _, estimate in found_here)

    def _error_at_checks(self, values: np.ndarray, checks: list[tuple[float, float]], estimate: float) -> float:
        """Return the error estimate by solves at the checks, from the error estimate of the nodes."""
        if values[0].size == 1:
            return estimate
        solved, of_checks = self._solve(checks)
        places = np.array(checks).T
        along, across = map(lagrange_values, places, values.shape[1:])
        found = np.einsum("pa,qan,pn->qp", along, values, across)
        differences = np.abs(found - _interpolated_values(solved)).max(axis=1)
        if not differences[2:].max() <= LIMITS_TOLERANCE:
            raise self._failure(f"rotation and strain differ by {differences[2:].max():.1e} from those of solves")
        # Differences of logarithms are relative ones.
        return float(SAFETY_FACTOR * differences[:2].max() + max(estimate, of_checks))

    def _failure(self, why: str) -> NotCertifiedError:
        over = f"over aspect ratios {_ends(self.aspect_range)} and nu = {_ends(self.nu_range)}"
        return NotCertifiedError(f"no interpolant of '{self.kind}' {over} within {self.tolerance:.1e}: {why}")


def _ends(ends: tuple[float, float]) -> str:
    return " to ".join(f"{end:.6g}" for end in ends)


def _interpolated_values(answers: np.ndarray) -> np.ndarray:
    """Return the interpolated logarithms (4, n) of answers (n, 4) in the order of `ANSWER_NAMES`."""
    displacement, mean, rotation, strain = answers.T
    return np.stack([np.log(displacement), np.log(mean), np.log1p(rotation / strain), np.log(strain)])


def chebyshev_points(count: int) -> np.ndarray:
    """Return Chebyshev points from 1 to -1, both included, shape (count,); twice the intervals reuse them."""
    if count == 1:
        return np.zeros(1)
    # By the sine: its arguments are the same numbers there, too.
    return np.sin(np.pi / 2 * np.arange(count - 1, -count, -2) / (count - 1))


def lagrange_values(places: np.ndarray, count: int) -> np.ndarray:
    """Return the Lagrange polynomials of Chebyshev points at `places` in [-1, 1], shape (n, count).

    Barycentric formula (Berrut and Trefethen, SIAM Review 46:501, 2004, formula 4.2 with weights 5.4).
    """
    weights = (-1.0) ** np.arange(count)
    weights[[0, -1]] /= 2
    distances = places[:, None] - chebyshev_points(count)
    at_node, node = np.nonzero(distances == 0)
    distances[at_node] = 1.0
    found = weights / distances
    found[at_node] = 0.0
    found[at_node, node] = 1.0
    return found / found.sum(axis=1, keepdims=True)


def _expected_error(values: np.ndarray) -> float:
    """Return the error expected from the decay of pairs of Chebyshev coefficients along the second axis."""
    count = values.shape[1]
    if count == 1:
        return 0.0
    series = np.linalg.solve(chebyshev.chebvander(chebyshev_points(count), count - 1), values)
    sizes = np.abs(series).max(axis=(0, 2))
    before, last = (sizes[1], sizes[2]) if count == 3 else (sizes[-4:-2].max(), sizes[-2:].max())
    return float(last * min(last / before, 1.0)) if before > 0 else float(last)


def _place(values: np.ndarray, ends: ArrayLike) -> np.ndarray:
    """Map values between two ends to -1 to 1; if the ends are equal, to 0 at them and infinity elsewhere."""
    first, last = np.asarray(ends, float)
    if last > first:
        return (2 * values - first - last) / (last - first)
    return np.where(np.abs(values - first) <= BOX_TOLERANCE * max(1.0, abs(first)), 0.0, np.inf)


def _value_at_place(place: float, ends: ArrayLike) -> float:
    """Map a place in -1 to 1 to the value there, the inverse of `_place`."""
    first, last = np.asarray(ends, float)
    return float((first + last) / 2 + place * (last - first) / 2)

"""Sides of an outline, straight or arcs, and edges: points, lengths, distances, windings and intersections."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import Self

import numpy as np

MOST_PAIRS = 4_000_000  # pairs of edges that are compared at a time


def near_edges(points: np.ndarray, edges: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Return pairs (n_pairs, 2) of disjoint edges nearer than their reaches (n,) together [m]."""
    start, end = points[edges[:, 0]], points[edges[:, 1]]
    # Along a direction in which few sides of shapes run, an edge overlaps few others.
    along = np.stack([start, end]) @ np.array([[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]])
    low, high = along.min(axis=0) - reach[:, None], along.max(axis=0) + reach[:, None]
    order = np.argsort(low[:, 0], kind="stable")
    counts = np.searchsorted(low[order, 0], high[order, 0], side="right") - np.arange(len(order)) - 1
    before = np.cumsum(counts) - counts
    parts = np.searchsorted(before, np.arange(MOST_PAIRS, counts.sum(), MOST_PAIRS))
    found = []
    for here in np.split(np.arange(len(order)), parts):
        first = np.repeat(here, counts[here])
        second = first + 1 + np.arange(len(first)) - np.repeat(before[here] - before[here[:1]], counts[here])
        one, other = order[first], order[second]
        near = (low[one, 1] <= high[other, 1]) & (low[other, 1] <= high[one, 1])
        near &= (edges[one][:, :, None] != edges[other][:, None, :]).all(axis=(1, 2))
        one, other = one[near], other[near]
        a, b, c, d = start[one], end[one], start[other], end[other]
        crossing = (turn(a, b, c) * turn(a, b, d) < 0) & (turn(c, d, a) * turn(c, d, b) < 0)
        distance = np.min([distances(a, c, d), distances(b, c, d), distances(c, a, b), distances(d, a, b)], axis=0)
        close = crossing | (distance <= reach[one] + reach[other])
        found.append(np.stack([one, other], axis=1)[close])
    return np.concatenate(found)


def turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Twice the area of triangles of points (..., 2), negative where c is to the right of the way from a to b."""
    way, there = b - a, c - a
    return np.asarray(way[..., 0] * there[..., 1] - way[..., 1] * there[..., 0])


def distances(point: np.ndarray, one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Distance of points from edges from `one` to `two`, all (n, 2) [m]."""
    along = two - one
    share = np.clip(((point - one) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
    return np.asarray(np.linalg.norm(point - one - share[:, None] * along, axis=1))


def winding(start: np.ndarray, end: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Return how often edges from `start` to `end` (n, 2) wind counter-clockwise about points (..., 1, 2) off them."""
    left = turn(at, start, end)
    up = (start[:, 1] <= at[..., 1]) & (end[:, 1] > at[..., 1]) & (left > 0)
    down = (start[:, 1] > at[..., 1]) & (end[:, 1] <= at[..., 1]) & (left < 0)
    return np.asarray(up.sum(axis=-1) - down.sum(axis=-1))


def in_words(points: Sequence[float] | np.ndarray) -> str:
    """Middle of one or more points, in words."""
    return "({:.6g}, {:.6g}) mm".format(*(1e3 * np.reshape(points, (-1, 2)).mean(axis=0)))


def edge_in_words(points: np.ndarray, ends: Sequence[int] | np.ndarray) -> str:
    """Both ends of an edge, in words."""
    return f"from {in_words(points[ends[0]])} to {in_words(points[ends[1]])}"


Point = tuple[float, float]  # coordinates [m]

RADIUS_TOLERANCE = 1e-9  # largest relative difference of two ends' distances from the centre of a circle

LEAST_SIDE_GAP = 1e-9  # smallest distance of sides over the extent of the shape; nearer ones touch

CHORD_ERROR = 1e-6
"""Largest distance of an arc from the polygon that stands for it in checks, over the extent of its round."""


@dataclass(frozen=True)
class OutlineSide:
    """Side of an outline: straight, or an arc of less than half a turn, with the body on its left; ends in m."""

    start: Point
    end: Point
    centre: Point | None = None
    group: str = ""

    def __post_init__(self) -> None:
        if self.start == self.end:
            raise ValueError(f"from {in_words(self.start)} to itself; leave it out, and split a circle into four arcs")
        _ = self.arc  # refused here, not when it is used

    @cached_property
    def arc(self) -> tuple[float, float, float, float] | None:
        """Semi-axes of an arc along x and y [m], start angle and counter-clockwise turn [rad]; None if straight."""
        if self.centre is None:
            return None
        centre = self.centre
        (x, y), (u, v) = ((end[0] - centre[0], end[1] - centre[1]) for end in (self.start, self.end))
        first, second = math.hypot(x, y), math.hypot(u, v)
        about = f"arc from {in_words(self.start)} to {in_words(self.end)} about {in_words(centre)}"
        if not min(first, second) > RADIUS_TOLERANCE * max(first, second):
            raise ValueError(f"{about}: an end is at the centre; move one of them")
        if abs(first - second) <= RADIUS_TOLERANCE * first:
            across = along = 0.5 * (first + second)
        else:
            # 1 / a^2 and 1 / b^2 of x^2 / a^2 + y^2 / b^2 = 1 at both ends, scaled.
            large = max(first, second)
            x2, y2, u2, v2 = ((one / large) ** 2 for one in (x, y, u, v))
            determinant = x2 * v2 - u2 * y2
            shares = v2 - y2, x2 - u2
            if not (abs(determinant) > RADIUS_TOLERANCE and min(one / determinant for one in shares) > 1e-12):
                ends = f"the ends are {1e3 * first:.9g} and {1e3 * second:.9g} mm from it"
                why = f"{ends}, and no ellipse with axes along x and y about it goes through both"
                raise ValueError(f"{about}: {why}; correct the centre")
            across, along = (large / math.sqrt(share / determinant) for share in shares)
        begin, finish = math.atan2(y / along, x / across), math.atan2(v / along, u / across)
        turn = math.remainder(finish - begin, 2 * math.pi)
        if abs(abs(turn) - math.pi) < 1e-6:
            raise ValueError(f"{about}: is half a turn, and could go either way; split it into two arcs")
        if abs(turn) < 1e-9:
            raise ValueError(f"{about}: turns by no angle; correct the centre, or leave it out for a straight side")
        return across, along, begin, turn

    def at(self, parameter: float) -> Point:
        """Point at a parameter [m]."""
        if parameter in (0.0, 1.0):
            return self.end if parameter else self.start
        if self.arc is None or self.centre is None:
            (x, y), (u, v) = self.start, self.end
            return x + parameter * (u - x), y + parameter * (v - y)
        across, along, begin, turn = self.arc
        angle = begin + parameter * turn
        return self.centre[0] + across * math.cos(angle), self.centre[1] + along * math.sin(angle)

    def slope(self, parameter: float) -> Point:
        """Derivative of the point by the parameter [m]."""
        if self.arc is None:
            return self.end[0] - self.start[0], self.end[1] - self.start[1]
        across, along, begin, turn = self.arc
        angle = begin + parameter * turn
        return -across * turn * math.sin(angle), along * turn * math.cos(angle)

    def length_to(self, parameter: float) -> float:
        """Length from the start to a parameter [m], of an ellipse by an elliptic integral."""
        if self.arc is None:
            return parameter * math.dist(self.start, self.end)
        across, along, begin, turn = self.arc
        if across == along:
            return parameter * (across * abs(turn))
        from scipy.special import ellipeinc  # here, since few outlines have ellipses

        first, last = ellipeinc([begin, begin + parameter * turn], 1 - (across / along) ** 2)
        return float(along * abs(last - first))

    def parameter_of(self, length: float) -> float:
        """Parameter at a length from the start along the side [m]."""
        if self.arc is None or self.arc[0] == self.arc[1]:
            return length / self.length_to(1.0)
        from scipy.optimize import brentq  # here, as above

        return float(brentq(lambda parameter: self.length_to(parameter) - length, 0.0, 1.0, xtol=1e-16))

    def divided(self, count: int, low: float = 0.0, high: float = 1.0) -> list[float]:
        """Parameters that divide it, or a stretch of it, into parts of equal length; both ends are among them."""
        first, last = self.length_to(low), self.length_to(high)
        inner = (self.parameter_of(first + (last - first) * i / count) for i in range(1, count))
        return [low, *inner, high]

    def swept_area(self, origin: Point = (0.0, 0.0)) -> float:
        """Signed area between the side and a point [m2]: the sum over an outline is the area within."""
        (x, y), (u, v) = ((end[0] - origin[0], end[1] - origin[1]) for end in (self.start, self.end))
        if self.arc is None or self.centre is None:
            return 0.5 * (x * v - u * y)
        across, along, _, turn = self.arc
        centre = self.centre[0] - origin[0], self.centre[1] - origin[1]
        return 0.5 * (centre[0] * (v - y) - centre[1] * (u - x) + across * along * turn)

    def chord_distance(self, low: float, high: float) -> float:
        """Bound on the distance of points between two parameters from the chord between these [m]."""
        if self.arc is None:
            return 0.0
        return max(self.arc[:2]) * (1 - math.cos(0.5 * abs(self.arc[3]) * (high - low)))

    @cached_property
    def extremes(self) -> list[Point]:
        """Ends and points farthest along the axes: the box around these is that around the side [m]."""
        if self.arc is None:
            return [self.start, self.end]
        _, _, begin, turn = self.arc
        parameters = ((quarter * math.pi / 2 - begin) / turn for quarter in range(-8, 9))
        return [self.start, self.end, *(self.at(one) for one in parameters if 0 < one < 1)]

    def nearest(self, point: Point) -> tuple[float, float]:
        """Parameter at which it is nearest to a point, and the distance there [m]."""
        if self.arc is None:
            x, y = self.slope(0.0)
            share = ((point[0] - self.start[0]) * x + (point[1] - self.start[1]) * y) / (x * x + y * y)
            share = min(max(share, 0.0), 1.0)
            return share, math.dist(self.at(share), point)
        # The best of some stretches, then halving of the angle between the way to the point and the tangent.
        best = min(range(33), key=lambda i: math.dist(self.at(i / 32), point)) / 32
        low, high = max(best - 1 / 32, 0.0), min(best + 1 / 32, 1.0)
        for _ in range(60):
            middle = 0.5 * (low + high)
            (x, y), (u, v) = self.at(middle), self.slope(middle)
            if (point[0] - x) * u + (point[1] - y) * v > 0:
                low = middle
            else:
                high = middle
        parameter = min((0.0, 1.0, 0.5 * (low + high)), key=lambda one: math.dist(self.at(one), point))
        return parameter, math.dist(self.at(parameter), point)

    def find_points(self, points: Mapping[str, Point], small: float) -> dict[str, float]:
        """Return parameters of the named points within a distance `small` [m]; 0 or 1 near an end."""
        found = {}
        for name, point in points.items():
            parameter, distance = self.nearest(point)
            if distance <= small:
                near = (end for end in (0.0, 1.0) if math.dist(point, self.at(end)) <= small)
                found[name] = next(near, parameter)
        return found


@dataclass(frozen=True)
class Stretch:
    """Side between two parameters, and numbers of the regions on its left and right."""

    side: OutlineSide
    low: float
    high: float
    left: int
    right: int

    def cut(self, parameters: Iterable[float]) -> list[Self]:
        """Stretches between parameters, of which the first and the last are its ends."""
        return [replace(self, low=low, high=high) for low, high in pairwise(parameters)]

    def divided(self, count: int) -> list[Self]:
        """Stretches of equal length."""
        return self.cut(self.side.divided(count, self.low, self.high))


@dataclass(frozen=True)
class Round:
    """Closed counter-clockwise round of sides, with the parts on its left and right, None outside the body."""

    sides: tuple[OutlineSide, ...]
    inner: str | None
    outer: str | None = None
    around: int | None = None

    @cached_property
    def area(self) -> float:
        """Area within [m2]."""
        return enclosed(self.sides)


def enclosed(sides: Sequence[OutlineSide]) -> float:
    """Signed area within a round of sides [m2], positive where it runs counter-clockwise."""
    # About a corner: coordinates far from the origin would cost digits.
    return sum(side.swept_area(sides[0].start) for side in sides)


def reverse_round(sides: Sequence[OutlineSide]) -> tuple[OutlineSide, ...]:
    """The same round the other way, from the same corner."""
    return tuple(OutlineSide(side.end, side.start, side.centre, side.group) for side in sides[::-1])


def extent(sides: Sequence[OutlineSide]) -> tuple[Point, Point]:
    """Lower left and upper right corner of the box around sides [m]."""
    xs, ys = zip(*(point for side in sides for point in side.extremes))
    return (min(xs), min(ys)), (max(xs), max(ys))


@lru_cache(maxsize=256)
def polygon(sides: tuple[OutlineSide, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return points (n, 2) [m] within `CHORD_ERROR` of a round, and the side that begins or goes on at each."""
    error = CHORD_ERROR * math.dist(*extent(sides))
    points, numbers = [], []
    for number, side in enumerate(sides):
        count = math.ceil(abs(side.arc[3]) * math.sqrt(max(side.arc[:2]) / (8 * error))) if side.arc else 1
        points += [side.at(i / count) for i in range(count)]
        numbers += [number] * count
    return np.array(points), np.array(numbers)


def winds_about(sides: tuple[OutlineSide, ...], point: Point) -> bool:
    """Return whether a round winds about a point that is not on it."""
    points, _ = polygon(sides)
    return bool(winding(points, np.roll(points, -1, axis=0), np.array(point)))


def find_meeting(rounds: Sequence[tuple[OutlineSide, ...]]) -> tuple[tuple[int, int], tuple[int, int], Point] | None:
    """Return where sides of rounds meet off shared corners, or None: round and side of both, and the point [m]."""
    points, edges, reaches = [], [], []
    names: list[tuple[int, int]] = []
    size = max(math.dist(*extent(sides)) for sides in rounds)
    for which, sides in enumerate(rounds):
        corners, numbers = polygon(sides)
        order = len(names) + np.arange(len(corners))
        edges.append(np.stack([order, np.roll(order, -1)], axis=1))
        points.append(corners)
        names += [(which, number) for number in numbers.tolist()]
        errors = [0.0 if side.arc is None else CHORD_ERROR * math.dist(*extent(sides)) for side in sides]
        reaches.append(LEAST_SIDE_GAP * size + np.array(errors)[numbers])
    places, ends = np.concatenate(points), np.concatenate(edges)
    pairs = np.sort(near_edges(places, ends, np.concatenate(reaches)), axis=1)  # edges are numbered as their sides are
    if not len(pairs):
        return None
    one, other = min(pairs.tolist())
    (start, end), (other_start, other_end) = places[ends[one]], places[ends[other]]
    ways = np.stack([end - start, other_start - other_end], axis=1)
    share = np.linalg.lstsq(ways, other_start - start, rcond=None)[0][0]
    x, y = (start + np.clip(share, 0.0, 1.0) * (end - start)).tolist()
    return names[one], names[other], (x, y)

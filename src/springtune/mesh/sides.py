"""Sides of an outline, straight or arcs: points, lengths and intersections."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

Point = tuple[float, float]
"""Coordinates [m]."""

SAME = 1e-9
"""Largest relative difference of two ends' distances from the centre of a circle."""

APART = 1e-9
"""Smallest distance of sides over the extent of the shape; nearer ones touch."""


@dataclass(frozen=True)
class OutlineSide:
    """Side of an outline: straight, or an arc of less than half a turn; ends in m.

    Parameters run from 0 to 1, by angle along an arc (the eccentric angle of an ellipse). The body is on the left of
    a counter-clockwise outline.

    Examples
    --------
    A quarter of a circle and one of an ellipse:

    >>> quarter = OutlineSide((1.0, 0.0), (0.0, 1.0), centre=(0.0, 0.0))
    >>> print(f"{quarter.length:.6f}", "({:.6f}, {:.6f})".format(*quarter.at(0.5)))
    1.570796 (0.707107, 0.707107)
    >>> print(f"{OutlineSide((2.0, 0.0), (0.0, 1.0), centre=(0.0, 0.0)).length:.6f}")
    2.422112
    """

    start: Point
    end: Point
    centre: Point | None = None
    group: str = ""

    def __post_init__(self) -> None:
        if self.start == self.end:
            raise ValueError(f"from {in_mm(self.start)} to itself; leave it out, and split a circle into four arcs")
        _ = self.arc  # refused here, not when it is used

    @cached_property
    def arc(self) -> tuple[float, float, float, float] | None:
        """Of an arc: semi-axes along x and y [m], angle at the start and by which it turns, counter-clockwise [rad]."""
        if self.centre is None:
            return None
        centre = self.centre
        (x, y), (u, v) = ((end[0] - centre[0], end[1] - centre[1]) for end in (self.start, self.end))
        first, second = math.hypot(x, y), math.hypot(u, v)
        about = f"arc from {in_mm(self.start)} to {in_mm(self.end)} about {in_mm(centre)}"
        if not min(first, second) > SAME * max(first, second):
            raise ValueError(f"{about}: an end is at the centre; move one of them")
        if abs(first - second) <= SAME * first:
            across = along = 0.5 * (first + second)
        else:
            # 1 / a^2 and 1 / b^2 of x^2 / a^2 + y^2 / b^2 = 1 at both ends, scaled.
            large = max(first, second)
            x2, y2, u2, v2 = ((one / large) ** 2 for one in (x, y, u, v))
            determinant = x2 * v2 - u2 * y2
            shares = [(v2 - y2) / determinant, (x2 - u2) / determinant] if abs(determinant) > SAME else [-1.0, -1.0]
            if not min(shares) > 1e-12:
                ends = f"the ends are {1e3 * first:.9g} and {1e3 * second:.9g} mm from it"
                why = f"{ends}, and no ellipse with axes along x and y about it goes through both"
                raise ValueError(f"{about}: {why}; correct the centre")
            across, along = (large / math.sqrt(share) for share in shares)
        begin, finish = math.atan2(y / along, x / across), math.atan2(v / along, u / across)
        turn = math.remainder(finish - begin, 2 * math.pi)
        if abs(abs(turn) - math.pi) < 1e-6:
            raise ValueError(f"{about}: is half a turn, and could go either way; split it into two arcs")
        if abs(turn) < 1e-9:
            raise ValueError(f"{about}: turns by no angle; correct the centre, or leave it out for a straight side")
        return across, along, begin, turn

    @property
    def circular(self) -> bool:
        """Whether it is an arc of a circle."""
        return self.arc is not None and self.arc[0] == self.arc[1]

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

    def tangent(self, parameter: float) -> Point:
        """Unit vector along the side at a parameter."""
        x, y = self.slope(parameter)
        norm = math.hypot(x, y)
        return x / norm, y / norm

    @cached_property
    def length(self) -> float:
        """Length [m]."""
        if self.arc is None:
            return math.dist(self.start, self.end)
        return self.arc[0] * abs(self.arc[3]) if self.circular else self.length_to(1.0)

    def length_to(self, parameter: float) -> float:
        """Length from the start to a parameter [m], of an ellipse by an elliptic integral."""
        if self.arc is None or self.circular:
            return parameter * self.length
        from scipy.special import ellipeinc  # here, since few outlines have ellipses

        across, along, begin, turn = self.arc
        first, last = ellipeinc([begin, begin + parameter * turn], 1 - (across / along) ** 2)
        return float(along * abs(last - first))

    def parameter_of(self, length: float) -> float:
        """Parameter at a length from the start along the side [m]."""
        if self.arc is None or self.circular:
            return length / self.length
        from scipy.optimize import brentq  # here, as above

        return float(brentq(lambda parameter: self.length_to(parameter) - length, 0.0, 1.0, xtol=1e-16))

    def divided(self, count: int, low: float = 0.0, high: float = 1.0) -> list[float]:
        """Parameters that divide it, or a stretch of it, into parts of equal length; both ends are among them."""
        first, last = self.length_to(low), self.length_to(high)
        inner = (self.parameter_of(first + (last - first) * i / count) for i in range(1, count))
        return [low, *inner, high]

    def swept(self, origin: Point = (0.0, 0.0)) -> float:
        """Signed area between the side and a point [m2]: the sum over an outline is the area within."""
        (x, y), (u, v) = ((end[0] - origin[0], end[1] - origin[1]) for end in (self.start, self.end))
        if self.arc is None or self.centre is None:
            return 0.5 * (x * v - u * y)
        across, along, _, turn = self.arc
        centre = self.centre[0] - origin[0], self.centre[1] - origin[1]
        return 0.5 * (centre[0] * (v - y) - centre[1] * (u - x) + across * along * turn)

    def aside(self, low: float, high: float) -> float:
        """Bound on the distance of points between two parameters from the chord between these [m]."""
        if self.arc is None:
            return 0.0
        return max(self.arc[:2]) * (1 - math.cos(0.5 * abs(self.arc[3]) * (high - low)))

    @cached_property
    def extremes(self) -> list[Point]:
        """Ends and points farthest along the axes: the box around these is that around the side [m]."""
        found = [self.start, self.end]
        if self.arc is not None:
            _, _, begin, turn = self.arc
            for quarter in range(-8, 9):
                parameter = (quarter * math.pi / 2 - begin) / turn
                if 0 < parameter < 1:
                    found.append(self.at(parameter))
        return found

    def nearest(self, point: Point) -> tuple[float, float]:
        """Parameter at which it is nearest to a point, and the distance there [m]."""
        if self.arc is None:
            x, y = self.slope(0.0)
            share = ((point[0] - self.start[0]) * x + (point[1] - self.start[1]) * y) / (x * x + y * y)
            share = min(max(share, 0.0), 1.0)
            return share, math.dist(self.at(share), point)
        # The best of some stretches, then halving of the angle between the way to the point and the tangent.
        count = 32
        tries = [i / count for i in range(count + 1)]
        distances = [math.dist(self.at(one), point) for one in tries]
        best = min(range(count + 1), key=distances.__getitem__)
        low, high = tries[max(best - 1, 0)], tries[min(best + 1, count)]
        for _ in range(60):
            middle = 0.5 * (low + high)
            (x, y), (u, v) = self.at(middle), self.slope(middle)
            if (point[0] - x) * u + (point[1] - y) * v > 0:
                low = middle
            else:
                high = middle
        parameter = min((0.0, 1.0, 0.5 * (low + high)), key=lambda one: math.dist(self.at(one), point))
        return parameter, math.dist(self.at(parameter), point)

    def parameter_near(self, point: Point, distance: float) -> float | None:
        """Parameter at which it is nearest to a point, where that is within a distance [m]; None otherwise."""
        low, high = extent([self])
        if any(not low[i] - distance <= point[i] <= high[i] + distance for i in range(2)):
            return None
        parameter, found = self.nearest(point)
        return parameter if found <= distance else None


@dataclass(frozen=True)
class Round:
    """Closed counter-clockwise round of sides.

    `inner` and `outer` are the parts on its left and right, None outside the body. `around` is the number of the
    round whose inside is on the right, or None.
    """

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
    return sum(side.swept(sides[0].start) for side in sides)


def turned(sides: Sequence[OutlineSide]) -> tuple[OutlineSide, ...]:
    """The same round the other way, from the same corner."""
    return tuple(OutlineSide(side.end, side.start, side.centre, side.group) for side in sides[::-1])


def extent(sides: Sequence[OutlineSide]) -> tuple[Point, Point]:
    """Lower left and upper right corner of the box around sides [m]."""
    xs, ys = zip(*(point for side in sides for point in side.extremes))
    return (min(xs), min(ys)), (max(xs), max(ys))


def winds_about(sides: Sequence[OutlineSide], point: Point) -> bool:
    """Whether a round winds about a point that is not on it."""
    (left, low), (right, high) = extent(sides)
    if not (left <= point[0] <= right and low <= point[1] <= high):
        return False
    total = 0.0
    for side in sides:
        stretches = [(0.0, 1.0)]
        while stretches:
            low, high = stretches.pop()
            first, second = side.at(low), side.at(high)
            if _to_chord(point, first, second) <= side.aside(low, high) and high - low > 1e-12:
                middle = 0.5 * (low + high)
                stretches += [(low, middle), (middle, high)]
                continue
            (a, b), (c, d) = ((end[0] - point[0], end[1] - point[1]) for end in (first, second))
            total += math.atan2(a * d - b * c, a * c + b * d)
    return abs(total) > math.pi


def meeting(rounds: Sequence[Sequence[OutlineSide]]) -> tuple[tuple[int, int], tuple[int, int], Point] | None:
    """Return where sides of rounds meet off shared corners, or None: round and side of both, and the point [m]."""
    (left, low), (right, high) = extent([side for sides in rounds for side in sides])
    small = APART * max(right - left, high - low)
    for one, other in _near(rounds, small):
        first, second = (rounds[which][number] for which, number in (one, other))
        for span, other_span in _away_from_corners(one[1], other[1], len(rounds[one[0]]) if one[0] == other[0] else 0):
            where = _meet(first, second, span, other_span, small)
            if where is not None:
                return one, other, where
    return None


Span = tuple[float, float]
"""Parameters between which a stretch of a side is."""


def _away_from_corners(i: int, j: int, count: int) -> list[tuple[Span, Span]]:
    """Stretches of two sides of a round of so many that are not to meet: all of one and of the other but its corner."""
    whole, without_start, without_end = (0.0, 1.0), (1e-3, 1.0), (0.0, 1 - 1e-3)
    if count == 2:
        return [((1e-3, 1 - 1e-3), whole), (whole, (1e-3, 1 - 1e-3))]
    if count and (i + 1) % count == j:
        return [(without_end, whole), (whole, without_start)]
    if count and (j + 1) % count == i:
        return [(without_start, whole), (whole, without_end)]
    return [(whole, whole)]


def _near(rounds: Sequence[Sequence[OutlineSide]], small: float) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Pairs of sides whose boxes are not apart, each once and in order: number of round and side, of both."""
    boxes = sorted(
        (extent([side]), (which, number)) for which, sides in enumerate(rounds) for number, side in enumerate(sides)
    )
    active: list[tuple[tuple[Point, Point], tuple[int, int]]] = []
    for (low, high), name in boxes:
        active = [one for one in active if one[0][1][0] >= low[0] - small]
        for (other_low, other_high), other in active:
            if other_low[1] <= high[1] + small and other_high[1] >= low[1] - small:
                yield min(name, other), max(name, other)
        active.append(((low, high), name))


def _meet(side: OutlineSide, other: OutlineSide, span: Span, other_span: Span, small: float) -> Point | None:
    """Where stretches of two sides come nearer than a distance to each other; None where they do not."""
    pairs = [(span, other_span)]
    while pairs:
        one, two = pairs.pop()
        bounds = side.aside(*one), other.aside(*two)
        distance, where = _chords_apart(side.at(one[0]), side.at(one[1]), other.at(two[0]), other.at(two[1]))
        if distance > bounds[0] + bounds[1] + small:
            continue
        if max(bounds) <= 0.1 * small:
            return where
        if bounds[0] >= bounds[1]:
            middle = 0.5 * (one[0] + one[1])
            pairs += [((one[0], middle), two), ((middle, one[1]), two)]
        else:
            middle = 0.5 * (two[0] + two[1])
            pairs += [(one, (two[0], middle)), (one, (middle, two[1]))]
    return None


def _to_chord(point: Point, start: Point, end: Point) -> float:
    """Distance of a point from a straight stretch [m]."""
    along = end[0] - start[0], end[1] - start[1]
    square = along[0] ** 2 + along[1] ** 2
    share = ((point[0] - start[0]) * along[0] + (point[1] - start[1]) * along[1]) / square if square else 0.0
    share = min(max(share, 0.0), 1.0)
    return math.dist((start[0] + share * along[0], start[1] + share * along[1]), point)


def _chords_apart(a: Point, b: Point, c: Point, d: Point) -> tuple[float, Point]:
    """Distance between the straight stretches from a to b and from c to d [m], and where it is."""

    def left(one: Point, two: Point, three: Point) -> float:
        return (two[0] - one[0]) * (three[1] - one[1]) - (two[1] - one[1]) * (three[0] - one[0])

    on_left, other_on_left = left(c, d, a), left(c, d, b)
    if left(a, b, c) * left(a, b, d) < 0 and on_left * other_on_left < 0:
        share = on_left / (on_left - other_on_left)
        return 0.0, (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]))
    return min((_to_chord(a, c, d), a), (_to_chord(b, c, d), b), (_to_chord(c, a, b), c), (_to_chord(d, a, b), d))


def in_mm(point: Point, digits: int = 9) -> str:
    """A point, in words."""
    return f"({1e3 * point[0]:.{digits}g}, {1e3 * point[1]:.{digits}g}) mm"

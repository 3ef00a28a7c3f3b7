"""Points of an equilibrium path, one after the other by arc length."""

from typing import NamedTuple

import numpy as np

from ..linalg.factors import SingularError
from .newton import TOLERANCE, LoadedNetwork

BEYOND = 0.25
"""First increment beyond the last load step, over that step."""

MOST_BEYOND = 24
"""Most points beyond the last load step in search of a limit point."""

SHORTEST_BEYOND = 1e-6
"""Shortest increment beyond the last load step, over that step."""

SHORTEST_INVERTED = 1e-3
"""Shortest increment to a place where a cell inverts, over that step."""

NEARLY = 1e-3
"""Relative distance below a limit point, which is only estimated, at which a load may lie above it."""

MOST_BEHIND = 60
"""Most points behind a limit point in search of a stable one that carries the load."""

FEW, MANY, MOST_OF_POINT = 3, 8, 12
"""Newton steps of a point: up to which the next increment grows, beyond which it is halved, and most of them."""


class Point(NamedTuple):
    """A point of a path: unknowns [m], load [m], negative pivots there and the Newton steps that it took."""

    u: np.ndarray
    load: float
    negative_pivots: int
    steps: int


def next_point(
    problem: LoadedNetwork, s: float, last: Point, direction: np.ndarray | None, length: float, shortest: float
) -> tuple[Point | None, float]:
    """Return the next point, or None, and its increment's length [m], halved while Newton's method fails.

    The sign of the load `s` [m] is the way the path begins; `direction` (unknowns,) [m] points from the point before,
    None at rest. `length` and `shortest` are norms of the displacements of all unknowns [m].
    """
    displacements = problem.moved(last.load, problem.network.expand(last.u))
    try:
        tangent = problem.factorize_tangent(last.load, displacements).solve(problem.rate(displacements))
        sign = np.sign(s) if direction is None else np.sign(direction @ tangent) or 1.0
        while length > shortest:
            rise = float(sign * length / np.linalg.norm(tangent))
            found = _correct(problem, last, rise * tangent, rise, abs(s) * problem.load_norm)
            if found is not None:
                return found, length
            length *= 0.5
    except SingularError:  # a point exactly on a limit point
        pass
    return None, length


def _correct(problem: LoadedNetwork, last: Point, du: np.ndarray, ds: float, scale: float) -> Point | None:
    """Newton's method in the plane across an increment; None where it does not converge."""
    network, across = problem.network, du
    u, at = last.u + du, last.load + ds
    for step in range(1, MOST_OF_POINT + 1):
        displacements = problem.moved(at, network.expand(u))
        load = problem.load_at(displacements)
        with np.errstate(over="ignore", invalid="ignore"):
            missing = at * load - network.resistance(displacements)
            size = np.linalg.norm(missing)
        if not np.isfinite(size):
            return None
        factor = problem.factorize_tangent(at, displacements)
        if size <= TOLERANCE * scale:
            return Point(u, at, problem.stability(at, displacements, factor)[0], step)
        back, forth = factor.solve(missing), factor.solve(problem.rate(displacements))
        change = -(across @ back) / (across @ forth)
        u, at = u + back + change * forth, at + change
    return None


class Continuation(NamedTuple):
    """Path beyond an equilibrium.

    - `limit`: Largest load before the path turns back with one more negative eigenvalue [m], or NaN.
    - `lost`: First load at which the path was unstable before it turns back [m], or NaN.
    - `end`: Stable point at or beyond the target, the last below it before a limit point, or the one behind it that
      regains the load.
    - `inverts`: Whether a cell inverts before the path turns back or reaches the target.
    """

    limit: float
    lost: float
    end: Point | None
    inverts: bool = False


def continued(
    problem: LoadedNetwork, load: float, last: np.ndarray, before: np.ndarray, target: float, farthest: float = 0.0
) -> Continuation:
    """Follow a path by arc length from an equilibrium to a load, or to the limit point where it turns back.

    The equilibrium is at `load` with displacements `last`; `before` is one shortly before. Loads are over the
    reference stiffness [m]. `farthest` is the increment behind a limit point, norm of all displacements [m]; 0 stops
    there.
    """
    network, limit, lost = problem.network, np.nan, np.nan
    direction = network.reduce(last - before)
    point = stable = Point(network.reduce(last), load, 0, 0)
    increment = float(np.linalg.norm(direction))
    length = BEYOND * increment  # near a limit point two paths may be near
    try:
        pivots = problem.stability(load, last, problem.factorize_tangent(load, last))[0]
    except SingularError:
        return Continuation(limit, lost, None)
    most, growth, way, loads = MOST_BEYOND, 1.5, [0.0], [load]
    watched = problem.holds(load, last)  # under a follower pressure the symmetric part may be indefinite all along
    while most:
        found, length = next_point(problem, target, point, direction, length, SHORTEST_BEYOND * increment)
        if found is None:
            break
        if network.inverted(problem.moved(found.load, network.expand(found.u))):
            growth, length = 1.0, BEYOND * length  # cells that collapse mostly snap just before
            if length < SHORTEST_INVERTED * increment:
                return Continuation(limit, lost, None, inverts=True)
            continue
        unstable = found.negative_pivots > pivots
        half = 0.5 * (point.load + found.load)
        middle = problem.moved(half, network.expand(0.5 * (point.u + found.u)))
        if watched and not unstable and point is stable and not problem.holds(half, middle):
            length *= BEYOND  # it has left the path
            continue
        most -= 1
        way += [way[-1] + float(np.linalg.norm(found.u - point.u))]
        loads += [found.load]
        if np.isnan(limit) and abs(found.load) < abs(point.load) and unstable:
            limit, lost = _top(way, loads), np.nan if lost == point.load else lost
            if not farthest:  # the top is between two points: a load next to it may be carried
                return Continuation(limit, lost, stable if abs(limit) >= (1 - NEARLY) * abs(target) else None)
            most, increment = MOST_BEHIND, max(increment, farthest)
        elif np.isnan(lost) and unstable:
            lost = found.load
        direction, point, stable = found.u - point.u, found, stable if unstable else found
        if abs(point.load) >= abs(target) and not unstable:
            return Continuation(limit, lost, point)
        if point.steps <= FEW:
            length = min(growth * length, increment)
    return Continuation(limit, lost, None)


def _top(way: list[float], loads: list[float]) -> float:
    """Largest load of a path whose last point falls: that of the parabola through its last three points, if it is."""
    if len(way) < 3:
        return loads[-2]
    square, slope, _ = np.polyfit(np.subtract(way[-3:], way[-2]), np.subtract(loads[-3:], loads[-2]), 2)
    return float(loads[-2] - slope**2 / (4 * square)) if square * loads[-2] < 0 else loads[-2]

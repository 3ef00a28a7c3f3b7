"""Equilibrium paths by arc length: beyond a load step, through limit points, and to buckling loads."""

from typing import NamedTuple

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

from ..linalg.factors import SingularError
from .network import Network
from .newton import TOLERANCE, LoadedNetwork, norm

INCREMENT_BEYOND = 0.25  # first increment beyond the last load step, over that step

MOST_POINTS_BEYOND = 24  # most points beyond the last load step in search of a limit point

LEAST_INCREMENT = 1e-6  # shortest increment beyond the last load step, over that step

LEAST_INCREMENT_INVERTING = 1e-3  # shortest increment to a place where a cell inverts, over that step

LIMIT_LOAD_TOLERANCE = 1e-3
"""Relative distance below a limit point, which is only estimated, at which a load may lie above it."""

MOST_POINTS_BEHIND = 60  # most points behind a limit point in search of a stable one that carries the load

FEW_STEPS, MANY_STEPS, MOST_POINT_STEPS = 3, 8, 12
"""Newton steps of a point: up to which the next increment grows, beyond which it is halved, and most of them."""

STRAIGHT_COLUMN_CHANGE = 0.02
"""Largest relative change of a buckling load by the tangent at 0.4 of it, for a nearly straight column."""

BUCKLING_INCREMENT, MOST_INCREMENTS = 0.05, 20
"""Increment of a path to its buckling load, over the displacements of a straight one there, and how many at most."""

BENDING_MESSAGE = "nothing bifurcates: the path bends before; this is the load of the nearly perfect column, about rest"
"""Message for a path without a buckling load."""


class Point(NamedTuple):
    """A point of a path: unknowns [m], load [m], negative pivots there and the Newton steps that it took."""

    u: np.ndarray
    load: float
    negative_pivots: int
    steps: int


def next_point(
    problem: LoadedNetwork, s: float, last: Point, direction: np.ndarray | None, length: float, shortest: float
) -> tuple[Point | None, float]:
    """Return the next point, or None, and its increment's length [m], halved while Newton's method fails."""
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
    """Run Newton's method in the plane across an increment; return None if it does not converge."""
    network, across = problem.network, du
    u, at = last.u + du, last.load + ds
    for step in range(1, MOST_POINT_STEPS + 1):
        displacements = problem.moved(at, network.expand(u))
        with np.errstate(over="ignore", invalid="ignore"):
            missing = at * problem.load_at(displacements) - network.free_forces_over_k(displacements)
        if not np.isfinite(size := norm(missing)):
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
    - `end`: Stable point at or beyond the target; else the last before a limit point, or one that regains the load.
    - `inverts`: Whether a cell inverts before the path turns back or reaches the target.
    """

    limit: float
    lost: float
    end: Point | None
    inverts: bool = False


def continue_path(
    problem: LoadedNetwork, load: float, last: np.ndarray, before: np.ndarray, target: float, farthest: float = 0.0
) -> Continuation:
    """Follow a path by arc length from an equilibrium to a load, or to the limit point where it turns back.

    `farthest` is the increment behind a limit point, norm of all displacements [m]; 0 stops there.
    """
    network, limit, lost = problem.network, np.nan, np.nan
    direction = network.reduce(last - before)
    point = stable = Point(network.reduce(last), load, 0, 0)
    increment = float(np.linalg.norm(direction))
    length = INCREMENT_BEYOND * increment  # near a limit point two paths may be near
    try:
        pivots = problem.stability(load, last, problem.factorize_tangent(load, last))[0]
    except SingularError:
        return Continuation(limit, lost, None)
    most, growth, way, loads = MOST_POINTS_BEYOND, 1.5, [0.0], [load]
    watched = problem.holds(load, last)  # under a follower pressure the symmetric part may be indefinite all along
    while most:
        found, length = next_point(problem, target, point, direction, length, LEAST_INCREMENT * increment)
        if found is None:
            break
        if network.inverted(problem.moved(found.load, network.expand(found.u))):
            growth, length = 1.0, INCREMENT_BEYOND * length  # cells that collapse mostly snap just before
            if length < LEAST_INCREMENT_INVERTING * increment:
                return Continuation(limit, lost, None, inverts=True)
            continue
        unstable = found.negative_pivots > pivots
        half = 0.5 * (point.load + found.load)
        middle = problem.moved(half, network.expand(0.5 * (point.u + found.u)))
        if watched and not unstable and point is stable and not problem.holds(half, middle):
            length *= INCREMENT_BEYOND  # it has left the path
            continue
        most -= 1
        way += [way[-1] + float(np.linalg.norm(found.u - point.u))]
        loads += [found.load]
        if np.isnan(limit) and abs(found.load) < abs(point.load) and unstable:
            limit, lost = _limit_load(way, loads), np.nan if lost == point.load else lost
            if not farthest:  # the top is between two points: a load next to it may be carried
                carried = abs(limit) >= (1 - LIMIT_LOAD_TOLERANCE) * abs(target)
                return Continuation(limit, lost, stable if carried else None)
            most, increment = MOST_POINTS_BEHIND, max(increment, farthest)
        elif np.isnan(lost) and unstable:
            lost = found.load
        direction, point, stable = found.u - point.u, found, stable if unstable else found
        if abs(point.load) >= abs(target) and not unstable:
            return Continuation(limit, lost, point)
        if point.steps <= FEW_STEPS:
            length = min(growth * length, increment)
    return Continuation(limit, lost, None)


def _limit_load(way: list[float], loads: list[float]) -> float:
    """Return the largest load of a path whose last load is smaller, by a parabola through its last three points."""
    if len(way) < 3:
        return loads[-2]
    square, slope, _ = np.polyfit(np.subtract(way[-3:], way[-2]), np.subtract(loads[-3:], loads[-2]), 2)
    return float(loads[-2] - slope**2 / (4 * square)) if square * loads[-2] < 0 else loads[-2]


class Path(NamedTuple):
    """Points of an equilibrium path, in order from rest; `loads` (n,) are over the reference stiffness [m]."""

    loads: np.ndarray
    displacements: np.ndarray
    negative_pivots: np.ndarray
    message: str


def follow(
    problem: LoadedNetwork, s: float, *, increment: float, most_points: int = 200, limit: float | None = None
) -> Path:
    """Follow the path from rest by arc length, through limit points, until it carries a load ``s`` [m].

    Riks' method with the exact tangent (E. Riks, Int. J. Solids Structures 15:529, 1979). `increment` is the first and
    largest increment and `limit` the largest displacement, norms over all unknowns [m].
    """
    network, direction = problem.network, None
    point = Point(np.zeros(network.unknowns), 0.0, 0, 0)
    points, length, message = [point], increment, "too many points"
    while len(points) < most_points:
        found, length = next_point(problem, s, point, direction, length, 1e-6 * increment)
        if found is None:
            message = "no equilibrium near the last point"
            break
        direction, point = found.u - point.u, found
        points.append(point)
        if network.inverted(problem.moved(point.load, network.expand(point.u))):
            message = "triangles are inverted"
            break
        if limit is not None and np.linalg.norm(point.u) >= limit or point.load / s >= 1.0:
            message = ""
            break
        growth = 1.5 if point.steps <= FEW_STEPS else 0.5 if point.steps > MANY_STEPS else 1.0
        length = min(growth * length, increment)
    moved = np.array([problem.moved(point.load, network.expand(point.u)) for point in points])
    _, loads, pivots, _ = map(np.array, zip(*points))
    return Path(loads, moved, pivots, message)


def buckling(problem: LoadedNetwork, guess: float) -> tuple[float, str]:
    """Find the load [m] at which the path from rest bifurcates, or would if it did not bend before; else say why not.

    Linear buckling analysis about two equilibria shortly below the critical load; the tangent must have a negative
    pivot shortly beyond it and none below. A column on an unsymmetric mesh bends from the first load on and stays
    stable: it gets the analysis about rest. `guess` is a load of its magnitude and sign [m]. The load is NaN, with a
    message, beyond a hundred times the guess, or if the path bends far below it, as an arch's does.
    """
    network, at_rest = problem.network, 0.01 * guess
    for share in (1.0, 0.1):  # a first estimate, then of its own size, whatever the guess
        step = share * at_rest
        there, back = step * problem.slope, -step * problem.slope
        at_rest = smallest_share(network, None, there, back) * step
        if not abs(at_rest) < 100 * abs(guess):
            return np.nan, "no buckling load up to a hundred times the load"
    first, second = (problem.newton(share * at_rest, share * at_rest * problem.slope) for share in (0.85, 0.95))
    if first.converged and second.converged:
        critical = (0.85 + 0.1 * smallest_share(network, first.displacements, second.displacements)) * at_rest
        if _bifurcates(problem, 0.85 * at_rest, first.displacements, critical):
            return critical, ""
    low = problem.newton(0.4 * at_rest, 0.4 * at_rest * problem.slope)
    if low.converged and abs(0.4 * smallest_share(network, None, low.displacements) - 1) <= STRAIGHT_COLUMN_CHANGE:
        return at_rest, BENDING_MESSAGE
    return np.nan, "no buckling load: the path bends far below it"


def _bifurcates(problem: LoadedNetwork, load: float, displacements: np.ndarray, critical: float) -> bool:
    """Whether the path on from a stable equilibrium loses its stability at a critical load, still rising."""
    network = problem.network
    direction, last = network.reduce(displacements), Point(network.reduce(displacements), load, 0, 0)
    length = BUCKLING_INCREMENT * float(np.linalg.norm(problem.slope)) * abs(critical)
    finest = length / 20  # longer ones may leap from a path that bends to the unstable one beside it
    for _ in range(MOST_INCREMENTS):
        found, _ = next_point(problem, critical, last, direction, length, 1e-6 * length)
        if found is None or found.load / critical > 1 + 2 * BUCKLING_INCREMENT:
            return False
        if not found.negative_pivots:
            direction, last = found.u - last.u, found
        elif length > finest:
            length *= 0.25
        else:
            return bool(1 - BUCKLING_INCREMENT < last.load / critical < found.load / critical)
    return False


def smallest_share(
    network: Network, first: np.ndarray | None, second: np.ndarray, mirror: np.ndarray | None = None
) -> float:
    """Return where on the line from one tangent (0) to another (1) the first eigenvalue vanishes.

    One over the largest eigenvalue of ``(K1 - K2) v = mu K1 v``. The `first` displacements [m] are None at rest.
    """
    here, there = network.tangent(first), network.tangent(second)
    change = here - there if mirror is None else 0.5 * (network.tangent(mirror) - there)
    factor = network.rest_factor if first is None else network.factorize_tangent(first)
    inverse = LinearOperator(here.shape, factor.solve, dtype=float)
    # A fixed start, across the beam, since buckling bends it: the same numbers in every run.
    start = network.reduce(network.mesh.points[:, ::-1] ** 2 * [0.0, 1.0] + 1e-3 * network.mesh.points)
    largest = eigsh(change, 1, here, which="LA", Minv=inverse, v0=start, tol=1e-10, return_eigenvectors=False)[0]
    return 1.0 / largest if largest > 0 else np.inf

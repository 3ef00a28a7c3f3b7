"""Equilibrium paths through limit points, and buckling loads."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

from ..linalg.factors import Factor
from .continuation import FEW, MANY, Point, next_point
from .network import Network
from .statics import StaticProblem

NEARLY_STRAIGHT = 0.02
"""Largest relative change of a buckling load by the tangent at 0.4 of it, for a nearly straight column."""

INCREMENT, MOST_INCREMENTS = 0.05, 20
"""Increment of a path to its buckling load, over the displacements of a straight one there, and how many at most."""

BENDS = "nothing bifurcates: the path bends before; this is the load of the nearly perfect column, about rest"
"""Message for a path without a buckling load."""


@dataclass(frozen=True)
class Path:
    """Points of an equilibrium path, in order from rest.

    `loads` (n,) are force over reference stiffness [m], `displacements` (n, n_points, 2) [m]. `negative_pivots` (n,)
    counts negative eigenvalues of the tangent; `message` says why the path ends early.
    """

    loads: np.ndarray
    displacements: np.ndarray
    negative_pivots: np.ndarray
    message: str


def follow(
    problem: StaticProblem, s: float, *, increment: float, most_points: int = 200, limit: float | None = None
) -> Path:
    """Follow the path from rest by arc length, through limit points, until it carries a load ``s`` [m].

    Riks' method: each point is sought in the plane across the last tangent, with the exact tangent in every Newton
    step (E. Riks, Int. J. Solids Structures 15:529, 1979). `increment` is the first and largest increment and `limit`
    the largest displacement, norms over all unknowns [m].
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
        length = min(length * (1.5 if point.steps <= FEW else 0.5 if point.steps > MANY else 1.0), increment)
    return Path(
        np.array([point.load for point in points]),
        np.array([problem.moved(point.load, network.expand(point.u)) for point in points]),
        np.array([point.negative_pivots for point in points]),
        message,
    )


class Buckling(NamedTuple):
    """A buckling load over the reference stiffness [m], and what restricts it; nothing where the path bifurcates."""

    load: float
    message: str


def buckling(problem: StaticProblem, guess: float) -> Buckling:
    """Find the load at which the path from rest bifurcates, or would bifurcate if it did not bend before.

    The load is that of a linear buckling analysis about two equilibria shortly below the critical load of the one
    about rest. The tangent must have a negative pivot shortly beyond it and none shortly below. On an unsymmetric
    mesh a column bends from the first load on and stays stable; then the analysis about rest is returned.

    `guess` is a load of its magnitude and sign [m]. The load is NaN, with a message, if there is none up to a hundred
    times the guess, or if the path bends far below it, as an arch's does.

    Examples
    --------
    A slender beam of the triangular lattice, ``E t = 2 / sqrt(3)``, clamped on the left and pressed on the right,
    over Euler's load:

    >>> from springtune.mesh import MESH_TYPES
    >>> mesh = MESH_TYPES["structured"](0.2, 0.02, 0.01 / 27**0.5)  # six rows
    >>> x = mesh.points[:, 0]
    >>> held = np.repeat((x <= x.min())[:, None], 2, axis=1)
    >>> pushed = np.stack([(x >= x.max()) / (x >= x.max()).sum(), 0 * x], axis=1)
    >>> problem = StaticProblem(Network(mesh, held, 0.5 * mesh.cells_per_edge), pushed)
    >>> euler = np.pi**2 * 2 / np.sqrt(3) * 0.02**3 / 12 / (4 * 0.2**2)
    >>> found = buckling(problem, -1e-5)
    >>> float((found.load / -euler).round(2)), found.message
    (1.01, '')
    """
    network, at_rest = problem.network, 0.01 * guess
    for share in (1.0, 0.1):  # a first estimate, then of its own size, whatever the guess
        step = share * at_rest
        there, back = step * problem.slope, -step * problem.slope
        at_rest = smallest_share(network, None, there, problem.rest_factor, back) * step
        if not abs(at_rest) < 100 * abs(guess):
            return Buckling(np.nan, "no buckling load up to a hundred times the load")
    first, second = (problem.newton(share * at_rest, share * at_rest * problem.slope) for share in (0.85, 0.95))
    if first.converged and second.converged:
        critical = (0.85 + 0.1 * smallest_share(network, first.displacements, second.displacements)) * at_rest
        if _bifurcates(problem, 0.85 * at_rest, first.displacements, critical):
            return Buckling(critical, "")
    low = problem.newton(0.4 * at_rest, 0.4 * at_rest * problem.slope)
    if low.converged and abs(0.4 * smallest_share(network, None, low.displacements) - 1) <= NEARLY_STRAIGHT:
        return Buckling(at_rest, BENDS)
    return Buckling(np.nan, "no buckling load: the path bends far below it")


def _bifurcates(problem: StaticProblem, load: float, displacements: np.ndarray, critical: float) -> bool:
    """Whether the path on from a stable equilibrium loses its stability at a critical load, still rising."""
    network = problem.network
    direction, last = network.reduce(displacements), Point(network.reduce(displacements), load, 0, 0)
    length = INCREMENT * float(np.linalg.norm(problem.slope)) * abs(critical)
    finest = length / 20  # longer ones may leap from a path that bends to the unstable one beside it
    for _ in range(MOST_INCREMENTS):
        found, _ = next_point(problem, critical, last, direction, length, 1e-6 * length)
        if found is None or found.load / critical > 1 + 2 * INCREMENT:
            return False
        if not found.negative_pivots:
            direction, last = found.u - last.u, found
        elif length > finest:
            length *= 0.25
        else:
            return bool(1 - INCREMENT < last.load / critical < found.load / critical)
    return False


def smallest_share(
    network: Network,
    first: np.ndarray | None,
    second: np.ndarray | None,
    factor: Factor | None = None,
    mirror: np.ndarray | None = None,
) -> float:
    """Return where on the line from one tangent (0) to another (1) the first eigenvalue vanishes.

    The tangent ``K1 + x (K2 - K1)`` is first singular at one over the largest eigenvalue of ``(K1 - K2) v = mu K1
    v``. Displacements [m] are None at rest. `mirror` is as far before the first as the second is beyond it [m]:
    tangents then change as they do at the first.
    """
    here, there = network.tangent(first), network.tangent(second)
    change = here - there if mirror is None else 0.5 * (network.tangent(mirror) - there)
    factor = factor or network.factorize_tangent(first)
    inverse = LinearOperator(here.shape, factor.solve, dtype=float)
    # A fixed start, across the beam, since buckling bends it: the same numbers in every run.
    start = network.reduce(network.mesh.points[:, ::-1] ** 2 * [0.0, 1.0] + 1e-3 * network.mesh.points)
    largest = eigsh(change, 1, here, which="LA", Minv=inverse, v0=start, tol=1e-10, return_eigenvectors=False)[0]
    return 1.0 / largest if largest > 0 else np.inf

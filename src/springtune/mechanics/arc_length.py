"""Equilibrium paths through limit points, and buckling loads."""

from dataclasses import dataclass

import numpy as np

from ..linalg.factors import SingularError
from .series import smallest_share
from .statics import TOLERANCE

FEW, MANY = 3, 8
"""Newton steps of a point of a path at or below which the next increment grows, and beyond which it is halved."""


@dataclass(frozen=True)
class Path:
    """Points of an equilibrium path, in order from rest.

    Attributes
    ----------
    loads : ndarray of float, shape (n,)
        Force over the reference stiffness [m].
    displacements : ndarray of float, shape (n, n_points, 2)
        [m]
    negative_pivots : ndarray of int, shape (n,)
        Negative eigenvalues of the tangent.
    message : str
        Why the path ends before its last load, empty where it does not.
    """

    loads: np.ndarray
    displacements: np.ndarray
    negative_pivots: np.ndarray
    message: str


def follow(problem, s, *, increment, most_points=200, limit=None):
    """Follow the path of a network from rest by arc length, through limit points, until it carries a load.

    Riks' method: each point is sought in the plane across the last tangent, with the exact tangent anew in every Newton
    step (E. Riks, Int. J. Solids Structures 15:529, 1979).

    Parameters
    ----------
    problem : StaticProblem
    s : float
        Force over the reference stiffness at which it ends [m].
    increment : float
        First and largest length of an increment, norm of the displacements of all unknowns [m].
    most_points : int, optional
    limit : float, optional
        Largest norm of the displacements; the path ends there.

    Returns
    -------
    Path
    """
    network, load = problem.network, problem.load
    u, at, scale = np.zeros(network.unknowns), 0.0, abs(s) * problem.load_norm
    direction = None
    points = [(0.0, network.expand(u), 0)]
    length, message = increment, "too many points"

    def factorize(u, at):
        follower = problem.follower and (at, problem.follower)
        return network.factorize(network.expand(u), follower)

    def forces(u):
        return load if problem.follower is None else network.reduce(problem.follower.forces(network.expand(u)))

    while len(points) < most_points:
        try:
            factor = factorize(u, at)
            tangent = factor.solve(forces(u))
            sign = np.sign(s) if direction is None else np.sign(direction @ tangent) or 1.0
            found = None
            while found is None and length > 1e-6 * increment:
                rise = sign * length / np.linalg.norm(tangent)
                found = _correct(problem, factorize, forces, u, at, rise * tangent, rise, scale)
                if found is None:
                    length *= 0.5
        except SingularError:
            length *= 0.7  # a point exactly on a limit point: the next one is not
            found = None
        if found is None:
            message = "no equilibrium near the last point"
            break
        new, load_now, pivots, steps = found
        direction, u, at = new - u, new, load_now
        points.append((at, network.expand(u), pivots))
        if network.inverted(points[-1][1]):
            message = "triangles are inverted"
            break
        if limit is not None and np.linalg.norm(u) >= limit or at / s >= 1.0:
            message = ""
            break
        length = min(length * (1.5 if steps <= FEW else 0.5 if steps > MANY else 1.0), increment)
    loads, displacements, pivots = zip(*points)
    return Path(np.array(loads), np.array(displacements), np.array(pivots), message)


def _correct(problem, factorize, forces, u, at, du, ds, scale, most=12):
    """Newton's method in the plane across an increment; None where it does not converge."""
    network, across = problem.network, du
    u, at = u + du, at + ds
    for step in range(1, most + 1):
        load = forces(u)
        with np.errstate(over="ignore", invalid="ignore"):
            missing = at * load - network.resistance(network.expand(u))
            size = np.linalg.norm(missing)
        if not np.isfinite(size):
            return None
        factor = factorize(u, at)
        if size <= TOLERANCE * scale:
            return u, at, problem.stability(at, network.expand(u), factor)[0], step
        back, forth = factor.solve(missing), factor.solve(load)
        change = -(across @ back) / (across @ forth)
        u, at = u + back + change * forth, at + change
    return None


def buckling_load(problem, guess):
    """Load at which the path from rest loses its stability [m]: force over the reference stiffness.

    A linear buckling analysis about two equilibria shortly below the critical load of the one about rest; the number of
    negative pivots of the tangent shortly below and above its answer proves it.

    Parameters
    ----------
    problem : StaticProblem
    guess : float
        A load of its magnitude and sign.

    Returns
    -------
    float
        NaN where there is none up to a hundred times the guess, or none that could be proved.
    """
    network, small = problem.network, 1e-3 * guess
    critical = smallest_share(network, None, small * problem.slope, problem.rest_factor) * small
    if not abs(critical) < 100 * abs(guess):
        return np.nan
    first, second = (problem.newton(share * critical, share * critical * problem.slope) for share in (0.85, 0.95))
    if not (first.converged and second.converged):
        return np.nan
    step = 0.1 * critical
    share = smallest_share(network, first.displacements, second.displacements)
    critical = 0.85 * critical + share * step

    def pivots(factor):
        # The path is all but straight between the two equilibria and here.
        along = (factor * critical - (critical - share * step)) / step
        return network.factorize(
            first.displacements + along * (second.displacements - first.displacements)
        ).negative_pivots

    return critical if pivots(0.99) < pivots(1.01) else np.nan

"""Equilibria of a network under a growing load: linear, nonlinear, and the whole path of them.

The load is ``s`` times a fixed pattern of forces of total 1; ``s = F / k`` is the force over the reference stiffness
[m]. Nothing else enters: a path over ``s`` serves every force, material and uniform stiffness of a mesh.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .network import SingularError
from .path import Expansion

TOLERANCE = 1e-10
"""Largest residual of an equilibrium, relative to the load."""

MAX_ITERATIONS = 12
MAX_HALVINGS = 12
KEEP_TANGENT = 0.03
"""Share of the residual that a step may leave for its tangent to serve once more."""

START_ORDER = 6
"""Orders of the series that starts Newton's method: together they cost a quarter of a factorisation."""


@dataclass(frozen=True)
class Equilibrium:
    """What a solve found.

    Attributes
    ----------
    displacements : ndarray of float, shape (n_points, 2)
        Displacement of each particle [m]; of the last iterate where it did not converge.
    converged : bool
    iterations : int
        Newton steps.
    residual : float
        Norm of the out-of-balance force over that of the load [1].
    factor : Factor or None
        The last factorised tangent.
    reason : str
        Why it did not converge, empty where it did.
    load_share : float
        Largest share of the load at which there is a good equilibrium [1]; 1 where it converged.
    last : ndarray of float, shape (n_points, 2), or None
        Displacements at that share, where it is below 1.
    """

    displacements: np.ndarray
    converged: bool
    iterations: int
    residual: float
    factor: object
    reason: str = ""
    load_share: float = 1.0
    last: np.ndarray | None = None


class FollowerPressure:
    """A pressure that turns and grows with the edges that it acts on, of total force 1 at rest.

    Each edge of vector e carries ``e`` turned by a right angle, over the length of the side, half of it on either end.

    Parameters
    ----------
    mesh : Mesh
    edges : ndarray of int, shape (n, 2)
        Edges of a straight side.
    axis : int
        Axis along the side; the force is along the other one.
    """

    def __init__(self, mesh, edges, axis):
        along = mesh.points[edges[:, 1], axis] - mesh.points[edges[:, 0], axis]
        self.edges = np.where((along < 0)[:, None], edges[:, ::-1], edges)
        self.rest = mesh.points[self.edges[:, 1]] - mesh.points[self.edges[:, 0]]
        turn = np.array([[0.0, -1.0], [1.0, 0.0]]) * (1 if axis == 0 else -1)
        self.turn = 0.5 * turn / np.abs(along).sum()
        half = np.block([-self.turn, self.turn])
        self.derivative = np.broadcast_to(np.vstack([half, half]), (len(edges), 4, 4))

    def forces(self, displacements):
        """Forces on the particles [1], shape (n_points, 2)."""
        sides = self.rest + displacements[self.edges[:, 1]] - displacements[self.edges[:, 0]]
        field = np.zeros(displacements.shape)
        np.add.at(field, self.edges, (sides @ self.turn.T)[:, None, :])
        return field


class StaticProblem:
    """A network under a load pattern.

    Parameters
    ----------
    network : Network
    pattern : ndarray of float, shape (n_points, 2)
        Forces on the particles [1]; scaled by ``s``.
    follower : FollowerPressure, optional
        What the forces become as the particles move; they stay as they are without.
    """

    def __init__(self, network, pattern, follower=None):
        self.network = network
        self.follower = follower
        self.load = network.reduce(pattern)
        self.load_norm = float(np.linalg.norm(self.load))

    @property
    def rest_factor(self):
        """Tangent factorised at rest, shared by all loads of the network."""
        return self.network.rest_factor

    @cached_property
    def slope(self):
        """Displacements of the linear network over ``s`` [1], shape (n_points, 2)."""
        return self.network.expand(self.rest_factor.solve(self.load))

    @cached_property
    def start(self):
        """Short series about rest: where Newton's method starts."""
        return Expansion(self.network, self.load, 0.0, None, self.rest_factor, order=START_ORDER)

    @cached_property
    def rest(self):
        """Long series about rest, for a whole curve."""
        return Expansion(self.network, self.load, 0.0, None, self.rest_factor)

    def linear(self, s):
        """Equilibrium of the network with linear kinematics.

        Parameters
        ----------
        s : float
            Force over the reference stiffness [m].

        Returns
        -------
        Equilibrium
        """
        displacements = s * self.slope
        missing = s * self.load - self.network.linear_resistance(displacements)
        residual = float(np.linalg.norm(missing)) / (abs(s) * self.load_norm)
        converged = residual <= TOLERANCE
        reason = "" if converged else f"linear solve left a residual of {residual:.1e}"
        return Equilibrium(displacements, converged, 1, residual, self.rest_factor, reason)

    def nonlinear(self, s):
        """Equilibrium of the network with its springs' full length law.

        Newton's method from the series about rest; where that fails, from the linear solution, which next to buckling
        is the nearer guess; where that fails, in load steps from rest.

        Parameters
        ----------
        s : float
            Force over the reference stiffness [m].

        Returns
        -------
        Equilibrium
        """
        iterations = 0
        starts = [lambda s: s * self.slope]
        if not self.network.energies and self.follower is None:  # the series is of springs under dead loads
            starts.insert(0, lambda s: self.start.predict(s))
        for start in starts:
            found = self.newton(s, start(s))
            iterations += found.iterations
            if found.converged:
                return replace(found, iterations=iterations)
        return self._in_steps(s, iterations)

    def newton(self, s, start, max_iterations=MAX_ITERATIONS):
        """Newton's method with the exact tangent and a line search on the norm of the residual.

        A step is halved until the residual falls and no triangle is inverted. A factorised tangent serves as long as
        its steps cut the residual by `KEEP_TANGENT`: near the solution a new one costs ten such steps.

        Parameters
        ----------
        s : float
            Force over the reference stiffness [m].
        start : ndarray of float, shape (n_points, 2)
            First guess of the displacements [m].
        max_iterations : int, optional
            Largest number of factorisations.

        Returns
        -------
        Equilibrium
        """
        network = self.network
        scale = abs(s) * self.load_norm

        def balance(displacements):
            load = self.load if self.follower is None else network.reduce(self.follower.forces(displacements))
            missing = s * load - network.resistance(displacements)
            return missing, _norm(missing) / scale

        displacements, factor, factorised, steps = start, None, 0, 0
        missing, residual = balance(displacements)
        if not np.isfinite(residual) or network.inverted(displacements):
            displacements = np.zeros_like(start)
            missing, residual = s * self.load, 1.0

        def end(reason=""):
            return Equilibrium(displacements, not reason, steps, residual, factor, reason)

        keep = False
        while True:
            if not keep:
                if factorised == max_iterations:
                    return end("too many iterations")
                try:
                    factor = network.factorize(displacements, self.follower and (s, self.follower))
                except SingularError:
                    return end("singular tangent")
                factorised += 1
            step = network.expand(factor.solve(missing))
            length = 1.0
            for _ in range(MAX_HALVINGS):
                trial = displacements + length * step
                trial_missing, trial_residual = balance(trial)
                better = trial_residual <= max((1.0 - 1e-4 * length) * residual, 0.1 * TOLERANCE)
                if better and not network.inverted(trial):
                    break
                length *= 0.5
            else:
                if keep:  # the tangent is of an earlier iterate
                    keep = False
                    continue
                return end("line search found no descent")
            steps += 1
            keep = trial_residual <= KEEP_TANGENT * residual
            displacements, missing, residual = trial, trial_missing, trial_residual
            if residual <= TOLERANCE:
                return end()

    def _in_steps(self, s, iterations, smallest=1 / 64):
        """Load steps from rest, each started from the last two equilibria, halved where Newton's method fails."""
        done, step = 0.0, 0.25  # of the load
        last = before = np.zeros(self.network.held.shape)
        last_step = None
        while True:
            step = min(step, 1.0 - done)
            guess = last if last_step is None else last + (last - before) * (step / last_step)
            found = self.newton((done + step) * s, guess)
            iterations += found.iterations
            if found.converged:
                before, last, last_step = last, found.displacements, step
                done += step
                if done >= 1.0:
                    return replace(found, iterations=iterations)
                step *= 1.5
            elif step <= smallest:
                reason = f"{found.reason} beyond {100 * done:.3g} % of the load"
                return replace(found, iterations=iterations, reason=reason, load_share=done, last=last)
            else:
                step *= 0.5


def _norm(vector):
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.linalg.norm(vector))

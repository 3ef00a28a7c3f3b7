"""Equilibria of a network under a growing load: linear, nonlinear, and the whole path of them.

The load is ``s`` times a fixed pattern of forces of total 1; ``s = F / k`` is the force over the reference stiffness
[m]. Nothing else enters: a path over ``s`` serves every force, material and uniform stiffness of a mesh.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .factors import SingularError
from .path import Expansion

TOLERANCE = 1e-10
"""Residual of an equilibrium, relative to the load; slender beams reach it only within rounding, see `CORRECTION`."""

MAX_ITERATIONS = 12
MAX_HALVINGS = 12
CORRECTION = 1e-6
"""Largest estimated error of a solution's displacements: a residual alone says nothing where the stiffness is
ill-conditioned."""

FRESH = 2e-3
"""Residual up to which the tangent of an iterate has the inertia of the solution."""

FAR = 0.15
"""Stretch of a spring beyond which an equilibrium is sought along the path from rest."""

SURPRISE = 0.1
"""Distance of a spring's vector from where it was expected, over its length, beyond which a load step is halved."""

KEEP_TANGENT = 0.03
"""Share of the residual that a step may leave for its tangent to serve once more."""

START_ORDER = 3
"""Orders of the series that starts Newton's method: together they cost half of a factorisation."""


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
    factor_residual : float
        Residual where it was taken.
    reason : str
        Why it did not converge, empty where it did.
    unstable_share : float
        Share of the load at which the path to it is unstable [1]; NaN where no such place is known.
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
    factor_residual: float = 0.0
    reason: str = ""
    unstable_share: float = np.nan
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
        correction = self.correction(self.rest_factor, missing, displacements)
        good = correction <= CORRECTION
        reason = "" if good else _uncertain(correction)
        return Equilibrium(displacements, not reason, 1, residual, self.rest_factor, reason=reason)

    def correction(self, factor, missing, displacements):
        """Estimated error of displacements over their size [1].

        The Newton step that is left, and what rounding of the displacements does to the forces.

        Parameters
        ----------
        factor : Factor
            Tangent factorised near them.
        missing : ndarray of float, shape (unknowns,)
            Load less resistance [m].
        displacements : ndarray of float, shape (n_points, 2)
            [m]
        """
        rounding = np.finfo(float).eps * self.network.reduce(self.network.local_stiffness * displacements)
        signs = np.random.default_rng(0).choice([-1.0, 1.0], len(rounding))
        return _norm(factor.estimate(missing + signs * rounding)) / (_norm(displacements.ravel()) or 1.0)

    def negative_pivots(self, s, found):
        """Number of negative eigenvalues of the tangent at an equilibrium; 0 where it is stable.

        The last factorised tangent answers, unless it was taken too far from the solution.

        Parameters
        ----------
        s : float
            Force over the reference stiffness [m].
        found : Equilibrium

        Raises
        ------
        SingularError
            If the tangent is singular, as it is at a limit point.
        """
        if found.factor_residual <= FRESH:
            return found.factor.negative_pivots
        return self.network.factorize(found.displacements, self.follower and (s, self.follower)).negative_pivots

    def judge(self, s, found):
        """What an equilibrium is worth.

        Parameters
        ----------
        s : float
            Force over the reference stiffness [m].
        found : Equilibrium

        Returns
        -------
        status : str
            ``"solved"``, ``"unstable"`` or ``"not_converged"``.
        message : str
            Why it is not solved; empty where it is.
        negative_pivots : int or float
            Negative eigenvalues of the tangent; NaN where there is no equilibrium, or the tangent is singular.
        """
        if not found.converged:
            return "not_converged", f"{found.reason}; last residual {found.residual:.1e}", np.nan
        try:
            pivots = self.negative_pivots(s, found)
        except SingularError:
            return "unstable", "limit point: the tangent is singular", np.nan
        if pivots:
            many = "s" if pivots > 1 else ""
            return "unstable", f"unstable equilibrium: the tangent has {pivots} negative pivot{many}", pivots
        if found.unstable_share < 1:
            share = f"{100 * found.unstable_share:.3g} %"
            return "unstable", f"the path to it is unstable at {share} of the load: the beam leaves it", pivots
        return "solved", "", pivots

    def nonlinear(self, s):
        """Equilibrium of the network with its springs' full length law.

        Newton's method from the series about rest; where that fails, from the linear solution, which next to buckling
        is the nearer guess; where that fails, in load steps from rest. So are solutions with springs stretched beyond
        `FAR` of their length: there may be other equilibria, and the one asked for is on the path from rest.

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
                if self.network.largest_stretch(found.displacements) <= FAR:
                    return replace(found, iterations=iterations)
                break
        return self._in_steps(s, iterations)

    def _unstable(self, s, found):
        try:
            return self.negative_pivots(s, found) > 0
        except SingularError:
            return True

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

        displacements, factor, factorised, steps, taken = start, None, 0, 0, 0.0
        missing, residual = balance(displacements)
        if not np.isfinite(residual) or network.inverted(displacements):
            displacements = np.zeros_like(start)
            missing, residual = s * self.load, 1.0

        def end(reason=""):
            return Equilibrium(displacements, not reason, steps, residual, factor, taken, reason)

        keep, stalled = False, 0
        while True:
            if not keep:
                if factorised == max_iterations:
                    return end("too many iterations")
                try:
                    factor = network.factorize(displacements, self.follower and (s, self.follower))
                except SingularError:
                    return end("singular tangent")
                factorised, taken = factorised + 1, residual
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
                correction = self.correction(factor, missing, displacements)
                if correction <= CORRECTION:  # rounding hides a smaller residual
                    return end()
                if _norm(step) <= CORRECTION * _norm(displacements):
                    return end(_uncertain(correction))
                return end("line search found no descent")
            steps += 1
            keep = trial_residual <= KEEP_TANGENT * residual
            displacements, missing, residual = trial, trial_missing, trial_residual
            if residual <= TOLERANCE:
                correction = self.correction(factor, missing, displacements)
                if correction <= CORRECTION:
                    return end()
                if stalled == 3:
                    return end(_uncertain(correction))
                stalled += 1

    def _in_steps(self, s, iterations, smallest=1 / 64):
        """Load steps from rest, each started from the last two equilibria, halved where Newton's method fails."""
        done, step = 0.0, 0.25  # of the load
        last = before = np.zeros(self.network.held.shape)
        last_step, unstable = None, np.nan
        while True:
            step = min(step, 1.0 - done)
            guess = step * s * self.slope if last_step is None else last + (last - before) * (step / last_step)
            found = self.newton((done + step) * s, guess)
            iterations += found.iterations
            # Where springs are far from where the path pointed, some of them have snapped.
            missed = self.network.largest_change(found.displacements - guess) > SURPRISE
            if found.converged and (step <= smallest or not missed):
                if missed and np.isnan(unstable):
                    unstable = done
                before, last, last_step = last, found.displacements, step
                done += step
                if done >= 1.0:
                    return replace(found, iterations=iterations, unstable_share=unstable)
                if np.isnan(unstable) and self._unstable(done * s, found):
                    unstable = done
                step *= 1.5
            elif step <= smallest:
                reason = f"{found.reason} beyond {100 * done:.3g} % of the load"
                return replace(found, iterations=iterations, reason=reason, load_share=done, last=last)
            else:
                step *= 0.5


def _uncertain(correction):
    return f"ill-conditioned: {correction:.1e} of the displacements is uncertain"


def _norm(vector):
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.linalg.norm(vector))

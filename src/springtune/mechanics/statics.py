"""Equilibria of a network under a growing load: linear, nonlinear, and the whole path of them.

The load is ``s`` times a fixed pattern of forces of total 1; ``s = F / k`` is the force over the reference stiffness
[m]. Nothing else enters: a path over ``s`` serves every force, material and uniform stiffness of a mesh.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigs

from ..linalg.factors import SingularError
from ..problem.status import Status
from .series import Expansion

TOLERANCE = 1e-10
"""Residual of an equilibrium, relative to the load; slender beams reach it only within rounding, see `CORRECTION`."""

MAX_ITERATIONS = 16
MAX_HALVINGS = 12
CORRECTION = 1e-6
"""Largest estimated error of a solution's displacements: a residual alone says nothing where the stiffness is
ill-conditioned."""

REFINED = 1e-9
"""Estimated error above which a solution is refined by further steps, as long as each of them halves it."""

REPRESENTATION = 4.0
"""Residual that counts as balance, over what rounding of the displacements alone makes of it."""

WATCHED = 4
"""Steps of Newton's method in a row that may leave the residual above the least one seen: a slender beam that turns is
stretched by one step and released by the next."""

LONGEST_STEP = 0.5
"""Largest change of a spring's vector over its length in such a step."""

FAR = 0.15
"""Stretch of a spring beyond which an equilibrium is sought along the path from rest."""

TURNED = 0.3
"""Change of a spring's vector over its length, turns included, beyond which it is, too."""

SURPRISE = 0.1
"""Distance of a spring's vector from where it was expected, over its length, beyond which a load step is halved."""

SMALLEST_STEP = 1 / 64
"""Load step in which Newton's method has to converge, over the load."""

SHORTEST = 1 / 2048
"""Load step down to which springs that turn fast are told from springs that snap."""

MODES = 24
"""Eigenvalues nearest to zero that tell whether an equilibrium under a follower pressure is stable."""

MERGED = 1e-6
"""Imaginary part of an eigenvalue over its size beyond which two modes have merged: they flutter."""

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
        Factorised tangent: that at the solution, where it converged.
    reason : str
        Why it did not converge, empty where it did.
    error_estimate : float
        Estimated error of the displacements over their size [1]; NaN where there is no balance.
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
    reason: str = ""
    error_estimate: float = np.nan
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
    def _slope(self):
        """The linear network's displacements over ``s``, the residual [1] and the estimated error of them [1]."""

        def balance(slope):
            missing = self.load - self.network.linear_resistance(slope)
            return missing, _norm(missing) / self.load_norm

        first = self.network.expand(self.rest_factor.solve(self.load))
        here, correction = self._refine((first, *balance(first)), self.rest_factor, balance, linear=True)
        slope, _, residual = here
        return slope, residual, correction

    @property
    def slope(self):
        """Displacements of the linear network over ``s`` [1], shape (n_points, 2)."""
        return self._slope[0]

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
        slope, residual, correction = self._slope
        reason = "" if correction <= CORRECTION else _uncertain(correction)
        return Equilibrium(s * slope, not reason, 1, residual, self.rest_factor, reason, correction)

    def _correction(self, factor, missing, displacements, linear=False):
        """Estimated error of displacements over their size [1].

        The Newton step that is left, and what rounding of the forces does to the displacements.

        Parameters
        ----------
        factor : Factor
            Tangent factorised near them.
        missing : ndarray of float, shape (unknowns,)
            Load less resistance [m].
        displacements : ndarray of float, shape (n_points, 2)
            [m]
        linear : bool, optional
            Whether the network has linear kinematics.
        """
        rounding = self.network.rounding(displacements, linear)
        signs = np.random.default_rng(0).choice([-1.0, 1.0], len(rounding))
        return _norm(factor.estimate(missing + signs * rounding)) / (_norm(displacements.ravel()) or 1.0)

    def _balanced(self, s, displacements, residual):
        """Whether a residual is within the tolerance, or what rounding of the displacements alone makes of it."""
        if residual <= TOLERANCE:
            return True
        rounding = np.finfo(float).eps * self.network.reduce(self.network.local_stiffness * displacements)
        return residual * abs(s) * self.load_norm <= REPRESENTATION * _norm(rounding)

    def negative_pivots(self, s, found):
        """Number of negative eigenvalues of the tangent at an equilibrium; 0 where it is stable under dead loads.

        Parameters
        ----------
        s : float
            Force over the reference stiffness [m].
        found : Equilibrium
            Its factor is that of the tangent there.

        Raises
        ------
        SingularError
            If the tangent is singular, as it is at a limit point.
        """
        return self.stability(s, found.displacements, found.factor)[0]

    def stability(self, s, displacements, factor):
        """Whether an equilibrium is stable.

        Parameters
        ----------
        s : float
            Force over the reference stiffness [m].
        displacements : ndarray of float, shape (n_points, 2)
            [m]
        factor : Factor
            Tangent factorised there; that at rest for linear kinematics.

        Returns
        -------
        negative : int
            Number of negative eigenvalues of the tangent.
        flutters : bool
            Whether two modes have merged, as they may under a follower pressure alone.

        Raises
        ------
        SingularError
            If the tangent is singular, as it is at a limit point.
        """
        if self.follower is None or factor is self.rest_factor:
            return factor.negative_pivots, False
        modes = self.modes(s, displacements, factor)
        merged = np.abs(modes.imag) > MERGED * np.abs(modes)
        return int((modes.real < 0)[~merged].sum()), bool(merged.any())

    def modes(self, s, displacements, factor):
        """Eigenvalues nearest to zero of the tangent over the masses, at an equilibrium under a follower pressure.

        Such a tangent is not symmetric: besides one of them passing zero, where a beam buckles, two may merge and leave
        the real axis, and the beam flutters (Beck's column: M. Beck, Z. angew. Math. Phys. 3:225, 1952). Masses are
        those of a uniform sheet; damping, which can lower the critical load, is none.

        Parameters
        ----------
        s : float
            Force over the reference stiffness [m].
        displacements : ndarray of float, shape (n_points, 2)
            [m]
        factor : Factor
            Tangent factorised there.

        Returns
        -------
        ndarray of complex, shape (n,)
            Squares of the frequencies, over stiffness and mass of the whole sheet; at most `MODES`.
        """
        network = self.network
        mass = network.reduce(np.repeat(network.mesh.particle_areas[:, None], 2, axis=1)) / network.mesh.area
        if len(mass) <= 4 * MODES:
            tangent = network.tangent(displacements, (s, self.follower))
            values = np.linalg.eigvals(tangent.toarray() / mass[:, None])
            return values[np.argsort(abs(values))][:MODES]
        # The largest eigenvalues of the inverse.
        inverse = LinearOperator((len(mass),) * 2, lambda right: factor.solve(mass * right.ravel()), dtype=float)
        start = np.random.default_rng(0).standard_normal(len(mass))
        return 1.0 / eigs(inverse, MODES, v0=start, return_eigenvectors=False)

    def judge(self, s, found):
        """What an equilibrium is worth.

        Parameters
        ----------
        s : float
            Force over the reference stiffness [m].
        found : Equilibrium

        Returns
        -------
        status : Status
            Solved, unstable or not converged.
        message : str
            Why it is not solved; empty where it is.
        negative_pivots : int or float
            Negative eigenvalues of the tangent; NaN where there is no equilibrium, or the tangent is singular.
        """
        if not found.converged:
            return Status.NOT_CONVERGED, f"{found.reason}; last residual {found.residual:.1e}", np.nan
        try:
            pivots, flutters = self.stability(s, found.displacements, found.factor)
        except SingularError:
            return Status.UNSTABLE, "limit point: the tangent is singular", np.nan
        if pivots:
            many = "s" if pivots > 1 else ""
            return Status.UNSTABLE, f"unstable equilibrium: the tangent has {pivots} negative pivot{many}", pivots
        if flutters:
            return (
                Status.UNSTABLE,
                "unstable equilibrium: it flutters, two modes have merged into a complex pair",
                pivots,
            )
        if found.unstable_share < 1:
            share = f"{100 * found.unstable_share:.3g} %"
            return Status.UNSTABLE, f"the path to it is unstable at {share} of the load: the beam leaves it", pivots
        return Status.SOLVED, "", pivots

    def nonlinear(self, s):
        """Equilibrium of the network with its springs' full length law.

        Newton's method from the series about rest; where that fails, from the linear solution, which next to buckling
        is the nearer guess; where that fails, in load steps from rest. So are solutions with springs stretched beyond
        `FAR` or turned beyond `TURNED`: there may be other equilibria, and the one asked for is on the path from rest.

        Parameters
        ----------
        s : float
            Force over the reference stiffness [m].

        Returns
        -------
        Equilibrium
            Its factor is that of the tangent at the solution.
        """
        iterations = 0
        starts = [lambda s: s * self.slope]
        if not self.network.energies and self.follower is None:  # the series is of springs under dead loads
            starts.insert(0, lambda s: self.start.predict(s))
        for start in starts:
            found = self.newton(s, start(s))
            iterations += found.iterations
            if found.converged:
                change = self.network.largest_change(found.displacements)  # never below the stretch
                if change <= FAR or change <= TURNED and self.network.largest_stretch(found.displacements) <= FAR:
                    return replace(found, iterations=iterations)
                break
        return self._in_steps(s, iterations)

    def _unstable(self, s, found):
        """Whether a path leaves an equilibrium; flutter on the way is no matter of where it leads."""
        try:
            return self.stability(s, found.displacements, found.factor)[0] > 0
        except SingularError:
            return True

    def _balance(self, s, displacements):
        """Load less resistance [m], and its norm over that of the load [1]."""
        load = self.load if self.follower is None else self.network.reduce(self.follower.forces(displacements))
        missing = s * load - self.network.resistance(displacements)
        return missing, _norm(missing) / (abs(s) * self.load_norm)

    def _factorize(self, s, displacements):
        return self.network.factorize(displacements, self.follower and (s, self.follower))

    def newton(self, s, start, max_iterations=MAX_ITERATIONS):
        """Newton's method with the exact tangent.

        A few steps may leave the residual above the least one seen, before the iterate with that is taken up again and
        steps are halved until the residual falls (watchdog technique: Chamberlain, Lemarechal, Pedersen and Powell,
        Math. Programming Study 16:1, 1982). No step may invert a cell. A factorised tangent serves as long as its steps
        cut the residual by `KEEP_TANGENT`: near the solution a new one costs ten such steps.

        Parameters
        ----------
        s : float
            Force over the reference stiffness [m].
        start : ndarray of float, shape (n_points, 2)
            First guess of the displacements [m].
        max_iterations : int, optional
            Largest number of factorisations on the way; one more is that of the tangent at the solution.

        Returns
        -------
        Equilibrium
        """
        network = self.network
        here = start, *self._balance(s, start)  # displacements, what is missing and the residual
        if not np.isfinite(here[2]) or network.inverted(start):
            here = np.zeros_like(start), s * self.load, 1.0
        factor, factorised, steps, keep = None, 0, 0, False
        best, since, watched = here, 0, True

        def end(reason):
            return Equilibrium(here[0], False, steps, here[2], factor, reason)

        while not self._balanced(s, here[0], here[2]):
            if not keep:
                if factorised == max_iterations:
                    return end("too many iterations")
                factor = None  # which gives its room back
                try:
                    factor = self._factorize(s, here[0])
                except SingularError:
                    return end("singular tangent")
                factorised += 1
            step = network.expand(factor.solve(here[1]))
            there = self._step(s, here, step, halvings=0 if watched else MAX_HALVINGS)
            lower = there is not None and there[2] <= (1.0 - 1e-4) * best[2]
            if keep and not lower:  # the tangent is of an earlier iterate
                keep = False
                continue
            if watched and not lower and (there is None or since == WATCHED):
                here, keep, watched = best, False, False
                continue
            if there is None:
                return end("line search found no descent")
            steps += 1
            keep = there[2] <= KEEP_TANGENT * here[2]
            here = there
            best, since = (here, 0) if lower else (best, since + 1)
        factor = None
        try:
            factor = self._factorize(s, here[0])
            refined, correction = self._refine(here, factor, lambda displacements: self._balance(s, displacements))
            if refined is not here and self.network.largest_change(refined[0] - here[0]) > CORRECTION:
                factor = None
                factor = self._factorize(s, refined[0])
        except SingularError:
            return end("singular tangent")
        displacements, _, residual = refined
        reason = "" if correction <= CORRECTION else _uncertain(correction)
        return Equilibrium(displacements, not reason, steps, residual, factor, reason, correction)

    def _refine(self, here, factor, balance, linear=False):
        """Steps with one tangent for as long as each of them halves the estimated error; where they end, and that."""
        correction = self._correction(factor, here[1], here[0], linear)
        while correction > REFINED:
            displacements = here[0] + self.network.expand(factor.solve(here[1]))
            there = displacements, *balance(displacements)
            better = self._correction(factor, there[1], displacements, linear)
            if not better <= 0.5 * correction or not linear and self.network.inverted(displacements):
                break
            here, correction = there, better
        return here, correction

    def _step(self, s, here, step, halvings):
        """Where a step leads, halved until the residual falls; as it is where it may not be halved.

        None where no such step keeps all cells from turning inside out.
        """
        displacements, _, residual = here
        length = 1.0
        if not halvings and 2 * np.abs(step).max() > LONGEST_STEP * self.network.rest_lengths.min():
            length /= max(1.0, self.network.largest_change(step) / LONGEST_STEP)
        for _ in range(max(halvings, 1)):
            trial = displacements + length * step
            missing, found = self._balance(s, trial)
            lower = not halvings or found <= (1.0 - 1e-4 * length) * residual
            if lower and np.isfinite(found) and not self.network.inverted(trial):
                return trial, missing, found
            length *= 0.5
        return None

    def _in_steps(self, s, iterations):
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
            if found.converged and (step <= SHORTEST or not missed):
                if missed and np.isnan(unstable):
                    unstable = done
                before, last, last_step = last, found.displacements, step
                done += step
                if done >= 1.0:
                    return replace(found, iterations=iterations, unstable_share=unstable)
                if np.isnan(unstable) and self._unstable(done * s, found):
                    unstable = done
                step *= 1.5
            elif step <= SMALLEST_STEP and not found.converged:
                reason = f"{found.reason} beyond {100 * done:.3g} % of the load"
                return replace(found, iterations=iterations, reason=reason, load_share=done, last=last)
            else:
                step *= 0.5


def _uncertain(correction):
    return f"ill-conditioned: {correction:.1e} of the displacements is uncertain"


def _norm(vector):
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.linalg.norm(vector))

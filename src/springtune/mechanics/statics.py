"""Equilibria of a network under a growing load: linear, nonlinear, and along the whole path.

The load is ``s`` times a fixed pattern of forces of total 1; ``s = F / k`` is force over reference stiffness [m]. So
one path serves every force, material and uniform stiffness of a mesh.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np

from ..linalg.factors import SingularError as SingularError
from ..problem.status import Status
from .continuation import continue_path
from .expansion import Expansion
from .newton import Equilibrium, LoadedNetwork, uncertainty

FAR_STRETCH = 0.15
"""Stretch of a spring beyond which an equilibrium is sought along the path from rest."""

FAR_CHANGE = 0.3
"""Change of a spring's vector over its length above which this applies too."""

UNSNAPPED_CHANGE = 1e-3
"""Change of a spring's vector over its length below which no path turns back."""

SURPRISING_CHANGE = 0.1
"""Distance of a spring's vector from its prediction, over its length, above which a load step is halved."""

SMALLEST_STEP = 1 / 64
"""Load step in which Newton's method has to converge, over the load."""

SHORTEST_STEP = 1 / 2048
"""Smallest load step that distinguishes springs that turn fast from springs that snap."""

LARGEST_BEND = 0.1
"""Largest distance of a parabola's middle from the straight way's, over its length, to use it."""

FORESEEN_SHARE, WORK_SHARE = 0.25, 0.02
"""Limits below which no snap can lie on the way to an equilibrium.

Its distance from a guess over the way to it; and the work of out-of-balance forces in the middle of the way over the
load's. Of 153 snaps of arches the smallest values are 0.35 and 0.05.
"""

WAY_INCREMENTS = 8
"""Increments of a path behind a limit point, over the straight way from there to a stable equilibrium."""

HIGH_ORDER = 16
"""Order of a series if the default order fails."""

START_ORDER = 3
"""Orders of the series that starts Newton's method: together they cost half of a factorization."""


class StaticProblem(LoadedNetwork):
    """Network under a load `pattern` of forces [1] and `given` displacements, both scaled by ``s``.

    `dead` is the part that keeps its direction; `load_norm`, which residuals are over, includes reactions to `given`.
    """

    @cached_property
    def start(self) -> Expansion:
        """Short series about rest: where Newton's method starts."""
        return Expansion(self.network, self.load, 0.0, None, self.network.rest_factor, order=START_ORDER, rough=True)

    @cached_property
    def rest(self) -> Expansion:
        """Long series about rest, for a whole curve."""
        return Expansion(self.network, self.load, 0.0, None, self.network.rest_factor)

    @cached_property
    def long_rest(self) -> Expansion:
        """Series about rest of higher order."""
        return self.rest.extended(HIGH_ORDER)

    def linear(self, s: float) -> Equilibrium:
        """Return the equilibrium with linear kinematics."""
        slope, residual, error = self._slope
        reason = uncertainty(error)
        return Equilibrium(s * slope, not reason, 1, residual, self.network.rest_factor, reason, error)

    def judge(self, s: float, found: Equilibrium) -> tuple[Status, str, float]:
        """Return status, message and negative pivots of an equilibrium; NaN pivots if it has no regular tangent."""
        share = f"{100 * found.unstable_share:.3g} %"
        if found.limit_share < 1 and not found.unstable_share < found.limit_share:
            at = f"{100 * found.limit_share:.3g} % of the load"
            message = f"limit point: the path from rest turns back and becomes unstable at {at}"
            if found.snapped:
                message += "; after a snap the body reaches a stable equilibrium that carries the load"
            return Status.UNSTABLE, message, np.nan
        if found.unstable_share < 1 and not found.converged:
            return Status.UNSTABLE, f"buckled: the path from rest is unstable at {share} of the load", np.nan
        if not found.converged:
            return Status.NOT_CONVERGED, f"{found.reason}; last residual {found.residual:.1e}", np.nan
        assert found.factor is not None  # of what converged
        try:
            pivots, flutters = self.stability(s, found.displacements, found.factor)
        except SingularError:
            return Status.UNSTABLE, "limit point: the tangent is singular", np.nan
        if pivots:
            counted = f"{pivots} negative pivot{'s' if pivots > 1 else ''}"
            return Status.UNSTABLE, f"buckled: this equilibrium is unstable ({counted})", pivots
        if flutters:
            return Status.UNSTABLE, "it flutters: two modes have merged into a complex pair", pivots
        if found.unstable_share < 1:
            return Status.UNSTABLE, f"buckled: the path to this equilibrium is unstable at {share} of the load", pivots
        objections = (energy.objection(found.displacements) for energy in self.network.energies)
        return Status.SOLVED, "; ".join(filter(None, objections)), pivots

    def nonlinear(self, s: float) -> Equilibrium:
        """Return the equilibrium with the springs' full length law, on the path from rest.

        Newton's method starts from the series about rest; if it fails, from the linear solution; then in load steps.
        Load steps also replace solutions with springs stretched beyond `FAR_STRETCH` or turned beyond `FAR_CHANGE`, or
        with an unstable point half-way from rest.
        """
        iterations = 0
        starts: list[Callable[[float], np.ndarray]] = [lambda s: s * self.slope]
        if not self.network.energies and self.follower is None and self.given is None:
            # The series is of springs under dead loads.
            starts.insert(0, lambda s: self.start.predict(s))
        for start in starts:
            found = self.newton(s, start(s))
            iterations += found.iterations
            if found.converged:
                change = self.network.largest_change(found.displacements)  # never below the stretch
                near = (
                    change <= FAR_STRETCH
                    or change <= FAR_CHANGE
                    and self.network.largest_stretch(found.displacements) <= FAR_STRETCH
                )
                rest = np.zeros(found.displacements.shape)
                if near and (
                    change <= UNSNAPPED_CHANGE
                    or self._has_no_snap(0.0, rest, s, found.displacements, s * self.slope)
                    or self._is_unstable(s, found)
                ):
                    return replace(found, iterations=iterations)
                break
        return self._solve_in_steps(s, found, iterations)

    def departure(self, s: float, displacements: np.ndarray) -> str:
        """Return why the path from rest does not lead to a stable equilibrium; mostly empty."""
        network = self.network
        if network.largest_change(displacements) <= UNSNAPPED_CHANGE or self.holds(0.5 * s, 0.5 * displacements):
            return ""
        found = self.nonlinear(s)
        status, message, _ = self.judge(s, found)
        if status is Status.SOLVED:
            apart = network.largest_change(displacements - found.displacements) > SURPRISING_CHANGE
            return "the path from rest leads to another stable equilibrium" if apart else ""
        return message if found.limit_share < 1 else ""

    def _has_no_snap(
        self, s: float, here: np.ndarray, to: float, there: np.ndarray, guess: np.ndarray, bend: float = 0.25
    ) -> bool:
        """Return whether the way from one equilibrium to the next, bent towards a guess, is stable in its middle."""
        network = self.network
        middle, off, way = 0.5 * (here + there), there - guess, there - here
        if bend * np.linalg.norm(off) <= LARGEST_BEND * np.linalg.norm(way):
            middle = middle - bend * off
        half = 0.5 * (s + to)
        if self.given is None and network.largest_change(off) <= FORESEEN_SHARE * network.largest_change(way):
            along = network.reduce(way)
            work = (to - s) * float(self.load_at(there) @ along)
            if abs(float(self.balance(half, middle)[0] @ along)) <= WORK_SHARE * abs(work):
                return True
        return self.holds(half, middle)

    def _is_unstable(self, s: float, found: Equilibrium) -> bool:
        """Return whether a path leaves an equilibrium; flutter does not count."""
        assert found.factor is not None  # of what converged
        try:
            return self.stability(s, found.displacements, found.factor)[0] > 0
        except SingularError:
            return True

    def _solve_in_steps(self, s: float, direct: Equilibrium, iterations: int) -> Equilibrium:
        """Load steps from rest, each started from the last two equilibria, halved where Newton's method fails."""
        done, step = 0.0, 0.25  # of the load
        last = before = np.zeros(self.network.held.shape)
        last_step, unstable = 0.0, np.nan
        while True:
            step = min(step, 1.0 - done)
            here, there = done * s, (done + step) * s
            guess = last + (last - before) * (step / last_step) if last_step else there * self.slope
            found = self.newton(there, guess)
            iterations += found.iterations
            # Where springs are far from where the path pointed, some of them have snapped.
            missed = self.network.largest_change(found.displacements - guess) > SURPRISING_CHANGE
            looked_at = found.converged and np.isnan(unstable)
            leaves = looked_at and self._is_unstable(there, found)
            bend = 0.25 * step / (step + last_step)
            apart = (
                looked_at and not leaves and not self._has_no_snap(here, last, there, found.displacements, guess, bend)
            )
            limit, inverts, failed = np.nan, False, apart or not found.converged
            if failed and step <= SMALLEST_STEP and last_step:
                limit, lost, end, inverts = continue_path(self, here, last, before, there)
                if np.isnan(unstable) and not limit / s <= lost / s:
                    unstable = lost / s
                if end is not None and np.isnan(lost):
                    guess = self.network.expand(end.u)
                    near = self.newton(there, guess)
                    close = (
                        near.converged and self.network.largest_change(near.displacements - guess) <= SURPRISING_CHANGE
                    )
                    if close and not self._is_unstable(there, near):
                        found, failed, missed = near, False, False
            if not failed and (step <= SHORTEST_STEP or not missed):
                if leaves or missed and np.isnan(unstable):
                    unstable = done + step if leaves else done
                before, last, last_step = last, found.displacements, step
                done += step
                if done >= 1.0:
                    return replace(found, iterations=iterations, unstable_share=unstable)
                step *= 1.5
            elif failed and (
                step <= SHORTEST_STEP or not np.isnan(limit) or not found.converged and step <= SMALLEST_STEP
            ):
                reason = "cells turn inside out" if inverts else found.reason or "no stable path"
                return replace(
                    found,
                    converged=False,
                    iterations=iterations,
                    reason=f"{reason} beyond {100 * done:.3g} % of the load",
                    unstable_share=unstable,
                    load_share=done,
                    last=last,
                    limit_share=limit / s,
                    snapped=not np.isnan(limit) and self._snaps(s, direct, here, last, before),
                )
            else:
                step *= 0.5

    def _snaps(self, s: float, direct: Equilibrium, here: float, last: np.ndarray, before: np.ndarray) -> bool:
        """Return whether a path that turns back beyond a load regains the whole load in a stable equilibrium."""
        if not direct.converged or self._is_unstable(s, direct):
            return False
        way = float(np.linalg.norm(self.network.reduce(direct.displacements - last)))
        return continue_path(self, here, last, before, s, way / WAY_INCREMENTS).end is not None

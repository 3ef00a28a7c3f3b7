"""A network under a load, and Newton's method for one equilibrium of it, with an error estimate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import NamedTuple

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigs

from ..linalg.factors import Factor, SingularError
from .network import FollowerPressure, Network

TOLERANCE = 1e-10
"""Residual of an equilibrium over the load [1]; slender beams only reach rounding, see `ERROR_TOLERANCE`."""

MAX_FACTORIZATIONS = 16
MAX_HALVINGS = 12
ERROR_TOLERANCE = 1e-6
"""Largest estimated error of displacements; a small residual says little with an ill-conditioned stiffness."""

REFINE_FROM_ERROR = 1e-9
"""Estimated error above which a solution is refined by further steps, as long as each of them halves it."""

ROUNDING_FACTOR = 4.0  # residual that counts as balance, over that of rounding the displacements

MOST_WATCHED_STEPS = 4
"""Steps in a row that may leave the residual above its minimum: a slender turning beam stretches and releases."""

LONGEST_STEP = 0.5  # largest change of a spring's vector over its length in a watched step

MOST_MODES = 24  # eigenvalues nearest to zero that tell whether an equilibrium under a follower pressure is stable

FLUTTER_SHARE = 1e-6  # imaginary part of an eigenvalue over its size beyond which two modes have merged: they flutter

KEPT_TANGENT_FACTOR = 0.03  # largest factor on the residual in a step for which the tangent is reused


@dataclass(frozen=True)
class Equilibrium:
    """Result of a solve.

    - `displacements` (n_points, 2): Displacements [m]; of the last iterate if it did not converge.
    - `residual`: Norm of the out-of-balance force over that of the load [1].
    - `factor`: Factorized tangent; at the solution if it converged.
    - `error_estimate`: Estimated relative error of the displacements [1], or NaN.
    - `unstable_share`, `limit_share`: Shares of the load where the path is unstable and turns back, or NaN.
    - `load_share`: Largest share of the load with a good equilibrium [1]; 1 if it converged.
    - `last` (n_points, 2), or None: Displacements at that share, if below 1.
    - `snapped`: Whether the path regains the load in a stable equilibrium behind the limit point.
    """

    displacements: np.ndarray
    converged: bool
    iterations: int
    residual: float
    factor: Factor | None
    reason: str = ""
    error_estimate: float = np.nan
    unstable_share: float = np.nan
    load_share: float = 1.0
    last: np.ndarray | None = None
    limit_share: float = np.nan
    snapped: bool = False


class Iterate(NamedTuple):
    """Iterate: displacements (n_points, 2) [m], `missing` load (unknowns,) [m], and its norm over the load's."""

    displacements: np.ndarray
    missing: np.ndarray
    residual: float


class LoadedNetwork:
    """Network under a load pattern, see `springtune.mechanics.statics.StaticProblem`."""

    def __init__(
        self,
        network: Network,
        pattern: np.ndarray,
        follower: FollowerPressure | None = None,
        *,
        dead: np.ndarray | None = None,
        given: np.ndarray | None = None,
    ) -> None:
        self.network, self.follower, self.given = network, follower, given
        self.load = network.reduce(pattern)
        self.load_norm = float(np.linalg.norm(self.load))
        self._dead = None if dead is None or follower is None else network.reduce(dead)
        if given is not None:
            # A first scale, to refine the linear solution, whose own forces are the final one.
            self.load_norm += float(np.linalg.norm(network.free_forces_over_k(given, linear=True)))
            forces = np.where(network.held, network.linear_forces_over_k(self.slope), 0.0)
            self.load_norm = float(np.hypot(np.linalg.norm(self.load), np.linalg.norm(forces))) or self.load_norm

    @cached_property
    def _slope(self) -> tuple[np.ndarray, float, float]:
        """The linear network's displacements over ``s``, the residual [1] and the estimated error of them [1]."""

        def balance(slope: np.ndarray) -> tuple[np.ndarray, float]:
            missing = self.load - self.network.free_forces_over_k(slope, linear=True)
            return missing, norm(missing) / self.load_norm

        network, factor = self.network, self.network.rest_factor
        if self.given is None:
            first = network.expand(factor.solve(self.load))
        else:
            first = self.given + network.expand(factor.solve(balance(self.given)[0]))
        here, error = refine(network, Iterate(first, *balance(first)), factor, balance, linear=True)
        return here.displacements, here.residual, error

    @property
    def slope(self) -> np.ndarray:
        """Displacements of the linear network over ``s`` [1], shape (n_points, 2)."""
        return self._slope[0]

    def stability(self, s: float, displacements: np.ndarray, factor: Factor) -> tuple[int, bool]:
        """Return the number of negative pivots of an equilibrium's tangent, and whether it is singular."""
        if self.follower is None or factor is self.network.rest_factor:
            return factor.negative_pivots, False
        modes = self.modes(s, displacements, factor)
        merged = np.abs(modes.imag) > FLUTTER_SHARE * np.abs(modes)
        return int((modes.real < 0)[~merged].sum()), bool(merged.any())

    def modes(self, s: float, displacements: np.ndarray, factor: Factor) -> np.ndarray:
        """Return the eigenvalues nearest to zero of the tangent over the masses, under a follower pressure.

        One may pass zero (buckling), or two may merge and leave the real axis (flutter; Beck's column: M. Beck, Z.
        angew. Math. Phys. 3:225, 1952). Masses are those of a uniform sheet; damping, left out, can lower the load.
        """
        network = self.network
        mass = network.reduce(np.repeat(network.mesh.particle_areas[:, None], 2, axis=1)) / network.mesh.area
        if len(mass) <= 4 * MOST_MODES:
            tangent = network.tangent(displacements, self._follower_at(s))
            values = np.linalg.eigvals(tangent.toarray() / mass[:, None])
            return values[np.argsort(abs(values))][:MOST_MODES]
        # The largest eigenvalues of the inverse.
        inverse = LinearOperator((len(mass),) * 2, lambda right: factor.solve(mass * right.ravel()), dtype=float)
        start = np.random.default_rng(0).standard_normal(len(mass))
        return 1.0 / eigs(inverse, MOST_MODES, v0=start, return_eigenvectors=False)

    def holds(self, s: float, displacements: np.ndarray) -> bool:
        """Return whether no cell is inverted and the symmetric part of the tangent is positive definite."""
        return not self.network.inverted(displacements) and self.network.is_stable(displacements, self._follower_at(s))

    def balance(self, s: float, displacements: np.ndarray) -> tuple[np.ndarray, float]:
        """Return load less resistance [m], shape (unknowns,), and its norm over that of the load [1]."""
        missing = s * self.load_at(displacements) - self.network.free_forces_over_k(displacements)
        return missing, norm(missing) / (abs(s) * self.load_norm)

    def load_at(self, displacements: np.ndarray) -> np.ndarray:
        """Load pattern at displacements [m] of shape (n_points, 2), a follower's turned with them: [1], (unknowns,)."""
        if self.follower is None:
            return self.load
        turned = self.network.reduce(self.follower.forces(displacements))
        return turned if self._dead is None else self._dead + turned

    @cached_property
    def _free(self) -> Network:
        """The network without held directions."""
        network, none = self.network, np.zeros(self.network.held.shape, dtype=bool)
        return Network(network.mesh, none, network.stiffness, network.energies)

    def rate(self, displacements: np.ndarray) -> np.ndarray:
        """Load that is missing for a growth of ``s`` by one, prescribed displacements included: [1], (unknowns,)."""
        load = self.load_at(displacements)
        if self.given is None:
            return load
        pull = self._free.tangent(displacements) @ self.given.ravel()
        return load - self.network.reduce(pull.reshape(self.given.shape))

    def moved(self, s: float, displacements: np.ndarray) -> np.ndarray:
        """Displacements [m], shape (n_points, 2), with those prescribed at ``s`` inserted."""
        return displacements if self.given is None else np.where(self.network.held, s * self.given, displacements)

    def factorize_tangent(self, s: float, displacements: np.ndarray) -> Factor:
        """Factorize the tangent of resistance less load, see `Network.factorize_tangent`."""
        return self.network.factorize_tangent(displacements, self._follower_at(s))

    def newton(self, s: float, start: np.ndarray, max_factorizations: int = MAX_FACTORIZATIONS) -> Equilibrium:
        """Run Newton's method from displacements [m], shape (n_points, 2), see `Newton`."""
        return Newton(self, s, max_factorizations).solve(self.moved(s, start))

    def _follower_at(self, s: float) -> tuple[float, FollowerPressure] | None:
        return None if self.follower is None else (s, self.follower)


class Newton:
    """Newton's method with the exact tangent, under one load ``s`` [m]; no step inverts a cell.

    If the residual stays above its minimum, the best iterate is restored and steps are halved (watchdog technique:
    Chamberlain, Lemarechal, Pedersen and Powell, Math. Programming Study 16:1, 1982). A factor is reused while its
    steps cut the residual by `KEPT_TANGENT_FACTOR`: a new one costs ten such steps.
    """

    def __init__(self, problem: LoadedNetwork, s: float, max_factorizations: int) -> None:
        self.problem, self.network, self.s = problem, problem.network, s
        self.max_factorizations = max_factorizations

    def solve(self, start: np.ndarray) -> Equilibrium:
        """Return the equilibrium from displacements [m] that contain the prescribed ones; from rest if invalid."""
        here = self._iterate_at(start)
        if not np.isfinite(here.residual) or self.network.inverted(start):
            here = self._iterate_at(self.problem.moved(self.s, np.zeros_like(start)))
        self._here = self._best = here
        self._factor: Factor | None = None
        self._factorizations = self._steps = self._since_best = 0
        self._keep, self._watched = False, True
        if not np.isfinite(here.residual):
            return self._failure("no forces where it begins")
        while not self._is_balanced():
            reason = self._iterate()
            if reason:
                return self._failure(reason)
        return self._refine_solution()

    def _iterate_at(self, displacements: np.ndarray) -> Iterate:
        return Iterate(displacements, *self.problem.balance(self.s, displacements))

    def _is_balanced(self) -> bool:
        """Return whether the residual is within the tolerance, or that of rounding the displacements."""
        displacements, _, residual = self._here
        if residual <= TOLERANCE:
            return True
        rounding = np.finfo(float).eps * self.network.reduce(self.network.local_stiffness * displacements)
        return residual * abs(self.s) * self.problem.load_norm <= ROUNDING_FACTOR * norm(rounding)

    def _iterate(self) -> str:
        """Take or reject a step; return why none can be taken, or an empty string."""
        if not self._keep:
            if self._factorizations == self.max_factorizations:
                return "too many iterations"
            self._factor = None  # which gives its room back
            try:
                self._factor = self.problem.factorize_tangent(self.s, self._here.displacements)
            except SingularError:
                return "singular tangent"
            self._factorizations += 1
        assert self._factor is not None  # kept, or of this iterate
        try:
            step = self._factor.step(self._here.missing)
        except SingularError as error:  # multigrid solves before it knows
            return str(error)
        there = self._step(self.network.expand(step))
        lower = there is not None and there.residual <= (1.0 - 1e-4) * self._best.residual
        if self._keep and not lower:  # the tangent is of an earlier iterate
            self._keep = False
            return ""
        if self._watched and not lower and (there is None or self._since_best == MOST_WATCHED_STEPS):
            self._here, self._keep, self._watched = self._best, False, False
            return ""
        if there is None:
            return "line search found no descent"
        self._steps += 1
        self._keep = there.residual <= KEPT_TANGENT_FACTOR * self._here.residual
        self._here = there
        self._best, self._since_best = (there, 0) if lower else (self._best, self._since_best + 1)
        return ""

    def _step(self, step: np.ndarray) -> Iterate | None:
        """Apply a step, halved until the residual falls unless watched; None if every such step inverts a cell."""
        displacements, _, residual = self._here
        length, halvings = 1.0, 0 if self._watched else MAX_HALVINGS
        if not halvings and 2 * np.abs(step).max() > LONGEST_STEP * self.network.rest_lengths.min():
            length /= max(1.0, self.network.largest_change(step) / LONGEST_STEP)
        for _ in range(max(halvings, 1)):
            there = self._iterate_at(displacements + length * step)
            lower = not halvings or there.residual <= (1.0 - 1e-4 * length) * residual
            if lower and np.isfinite(there.residual) and not self.network.inverted(there.displacements):
                return there
            length *= 0.5
        return None

    def _refine_solution(self) -> Equilibrium:
        """Return the equilibrium with the tangent there, refined if its estimated error is large."""
        here, self._factor = self._here, None
        try:
            self._factor = self.problem.factorize_tangent(self.s, here.displacements)
            refined, error = refine(self.network, here, self._factor, partial(self.problem.balance, self.s))
            if refined is not here and self.network.largest_change(refined[0] - here[0]) > ERROR_TOLERANCE:
                self._factor = None
                self._factor = self.problem.factorize_tangent(self.s, refined.displacements)
        except SingularError:
            return self._failure("singular tangent")
        (moved, _, residual), reason = refined, uncertainty(error)
        return Equilibrium(moved, not reason, self._steps, residual, self._factor, reason, error)

    def _failure(self, reason: str) -> Equilibrium:
        here = self._here
        return Equilibrium(here.displacements, False, self._steps, here.residual, self._factor, reason)


def error_estimate(network: Network, factor: Factor, here: Iterate, linear: bool) -> float:
    """Return the estimated relative error of displacements [1], from the Newton step left and rounding of forces."""
    rounding = network.rounding(here.displacements, linear)
    step = factor.estimate(here.missing + _signs(len(rounding)) * rounding)
    return norm(step) / (norm(here.displacements.ravel()) or 1.0)


@lru_cache(maxsize=4)
def _signs(count: int) -> np.ndarray:
    """Random signs of rounding errors, the same for all networks of a size."""
    return np.random.default_rng(0).choice([-1.0, 1.0], count)


_Balance = Callable[[np.ndarray], tuple[np.ndarray, float]]
"""Load that is missing at displacements, and its norm over the load's, see `LoadedNetwork.balance`."""


def refine(
    network: Network, here: Iterate, factor: Factor, balance: _Balance, linear: bool = False
) -> tuple[Iterate, float]:
    """Take steps with one tangent while each halves the estimated error; return the iterate and that error [1]."""
    error = error_estimate(network, factor, here, linear)
    while error > REFINE_FROM_ERROR:
        displacements = here.displacements + network.expand(factor.solve(here.missing))
        there = Iterate(displacements, *balance(displacements))
        better = error_estimate(network, factor, there, linear)
        if not better <= 0.5 * error or not linear and network.inverted(displacements):
            break
        here, error = there, better
    return here, error


def uncertainty(error: float) -> str:
    """Return why a solution of this estimated error is refused, or an empty string."""
    return "" if error <= ERROR_TOLERANCE else f"ill-conditioned: {error:.1e} of the displacements is uncertain"


def norm(vector: np.ndarray) -> float:
    """Euclidean norm, infinite or NaN without a warning."""
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.linalg.norm(vector))

"""Networks in motion: masses, dampers and time steps.

With loads and stiffnesses over a reference stiffness k a network moves as ``(m/k) u'' + (c/k) u' + r(u) = s p``, with
inertia m/k [s2] and dampers c/k [s]; frequencies and steps stay in seconds. A run can rest on an unstable equilibrium,
so the tangent at rest is factorized once, to count its negative pivots.
"""

from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import diags_array, sparray
from scipy.sparse.linalg import eigsh

from ..linalg.factors import SingularError
from ..mesh.cells import Mesh
from ..problem.boundary import free_motion
from ..safe_io import Tabled
from . import EXPLICIT, IMPLICIT, INTEGRATORS, LAGGED_INTEGRATORS, PRECISIONS, BackwardEuler
from .network import Network
from .newton import TOLERANCE
from .statics import StaticProblem
from .stepping import Moving, make_stepper

STEPS_PER_CHECK = 64  # steps between checks of an explicit run; a check costs about two steps, one for rest some twenty

VECTORS_PER_LOOK, MODE_RESIDUAL = 12, 1e-9
"""Vectors of Lanczos' method between looks at its modes; how far inertia may move a mode from its shape [1]."""

MOST_EXTENTS = 1e3  # displacement over the largest of the network's extents beyond which a run has left its model


def masses(mesh: Mesh, density: float, thickness: float) -> np.ndarray:
    """Return lumped masses [kg], shape (n_points,): a cell of area A gives ``rho A t / n`` to each of its n corners.

    The centre of mass is exact for triangles and parallelograms (equation 1 of the paper).
    """
    return density * thickness * mesh.particle_areas


@dataclass(frozen=True, repr=False)
class Run(Tabled):
    """Result of a run.

    - `displacements`, `velocities` (n_points, 2): Final state [m], [m/s].
    - `status`: ``"rest"`` (stable), ``"unstable"`` (at rest on an unstable equilibrium), ``"moving"`` (all steps
      done), ``"diverged"`` or ``"inverted"``.
    - `message`: What went wrong and what to do; else empty.
    - `time`: [s]
    - `residual`: Final out-of-balance force over the load [1]; without a load, over that of the start.
    - `samples` (n, 4): Time [s], energy [J] and momentum [N s], if asked for, see `Motion.energy`.
    """

    displacements: np.ndarray
    velocities: np.ndarray
    status: str
    message: str
    steps: int
    time: float
    residual: float
    samples: np.ndarray

    def _rows(self) -> Iterator[tuple[str, str]]:
        yield "status", self.status
        yield "reason", self.message
        yield "time", f"{self.time:.4g} s, {self.steps} steps"
        yield "residual", f"{self.residual:.2g}"


class Motion(Moving):
    """`Moving` network with its frequencies, energy and runs; dampers ``beta * network.stiffness`` are Rayleigh's."""

    # -- before a run -----------------------------------------------------------------------------------------------

    @cached_property
    def particle_bound(self) -> float:
        """Upper bound of the highest frequency [rad/s], ``omega^2 <= max_i 2 sum_j k_ij / m_i``; 2 over it is safe."""
        return float(np.sqrt((self.network.reduce(self.network.local_stiffness) / self.mass).max()))

    @cached_property
    def omega_max(self) -> float:
        """Highest frequency at rest [rad/s]."""
        return self.highest_frequency(self.stiffness_matrix)

    def highest_frequency(self, stiffness: sparray) -> float:
        """Highest frequency of a tangent [rad/s], by Lanczos' method: nothing is factorized."""
        root = diags_array(1.0 / np.sqrt(self.mass))
        return float(np.sqrt(_largest(root @ stiffness @ root)[0]))

    def step_limit(self, integrator: str) -> float:
        r"""Return the largest stable step about rest [s]; infinite for implicit schemes.

        :math:`2/\omega_{max}`; with lagged damping :math:`4 M - 2 h C - h^2 K` has no negative eigenvalue, for one mode
        of damping ratio xi :math:`h < (2/\omega)(\sqrt{1 + \xi^2} - \xi)`.
        """
        if integrator in IMPLICIT:
            return np.inf
        alpha = self.mass_damping if integrator in LAGGED_INTEGRATORS else 0.0
        if self.dampers is None:
            # All modes share alpha, so the highest one goes first.
            xi = 0.5 * alpha / self.omega_max
            return float(2 / self.omega_max * (np.sqrt(1 + xi**2) - xi))
        root = diags_array(1.0 / np.sqrt(self.mass))
        stiffness, damping = (root @ matrix @ root for matrix in (self.stiffness_matrix, self.damper_matrix))
        step, start = 2 / self.omega_max, None
        for _ in range(40):
            # At the vector that is worst at one step, the step at which it would just be stable.
            _, start = _largest(2 * step * damping + step**2 * stiffness, start)
            k, c = start @ (stiffness @ start), start @ (damping @ start) + alpha
            previous, step = step, (np.sqrt(c * c + 4 * k) - c) / k
            if abs(step - previous) <= 1e-9 * step:
                break
        return float(step)

    @property
    def loaded_frequency(self) -> float:
        """Frequency of `loaded_mode` [rad/s]."""
        return self.loaded_mode[0]

    @cached_property
    def loaded_mode(self) -> tuple[float, np.ndarray]:
        """Frequency [rad/s] and shape (with inertia 1) of the mode with the largest share in the static answer."""
        factor, load = self.network.rest_factor, self.network.reduce(self.load)
        if not load.any():
            raise ValueError("no load, so no mode is loaded; ask the motion under the load, without released=True")
        found, solved = list[np.ndarray](), list[np.ndarray]()
        vector = answer = factor.solve(load)
        while True:
            for _ in range(2):
                for other in found:
                    vector = vector - (other @ (self.mass * vector)) * other
            size = np.sqrt(vector @ (self.mass * vector))
            last = len(found) == len(load) or size <= 1e-12 * (np.sqrt(answer @ (self.mass * answer)) if found else 0.0)
            if last or found and len(found) % VECTORS_PER_LOOK == 0:
                basis = np.array(found)
                squares, shapes = np.linalg.eigh(basis @ (self.stiffness_matrix @ basis.T))
                shares = (shapes.T @ (basis @ load)) ** 2 / squares
                modes, images = shapes.T @ basis, shapes.T @ np.array(solved)
                off = images - ((images * modes) @ self.mass)[:, None] * modes
                left = np.sqrt((off**2 @ self.mass) / (images**2 @ self.mass))
                shares[left > MODE_RESIDUAL] = 0.0  # not a mode yet
                most = int(np.argmax(shares))
                if last or shares[most] >= load @ answer - shares.sum():
                    return float(np.sqrt(squares[most])), modes[most]
            found.append(vector / size)
            solved.append(vector := factor.solve(self.mass * found[-1]))

    @property
    def critical_damping(self) -> float:
        """Mass damping [1/s] that is critical for the mode of `loaded_frequency`."""
        return 2 * self.loaded_frequency

    # -- mechanics --------------------------------------------------------------------------------------------------

    def energy(self, displacements: np.ndarray, velocities: np.ndarray) -> float:
        """Kinetic energy, plus that of the network, less the work of the load [J]."""
        kinetic = 0.5 * float((self.inertia * velocities**2).sum())
        if self.linear:
            stored = 0.5 * float((displacements * self.network.linear_forces_over_k(displacements)).sum())
        else:
            stored = self.network.energy_over_k(displacements)
        return self.reference * (kinetic + stored - float((self.load * displacements).sum()))

    def residual(self, displacements: np.ndarray, start: np.ndarray | None = None) -> float:
        """Out-of-balance force over the load [1]; without a load, over that of a start (n_points, 2) [m]."""
        size = np.linalg.norm(self.network.reduce(self.load))
        if not size and start is not None:
            size = np.linalg.norm(self.missing(start))
        with np.errstate(over="ignore", invalid="ignore"):
            return float(np.linalg.norm(self.missing(displacements)) / (size or 1.0))

    # -- a run ------------------------------------------------------------------------------------------------------

    def run(
        self,
        integrator: str | BackwardEuler,
        step: float,
        steps: int,
        start: np.ndarray | None = None,
        velocities: np.ndarray | None = None,
        *,
        rest: float | None = None,
        sample: int = 0,
        watch: Callable[[float, np.ndarray, np.ndarray], None] | None = None,
        precision: str = "float64",
        threads: int = 1,
    ) -> Run:
        """Take a number of steps [s], or step until rest; `watch` gets time [s], displacements and velocities."""
        name = "backward-euler" if isinstance(integrator, BackwardEuler) else integrator
        if name not in INTEGRATORS:
            raise ValueError(f"unknown integrator '{name}'; known: {', '.join(INTEGRATORS)}")
        if not (step > 0 and np.isfinite(step)):
            raise ValueError(f"a step of {step} s; give one above zero")
        if precision not in PRECISIONS:
            raise ValueError(f"unknown precision '{precision}'; known: {', '.join(PRECISIONS)}")
        if not (isinstance(threads, int) and threads >= 1):
            raise ValueError(f"threads: {threads!r} is not a whole number above zero; give the number of cores to use")
        if name in IMPLICIT and (precision, threads) != ("float64", 1):
            raise ValueError(f"'{name}' takes its steps in double precision and one thread; give neither")
        stepper = make_stepper(self, integrator, step, precision, threads)
        shape = self.network.held.shape
        v = np.zeros(shape) if velocities is None else np.array(velocities, dtype=float)
        v[self.network.held] = 0.0
        first = np.zeros(shape) if start is None else np.array(start, dtype=float)
        stepper.begin(first.copy(), v)
        let_go = 0.0 if rest is None or self.load.any() else self.energy(first, v)
        pace = sample or (STEPS_PER_CHECK if name in EXPLICIT else 1)
        samples: list[list[float]] = []
        done = 0
        with closing(stepper):
            while True:
                u, v = stepper.state(exact=bool(sample) or rest is not None or done >= steps)
                if end := self._bad_end(stepper.failed, u, v, name, step, done):
                    u, v = stepper.state()
                    break
                if sample:
                    samples.append([done * step, self.energy(u, v), *self.reference * (self.inertia * v).sum(axis=0)])
                    if watch is not None:
                        watch(done * step, u, v)
                at_rest = rest is not None and done > 0 and self._at_rest(u, v, rest, first, let_go)
                if at_rest or done >= steps:
                    end = self._good_end(u, name, done, at_rest, None if rest is None else self.residual(u, first))
                    break
                count = min(pace, steps - done)
                stepper.advance(count)
                done += count
        sampled = np.array(samples).reshape(-1, 4)
        return Run(u, v, *end, done, done * step, self.residual(u, first), sampled)

    def _bad_end(
        self, failed: str, u: np.ndarray, v: np.ndarray, integrator: str, step: float, done: int
    ) -> tuple[str, str] | None:
        """Status and message of a failed run; None if it may go on."""
        size = np.abs(u).max()
        extent = np.ptp(self.network.mesh.points, axis=0).max()
        if not np.isfinite(size) or size > MOST_EXTENTS * extent or not np.isfinite(v).all():
            limit = self.step_limit(integrator)
            why = " though the step is stable about rest; use a smaller step or load"
            if step > limit:
                above = f": a step of {step:.3g} s is above the stable one of {limit:.3g} s"
                why = f"{above}; take at most {0.9 * limit:.2g} s"
            return "diverged", f"diverged within {done} steps{why}"
        if failed:
            return "diverged", f"{failed} in step {done}; take a smaller step"
        return None

    def _good_end(
        self, u: np.ndarray, integrator: str, done: int, at_rest: bool, residual: float | None
    ) -> tuple[str, str]:
        """Status and message of a run that came to rest, or took its last step."""
        if self.network.inverted(u):
            return "inverted", f"triangles are inverted after {done} steps; use less load or smaller steps"
        if at_rest:
            status, message = self.judge_rest(u)
            if status == "unstable" and integrator == "backward-euler":
                message += "; take smaller steps, since large ones can rest at an unstable equilibrium"
            return status, message
        if residual is None:
            return "moving", ""
        return "moving", f"not at rest after {done} steps, residual {residual:.1e}; take more steps or other damping"

    def _at_rest(self, u: np.ndarray, v: np.ndarray, rest: float, first: np.ndarray, let_go: float) -> bool:
        if self.residual(u, first) > rest:
            return False
        # The speed that the load would give its particles in free fall through the static displacement; without a load,
        # the speed of the energy at the start.
        energy = self.reference * abs(float((self.load * u).sum())) or let_go or 1.0
        return 0.5 * self.reference * float((self.inertia * v**2).sum()) <= rest**2 * energy

    def judge_rest(self, displacements: np.ndarray) -> tuple[str, str]:
        """Return status and message of an equilibrium, by its stability."""
        network = self.network
        if free_motion(network.mesh.points, network.held):
            return "rest", "the body is free to move as a whole, so whether it is stable was not checked"
        try:
            pivots = (network.rest_factor if self.linear else network.factorize_tangent(displacements)).negative_pivots
        except SingularError as error:
            return "unstable", f"at rest on a limit point, where the tangent is singular ({error}); use another load"
        if not pivots:
            why = "" if self.linear else StaticProblem(network, self.load).departure(displacements)
            return "rest", f"at rest in an equilibrium that a slowly growing load does not reach: {why}" if why else ""
        why = f"{pivots} negative pivot{'s' * (pivots > 1)}: any disturbance ends it"
        remedy = "disturb the body, such as sideways by a thousandth of the load, and run again"
        return "unstable", f"at rest on an unstable equilibrium ({why}); {remedy}"


def _largest(matrix: sparray, start: np.ndarray | None = None) -> tuple[float, np.ndarray]:
    """Largest eigenvalue of a symmetric matrix and its vector."""
    size = matrix.shape[0]
    if size < 40:
        values, vectors = np.linalg.eigh(matrix.toarray())
        return values[-1], vectors[:, -1]
    # A fixed start, rough enough to have a share of the highest mode: the same numbers in every run.
    start = np.random.default_rng(0).standard_normal(size) if start is None else start
    values, vectors = eigsh(matrix, 1, which="LA", v0=start, tol=1e-8, ncv=min(size - 1, 40))
    return values[0], vectors[:, 0]


# -- dynamic relaxation ------------------------------------------------------------------------------------------------

STEPS_PER_ESTIMATE = 40  # steps between new estimates of the lowest frequency


def relax(network: Network, load: np.ndarray, *, linear: bool = False, max_steps: int = 200_000) -> Run:
    r"""Find an equilibrium under a force over reference stiffness [m] by dynamic relaxation, with fictitious masses.

    Masses of twice the row sums of stiffness make a step of 1 stable. Damping is critical for the frequency
    :math:`\omega^2 = \Delta u \cdot \Delta r / \Delta u \cdot M \Delta u` (Underwood, Dynamic relaxation, in:
    Computational methods for transient analysis, 1983, ch. 5).
    """
    # A quarter of the bound makes a step of 1 just stable; a fifth more is room for springs that stiffen.
    inertia = 0.3 * network.local_stiffness.max(axis=1, initial=0.0, where=~network.held)
    motion = Motion(network, inertia, load, linear=linear)
    u = v = np.zeros(network.held.shape)
    done, before = 0, None
    while done < max_steps:
        found = motion.run("central-difference", 1.0, STEPS_PER_ESTIMATE, u, v)
        done += found.steps
        if found.status == "diverged":
            return replace(found, steps=done, message="dynamic relaxation diverged; use load steps or Newton's method")
        u, v = found.displacements, found.velocities
        if found.residual <= TOLERANCE:
            inverted = "inverted", "triangles are inverted; use a smaller load"
            status, message = inverted if network.inverted(u) else motion.judge_rest(u)
            return replace(found, status=status, message=message, steps=done)
        resistance = -motion.missing(u)
        if before is not None:
            moved = network.reduce(u) - before[0]
            work, weight = moved @ (resistance - before[1]), moved @ (network.reduce(motion.inertia) * moved)
            if work > 0 and weight > 0:
                motion.mass_damping = 2 * np.sqrt(work / weight)
        before = network.reduce(u), resistance
    message = f"not at rest after {max_steps} steps, residual {found.residual:.1e}; take more steps"
    return replace(found, status="moving", message=message, steps=done)

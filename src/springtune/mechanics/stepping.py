"""How a network in motion advances: one class of steps for each kind of integrator."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, Protocol

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import cg

from ..linalg.factors import Factor, factorize
from .integrators import EXPLICIT, LAGGED, BackwardEuler
from .network import Network

FEWEST = 5000
"""Springs, or entries of a matrix, of a part: with fewer, threads cost more than they save."""


class Moving(Protocol):
    """What advances: a network with masses and dampers under a load, as `springtune.mechanics.dynamics.Motion`."""

    network: Network
    linear: bool
    load: np.ndarray
    inertia: np.ndarray
    mass_damping: float
    dampers: np.ndarray | None

    @property
    def mass(self) -> np.ndarray:
        """Inertia of each unknown [s2], shape (unknowns,)."""

    @property
    def stiffness_matrix(self) -> csc_array:
        """Tangent at rest [1]."""

    @property
    def damper_matrix(self) -> csc_array | None:
        """Matrix of the dampers along springs at rest [s]; None without any."""

    def damper_tangent(self, displacements: np.ndarray) -> csc_array | None:
        """Derivative of the dampers' forces by the velocities [s]; or None."""

    def missing(self, displacements: np.ndarray) -> np.ndarray:
        """Load less resistance [m], shape (unknowns,)."""


def make_stepper(
    motion: Moving, integrator: str | BackwardEuler, step: float, precision: str = "float64", threads: int = 1
) -> Stepper:
    """State of a run of one integrator.

    Parameters
    ----------
    motion : Moving
    integrator : str or BackwardEuler
        One of `springtune.mechanics.integrators.INTEGRATORS`.
    step : float
        [s]
    precision : str, optional
        ``"float64"`` or ``"float32"``, of explicit schemes.
    threads : int, optional
        At most so many, of explicit schemes.

    Returns
    -------
    Stepper
    """
    if integrator in EXPLICIT:
        return ExplicitSteps(motion, integrator, step, precision, threads)
    if integrator == "implicit-midpoint":
        return MidpointSteps(motion, step)
    return BackwardEulerSteps(motion, step, integrator if isinstance(integrator, BackwardEuler) else BackwardEuler())


class Stepper(ABC):
    """State of a run and how it advances.

    Attributes
    ----------
    failed : str
        Why a step failed; empty where none did.
    """

    failed = ""

    def begin(self, u: np.ndarray, v: np.ndarray) -> None:
        """Start from displacements [m] and velocities [m/s], shape (n_points, 2)."""
        self.u, self.v = u, v

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """Displacements [m] and velocities [m/s] of now, shape (n_points, 2)."""
        return self.u, self.v

    @abstractmethod
    def advance(self, steps: int) -> None:
        """Take a number of steps."""

    def close(self) -> None:  # noqa: B027  most have nothing to do
        """End what was begun for the run, threads."""


class ExplicitSteps(Stepper):
    """Compiled steps, of springs that keep their length law or of a linear network; others are taken in numpy.

    Parameters are those of `make_stepper`.
    """

    def __init__(self, motion: Moving, integrator: str, step: float, precision: str, threads: int) -> None:
        self.motion, self.step = motion, step
        self.half = integrator != "symplectic-euler"
        self.kind = np.dtype(precision).type
        network = motion.network
        with np.errstate(divide="ignore"):
            self.inverse = np.where(network.held, 0.0, 1.0 / motion.inertia)
        half = 0.5 * motion.mass_damping * step
        if integrator in LAGGED:
            keep, gain = 1 - 2 * half, step * self.inverse
        else:
            keep, gain = (1 - half) / (1 + half), step * self.inverse / (1 + half)
        self._as: Callable[..., np.ndarray]
        self._back: Callable[..., np.ndarray]
        self._as = self._back = np.array
        self._numbers = self.kind(keep), self.kind(step)
        self.function: Callable[..., None] | None = None
        if motion.linear:
            self._of_matrix(motion.stiffness_matrix, gain, threads)
        elif network.energies:
            if threads > 1:
                raise ValueError(f"threads: {threads}, and a network with energies moves in one; give 1")
            self._states = 1, 1
            self._keep, self._gain = self._numbers[0], np.asarray(gain, dtype=self.kind)
        else:
            self._of_springs(gain, threads)

    def _of_springs(self, gain: np.ndarray, threads: int) -> None:
        """Prepare steps of springs that keep their length law."""
        from .kernels import advance_springs

        motion, network = self.motion, self.motion.network
        first, second = network.first, network.second
        dampers = np.zeros(0) if motion.dampers is None else motion.dampers
        numbers = [
            np.ascontiguousarray(values, dtype=self.kind)
            for values in (network.rest_vectors, network.rest_lengths, network.stiffness, dampers, gain, motion.load)
        ]
        of_springs, of_points = numbers[:4], [*numbers[4:], np.empty(gain.shape, dtype=self.kind)]
        self.function = advance_springs
        self._parts: list[tuple[Any, ...]] = []
        pointers = np.searchsorted(first, np.arange(len(gain) + 1))
        for begin, end in parts_of(pointers, threads):
            crossing = np.flatnonzero((first < begin) & (second >= begin) & (second < end))
            ghosts, starts = np.unique(first[crossing], return_index=True)
            springs = np.r_[crossing, pointers[begin] : pointers[end]]
            rows = np.r_[starts, len(crossing) + pointers[begin : end + 1] - pointers[begin]]
            index = [values.astype(np.uint32) for values in (ghosts, rows, second[springs])]
            own = [values[springs] if len(values) else values for values in of_springs]
            self._parts.append((begin, end, *index, *own, *of_points))
        several = len(self._parts) > 1
        self._states = 1 + several, 1 + (several and len(dampers) > 0)

    def _of_matrix(self, matrix: csc_array, gain: np.ndarray, threads: int) -> None:
        """Prepare steps of a linear network; the matrix is symmetric, so its columns are its rows."""
        from .kernels import advance_matrix

        motion, network = self.motion, self.motion.network
        damping = np.zeros(0) if motion.damper_matrix is None else motion.damper_matrix.data
        index = matrix.indptr.astype(np.uint32), matrix.indices.astype(np.uint32)
        numbers = matrix.data, damping, network.reduce(gain), network.reduce(motion.load)
        arrays = *index, *(np.ascontiguousarray(values, dtype=self.kind) for values in numbers)
        self.function = advance_matrix
        self._parts = [(*part, *arrays) for part in parts_of(matrix.indptr, threads)]
        self._as, self._back = network.reduce, network.expand
        self._states = 2, 1 + (len(damping) > 0)

    def begin(self, u: np.ndarray, v: np.ndarray) -> None:
        """See `Stepper`."""
        if self.half:  # the velocity half a step before the start
            v = v - 0.5 * self.step * self._acceleration(u, v)
        self._u, self._v = (
            np.repeat(np.asarray(self._as(values), dtype=self.kind)[None], count, axis=0)
            for values, count in zip((u, v), self._states)
        )
        if self.function is not None:
            from .kernels import packed

            with packed():  # it is compiled
                self._calls(0)[0][0]()

    def _acceleration(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        motion = self.motion
        force = motion.network.expand(motion.missing(u) - _damper_forces(motion, u, v))
        return force * self.inverse - motion.mass_damping * v

    def advance(self, steps: int) -> None:
        """See `Stepper`."""
        if self.function is None:
            self._advance_energies(steps)
            return
        calls, progress = self._calls(steps)
        begun: list[Future[None]] = []

        def take(call: Callable[[], None]) -> None:
            try:
                call()
            except BaseException:
                progress[-1] = 1  # the others need not wait for this part
                raise

        try:
            for call in calls[1:]:
                begun.append(self.threads.submit(take, call))
            take(calls[0])
        except BaseException:  # the system gives no more threads, or the user interrupts
            progress[-1] = 1
            raise
        finally:
            for one in begun:
                one.result()
        for values in (self._u, self._v):
            values[0] = values[steps % len(values)]

    def _calls(self, steps: int) -> tuple[list[Callable[[], None]], np.ndarray]:
        """Steps of each part, and the progress by which parts wait for each other."""
        from .kernels import STRIDE

        progress = np.zeros((len(self._parts) + 1, STRIDE), dtype=np.int64)
        rest = *self._numbers, self._u, self._v, steps, progress
        function = self.function
        assert function is not None
        return [partial(function, number, *part, *rest) for number, part in enumerate(self._parts)], progress

    @cached_property
    def threads(self) -> ThreadPoolExecutor:
        """Threads for all parts but the first; they stay on their cores from one call to the next."""
        return ThreadPoolExecutor(max(1, len(self._parts) - 1))

    def close(self) -> None:
        """See `Stepper`."""
        if "threads" in self.__dict__:
            self.threads.shutdown()

    def _advance_energies(self, steps: int) -> None:
        """As the kernels, of a network whose energies are not compiled."""
        motion, step, u, v = self.motion, self._numbers[1], self._u[0], self._v[0]
        with np.errstate(over="ignore", invalid="ignore"):
            for _ in range(steps):
                at, speed = u.astype(float), v.astype(float)
                missing = motion.missing(at) - _damper_forces(motion, at, speed)
                v *= self._keep
                v += self._gain * motion.network.expand(missing)
                u += step * v

    def state(self) -> tuple[np.ndarray, np.ndarray]:
        """See `Stepper`."""
        u, v = (self._back(values[0]).astype(float) for values in (self._u, self._v))
        if self.half and np.isfinite(v).all() and np.isfinite(u).all():
            with np.errstate(over="ignore", invalid="ignore"):
                v = v + 0.5 * self.step * self._acceleration(u, v)
        return u, v


def parts_of(pointers: np.ndarray, threads: int) -> list[tuple[int, int]]:
    """Rows, from one to before another, of as many parts with as many entries as threads have enough to do.

    Parameters
    ----------
    pointers : ndarray of int, shape (n_rows + 1,)
        First entry of each row.
    threads : int

    Returns
    -------
    list of tuple of int
    """
    count = int(min(threads, max(1, pointers[-1] // FEWEST)))
    ends = np.searchsorted(pointers, np.arange(1, count) * (pointers[-1] / count)).tolist()
    return list(pairwise([0, *ends, len(pointers) - 1]))


def _damper_forces(motion: Moving, u: np.ndarray, v: np.ndarray) -> np.ndarray | float:
    """Forces of the dampers along springs, shape (unknowns,)."""
    if motion.dampers is None:
        return 0.0
    network = motion.network
    if motion.linear:
        return motion.damper_matrix @ network.reduce(v)
    along = network.rest_vectors + network.stretch(u)
    rate = np.einsum("ij,ij->i", along, network.stretch(v)) / np.einsum("ij,ij->i", along, along)
    return -network.gather((motion.dampers * rate)[:, None] * along)


class BackwardEulerSteps(Stepper):
    r"""One linear solve a step, as SOFA's EulerImplicitSolver does.

    .. math:: (M (1 + h \alpha) + h C + h (h + \beta) K) \Delta v = h (f - (h + \beta) K v - C v - \alpha M v)

    Parameters
    ----------
    motion : Moving
    step : float
        [s]
    options : BackwardEuler
    """

    def __init__(self, motion: Moving, step: float, options: BackwardEuler) -> None:
        self.motion, self.step, self.options = motion, step, options
        self.solve: Callable[[np.ndarray], np.ndarray] | None = None

    def advance(self, steps: int) -> None:
        """See `Stepper`."""
        motion, network, h, beta = self.motion, self.motion.network, self.step, self.options.stiffness_damping
        for _ in range(steps):
            if self.solve is None or not motion.linear:
                self.stiffness = motion.stiffness_matrix if motion.linear else network.tangent(self.u)
                self.damping = motion.damper_tangent(self.u)
                mass = diags_array(motion.mass * (1 + h * motion.mass_damping))
                matrix = mass + h * (h + beta) * self.stiffness
                if self.damping is not None:
                    matrix = matrix + h * self.damping
                self.solve = self._solver(csc_array(matrix))
            v = network.reduce(self.v)
            right = motion.missing(self.u) - (h + beta) * (self.stiffness @ v)
            right -= motion.mass_damping * motion.mass * v
            if self.damping is not None:
                right -= self.damping @ v
            v = v + self.solve(h * right)
            self.v = network.expand(v)
            self.u = self.u + h * self.v

    def _solver(self, matrix: csc_array) -> Callable[[np.ndarray], np.ndarray]:
        if self.options.iterations is None:
            return factorize(matrix, self.motion.network.solver).solve
        # SOFA's test is of the residual over the right-hand side, as here.
        return lambda right: cg(matrix, right, rtol=self.options.tolerance, maxiter=self.options.iterations)[0]


class MidpointSteps(Stepper):
    """Implicit midpoint rule: for the mean velocity w of a step, ``2 M (w - v) / h + C w = f(u + h w / 2)``.

    Parameters
    ----------
    motion : Moving
    step : float
        [s]
    """

    def __init__(self, motion: Moving, step: float) -> None:
        self.motion, self.step = motion, step
        self.factor: Factor | None = None
        self._load = float(np.linalg.norm(motion.network.reduce(motion.load)))

    def advance(self, steps: int) -> None:
        """See `Stepper`."""
        network = self.motion.network
        for _ in range(steps):
            v = network.reduce(self.v)
            middle = self._mean_velocity(v)
            if self.failed:
                return
            self.u = self.u + self.step * network.expand(middle)
            self.v = network.expand(2 * middle - v)

    def _mean_velocity(self, v: np.ndarray) -> np.ndarray:
        """Mean velocity of the next step, by Newton's method; a factor serves as long as its steps converge."""
        motion, network, h = self.motion, self.motion.network, self.step
        inertia = 2 / h * motion.mass
        damping = motion.mass_damping * motion.mass
        middle, last, fresh = v.copy(), np.inf, self.factor is None
        for _ in range(40):
            at = self.u + 0.5 * h * network.expand(middle)
            missing = motion.missing(at) - inertia * (middle - v) - damping * middle
            missing -= _damper_forces(motion, at, network.expand(middle))
            with np.errstate(over="ignore", invalid="ignore"):
                size = float(np.linalg.norm(missing))
                scale = float(np.linalg.norm(inertia * v)) + float(np.linalg.norm(motion.missing(self.u))) + self._load
            if size <= 1e-12 * scale or scale == 0:
                return middle
            if not np.isfinite(size):
                self.failed = "Newton's method diverged"
                return middle
            if self.factor is None or (size > 0.1 * last and not fresh):
                self.factor = self._factorize(at, inertia + damping)
                fresh = True
            elif size >= last:
                if size <= 1e-9 * scale:  # rounding
                    return middle
                fresh = False
            middle = middle + self.factor.solve(missing)
            last = size
        self.failed = "Newton's method did not converge"
        return middle

    def _factorize(self, at: np.ndarray, diagonal: np.ndarray) -> Factor:
        motion = self.motion
        stiffness = motion.stiffness_matrix if motion.linear else motion.network.tangent(at)
        matrix = diags_array(diagonal) + 0.5 * self.step * stiffness
        if motion.dampers is not None:
            matrix = matrix + motion.damper_tangent(at)
        return factorize(csc_array(matrix), motion.network.solver)

"""Networks in motion and their time steps: one class for each kind of integrator."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cached_property, partial

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import cg

from ..linalg.factors import Factor, factorize, narrow_order
from . import EXPLICIT, LAGGED_INTEGRATORS, BackwardEuler
from .network import Network

LEAST_ENTRIES_A_THREAD = 5000
"""Springs, or entries of a matrix, of a thread: with fewer, threads cost more than they save."""

BLOCK_ROWS = 256  # rows advanced at once, so that data between the loops stay in the cache

CACHE_BYTES = 2**19  # bytes that a thread may expect to keep near its core

MOST_PASS_STEPS = 8
"""Steps of a pass at most: with more, threads wait longer for each other at its ends, and save nothing."""


class Moving:
    """Network with masses, dampers and a load, over the `reference` stiffness [N/m]; `mass_damping` is alpha [1/s]."""

    def __init__(
        self,
        network: Network,
        inertia: np.ndarray,
        load: np.ndarray | None = None,
        mass_damping: float = 0.0,
        dampers: np.ndarray | None = None,
        linear: bool = False,
        reference: float = 1.0,
    ) -> None:
        self.network, self.linear, self.reference = network, linear, reference
        self.load = np.zeros(network.held.shape) if load is None else load
        self.mass_damping, self.dampers = mass_damping, dampers
        self.inertia = np.repeat(np.asarray(inertia, dtype=float)[:, None], 2, axis=1)
        bad = int((~(self.inertia > 0) & ~network.held).any(axis=1).sum())
        if bad:
            raise ValueError(f"{bad} particles can move and have no mass; remove particles without cells from the mesh")
        if mass_damping < 0 or (dampers is not None and (dampers < 0).any()):
            raise ValueError("a damping is negative, and a run would gain energy; give 0 or more")

    @cached_property
    def mass(self) -> np.ndarray:
        """Inertia of each unknown [s2], shape (unknowns,)."""
        return self.network.reduce(self.inertia)

    @cached_property
    def stiffness_matrix(self) -> csc_array:
        """Tangent at rest [1]."""
        return self.network.tangent()

    @cached_property
    def damper_matrix(self) -> csc_array | None:
        """Matrix of the dampers along springs at rest [s]; None without any."""
        if self.dampers is None:
            return None
        return Network(self.network.mesh, self.network.held, self.dampers, like=self.network).tangent()

    def damper_tangent(self, displacements: np.ndarray) -> csc_array | None:
        """Derivative of the dampers' forces by the velocities [s], the springs turned by displacements [m]; or None."""
        if self.dampers is None or self.linear:
            return self.damper_matrix
        along = self.network.rest_vectors + self.network.end_differences(displacements)
        along = along / np.linalg.norm(along, axis=1)[:, None]
        apart = np.concatenate([along, -along], axis=1)
        matrices = self.dampers[:, None, None] * apart[:, :, None] * apart[:, None, :]
        return self.network.stiffness_of(self.network.mesh.edges, matrices)

    def damper_forces(self, u: np.ndarray, v: np.ndarray) -> np.ndarray | float:
        """Forces of the dampers along springs [m], shape (unknowns,)."""
        network = self.network
        if self.dampers is None:
            return 0.0
        if self.linear:
            return self.damper_matrix @ network.reduce(v)
        along = network.rest_vectors + network.end_differences(u)
        rate = np.einsum("ij,ij->i", along, network.end_differences(v)) / np.einsum("ij,ij->i", along, along)
        return -network.gather((self.dampers * rate)[:, None] * along)

    def missing(self, displacements: np.ndarray) -> np.ndarray:
        """Load less resistance [m], shape (unknowns,)."""
        with np.errstate(over="ignore", invalid="ignore"):
            return self.network.reduce(self.load) - self.network.free_forces_over_k(displacements, self.linear)


def make_stepper(
    motion: Moving, integrator: str | BackwardEuler, step: float, precision: str = "float64", threads: int = 1
) -> Stepper:
    """Return the state of a run of one integrator; `step` in s."""
    if integrator in EXPLICIT:
        return _ExplicitSteps(motion, integrator, step, precision, threads)
    if integrator == "implicit-midpoint":
        return _MidpointSteps(motion, step)
    options = integrator if isinstance(integrator, BackwardEuler) else BackwardEuler()
    return _BackwardEulerSteps(motion, step, options, precision)


class Stepper(ABC):
    """State of a run and how it advances."""

    failed = ""

    def begin(self, u: np.ndarray, v: np.ndarray) -> None:
        """Start from displacements [m] and velocities [m/s], shape (n_points, 2)."""
        self.u, self.v = u, v

    def state(self, exact: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """Displacements [m] and velocities [m/s] of now, shape (n_points, 2); or velocities of about now."""
        return self.u, self.v

    @abstractmethod
    def advance(self, steps: int) -> None:
        """Take a number of steps."""

    def close(self) -> None:  # noqa: B027  most have nothing to do
        """Stop the threads of the run."""


class _ExplicitSteps(Stepper):
    """Explicit steps: compiled for springs with their length law or linear networks, else in numpy."""

    _states = 1, 1  # of displacements, and of velocities, between which steps alternate

    def __init__(self, motion: Moving, integrator: str, step: float, precision: str, threads: int) -> None:
        self.motion, self.step = motion, step
        self.half = integrator != "symplectic-euler"
        self.kind, network = np.dtype(precision).type, motion.network
        with np.errstate(divide="ignore"):
            self.inverse = np.where(network.held, 0.0, 1.0 / motion.inertia)
        half = 0.5 * motion.mass_damping * step
        if integrator in LAGGED_INTEGRATORS:
            keep, gain = 1 - 2 * half, step * self.inverse
        else:
            keep, gain = (1 - half) / (1 + half), step * self.inverse / (1 + half)
        identity: Callable[..., np.ndarray] = np.array
        self._as = self._back = identity
        self._numbers = self.kind(keep), self.kind(step)
        self.function: Callable[..., None] | None = None
        if motion.linear:
            self._of_matrix(motion.stiffness_matrix, gain, threads)
        elif network.energies:
            if threads > 1:
                raise ValueError(f"threads: {threads}, and a network with energies moves in one; give 1")
            self._gain = np.asarray(gain, dtype=self.kind)
        else:
            self._of_springs(gain, threads)

    def _of_springs(self, gain: np.ndarray, threads: int) -> None:
        """Prepare steps of springs that keep their length law."""
        from .kernels import advance_springs

        motion, network = self.motion, self.motion.network
        order, place = self._order()
        ends = np.sort([place[network.first], place[network.second]], axis=0)
        springs = np.lexsort(ends[::-1])
        first, second = ends[:, springs]
        rest = network.rest_vectors * np.where(place[network.first] < place[network.second], 1, -1)[:, None]
        dampers = np.zeros(0) if motion.dampers is None else motion.dampers[springs]
        numbers = rest[springs].T, network.rest_lengths[springs], network.stiffness[springs], dampers
        values = *numbers, gain[order], motion.load[order]
        *of_springs, gain, load = (np.ascontiguousarray(one, dtype=self.kind) for one in values)
        pointers = np.searchsorted(first, np.arange(len(gain) + 1))
        bandwidth = int((second - first).max(initial=1))
        number = load.itemsize
        threads, size, self._depth = passes_of(pointers, bandwidth, 10 * number, 4 * number + 8, threads)
        most = int((pointers[size:] - pointers[:-size]).max(initial=0))
        force, index = load.copy(), (values.astype(np.uint32) for values in (pointers, first, second))
        arrays, sizes = (*index, *of_springs, gain, load, force), (*self._numbers, size, bandwidth)
        self.function = advance_springs
        self._threads = [((*arrays, np.empty((4, most), dtype=self.kind)), sizes) for _ in range(threads)]
        self._as, self._back = lambda values: values[order], lambda values: values[place]

    def _of_matrix(self, matrix: csc_array, gain: np.ndarray, threads: int) -> None:
        """Prepare steps of a linear network; the matrix is symmetric, so its columns are its rows."""
        from .kernels import advance_matrix

        motion, network = self.motion, self.motion.network
        _, place = self._order()
        order = np.argsort(network.reduce(2 * place[:, None] + np.arange(2)))
        place = np.argsort(order)
        matrix, dampers = csc_array(matrix[order][:, order]), motion.damper_matrix
        damping = np.zeros(0) if dampers is None else csc_array(dampers[order][:, order]).data
        index = matrix.indptr.astype(np.uint32), matrix.indices.astype(np.uint32)
        numbers = matrix.data, damping, network.reduce(gain)[order], network.reduce(motion.load)[order]
        arrays = *index, *(np.ascontiguousarray(values, dtype=self.kind) for values in numbers)
        rows = np.repeat(np.arange(len(order)), np.diff(matrix.indptr))
        bandwidth, number = int(np.abs(matrix.indices - rows).max(initial=1)), self.kind(0).nbytes
        threads, size, self._depth = passes_of(matrix.indptr, bandwidth, 6 * number, number + 4, threads)
        self.function = advance_matrix
        self._threads = [(arrays, (*self._numbers, size, bandwidth))] * threads
        self._as = lambda values: network.reduce(values)[order]
        self._back = lambda values: network.expand(values[place])
        self._states = 2, 1 + (len(damping) > 0)

    def _order(self) -> tuple[np.ndarray, np.ndarray]:
        """Particles in the order in which they are advanced, and the place of each in it."""
        mesh = self.motion.network.mesh
        # Where all of them are next to the processor anyway, none are advanced before others.
        count = len(mesh.points)
        order = narrow_order(count, mesh.edges) if len(mesh.edges) > LEAST_ENTRIES_A_THREAD else np.arange(count)
        return order, np.argsort(order)

    def begin(self, u: np.ndarray, v: np.ndarray) -> None:
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
        force = motion.network.expand(motion.missing(u) - motion.damper_forces(u, v))
        return force * self.inverse - motion.mass_damping * v

    def advance(self, steps: int) -> None:
        if self.function is None:
            self._advance_energies(steps)
            return
        calls, progress = self._calls(steps)
        begun: list[Future[None]] = []

        def take(call: Callable[[], None]) -> None:
            try:
                call()
            except BaseException:
                progress[-1] = 1  # the others need not wait for this one
                raise

        try:
            for call in calls[1:]:
                begun.append(self.threads.submit(take, call))
            calls[0]()
        except BaseException:  # the system gives no more threads, or the user interrupts
            progress[-1] = 1
            raise
        finally:
            for one in begun:
                one.result()
        for values in (self._u, self._v):
            values[0] = values[steps % len(values)]

    def _calls(self, steps: int) -> tuple[list[Callable[[], None]], np.ndarray]:
        """Steps of each thread, and the progress by which they wait for each other."""
        from .kernels import PROGRESS_STRIDE

        progress = np.zeros((len(self._threads) + 1, PROGRESS_STRIDE), dtype=np.int64)
        # Passes of one depth for all threads, so that none waits for another's longer one at the end.
        rounds = max(1, -(-steps // (len(self._threads) * self._depth)))
        depth = max(1, -(-steps // (len(self._threads) * rounds)))
        function = self.function
        assert function is not None
        state = self._u, self._v, steps, depth, progress
        return [partial(function, number, *one, *state) for number, one in enumerate(self._threads)], progress

    @cached_property
    def threads(self) -> ThreadPoolExecutor:
        """Threads besides the caller's; they keep their cores between calls."""
        return ThreadPoolExecutor(max(1, len(self._threads) - 1))

    def close(self) -> None:
        if "threads" in self.__dict__:
            self.threads.shutdown()

    def _advance_energies(self, steps: int) -> None:
        """Advance a network with energies, which are not compiled."""
        motion, (keep, step), u, v = self.motion, self._numbers, self._u[0], self._v[0]
        with np.errstate(over="ignore", invalid="ignore"):
            for _ in range(steps):
                at, speed = u.astype(float), v.astype(float)
                missing = motion.missing(at) - motion.damper_forces(at, speed)
                v *= keep
                v += self._gain * motion.network.expand(missing)
                u += step * v

    def state(self, exact: bool = True) -> tuple[np.ndarray, np.ndarray]:
        # Velocities are half a step behind where they need not be exact.
        u, v = (self._back(values[0]).astype(float) for values in (self._u, self._v))
        if exact and self.half and np.isfinite(v).all() and np.isfinite(u).all():
            with np.errstate(over="ignore", invalid="ignore"):
                v = v + 0.5 * self.step * self._acceleration(u, v)
        return u, v


def passes_of(pointers: np.ndarray, bandwidth: int, of_row: int, of_entry: int, threads: int) -> tuple[int, int, int]:
    """Return threads, rows of a block and steps of a pass, see `springtune.mechanics.kernels`."""
    rows, entries = len(pointers) - 1, int(pointers[-1])
    each = of_row + of_entry * entries / max(1, rows)
    for count in range(min(threads, max(1, entries // LEAST_ENTRIES_A_THREAD)), 1, -1):
        depth = int((rows / count - 2 * BLOCK_ROWS) / bandwidth)
        if depth >= 1:
            return count, BLOCK_ROWS, min(depth, _deepest(each, bandwidth))
    if rows * each <= CACHE_BYTES:
        return 1, rows, 1
    return 1, BLOCK_ROWS, _deepest(each, bandwidth)


def _deepest(each: float, bandwidth: int) -> int:
    """Return the steps of a pass whose rows fit into a cache."""
    return int(np.clip((CACHE_BYTES / each - BLOCK_ROWS) / bandwidth, 1, MOST_PASS_STEPS))


class _BackwardEulerSteps(Stepper):
    r"""One linear solve a step, as SOFA's EulerImplicitSolver does; `step` h in s.

    .. math:: (M (1 + h \alpha) + h C + h (h + \beta) K) \Delta v = h (f - (h + \beta) K v - C v - \alpha M v)

    The state, the matrix and conjugate gradients are of the precision; forces are computed in double.
    """

    def __init__(self, motion: Moving, step: float, options: BackwardEuler, precision: str) -> None:
        self.motion, self.step, self.options, self.kind = motion, step, options, np.dtype(precision)
        self.solve: Callable[[np.ndarray], np.ndarray] | None = None

    def advance(self, steps: int) -> None:
        motion, network, h = self.motion, self.motion.network, self.step
        for _ in range(steps):
            if self.solve is None or not motion.linear:
                self.stiffness = motion.stiffness_matrix if motion.linear else network.tangent(self.u)
                self.damping = motion.damper_tangent(self.u)
                mass = diags_array(motion.mass * (1 + h * motion.mass_damping))
                matrix = mass + h * h * self.stiffness
                if self.damping is not None:
                    matrix = matrix + h * self.damping
                self.solve = self._solver(csc_array(matrix, dtype=self.kind))
            v = network.reduce(self.v)
            right = motion.missing(self.u) - h * (self.stiffness @ v)
            right -= motion.mass_damping * motion.mass * v
            if self.damping is not None:
                right -= self.damping @ v
            v = v + self.solve((h * right).astype(self.kind))
            self.v = network.expand(v).astype(self.kind)
            self.u = (self.u + h * self.v).astype(self.kind)

    def _solver(self, matrix: csc_array) -> Callable[[np.ndarray], np.ndarray]:
        if self.options.iterations is None:
            return factorize(matrix, self.motion.network.solver).solve
        # SOFA's test is of the residual over the right-hand side, as here.
        return lambda right: cg(matrix, right, rtol=self.options.tolerance, maxiter=self.options.iterations)[0]


class _MidpointSteps(Stepper):
    """Implicit midpoint rule: for the mean velocity w of a step, ``2 M (w - v) / h + C w = f(u + h w / 2)``."""

    def __init__(self, motion: Moving, step: float) -> None:
        self.motion, self.step = motion, step
        self.factor: Factor | None = None
        self._load = float(np.linalg.norm(motion.network.reduce(motion.load)))

    def advance(self, steps: int) -> None:
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
            missing -= motion.damper_forces(at, network.expand(middle))
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

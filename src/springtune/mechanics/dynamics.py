"""Masses, dampers and time: networks in motion.

A network whose loads, stiffnesses and energies are over a reference stiffness k moves as
``(m/k) u'' + (c/k) u' + r(u) = s p``: masses enter as inertia m/k [s2], dampers as c/k [s], and frequencies and steps
are in seconds all the same.

Explicit steps factorise nothing, and assemble nothing but the rows of a linear network. They are bounded before the
run by `Motion.step_limit`; where the bound is not kept, and in every other case of a run that came to nothing, the
status and the message of a `Run` say so.

A run ends at rest on any equilibrium, be it one that the least push would end: a straight column above its buckling
load. The tangent where a run came to rest is therefore factorised, once and for all kinds of runs, and its negative
pivots are counted.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import cg, eigsh

from ..linalg.factors import SingularError, factorised
from .integrators import EXPLICIT, IMPLICIT, INTEGRATORS, LAGGED
from .network import Network
from .statics import TOLERANCE

CHECK = 64
"""Steps between looks at an explicit run: a look costs about two steps."""

BLOWN_UP = 1e3
"""Displacement over the largest of the network's extents beyond which a run has left its model."""


def masses(mesh, density, thickness):
    """Lumped mass of each particle [kg], shape (n_points,): a cell of area A gives ``rho A t / n`` to its n corners.

    The total is exact; the centre is that of the body for triangles and parallelograms (the paper's equation 1).

    Parameters
    ----------
    mesh : Mesh
    density : float
        [kg/m3]
    thickness : float
        [m]
    """
    return density * thickness * mesh.particle_areas


def centre(mesh, masses):
    """Centre of mass [m], shape (2,)."""
    return masses @ mesh.points / masses.sum()


def rayleigh(ratios, frequencies):
    r"""Damping in proportion to mass and stiffness that has given ratios at two frequencies.

    .. math:: \xi(\omega) = \frac{\alpha}{2 \omega} + \frac{\beta \omega}{2}

    Parameters
    ----------
    ratios : tuple of float
        Damping ratios [1].
    frequencies : tuple of float
        Their angular frequencies [rad/s].

    Returns
    -------
    mass_damping, stiffness_damping : float
        alpha [1/s] and beta [s].

    Raises
    ------
    ValueError
        If the frequencies are equal, or the damping that comes out is negative: the run would gain energy.
    """
    (first, second), (low, high) = ratios, frequencies
    if low == high:
        raise ValueError(f"two damping targets at one frequency, {low:g} rad/s; give two frequencies")
    alpha, beta = np.linalg.solve([[0.5 / low, 0.5 * low], [0.5 / high, 0.5 * high]], [first, second])
    if alpha < 0 or beta < 0:
        raise ValueError(
            f"ratios {first:g} and {second:g} at {low:g} and {high:g} rad/s need negative damping (alpha = {alpha:.3g} "
            f"1/s, beta = {beta:.3g} s); give ratios nearer to each other or frequencies farther apart"
        )
    return float(alpha), float(beta)


@dataclass(frozen=True)
class Run:
    """What became of a run.

    Attributes
    ----------
    displacements, velocities : ndarray of float, shape (n_points, 2)
        Where it ended [m], [m/s].
    status : str
        ``"rest"`` (on a stable equilibrium), ``"unstable"`` (at rest on one that is not), ``"moving"`` (all steps are
        done), ``"diverged"`` or ``"inverted"``.
    message : str
        What went wrong and what to do; empty where nothing did.
    steps : int
    time : float
        [s]
    residual : float
        Out-of-balance force over the load at the end [1]; over the reference stiffness without a load [m].
    step_bound : float
        Step that is safe by each particle's stiffness alone [s], known before the run; infinite for implicit schemes.
    samples : ndarray of float, shape (n, 4)
        Time [s], energy over the reference stiffness [m2], and momentum over it [m s]; only where asked for.
    """

    displacements: np.ndarray
    velocities: np.ndarray
    status: str
    message: str
    steps: int
    time: float
    residual: float
    step_bound: float
    samples: np.ndarray


class Motion:
    """A network with masses, dampers and a load.

    Parameters
    ----------
    network : Network
    inertia : ndarray of float, shape (n_points,)
        Mass of each particle over the reference stiffness [s2].
    load : ndarray of float, shape (n_points, 2), optional
        Force on each particle over the reference stiffness [m]; none without.
    mass_damping : float, optional
        Damping over mass, alpha [1/s].
    dampers : ndarray of float, shape (n_springs,), optional
        Damping of each spring along its direction over the reference stiffness [s]; ``beta * network.stiffness`` is
        damping in proportion to the springs' stiffness.
    linear : bool, optional
        Whether the network has linear kinematics.

    Raises
    ------
    ValueError
        If a particle that can move has no mass, or a damping is negative.
    """

    def __init__(self, network, inertia, load=None, mass_damping=0.0, dampers=None, linear=False):
        self.network, self.linear = network, linear
        self.load = np.zeros(network.held.shape) if load is None else load
        self.mass_damping, self.dampers = mass_damping, dampers
        self.inertia = np.repeat(np.asarray(inertia, dtype=float)[:, None], 2, axis=1)
        bad = int((~(self.inertia > 0) & ~network.held).any(axis=1).sum())
        if bad:
            raise ValueError(f"{bad} particles can move and have no mass; remove particles without cells from the mesh")
        if mass_damping < 0 or (dampers is not None and (dampers < 0).any()):
            raise ValueError("a damping is negative, and a run would gain energy; give 0 or more")

    # -- before a run -----------------------------------------------------------------------------------------------

    @cached_property
    def mass(self):
        """Inertia of each unknown [s2], shape (unknowns,)."""
        return self.network.reduce(self.inertia)

    @cached_property
    def stiffness_matrix(self):
        """Tangent at rest [1]."""
        return self.network.tangent()

    @cached_property
    def damper_matrix(self):
        """Matrix of the dampers along springs at rest [s]; None without any."""
        if self.dampers is None:
            return None
        return Network(self.network.mesh, self.network.held, self.dampers, like=self.network).tangent()

    def damper_tangent(self, displacements):
        """Derivative of the dampers' forces by the velocities [s], the springs turned by displacements [m]; or None."""
        if self.dampers is None or self.linear:
            return self.damper_matrix
        along = self.network.rest_vectors + self.network.stretch(displacements)
        along = along / np.linalg.norm(along, axis=1)[:, None]
        apart = np.concatenate([along, -along], axis=1)
        matrices = self.dampers[:, None, None] * apart[:, :, None] * apart[:, None, :]
        return self.network.stiffness_of(self.network.mesh.edges, matrices)

    @cached_property
    def particle_bound(self):
        """Bound of the highest frequency from each particle's springs alone [rad/s]: above `omega_max`, never below.

        ``omega^2 <= max_i 2 sum_j k_ij / m_i``, see `Network.local_stiffness`.
        """
        return float(np.sqrt((self.network.reduce(self.network.local_stiffness) / self.mass).max()))

    def step_bound(self, integrator):
        """Step that is safe by each particle's stiffness alone, springs undamped [s]; infinite for implicit schemes."""
        return np.inf if integrator in IMPLICIT else 2 / self.particle_bound

    @cached_property
    def omega_max(self):
        """Highest frequency at rest [rad/s], by Lanczos' method: nothing is factorised."""
        root = diags_array(1.0 / np.sqrt(self.mass))
        return float(np.sqrt(_largest(root @ self.stiffness_matrix @ root)[0]))

    def step_limit(self, integrator):
        r"""Largest stable step about rest [s]; infinite for implicit schemes.

        Without damping that lags it is :math:`2/\omega_{max}`. With such damping, steps h are stable as long as
        :math:`4 M - 2 h C - h^2 K` has no negative eigenvalue; for one mode of damping ratio xi that is
        :math:`(2/\omega)(\sqrt{1 + \xi^2} - \xi)`.

        Parameters
        ----------
        integrator : str
            One of `INTEGRATORS`.
        """
        if integrator in IMPLICIT:
            return np.inf
        alpha = self.mass_damping if integrator in LAGGED else 0.0
        if self.dampers is None:
            # All modes share alpha, so the highest one goes first.
            xi = 0.5 * alpha / self.omega_max
            return 2 / self.omega_max * (np.sqrt(1 + xi**2) - xi)
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

    @cached_property
    def loaded_frequency(self):
        """Lowest frequency that the load excites [rad/s]: of the mode with the largest share in the static answer.

        By Lanczos' method from that answer, which a symmetric load keeps among the modes that it excites; one
        factorisation.
        """
        factor, load = self.network.rest_factor, self.network.reduce(self.load)
        if not load.any():
            raise ValueError("no load, so no mode is loaded; give a load or a damping")
        basis = []
        vector = factor.solve(load)
        for _ in range(min(12, len(load))):
            for _ in range(2):
                for other in basis:
                    vector = vector - (other @ (self.mass * vector)) * other
            size = np.sqrt(vector @ (self.mass * vector))
            if size <= 1e-12 * (np.sqrt(basis[0] @ (self.mass * basis[0])) if basis else 0.0):
                break
            basis.append(vector / size)
            vector = factor.solve(self.mass * basis[-1])
        basis = np.array(basis)
        squares, shapes = np.linalg.eigh(basis @ (self.stiffness_matrix @ basis.T))
        shares = (shapes.T @ (basis @ load)) ** 2 / squares
        return float(np.sqrt(squares[int(np.argmax(shares))]))

    def critical(self):
        """As it is, with damping in proportion to mass that is critical for the lowest loaded mode."""
        return Motion(self.network, self.inertia[:, 0], self.load, 2 * self.loaded_frequency, self.dampers, self.linear)

    # -- mechanics --------------------------------------------------------------------------------------------------

    def missing(self, displacements):
        """Load less resistance [m], shape (unknowns,)."""
        resist = self.network.linear_resistance if self.linear else self.network.resistance
        with np.errstate(over="ignore", invalid="ignore"):
            return self.network.reduce(self.load) - resist(displacements)

    def energy(self, displacements, velocities):
        """Kinetic energy, plus that of the network, less the work of the load, over the reference stiffness [m2]."""
        kinetic = 0.5 * float((self.inertia * velocities**2).sum())
        if self.linear:
            stored = 0.5 * float((displacements * self.network.linear_forces(displacements)).sum())
        else:
            stored = self.network.energy(displacements)
        return kinetic + stored - float((self.load * displacements).sum())

    def residual(self, displacements):
        """Out-of-balance force over the load [1], or without a load, over the reference stiffness [m]."""
        size = np.linalg.norm(self.network.reduce(self.load))
        with np.errstate(over="ignore", invalid="ignore"):
            return float(np.linalg.norm(self.missing(displacements)) / (size or 1.0))

    # -- a run ------------------------------------------------------------------------------------------------------

    def run(self, integrator, step, steps, start=None, velocities=None, *, rest=None, sample=0, precision="float64",
            stiffness_damping=0.0, iterations=None, tolerance=1e-5):  # fmt: skip
        """Move for a number of steps, or until rest.

        Parameters
        ----------
        integrator : str
            One of `INTEGRATORS`.
        step : float
            [s]
        steps : int
            At most so many.
        start, velocities : ndarray of float, shape (n_points, 2), optional
            Where it starts [m], [m/s]; at rest without.
        rest : float, optional
            Ends the run where the out-of-balance force is at most this share of the load, and the particles are as
            slow; it goes on without. Whether the equilibrium is stable is judged by the tangent there: loads as near to
            a critical one as the run is to balance may be misjudged.
        sample : int, optional
            Steps between samples of energy and momentum; none without.
        precision : str, optional
            ``"float64"`` or ``"float32"``, of explicit schemes.
        stiffness_damping : float, optional
            Rayleigh's beta of ``backward-euler`` [s].
        iterations : int, optional
            Conjugate-gradient iterations of each step of ``backward-euler``, in place of a factorisation.
        tolerance : float, optional
            Relative residual at which they end earlier; SOFA's default.

        Returns
        -------
        Run
        """
        if integrator not in INTEGRATORS:
            raise ValueError(f"unknown integrator '{integrator}'; known: {', '.join(INTEGRATORS)}")
        if not (step > 0 and np.isfinite(step)):
            raise ValueError(f"a step of {step} s; give one above zero")
        shape = self.network.held.shape
        u = np.zeros(shape) if start is None else np.array(start, dtype=float)
        v = np.zeros(shape) if velocities is None else np.array(velocities, dtype=float)
        v[self.network.held] = 0.0
        if integrator in EXPLICIT:
            stepper = _Explicit(self, integrator, step, precision)
        elif integrator == "backward-euler":
            stepper = _BackwardEuler(self, step, stiffness_damping, iterations, tolerance)
        else:
            stepper = _Midpoint(self, step)
        stepper.begin(u, v)
        pace = sample or (CHECK if integrator in EXPLICIT else 1)
        extent = BLOWN_UP * np.ptp(self.network.mesh.points, axis=0).max()
        done, samples, status, message = 0, [], "moving", ""
        while True:
            u, v = stepper.state()
            size = np.abs(u).max()
            if not np.isfinite(size) or size > extent or not np.isfinite(v).all():
                status, message = "diverged", self._why(integrator, step, done)
                break
            if stepper.failed:
                status, message = "diverged", f"{stepper.failed} in step {done}; take a smaller step"
                break
            if sample:
                momentum = (self.inertia * v).sum(axis=0)
                samples.append([done * step, self.energy(u, v), *momentum])
            if rest is not None and done and self._at_rest(u, v, rest):
                status = "rest"
                break
            if done >= steps:
                break
            count = min(pace, steps - done)
            stepper.advance(count)
            done += count
        residual = self.residual(u)
        if status != "diverged" and self.network.inverted(u):
            status, message = (
                "inverted",
                f"triangles are inverted after {done} steps; use less load or smaller steps",
            )
        if status == "rest":
            status, message = self._judge(u)
            if status == "unstable" and integrator == "backward-euler":
                message += ", in smaller steps, since large ones stay where they would otherwise be driven away"
        if status == "moving" and rest is not None:
            message = f"not at rest after {steps} steps, residual {residual:.1e}; take more steps or other damping"
        samples = np.array(samples).reshape(-1, 4)
        return Run(u, v, status, message, done, done * step, residual, self.step_bound(integrator), samples)

    def _at_rest(self, u, v, rest):
        if self.residual(u) > rest:
            return False
        # Speed that the load would give its particles in free fall through the static displacement.
        work = abs(float((self.load * u).sum())) or 1.0
        return 0.5 * float((self.inertia * v**2).sum()) <= rest**2 * work

    def _judge(self, u):
        """Status and message of a run that came to rest: whether its equilibrium is stable."""
        network = self.network
        x, y = (network.mesh.points - network.mesh.points.mean(axis=0)).T / np.ptp(network.mesh.points)
        one, none = np.ones(len(x)), np.zeros(len(x))
        motions = np.stack([[one, none], [none, one], [-y, x]]).transpose(2, 1, 0)[network.held]
        if np.linalg.matrix_rank(motions) < 3:
            return "rest", "the body is free to move as a whole, so whether it is stable was not checked"
        try:
            pivots = (network.rest_factor if self.linear else network.factorize(u)).negative_pivots
        except SingularError as error:
            return "unstable", f"at rest on a limit point, where the tangent is singular ({error}); use another load"
        if not pivots:
            return "rest", ""
        many = "s" if pivots > 1 else ""
        return "unstable", (
            f"at rest on an unstable equilibrium: the tangent has {pivots} negative pivot{many}, and the least push "
            f"would end it; push the body sideways, by a force of a thousandth of the load, say, and run again"
        )

    def _why(self, integrator, step, done):
        limit = self.step_limit(integrator)
        if step > limit:
            return (
                f"diverged within {done} steps: a step of {step:.3g} s is above the stable one of {limit:.3g} s; "
                f"take at most {0.9 * limit:.2g} s"
            )
        return f"diverged within {done} steps though the step is stable about rest; use a smaller step or load"


class _Stepper:
    """State of a run and how it advances."""

    failed = ""

    def begin(self, u, v):
        self.u, self.v = u, v

    def state(self):
        return self.u, self.v


class _Explicit(_Stepper):
    def __init__(self, motion, integrator, step, precision):
        self.motion, self.step = motion, step
        self.half = integrator != "symplectic-euler"
        self.kind = np.dtype(precision).type
        network = motion.network
        with np.errstate(divide="ignore"):
            inverse = np.where(network.held, 0.0, 1.0 / motion.inertia)
        half = 0.5 * motion.mass_damping * step
        if integrator in LAGGED:
            keep, gain = np.full(inverse.shape, 1 - 2 * half), step * inverse
        else:
            keep, gain = np.full(inverse.shape, (1 - half) / (1 + half)), step * inverse / (1 + half)
        self.inverse = inverse
        dampers = np.zeros(0) if motion.dampers is None else motion.dampers
        if motion.linear:
            from .kernels import advance_matrix as advance

            matrix = motion.stiffness_matrix  # symmetric: its columns are its rows
            damping = np.zeros(0) if motion.dampers is None else motion.damper_matrix.data
            self._as = network.reduce
            self._back = network.expand
            index = (matrix.indptr.astype(np.int32), matrix.indices.astype(np.int32))
            arrays = (matrix.data, damping, *map(network.reduce, (keep, gain, motion.load)))
        elif network.energies:
            advance, index, arrays = self._advance_energies, (), (keep, gain, motion.load)
            self._as = self._back = np.array
        else:
            from .kernels import advance_springs as advance

            self._as = self._back = np.array
            index = (network.first.astype(np.int32), network.second.astype(np.int32))
            arrays = (network.rest_vectors, network.rest_lengths, network.stiffness, dampers, keep, gain, motion.load)
        self._function, self._index = advance, index
        self._arrays = [np.ascontiguousarray(part, dtype=self.kind) for part in arrays]

    def begin(self, u, v):
        if self.half:  # the velocity half a step before the start
            v = v - 0.5 * self.step * self._acceleration(u, v)
        self.u = np.ascontiguousarray(self._as(u), dtype=self.kind)
        self.v = np.ascontiguousarray(self._as(v), dtype=self.kind)
        self.force = np.zeros_like(self.u)

    def _acceleration(self, u, v):
        motion = self.motion
        force = motion.network.expand(motion.missing(u) - _damper_forces(motion, u, v))
        return force * self.inverse - motion.mass_damping * v

    def advance(self, steps):
        self._function(*self._index, *self._arrays, self.u, self.v, self.force, self.kind(self.step), steps)

    def _advance_energies(self, keep, gain, load, u, v, force, step, steps):
        """As the kernels, of a network whose energies are not compiled."""
        motion = self.motion
        with np.errstate(over="ignore", invalid="ignore"):
            for _ in range(steps):
                at, speed = u.astype(float), v.astype(float)
                missing = motion.missing(at) - _damper_forces(motion, at, speed)
                v *= keep
                v += gain * motion.network.expand(missing)
                u += step * v

    def state(self):
        u, v = self._back(self.u).astype(float), self._back(self.v).astype(float)
        if self.half and np.isfinite(v).all() and np.isfinite(u).all():
            with np.errstate(over="ignore", invalid="ignore"):
                v = v + 0.5 * self.step * self._acceleration(u, v)
        return u, v


def _damper_forces(motion, u, v):
    """Forces of the dampers along springs, shape (unknowns,)."""
    if motion.dampers is None:
        return 0.0
    network = motion.network
    if motion.linear:
        return motion.damper_matrix @ network.reduce(v)
    along = network.rest_vectors + network.stretch(u)
    rate = np.einsum("ij,ij->i", along, network.stretch(v)) / np.einsum("ij,ij->i", along, along)
    return -network.gather((motion.dampers * rate)[:, None] * along)


class _BackwardEuler(_Stepper):
    r"""One linear solve a step, as SOFA's EulerImplicitSolver does.

    .. math:: (M (1 + h \alpha) + h C + h (h + \beta) K) \Delta v = h (f - (h + \beta) K v - C v - \alpha M v)
    """

    def __init__(self, motion, step, stiffness_damping, iterations, tolerance):
        self.motion, self.step, self.beta = motion, step, stiffness_damping
        self.iterations, self.tolerance = iterations, tolerance
        self.solve = None

    def advance(self, steps):
        motion, network, h = self.motion, self.motion.network, self.step
        for _ in range(steps):
            if self.solve is None or not motion.linear:
                self.stiffness = motion.stiffness_matrix if motion.linear else network.tangent(self.u)
                self.damping = motion.damper_tangent(self.u)
                mass = diags_array(motion.mass * (1 + h * motion.mass_damping))
                matrix = mass + h * (h + self.beta) * self.stiffness
                if self.damping is not None:
                    matrix = matrix + h * self.damping
                self.solve = self._solver(csc_array(matrix))
            v = network.reduce(self.v)
            right = motion.missing(self.u) - (h + self.beta) * (self.stiffness @ v)
            right -= motion.mass_damping * motion.mass * v
            if self.damping is not None:
                right -= self.damping @ v
            v = v + self.solve(h * right)
            self.v = network.expand(v)
            self.u = self.u + h * self.v

    def _solver(self, matrix):
        if self.iterations is None:
            return factorised(matrix).solve
        # SOFA's test is of the residual over the right-hand side, as here.
        return lambda right: cg(matrix, right, rtol=self.tolerance, maxiter=self.iterations)[0]


class _Midpoint(_Stepper):
    """Implicit midpoint rule: for the mean velocity w of a step, ``2 M (w - v) / h + C w = f(u + h w / 2)``."""

    def __init__(self, motion, step):
        self.motion, self.step = motion, step
        self.factor = None

    def advance(self, steps):
        motion, network, h = self.motion, self.motion.network, self.step
        inertia = 2 / h * motion.mass
        damping = motion.mass_damping * motion.mass
        load = float(np.linalg.norm(network.reduce(motion.load)))
        for _ in range(steps):
            v = network.reduce(self.v)
            middle, last, fresh = v.copy(), np.inf, self.factor is None
            for _ in range(40):
                at = self.u + 0.5 * h * network.expand(middle)
                missing = motion.missing(at) - inertia * (middle - v) - damping * middle
                missing -= _damper_forces(motion, at, network.expand(middle))
                with np.errstate(over="ignore", invalid="ignore"):
                    size = float(np.linalg.norm(missing))
                    scale = float(np.linalg.norm(inertia * v)) + float(np.linalg.norm(motion.missing(self.u))) + load
                if size <= 1e-12 * scale or scale == 0:
                    break
                if not np.isfinite(size):
                    self.failed = "Newton's method diverged"
                    return
                if self.factor is None or (size > 0.1 * last and not fresh):
                    stiffness = motion.stiffness_matrix if motion.linear else network.tangent(at)
                    matrix = diags_array(inertia + damping) + 0.5 * h * stiffness
                    if motion.dampers is not None:
                        matrix = matrix + motion.damper_tangent(at)
                    self.factor = factorised(csc_array(matrix))
                    fresh = True
                elif size >= last:
                    if size <= 1e-9 * scale:  # rounding
                        break
                    fresh = False
                middle = middle + self.factor.solve(missing)
                last = size
            else:
                self.failed = "Newton's method did not converge"
                return
            self.u = self.u + h * network.expand(middle)
            self.v = network.expand(2 * middle - v)


def _largest(matrix, start=None):
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

RELAX_CHECK = 40
"""Steps between new estimates of the lowest frequency."""


def relax(network, load, *, linear=False, tolerance=TOLERANCE, max_steps=200_000):
    r"""Equilibrium by dynamic relaxation: explicit steps with masses and damping made for it.

    Masses of twice the row sums of stiffness make a step of 1 stable and all local frequencies alike; the damping is
    critical for the frequency :math:`\omega^2 = \Delta u \cdot \Delta r / \Delta u \cdot M \Delta u` of the motion at
    hand (Underwood, Dynamic relaxation, in: Computational methods for transient analysis, 1983, ch. 5).
    No step factorises; what came to rest is judged by one factorisation, as a `Motion.run` is.

    Parameters
    ----------
    network : Network
    load : ndarray of float, shape (n_points, 2)
        Force on each particle over the reference stiffness [m].
    linear : bool, optional
    tolerance : float, optional
        Out-of-balance force over the load at which it ends.
    max_steps : int, optional

    Returns
    -------
    Run
        Its time and velocities are those of the made-up masses.
    """
    # A quarter of the bound makes a step of 1 just stable; a fifth more is room for springs that stiffen.
    inertia = 0.3 * network.local_stiffness.max(axis=1, initial=0.0, where=~network.held)
    motion = Motion(network, inertia, load, linear=linear)
    u = np.zeros(network.held.shape)
    v = np.zeros_like(u)
    done, before = 0, None
    while done < max_steps:
        found = motion.run("central-difference", 1.0, RELAX_CHECK, u, v)
        done += found.steps
        if found.status == "diverged":
            return replace(found, steps=done, message="dynamic relaxation diverged; use load steps or Newton's method")
        u, v = found.displacements, found.velocities
        if found.residual <= tolerance:
            if network.inverted(u):
                status, message = "inverted", "triangles are inverted; use a smaller load"
            else:
                status, message = motion._judge(u)
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

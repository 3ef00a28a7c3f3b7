"""Declaration of engines: what they take, what is typed into them, and how they step.

A frame of `dt` has `substeps` steps of ``h = dt / substeps``. After each step velocities are scaled by
``1 / (1 + damping h)``, which does not move an equilibrium. Forces of the load are dead, and on from the first step.
The textbook solvers have a base: a step from the inertial position ``y = x + h v + h^2 f / m``, and the velocity after
it. One that begins there and stops early rests too far along the load.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import metadata
from importlib.util import find_spec
from numbers import Real
from typing import Any, Protocol, TypeVar

import numpy as np

from ..handover.net import SpringNet
from ..handover.simulation import ENERGY_WORDS, VALUES, Net
from ..linalg.kernels import compiled
from ..mechanics import PRECISIONS
from ..mechanics.energies import Energy
from ..problem.quantities import positive, put, whole_number
from ..registry import Declaration, Registry, how_to_install
from ..safe_io import number_text

MOST_STEPS, LONGEST_FRAME = 100_000, 1.0  # most substeps and iterations, and the longest frame [s]


def number(value: Any, name: str, least: float = np.nextafter(0, 1)) -> float:
    """Return a number; refuse one that is not finite or is below `least`."""
    if isinstance(value, bool) or not isinstance(value, Real) or not least <= float(value) < np.inf:
        what = "of zero or more" if least == 0 else "above zero"
        raise ValueError(f"{name}: {value!r} is not a finite number {what}; give one")
    return float(value)


class EngineError(ValueError):
    """An engine cannot run a scene; the message says why and what to do.

    Examples
    --------
    >>> import springtune as st
    >>> try:
    ...     st.ENGINES["xpbd"].check(st.Setting(precision="float16"))
    ... except st.EngineError as error:
    ...     print(error)
    precision: 'float16' is unknown to engine 'xpbd'; give one of float64, float32
    """


class EngineAbsentError(EngineError):
    """The program of an engine is not installed; the message says how to install it."""


@dataclass(frozen=True)
class Setting:
    """Time step of an engine: frame, substeps, iterations, precision.

    Attributes
    ----------
    dt : float or str
        Time of a frame [s], at most 1, or a text such as ``"1/60"`` or ``"5 ms"``.
    substeps : int
        Steps of a frame, at most 100,000.
    iterations : int
        Of the engine's solver in a step, at most 100,000; without meaning where an engine has none.
    precision : str
        ``"float64"`` or ``"float32"``; by default the first one that an engine has.

    Raises
    ------
    ValueError
        If a number is out of its range.

    Examples
    --------
    >>> import springtune as st
    >>> setting = st.Setting("1/60", substeps=4)
    >>> print(setting, f"{1e3 * setting.step:.3f} ms")
    dt 1/60 s, 4 substeps, 10 iterations 4.167 ms
    """

    dt: Any = 1 / 60
    substeps: int = 1
    iterations: int = 10
    precision: str = ""

    def __post_init__(self) -> None:
        dt = self.dt
        if isinstance(dt, str) and "/" in dt and dt.replace("/", "", 1).replace(" ", "").isdigit():
            above, below = map(int, dt.split("/"))
            dt = above / below if below else 0.0
        counts = {name: whole_number(getattr(self, name), name, MOST_STEPS) for name in ("substeps", "iterations")}
        put(self, dt=positive(dt, "time", "dt"), **counts)
        if self.dt > LONGEST_FRAME:
            why = f"{self.dt:g} s is longer than {LONGEST_FRAME:g} s"
            raise ValueError(f"dt: {why}; give the time of a frame such as 1/60")

    @property
    def step(self) -> float:
        """Time of a step [s]."""
        return float(self.dt / self.substeps)

    def __str__(self) -> str:
        rate = round(1 / self.dt)
        frame = f"1/{rate} s" if abs(rate * self.dt - 1) < 1e-9 else number_text(self.dt, "s")
        counts = {"substep": self.substeps, "iteration": self.iterations}
        parts = [f"dt {frame}", *(f"{value} {name}{'s' * (value > 1)}" for name, value in counts.items())]
        return ", ".join(filter(None, [*parts, self.precision]))


class Session(Protocol):
    """Simulation of a net in an engine; it starts at rest and undeformed."""

    def advance(self, frames: int) -> None:
        """Take a number of frames."""

    def displacements(self) -> np.ndarray:
        """Displacement of each particle [m], shape (n_points, 2)."""


@dataclass(frozen=True)
class Parameter:
    """Number that is typed into an engine: its unit, and its formula from E, nu, the thickness t and the mesh."""

    unit: str
    formula: str


SPRING_STIFFNESS = Parameter("N/m", "k of the definition, one for each spring")  # stiffness of a spring


def typed_springs(net: SpringNet) -> dict[str, Any]:
    """Return the net's own stiffness of each spring [N/m] and moduli of energies."""
    values = {f"{one.kind} {name}": value for one in net.energies for name, value in one.values.items()}
    return ({"stiffness": net.stiffness} if np.any(net.stiffness) else {}) | values


@dataclass(frozen=True, eq=False)
class Engine(Declaration):
    """An engine with one of its solvers; made by the decorator `engine`.

    Attributes
    ----------
    name, order : str, float
        Program and solver, such as ``newton-vbd``, a label of datasets; and its place among the labels.
    function : callable
        (net, setting, damping over mass [1/s]) -> `Session`.
    program, source : str
        ``springtune`` for the textbook solvers, and where it is described.
    needs, extra : tuple of str, str
        Modules that it imports, as ``"mujoco>=3.13"``, and the optional dependencies of springtune that have them.
    laws : tuple of str
        Energies that it has besides springs, keys of `springtune.handover.simulation.FORMULAS`.
    precisions, iterates : tuple of str, bool
        Its own precision first; whether iterations mean something to it.
    parameters, typed, of_setting : dict of str to Parameter, callable, bool
        Numbers to type: (net), or (net, setting) if they depend on it, -> dict of arrays, or one number for all.
    springs_first : bool
        Whether it is taken with springs alone unless a definition with energies is asked for.
    law : callable, optional
        (net, reference stiffness) -> energies of its triangles in place of the net's.
    besides : str
        What else a script sets, as runs here do.
    measured : str
        Bound of the difference from the equilibrium of its own law, over the displacement, at converged settings.

    Examples
    --------
    A net in an engine, by hand:

    >>> import springtune as st
    >>> xpbd = st.ENGINES["xpbd"]
    >>> xpbd.parameters["compliance"].unit, xpbd.absent
    ('m/N', '')
    >>> beam, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    >>> scene = st.Scene(beam, st.make_mesh(beam, "right", "20 mm"), rubber, "traction", "0.2 N", definition="lattice")
    >>> net, setting = st.SpringNet.from_scene(scene), st.Setting("1 ms", iterations=100)
    >>> xpbd.check(setting, net)
    >>> list(xpbd.numbers(net, setting))
    ['compliance']
    >>> session = xpbd.start(net, setting, damping=100.0)
    >>> session.advance(200)
    >>> session.displacements().shape == net.points.shape
    True
    """

    program: str = "springtune"
    needs: tuple[str, ...] = ()
    extra: str = ""
    laws: tuple[str, ...] = ()
    precisions: tuple[str, ...] = PRECISIONS
    parameters: Mapping[str, Parameter] = field(default_factory=lambda: {"stiffness": SPRING_STIFFNESS})
    iterates: bool = True
    typed: Callable[..., dict[str, Any]] = field(default_factory=lambda: typed_springs)
    of_setting: bool = False
    springs_first: bool = False
    law: Callable[[Net, float], list[Energy]] | None = None
    besides: str = ""
    measured: str = ""
    source: str = ""

    @property
    def absent(self) -> str:
        """Return why the engine cannot run here and how to install it, or an empty string."""
        lacking = [need for need in self.needs if not _is_installed(need)]
        return f"engine '{self.name}' needs {' and '.join(lacking)}; {how_to_install(self.extra)}" if lacking else ""

    def check(self, setting: Setting, net: SpringNet | None = None) -> None:
        """Refuse a net or a setting that the engine cannot run.

        Parameters
        ----------
        setting : Setting
        net : SpringNet, optional

        Raises
        ------
        EngineAbsentError
            If it is not installed.
        EngineError
            If it has no such precision, or lacks an energy of a net.
        """
        if setting.precision not in ("", *self.precisions):
            why = f"'{setting.precision}' is unknown to engine '{self.name}'"
            raise EngineError(f"precision: {why}; give one of {', '.join(self.precisions)}")
        if net is not None and (lacking := _missing_energies(self, net)):
            others = " or ".join(one.name for one in ENGINES.values() if not _missing_energies(one, net))
            remedy = f"take another definition, or engine {others or 'none of these'}"
            raise EngineError(f"engine '{self.name}' has no {' and no '.join(lacking)}; {remedy}")
        if self.absent:
            raise EngineAbsentError(self.absent)

    def numbers(self, net: SpringNet, setting: Setting) -> dict[str, Any]:
        """Numbers to type, by the names of `parameters`.

        Parameters
        ----------
        net : SpringNet
        setting : Setting

        Returns
        -------
        dict of str to float or ndarray
        """
        return self.typed(net, setting) if self.of_setting else self.typed(net)

    def start(self, net: SpringNet, setting: Setting, damping: float) -> Session:
        """Start a session of a net with masses, supports and forces.

        Parameters
        ----------
        net : SpringNet
        setting : Setting
        damping : float
            Over mass [1/s].

        Returns
        -------
        Session
        """
        self.check(setting, net)
        return self.function(net, setting, number(damping, "damping", 0))


def version_numbers(text: str) -> tuple[int, ...]:
    """Numbers of a version, such as (3, 13)."""
    return tuple(int(part) for part in text.split(".") if part.isdigit())


def _is_installed(need: str) -> bool:
    """Whether a module is installed, in the required version or a later one."""
    name, _, least = need.partition(">=")
    if find_spec(name) is None:
        return False
    try:
        return not least or version_numbers(metadata.version(name)) >= version_numbers(least)
    except metadata.PackageNotFoundError:  # installed under another name
        return True


def _missing_energies(engine: Engine, net: SpringNet) -> list[str]:
    """Names of the energies of a net that an engine lacks, in words."""
    return [ENERGY_WORDS[one.kind] for one in net.energies if one.kind not in engine.laws]


ENGINES: Registry[Engine] = Registry(__package__, "engine", "engines")
"""Engines by name."""

Function = TypeVar("Function", bound=Callable[..., Any])


def engine(name: str, *, order: float = 1000, **declared: Any) -> Callable[[Function], Function]:
    """Declare a function as an engine, by a decorator that returns it unchanged.

    Parameters
    ----------
    name : str
        Program and solver; a label of datasets. A second declaration of the same function replaces the first.
    order : float, optional
        Place in the order of labels.
    **declared
        As the attributes of `Engine`.

    Returns
    -------
    callable

    Examples
    --------
    An engine in which nothing moves:

    >>> import springtune as st
    >>> @st.engine("still", precisions=("float64",))
    ... class Still:
    ...     "Nothing moves."
    ...     def __init__(self, net, setting, damping):
    ...         self.points = net.points
    ...     def advance(self, frames):
    ...         pass
    ...     def displacements(self):
    ...         return 0 * self.points
    >>> beam, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    >>> scene = st.Scene(beam, st.make_mesh(beam, "structured", "10 mm"), rubber, "traction", "0.2 N")
    >>> print(f"{100 * st.in_engine(scene, 'still').error:+.0f} %")
    -100 %
    >>> st.ENGINES.discard("still")
    """
    return lambda function: ENGINES.declare(Engine(name, function, order, **declared))


# -- textbook solvers --------------------------------------------------------------------------------------------------


@compiled
def spring_between(x, weights, i, j):  # type: ignore[no-untyped-def]
    """Direction of a spring from i to j, its length, and the sum of its ends' inverse masses along it."""
    dx, dy = x[j, 0] - x[i, 0], x[j, 1] - x[i, 1]
    length = np.sqrt(dx * dx + dy * dy)
    dx, dy = dx / length, dy / length
    total = (weights[i, 0] + weights[j, 0]) * dx * dx + (weights[i, 1] + weights[j, 1]) * dy * dy
    return dx, dy, length, total


@compiled
def stretch_spring(x, weights, i, j, dx, dy, change):  # type: ignore[no-untyped-def]
    """Move the ends of a spring apart along its direction, by a change times their inverse masses."""
    x[i, 0] -= weights[i, 0] * change * dx
    x[i, 1] -= weights[i, 1] * change * dy
    x[j, 0] += weights[j, 0] * change * dx
    x[j, 1] += weights[j, 1] * change * dy


@compiled
def project_springs(x, weights, springs, lengths, shares, compliance, multipliers, iterations):  # type: ignore[no-untyped-def]
    """Project all springs several times, each by a share of its correction; compliance is over the squared step."""
    for _ in range(iterations):
        for e in range(len(lengths)):
            i, j = springs[e]
            dx, dy, length, total = spring_between(x, weights, i, j)
            total += compliance[e]
            if total == 0:  # both ends are held
                continue
            change = shares[e] * (lengths[e] - length - compliance[e] * multipliers[e]) / total
            multipliers[e] += change
            stretch_spring(x, weights, i, j, dx, dy, change)


class Textbook:
    """Session of implicit Euler steps ``M (x - y) / h^2 + dW/dx = 0`` from ``y = x + h v + h^2 f / m``.

    All arrays are (n_points, 2), of the setting's precision; `weights` are inverse masses, 0 where held.
    """

    def __init__(self, net: SpringNet, setting: Setting, damping: float) -> None:
        dtype = np.dtype(setting.precision or "float64")
        self.dtype, self.h = dtype, dtype.type(setting.step)
        self.substeps, self.iterations = setting.substeps, setting.iterations
        self.velocity_share = dtype.type(1 / (1 + damping * setting.step))
        self.points = (net.points - net.points.mean(axis=0)).astype(dtype)  # small numbers lose least by rounding
        self.weights = np.where(net.held, 0, 1 / net.masses[:, None]).astype(dtype)
        self.push = (setting.step**2 * np.where(net.held, 0, net.forces / net.masses[:, None])).astype(dtype)
        self.inertia = (net.masses / setting.step**2).astype(dtype)
        self.x, self.v = self.points.copy(), np.zeros_like(self.points)
        there = net.stiffness != 0
        self.springs = net.springs[there]
        self.lengths, self.stiffness = net.rest_lengths[there].astype(dtype), net.stiffness[there].astype(dtype)

    def solve(self, y: np.ndarray) -> np.ndarray:
        """Return the positions at the end of a step from the inertial ones, which it may change."""
        raise NotImplementedError

    def advance(self, frames: int) -> None:
        """Take a number of frames."""
        with np.errstate(over="ignore", invalid="ignore"):
            for _ in range(frames * self.substeps):
                before = self.x
                self.x = self.solve(before + self.h * self.v + self.push)
                self.v = self.velocity_share / self.h * (self.x - before)

    def displacements(self) -> np.ndarray:
        """Displacement of each particle [m]."""
        return (self.x - self.points).astype(float)


def refuse_pushing_springs(net: SpringNet, why: str) -> None:
    """Refuse springs of negative stiffness."""
    if np.any(net.stiffness < 0):
        why = f"has springs of negative stiffness, and {why}; take 'patch' or 'lattice', or engine 'implicit-cg'"
        raise EngineError(f"definition '{net.header['definition']}': {why}")


def energy_parameters(*kinds: str) -> dict[str, Parameter]:
    """Parameters of a solver that takes a net's stiffnesses, and values of some kinds of energies, unchanged."""
    return {"stiffness": SPRING_STIFFNESS} | {
        f"{kind} {name}": Parameter(unit, f"{name} of {ENERGY_WORDS[kind]}, as of the net")
        for kind in kinds
        for name, unit in VALUES[kind].items()
    }

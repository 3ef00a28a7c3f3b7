"""A scene in an engine: moved until it rests, swings or flies apart, and compared."""

import time
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil
from typing import Any

import numpy as np

from ..handover.net import SpringNet
from ..handover.simulation import EquilibriumWarning, simulate
from ..problem.boundary import displacement_weights
from ..problem.compare import error_text
from ..problem.quantities import whole_number
from ..safe_io import Tabled, number_text
from ..scene.single import Result, Scene
from .base import ENGINES, Engine, EngineError, Session, Setting, number

MOST_PERCENTS = 2  # displacement over the reference's from which its error is given in times

MOST_DRIFT = 0.05
"""Error across what is measured, over it, above which a note warns of it, and springs are not recommended."""

MOST_ITERATIONS = 1_000_000_000  # most frames times substeps times iterations of a run

MOST_FRAMES = 600  # frames after which a run ends that has not come to rest; more where the scene's period is long

LEAST_PERIODS = 30  # periods of the loaded mode that a run has at least

WINDOW_PERIODS = 0.5  # time between two looks at a run, over the period of the loaded mode; at least a frame

REST_TOLERANCES = {"float64": 1e-7, "float32": 1e-4}
"""Distance from rest, over the largest displacement, that a run stops at, by precision."""

DIVERGED_EXTENTS = 1e2  # displacement over the body's extent beyond which a run has diverged

SWING_WINDOWS = 16  # windows of a run that tell whether it swings

LOOKS_PER_WINDOW = 8  # looks at a window at most, since a swing may repeat itself in each

STEADY_SWING_RATIO = 0.8
"""Amplitude of the later half of these over that of the earlier one, above which a swing is not on its way to rest."""

REST_WINDOWS = 4  # windows in a row that a run has to be near rest

MOST_CHANGE_RATIO = 0.99
"""Largest ratio of changes from one window to the next: slower creep counts as rest, since it may be rounding."""


def error_words(error: float, reference: float = 0.0) -> str:
    """Error of a displacement as text: "diverged" for NaN, and a factor instead of percents if it is large.

    >>> error_words(0.02, 1e-3), error_words(-10.0, -1e-3), error_words(float("nan"), 1e-3)
    ('+2.00 %', '11 times too far', 'diverged')
    """
    times = 1 + error * np.sign(reference or error)
    if reference == reference and error != error:
        return "diverged"
    return f"{times:.3g} times too far" if times >= MOST_PERCENTS else error_text(error)


@dataclass(frozen=True)
class Ended:
    """End of a session; see `EngineResult`."""

    displacements: np.ndarray
    status: str
    message: str
    frames: int
    frame_seconds: float
    swing: float


@dataclass(frozen=True, repr=False)
class EngineResult(Tabled, Ended):
    """Result of a scene in an engine.

    Attributes
    ----------
    displacements : ndarray of float, shape (n_points, 2)
        Of the particles [m]; mean ones where it swings, NaN where it diverged.
    status, message : str
        ``"rest"``; else, and why: ``"swings"``: it ends in a periodic state; ``"moving"``: it still creeps after the
        last frame; ``"inverted"``: it rests with cells turned inside out; or ``"diverged"``.
    frames, frame_seconds : int, float
        Time that a frame took, without the first ones, which may compile [s]; NaN of a single frame.
    swing : float
        Largest amplitude about the mean, where it swings [m].
    scene, engine, setting, factor, damping
        As of `in_engine`.

    Examples
    --------
    >>> import springtune as st
    >>> beam, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    >>> mesh = st.make_mesh(beam, "structured", "10 mm")
    >>> scene = st.Scene(beam, mesh, rubber, "traction", "0.2 N", definition="patch")
    >>> found = st.in_engine(scene, "xpbd", dt="1/60", substeps=10, iterations=20)
    >>> print(f"{found.status}: {1e3 * found.displacement:.3f} mm, by the definition {1e3 * found.exact:.3f} mm")
    rest: 1.776 mm, by the definition 1.000 mm
    >>> parts = found.definition_error, found.law_error, found.solver_error
    >>> f"{found.error:.2f} = {' + '.join(f'{one:.2f}' for one in parts)}", f"{found.residual:.2f}"
    ('0.78 = 0.00 + 0.00 + 0.78', '0.65')
    >>> found.network.status, f"{1e3 * found.reference:.3f} mm", found.by_law == found.exact
    (<Status.SOLVED: 1>, '0.998 mm', True)
    >>> f"{found.drift:.2f}", found.drifts[:12]
    ('0.47', 'moves across')
    """

    scene: Scene
    engine: str
    setting: Setting
    factor: float
    damping: float

    @property
    def displacement(self) -> float:
        """Displacement of the load [m]; of a shape its first quantity that is one."""
        return self.scene.displacement_of(self.displacements)

    @cached_property
    def network(self) -> Result:
        """Equilibrium of the network itself, with a factor of 1."""
        return self.scene.solve()

    @property
    def exact(self) -> float:
        """Displacement of the load in the network's equilibrium, with a factor of 1 [m]."""
        return self.scene.displacement_of(self.network.displacements)

    @cached_property
    def reference(self) -> float:
        """Displacement of the load by finite elements [m]."""
        one = self.scene.boundary_problem.watched
        return self.scene.reference_values()[one.name] if one else np.nan

    @property
    def error(self) -> float:
        """Error in the engine: (engine - reference) / abs(reference) [1], the sum of the next three."""
        return (self.displacement - self.reference) / abs(self.reference)

    @property
    def definition_error(self) -> float:
        """Error of the network's equilibrium, with a factor of 1 [1]."""
        return (self.exact - self.reference) / abs(self.reference)

    @cached_property
    def by_law(self) -> float:
        """Displacement of the load in the equilibrium of the engine's own law of triangles, with a factor of 1 [m]."""
        net, engine = net_of(self.scene), ENGINES[self.engine]
        if not (engine.law and net.energies):
            return self.exact
        with warnings.catch_warnings(action="ignore", category=EquilibriumWarning):
            moved = simulate(net, engine.program, engine.laws, engine.law).displacements
        return self.exact if moved is None else self.scene.displacement_of(moved)

    @property
    def law_error(self) -> float:
        """Error that the engine's own law of triangles adds [1]; 0 where it has the definition's law."""
        return (self.by_law - self.exact) / abs(self.reference)

    @property
    def solver_error(self) -> float:
        """Error that the engine's solver adds: (engine - equilibrium of its law) / abs(reference) [1]."""
        return (self.displacement - self.by_law) / abs(self.reference)

    @cached_property
    def drift(self) -> float:
        """Error across the measured direction: of the displacement along the other axis, over abs(reference) [1]."""
        return drift(self.scene, self.displacements)

    @property
    def residual(self) -> float:
        """Out-of-balance force of the network at the engine's displacements, over the load, with `factor` in it [1]."""
        load = self.scene.forces / (self.factor * self.scene.springs.reference)
        return self.scene.motion(load=load).residual(self.displacements)

    @property
    def drifts(self) -> str:
        """Sentence for a warning about `drift`."""
        return f"moves across by {self._drift_text} of what finite elements move along, which 'error' does not say"

    @property
    def _drift_text(self) -> str:
        """Text of `drift`; empty where the run diverged."""
        return error_text(self.drift) if self.drift == self.drift else ""

    def _rows(self) -> Iterator[tuple[str, str]]:
        yield "engine", f"{self.engine}, {self.setting}"
        yield "status", self.status
        yield "reason", self.message
        yield "displacement", number_text(self.displacement, "m")
        yield "a frame", frame_text(self.frame_seconds)

    def _computed_rows(self) -> Iterator[tuple[str, str]]:
        yield "error", error_words(self.error, self.reference)
        yield "from the definition", error_text(self.definition_error)
        if self.by_law != self.exact:
            yield "from the law", error_text(self.law_error)
        yield "from the solver", error_words(self.solver_error, self.reference)
        yield "drift across", self._drift_text

    @property
    def _parts(self) -> str:
        """Error in words, with its parts."""
        parts = {"definition": self.definition_error, "law": self.law_error, "solver": self.solver_error}
        each = ", ".join(f"{name} {error_words(part, self.reference)}" for name, part in parts.items() if part)
        return f"{error_words(self.error, self.reference)} ({each})" if self.error == self.error else "diverged"


def in_engine(
    scene: Scene,
    engine: str,
    setting: Setting | None = None,
    *,
    factor: float = 1.0,
    frames: int | None = None,
    tolerance: float | None = None,
    damping: float | None = None,
    order: int = 0,
    **parts: Any,
) -> EngineResult:
    """Move a scene in an engine, at the setting that it is used at, until it rests.

    Parameters
    ----------
    scene : Scene
        In nonlinear kinematics, of materials that have a density.
    engine : str
        Key of `springtune.ENGINES`.
    setting : Setting, optional
    factor : float, optional
        On all stiffnesses and moduli that are typed [1].
    frames : int, optional
        At most; by default 600, or 30 periods of the loaded mode if that is more.
    tolerance : float, optional
        Distance from rest over the largest displacement that ends the run [1]; by default 1e-7, in single precision
        1e-4.
    damping : float, optional
        Over mass [1/s]; by default the critical one of the loaded mode.
    order : int, optional
        0 for the mesh's order of particles, springs and cells, 1 for the reverse one, others for random ones.
    **parts
        In the place of a setting its parts: ``dt``, ``substeps``, ``iterations``, ``precision``.

    Returns
    -------
    EngineResult

    Raises
    ------
    KeyError, EngineError
        If no engine has the name; if it is not installed, or lacks what the scene has.

    Examples
    --------
    Too few iterations leave springs soft:

    >>> import springtune as st
    >>> beam, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    >>> mesh = st.make_mesh(beam, "structured", "10 mm")
    >>> scene = st.Scene(beam, mesh, rubber, "traction", "0.2 N", definition="patch")
    >>> for iterations in (10, 100):
    ...     found = st.in_engine(scene, "xpbd", dt="1/60", iterations=iterations)
    ...     print(f"{1e3 * found.displacement:.1f} mm in place of {1e3 * found.exact:.1f}")
    210.7 mm in place of 1.0
    16.5 mm in place of 1.0
    """
    chosen = ENGINES[engine]
    setting = with_precision(chosen, setting or Setting(**parts))
    net, places = net_of(scene, number(factor, "factor")), np.arange(len(scene.mesh.points))
    if order:
        net, places = reordered(net, order)
    frequency = scene.motion().loaded_frequency * factor**0.5
    damping = 2 * frequency if damping is None else damping
    session = chosen.start(net, setting, damping)
    window = max(1, round(WINDOW_PERIODS * 2 * np.pi / frequency / setting.dt))
    usual = max(MOST_FRAMES, ceil(LEAST_PERIODS / WINDOW_PERIODS) * window)
    asked = usual if frames is None else whole_number(frames, "frames", MOST_ITERATIONS)
    if asked * setting.substeps * (setting.iterations if chosen.iterates else 1) > MOST_ITERATIONS:
        why = f"{asked} frames of {setting} are over {MOST_ITERATIONS:.0e} iterations"
        raise EngineError(f"dt: {why}; take a longer dt, or fewer substeps")
    rest = REST_TOLERANCES[setting.precision] if tolerance is None else number(tolerance, "tolerance")
    ended = follow(session, window, asked, rest, float(np.ptp(net.points, axis=0).max()))
    ended = replace(ended, displacements=ended.displacements[places])
    if ended.status == "rest" and scene.network.inverted(ended.displacements):
        message = "at rest with cells turned inside out; take shorter steps, or less load"
        ended = replace(ended, status="inverted", message=message)
    return EngineResult(**vars(ended), scene=scene, engine=engine, setting=setting, factor=factor, damping=damping)


def with_precision(engine: Engine, setting: Setting) -> Setting:
    """Return a setting with the engine's own precision if it names no other."""
    return setting if setting.precision else replace(setting, precision=engine.precisions[0])


def drift(scene: Scene, displacements: np.ndarray) -> float:
    """Error of the displacement along the other axis, over the reference's along the load [1]; NaN without one."""
    if not (one := scene.boundary_problem.watched):
        return np.nan
    exact, grouped = scene.reference().at(scene.mesh.points), scene.boundary_problem.grouped
    across = displacement_weights(grouped, replace(one, component="y" if one.component == "x" else "x"))
    return float(np.tensordot(displacements - exact, across, axes=2) / abs(scene.displacement_of(exact)))


def reordered(net: SpringNet, order: int) -> tuple[SpringNet, np.ndarray]:
    """Net of the same mesh with its particles and cells in another order, and the new place of each particle."""
    random = np.random.default_rng(order)
    counts = len(net.points), len(net.triangles), len(net.quads)
    points, *rows = (random.permutation(count) if order > 1 else np.arange(count)[::-1] for count in counts)
    cells, places = {3: rows[0], 4: rows[1]}, np.argsort(points)
    springs = np.sort(places[net.springs], axis=1)
    edges = np.lexsort(springs.T[::-1])
    arrays = {name: getattr(net, name)[points] for name in ("points", "masses", "held", "forces")}
    arrays |= {name: getattr(net, name)[edges] for name in ("rest_lengths", "stiffness")}
    arrays |= {"triangles": places[net.triangles[cells[3]]], "quads": places[net.quads[cells[4]]]}
    energies = []
    for one in net.energies:
        own = cells[one.cells.shape[1]]
        values = {name: values[own] for name, values in one.values.items()}
        energies.append(replace(one, cells=places[one.cells[own]], values=values))
    return replace(net, **arrays, springs=springs[edges], energies=tuple(energies)), places


def net_of(scene: Scene, factor: float = 1.0) -> SpringNet:
    """Net of a scene with all stiffnesses and moduli times a factor; refuse scenes that no engine runs."""
    if scene.kinematics == "linear":
        raise EngineError("kinematics: 'linear', and engines keep the length law of springs; take 'nonlinear'")
    scene.motion()  # refuses what has no masses, and loads that turn or prescribe displacements
    springs = replace(scene.springs, reference=factor * scene.springs.reference)
    return SpringNet.from_scene(scene, springs=springs, errors=False)


def follow(session: Session, window: int, most: int, tolerance: float, extent: float) -> Ended:
    """Advance a session until it rests: the way left, extrapolated from the last changes, is below `tolerance`."""
    seen, seconds = list[np.ndarray](), list[float]()

    def ended(displacements: np.ndarray, status: str, message: str, swing: float) -> Ended:
        frame_seconds = float(np.median(seconds[1:])) if len(seconds) > 1 else np.nan  # the first ones may compile
        return Ended(displacements, status, message, done, frame_seconds, swing)

    last, before, gap, done, calm = session.displacements(), np.inf, 1.0, 0, 0
    while done < most:
        looks, size_of_window = [], min(window, most - done)
        each = ceil(size_of_window / LOOKS_PER_WINDOW)
        for begun in range(0, size_of_window, each):
            count = min(each, size_of_window - begun)
            begin = time.perf_counter()
            session.advance(count)
            seconds.append((time.perf_counter() - begin) / count)
            done, now = done + count, session.displacements()
            size = float(np.abs(now).max())
            if not size <= DIVERGED_EXTENTS * extent:
                message = f"diverged within {done} frames; take more substeps, or a smaller stiffness"
                return ended(np.full(now.shape, np.nan), "diverged", message, np.nan)
            looks.append(now)
        window_seen = np.stack([np.mean(looks, axis=0), np.min(looks, axis=0), np.max(looks, axis=0)])
        seen = [*seen[1 - SWING_WINDOWS :], window_seen]
        aside = float(np.abs(now - np.array(looks)).max())
        change, wider = float(np.abs(now - last).max()), gap
        ratio = change / before if before else float(change > 0)
        gap = 1 - min(ratio, MOST_CHANGE_RATIO)
        ahead = max(1 - MOST_CHANGE_RATIO, min(gap, gap * gap / wider))
        left = max(change, aside) * max(1.0, (1 - ahead) / ahead)
        calm = calm + 1 if left <= tolerance * size else 0
        last, before = now, change
        trembles = len(seen) == SWING_WINDOWS and _swing(seen) <= tolerance * size and _oscillates(seen)
        if calm == REST_WINDOWS or trembles:
            return ended(now, "rest", "", 0.0)
    swing = _swing(seen[len(seen) // 2 :])
    if len(seen) > 1 and _oscillates(seen) and swing > STEADY_SWING_RATIO * _swing(seen[: len(seen) // 2]):
        message = f"swings by {1e3 * swing:.3g} mm about its mean after {done} frames; take more substeps or damping"
        return ended(_mean(seen), "swings", message, swing)
    message = f"not at rest after {done} frames, still moving by {1e3 * change:.3g} mm in {window}; give more frames"
    return ended(now, "moving", message, swing)


def _mean(seen: list[np.ndarray]) -> np.ndarray:
    """Mean displacement, of the first and last windows with less weight: no swing has whole periods in them."""
    return np.average([mean for mean, _, _ in seen], axis=0, weights=np.hanning(len(seen) + 2)[1:-1])


def _swing(seen: list[np.ndarray]) -> float:
    """Largest amplitude about a mean [m]."""
    low, high = np.min([low for _, low, _ in seen], axis=0), np.max([high for _, _, high in seen], axis=0)
    return float((high - low).max() / 2)


def _oscillates(seen: list[np.ndarray]) -> bool:
    """Whether displacements go to and fro about one place rather than somewhere."""
    middle = len(seen) // 2
    drift = float(np.abs(_mean(seen[middle:]) - _mean(seen[:middle])).max())
    return _swing(seen[middle:]) > 2 * drift


def frame_text(seconds: float) -> str:
    """Time of a frame in words; empty without a timed one."""
    return "" if seconds != seconds else f"{1e3 * seconds:.3g} ms" if seconds < 1 else f"{1e3 * seconds:.0f} ms"

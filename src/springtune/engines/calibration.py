"""Calibration of a scene to an engine's setting: the numbers to type so that it moves as the material does.

In most solvers the displacement is nearly ``a / s + b`` with a factor ``s`` on all that is typed. ``b`` is what
iterations and substeps leave: where it exceeds the material's displacement, no factor helps.
"""

import logging
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from ..handover.net import NOT_COMPUTED, SpringNet
from ..mesh.cells import Mesh
from ..prediction.choices import check_loads, check_names, edge_places, predictable_loads, trial
from ..problem.compare import error_text
from ..problem.loads import LOADS
from ..problem.shapes import Shape
from ..reference.small_strain import ReferenceNotConvergedError
from ..safe_io import Tabled, TabledList, number_text
from ..scene.boundary_problem import ShapeProblem, unit_reference
from ..scene.single import Scene
from .base import ENGINES, Engine, EngineError, Setting
from .run import MOST_DRIFT, EngineResult, drift, error_words, frame_text, in_engine, net_of, with_precision

logger = logging.getLogger(__name__)

LOAD_SHARES = (0.25, 0.5, 1.0, 2.0)  # sizes of a load that a calibration is tried on, over its own

MOST_SPREAD = 0.05
"""Error up to which orders of the particles may differ from each other, and loads from a converged setting."""

FACTOR_ERROR, MOST_FACTOR_ERROR = 1e-3, 0.02
"""Error at which a factor is taken, and above which it is refused where nothing comes closer."""

BRACKET_RATIO, MOST_BRACKETS, SATURATED_CHANGE = 8.0, 7, 1e-3
"""Ratio of the factors that look for a bracket, how many there are, and the change of the displacement over one below
which stiffness no longer decides."""

TRIED_ORDERS = 4  # orders of particles, springs and cells that a calibration is tried in

DAMPING_NOTE = "critical for the loaded mode: each step divides velocities by 1 + damping times the step"
"""Note on the damping of a run."""

RUN_TOLERANCES = {"float64": 1e-4, "float32": 1e-3}
"""Distance from rest that ends a run, over the displacement, by precision."""

MOST_SWING = 5e-3
"""Amplitude over the displacement up to which a run that does not rest counts, as those of single precision do."""

CONVERGED_ERROR, STALLED_SHARE, MOST_DOUBLINGS = 0.01, 0.9, 8
"""Solver error of a converged setting, the share of it that two doublings of substeps or iterations leave where more
are hopeless, and how many are tried."""

FAR_ERROR, FAR_STEPS = 1.0, 10
"""Solver error above which doubling begins at once at this many stable steps of explicit integrators."""


@dataclass(frozen=True, repr=False)
class LoadBand(Tabled):
    """Errors of a calibrated factor under a load of several sizes.

    Attributes
    ----------
    load, sizes : str, tuple of float
        Tested forces on a beam [N], or factors on a load case of a shape [1].
    errors : tuple of float
        In the engine at each size [1]; NaN where it does not come to rest.
    definition_error : float
        Of the equilibrium by the engine's law without a factor, at the third size [1]: what a converged setting has.
    message : str
        Why there is no error.

    Examples
    --------
    >>> import springtune as st
    >>> beam, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    >>> scene = st.Scene(beam, st.make_mesh(beam, "structured", "20 mm"), rubber, "traction", "0.2 N")
    >>> fit = st.fit_engine(scene, "xpbd", substeps=16, loads=["bending"], needed=False)
    >>> for band in fit.bands:
    ...     print(f"{band.load} {100 * band.error:+.0f} %, converged {100 * band.definition_error:+.0f} %")
    traction -0 %, converged +0 %
    bending -35 %, converged -35 %
    """

    load: str
    sizes: tuple[float, ...]
    errors: tuple[float, ...]
    definition_error: float
    message: str = ""

    @property
    def error(self) -> float:
        """Error at the third size [1], the scene's or one that moves the reference as far."""
        return self.errors[LOAD_SHARES.index(1.0)]

    def _rows(self) -> Iterator[tuple[str, str]]:
        yield "load", self.load
        for share, error in zip(LOAD_SHARES, self.errors):
            yield f"x {share:g}", error_text(error) if error == error else "no rest"
        yield "converged", error_text(self.definition_error) if self.definition_error == self.definition_error else ""
        yield "reason", self.message


@dataclass(frozen=True, repr=False)
class NeededSetting(Tabled):
    """Setting whose solver error is below 1 % without a factor, found by doubling its substeps or its iterations.

    Attributes
    ----------
    raised : str
        ``"substeps"`` or ``"iterations"``.
    setting, found : Setting, bool
        The first one that serves, or the last one that was tried, and whether it serves.
    solver_error, frame_seconds : float
        There, without a factor [1]: the largest one in some orders of particles; and the time of a frame [s].
    typed : str
        The numbers to type there, those of the definition.

    Examples
    --------
    >>> import springtune as st
    >>> beam, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    >>> scene = st.Scene(beam, st.make_mesh(beam, "structured", "20 mm"), rubber, "traction", "0.2 N")
    >>> for one in st.fit_engine(scene, "xpbd", substeps=16, loads=["traction"]).needed:
    ...     print(f"{one.raised}: {one.setting}, {one.found}, {100 * one.solver_error:+.1f} %")
    substeps: dt 1/60 s, 32 substeps, 10 iterations, float64, True, -0.0 %
    iterations: dt 1/60 s, 16 substeps, 20 iterations, float64, True, -0.1 %
    """

    raised: str
    setting: Setting
    found: bool
    solver_error: float
    frame_seconds: float
    typed: str = ""

    def _rows(self) -> Iterator[tuple[str, str]]:
        yield "more", self.raised
        yield "setting", str(self.setting) if self.found else f"not reached with {self.setting}"
        yield "solver error", error_words(self.solver_error)
        yield "a frame", frame_text(self.frame_seconds)


@dataclass(frozen=True, repr=False)
class EngineFit(Tabled):
    """Numbers to type into an engine so that a scene is right at a setting, and their errors.

    Attributes
    ----------
    scene : Scene
    factor : float
        On all stiffnesses and moduli that are typed [1]; NaN where there is none, for the reason in `message`.
    result, untuned : EngineResult
        With the factor, or the one that came nearest; and without a factor.
    typed : dict of str to float or ndarray
        The numbers to type by the names of the engine's `parameters`, with the factor in them.
    bands, needed : TabledList of LoadBand, TabledList of NeededSetting
        By load, the scene's first; and what a converged setting needs.
    message : str
        Why there is no factor, or what else is to be known.
    spread : tuple of float
        Least and largest error with the factor in other orders of particles, springs and cells [1]; where these are too
        far apart for a factor, without one.

    Examples
    --------
    >>> import springtune as st
    >>> beam, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    >>> scene = st.Scene(beam, st.make_mesh(beam, "structured", "13 mm"), rubber, "traction", "0.2 N")
    >>> fit = st.fit_engine(scene, "xpbd", substeps=16, loads=["traction"], needed=False)
    >>> print(f"{fit.factor:.2f} times, {len(fit.typed['compliance'])} springs; error {100 * fit.error:+.1f} %")
    1.41 times, 205 springs; error -0.0 %
    >>> print(*fit.typed_rows())
    ('compliance', 'inside 0.00093108, on the outline 0.0018622', 'm/N', '1 / k of a spring')
    >>> fit.net().write("tuned.csv")[0].name
    'tuned.csv'
    """

    scene: Scene = field(repr=False)
    factor: float
    result: EngineResult = field(repr=False)
    untuned: EngineResult = field(repr=False)
    typed: dict[str, Any] = field(repr=False)
    bands: TabledList[LoadBand] = field(repr=False)
    needed: TabledList[NeededSetting] = field(repr=False)
    message: str
    spread: tuple[float, float] = (np.nan, np.nan)

    @property
    def error(self) -> float:
        """Error in the engine with the factor, under the load of the scene [1]."""
        return self.result.error

    def net(self) -> SpringNet:
        """Springs with the factor in them.

        Returns
        -------
        SpringNet

        Raises
        ------
        EngineError
            If there is no factor.
        """
        if self.factor != self.factor:
            raise EngineError(self.message)
        result, net = self.result, net_of(self.scene, self.factor)
        why = f"{NOT_COMPUTED}: the stiffness is that for engine '{result.engine}' at {result.setting}, which has not"
        calibrated = {
            "engine": result.engine,
            "setting": str(result.setting),
            "factor": self.factor,
            "step": result.setting.step,
            "iterations": result.setting.iterations,
            "damping": result.damping,
            "seconds": result.frames * result.setting.dt,
            "displacement": float((net.forces * result.displacements).sum() / np.abs(net.forces).sum()),
        }
        return replace(net, header=net.header | {"calibrated": calibrated, "expected_error": f"{why} converged"})

    def typed_rows(self) -> Iterator[tuple[str, str, str, str]]:
        """Name, value or range, unit and formula of each number to type, as texts; edges without springs left out.

        Returns
        -------
        iterator of tuple of str
        """
        return _typed_rows(ENGINES[self.result.engine], self.typed, self.scene.mesh)

    def _rows(self) -> Iterator[tuple[str, str]]:
        yield "engine", f"{self.result.engine}, {self.result.setting}"
        yield "factor", f"{self.factor:.5g}" if self.factor == self.factor else "none"
        for name, value, unit, formula in self.typed_rows():
            yield f"type {name}", f"{_with_unit(value, unit)}: {formula}"
        yield "displacement", number_text(self.result.displacement, "m")
        yield "by finite elements", number_text(self.result.reference, "m")
        yield "error", error_words(self.error, self.result.reference)
        if ENGINES[self.result.engine].iterates:
            yield "in other orders", _between(self.spread, self.result.reference)
        yield "drift across", self.result._drift_text
        yield "without a factor", self.untuned._parts
        yield "run", f"{self.result.status}, frames: {self.result.frames}"
        yield "damping", f"{self.result.damping:.4g} 1/s, {DAMPING_NOTE}"
        yield "set besides", ENGINES[self.result.engine].besides
        yield "a frame", frame_text(self.result.frame_seconds)
        yield "note", self.message


class _Runs(dict[tuple[float, Setting], EngineResult]):
    """Runs of a scene in an engine by factor and setting, each once."""

    def __init__(self, scene: Scene, engine: str, frames: int | None) -> None:
        self.scene, self.engine, self.frames = scene, engine, frames

    def __missing__(self, key: tuple[float, Setting]) -> EngineResult:
        self[key] = self.under(self.scene, *key)
        return self[key]

    def under(self, scene: Scene, factor: float, setting: Setting, order: int = 0) -> EngineResult:
        """Run of a scene of the same springs, damped critically for the loaded mode of the material."""
        damping, rest = 2 * scene.motion().loaded_frequency, RUN_TOLERANCES[setting.precision]
        about: dict[str, Any] = {"frames": self.frames, "tolerance": rest, "damping": damping, "order": order}
        logger.info("running %s at %s, stiffness times %.4g", scene.title, setting, factor)
        return in_engine(scene, self.engine, setting, factor=factor, **about)

    def orders(self, factor: float, setting: Setting) -> list[EngineResult]:
        """Runs with the particles, springs and cells in several orders; one run if the engine does not iterate."""
        others = range(1, TRIED_ORDERS if ENGINES[self.engine].iterates else 1)
        return [self[factor, setting], *(self.under(self.scene, factor, setting, order) for order in others)]

    def spread(self, factor: float, setting: Setting) -> tuple[tuple[float, float], str]:
        """Return the least and largest error over these orders, and the reason if they differ too much for a factor."""
        runs = self.orders(factor, setting)
        errors = np.array([one.error for one in runs])
        low, high = float(errors.min()), float(errors.max())
        if np.isnan(errors[0]) or np.abs(errors - errors[0]).max() <= MOST_SPREAD:
            return (low, high), ""
        outcome = f"is {_between((low, high), runs[0].reference)} in" if low == low else "diverges in some of"
        tried = f"{TRIED_ORDERS} orders of the same particles, with {factor:.4g} times the numbers of the definition"
        why = "the solver has not converged, so no factor holds in other scripts; take more substeps or iterations"
        return (low, high), f"the error at {setting} {outcome} {tried}: {why}"

    def ratio(self, factor: float, setting: Setting) -> float:
        """Return the displacement over the reference's; NaN if the run diverged."""
        found = self[factor, setting]
        return found.displacement / found.reference


def fit_engine(
    scene: Scene,
    engine: str,
    setting: Setting | None = None,
    *,
    loads: Iterable[str] | None = None,
    needed: bool = True,
    frames: int | None = None,
    **parts: Any,
) -> EngineFit:
    """Find what to type into an engine so that a scene's displacement is that of finite elements.

    One factor on all stiffnesses and moduli is found by Brent's method in its inverse.

    Parameters
    ----------
    scene : Scene
        As of `in_engine`, with the load to calibrate on.
    engine : str
        Key of `springtune.ENGINES`.
    setting : Setting, optional
    loads : iterable of str, optional
        Further loads that get a band, with the force that moves the reference as far; by default all that do not turn.
    needed : bool, optional
        Whether to look for settings that converge, which takes the longest.
    frames, **parts
        As of `in_engine`.

    Returns
    -------
    EngineFit

    Raises
    ------
    KeyError, EngineError
        As of `in_engine`, or if the load has no displacement.

    Examples
    --------
    A factor hides too few substeps from the load that it is found for, and from that load alone:

    >>> import springtune as st
    >>> beam, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    >>> scene = st.Scene(beam, st.make_mesh(beam, "structured", "13 mm"), rubber, "traction", "0.2 N")
    >>> fit = st.fit_engine(scene, "xpbd", dt="1/60", substeps=16, loads=["bending", "shear"])
    >>> print(f"{fit.factor:.2f}: {100 * fit.untuned.error:+.1f} % becomes {100 * fit.error:+.1f} %")
    1.41: +22.8 % becomes -0.0 %
    >>> print(*(f"{band.load} {100 * band.error:+.0f} %, converged {100 * band.definition_error:+.0f} %;"
    ...         for band in fit.bands))
    traction -0 %, converged +0 %; bending -8 %, converged -12 %; shear -14 %, converged +5 %;

    With fewer substeps there is none:

    >>> none = st.fit_engine(scene, "xpbd", dt="1/60", substeps=4, needed=False)
    >>> print(none.factor, f"{1e3 * none.result.displacement:.2f} mm in place of {1e3 * none.result.reference:.2f}")
    nan 8.61 mm in place of 1.00
    """
    chosen = ENGINES[engine]
    setting = with_precision(chosen, setting or Setting(**parts))
    chosen.check(setting, net_of(scene))
    names = _loads(scene, loads)
    runs = _Runs(scene, engine, frames)
    untuned = runs[1.0, setting]
    if not abs(untuned.reference) > 0:
        raise EngineError(f"load: {scene.load!r} has no displacement to calibrate to; add one to its quantities")
    spread, why = runs.spread(1.0, setting)
    factor, why = (np.nan, why) if why else _factor(runs, setting)
    tuned = runs[factor, setting] if factor == factor else min(runs.values(), key=lambda one: _size(one.error))
    if factor == factor:
        spread, why = runs.spread(factor, setting)
        factor, tuned = (np.nan, untuned) if why else (factor, tuned)
    found = factor == factor
    why = why or ("" if _is_at_rest(tuned) else tuned.message)
    notes = why, tuned.drifts if abs(tuned.drift) > MOST_DRIFT else "", scene.objection
    typed = chosen.numbers(net_of(scene, factor), setting) if found else {}
    bands = TabledList(_band(runs, name, tuned) for name in names if found)
    raised = ("substeps", "iterations") if chosen.iterates else ("substeps",)
    settings = TabledList(_needed(runs, name, setting) for name in raised if needed)
    return EngineFit(scene, factor, tuned, untuned, typed, bands, settings, "; ".join(filter(None, notes)), spread)


def _typed_rows(engine: Engine, typed: Mapping[str, Any], mesh: Mesh) -> Iterator[tuple[str, str, str, str]]:
    """Name, value or range by place of springs, unit and formula of each number to type, as texts."""
    for name, known in engine.parameters.items():
        if name in typed:
            values = np.asarray(typed[name])
            each = {"": _range_text(values)}
            if values.shape == (len(mesh.edges),):
                each = {f"{where} ": _range_text(values[part]) for where, part in edge_places(mesh).items()}
            text = ", ".join(f"{where}{value}" for where, value in each.items() if value)
            yield name, text, known.unit, known.formula


def _range_text(values: np.ndarray) -> str:
    """The finite values, or their range, as text."""
    values = values[np.isfinite(values)]
    ends = dict.fromkeys(f"{one:.5g}" for one in (values.min(), values.max())) if len(values) else ()
    return " to ".join(ends)


def _with_unit(value: str, unit: str) -> str:
    return value if unit == "1" else f"{value} {unit}"


def typed_text(rows: Iterable[tuple[str, str, str, str]]) -> str:
    """Names, values and units of the numbers to type, in one line."""
    return "; ".join(f"{name} {_with_unit(value, unit)}" for name, value, unit, _ in rows)


def _between(errors: tuple[float, float], reference: float) -> str:
    """Range of errors in words, from the least to the largest."""
    low, high = (error_words(error, reference) for error in sorted(errors, key=abs))
    if low == high:
        return low
    words = high.partition(" ")[2]
    return f"{low.removesuffix(f' {words}') if words != '%' else low} to {high}"


def _is_at_rest(one: EngineResult) -> bool:
    """Whether a run is at rest, up to rounding."""
    return one.status == "rest" or one.status != "inverted" and one.swing <= MOST_SWING * abs(one.displacement)


def _size(error: float) -> float:
    """Size of an error; infinite if the run diverged."""
    return abs(error) if np.isfinite(error) else np.inf


def _loads(scene: Scene, loads: Iterable[str] | None) -> tuple[str, ...]:
    """Loads that get a band, the scene's first."""
    if isinstance(scene.boundary_problem, ShapeProblem):
        known = scene.shape.loads
        others = check_names("loads", known if loads is None else loads, known, tuple(known), "is unknown")
    else:
        others = check_loads(predictable_loads() if loads is None else loads)
    return tuple(dict.fromkeys((scene.load, *others)))


def _factor(runs: _Runs, setting: Setting) -> tuple[float, str]:
    """Find the factor at which the displacement is the reference's; else NaN and the reason."""
    from scipy.optimize import brentq

    def error(softness: float) -> float:
        off = runs.ratio(1 / softness, setting) - 1
        return 0.0 if abs(off) <= FACTOR_ERROR else float(np.nan_to_num(off, nan=1.0))

    moved = f"{number_text(runs[1.0, setting].reference, 'm')} by finite elements"
    if not np.isfinite(runs.ratio(1.0, setting)):
        return np.nan, f"{runs.engine} diverges at {setting} with the numbers of the definition"
    first, last, diverged = _bracket(runs, setting)
    if last != last:
        what, there = "stiffness" if first >= 1 else "softness", number_text(runs[first, setting].displacement, "m")
        why = f", and {diverged:.3g} times diverges" if diverged == diverged else ""
        why += "; take more substeps or iterations"
        return np.nan, f"no {what} reaches {moved}: {first:.3g} times the stiffness leaves {there} at {setting}{why}"
    brentq(error, *sorted((1 / first, 1 / last)), xtol=1e-5 / max(first, last), maxiter=60)
    factor, best = min(((factor, one) for (factor, _), one in runs.items()), key=lambda pair: _size(pair[1].error))
    if not abs(best.error) <= MOST_FACTOR_ERROR:
        return np.nan, f"the displacement jumps over {moved} at {factor:.4g} times the stiffness"
    return factor, ""


def _bracket(runs: _Runs, setting: Setting) -> tuple[float, float, float]:
    """Two factors with the right one between them, NaN for the second without one, and one that diverged."""
    stiffen = runs.ratio(1.0, setting) > 1
    first, diverged, step = 1.0, np.nan, BRACKET_RATIO if stiffen else 1 / BRACKET_RATIO
    for _ in range(MOST_BRACKETS):
        factor = first * step
        ratio = runs.ratio(factor, setting)
        if stiffen and not np.isfinite(ratio):
            diverged, step = factor, step**0.5
        elif not np.isfinite(ratio) or (ratio > 1) != stiffen:
            return first, factor, diverged
        else:
            still = abs(ratio - runs.ratio(first, setting)) < SATURATED_CHANGE * abs(ratio)
            first = factor
            if stiffen and still and diverged != diverged:
                break
    return first, np.nan, diverged


def _needed(runs: _Runs, raised: str, setting: Setting) -> NeededSetting:
    """Double substeps or iterations until the solver error is small without a factor, or stalls."""
    errors: list[float] = []
    first, tried, found = getattr(setting, raised), runs[1.0, setting], False
    if raised == "substeps" and not abs(tried.solver_error) <= FAR_ERROR:
        ratio = setting.step / (FAR_STEPS * runs.scene.motion().step_limit("central-difference"))
        first *= 2 ** max(0, int(np.log2(ratio)))
    for power in range(MOST_DOUBLINGS + 1):
        try:
            tried = runs[1.0, replace(setting, **{raised: first * 2**power})]
        except ValueError:  # more than is run
            break
        errors.append(_size(tried.solver_error))
        if found := _is_at_rest(tried) and errors[-1] <= CONVERGED_ERROR:
            tried = max(runs.orders(1.0, tried.setting), key=lambda one: _size(one.solver_error))
            found = abs(tried.solver_error) <= CONVERGED_ERROR
        may_stall = power > 1 and (raised == "iterations" or errors[-3] <= FAR_ERROR)
        if found or (may_stall and errors[-1] >= STALLED_SHARE * errors[-3]):
            break
    engine = ENGINES[runs.engine]
    typed = typed_text(_typed_rows(engine, engine.numbers(net_of(runs.scene), tried.setting), runs.scene.mesh))
    return NeededSetting(raised, tried.setting, found, tried.solver_error, tried.frame_seconds, typed)


def _scene_under(scene: Scene, load: str, size: float) -> Scene:
    """Scene of the same springs under a load of a size."""
    make = partial(Scene, definition=scene.definition, stiffness=scene.uniform_stiffness, cache=scene.cache)
    if scene.definition.needs == "cases" and load != scene.load:
        raise EngineError(f"definition '{scene.definition.name}' is fitted to load '{scene.load}' alone")
    if isinstance(scene.boundary_problem, ShapeProblem):
        return make(scene.shape, scene.grouped, scene.by_part, load, scale=size)
    return make(scene.beam, scene.mesh, scene.material, load, size)


def _band(runs: _Runs, load: str, tuned: EngineResult) -> LoadBand:
    """Errors of the engine with the factor under a load of several sizes."""
    scene, nothing = runs.scene, (np.nan,) * len(LOAD_SHARES)
    base = scene.boundary_problem.size
    try:
        if load != scene.load and not isinstance(scene.boundary_problem, ShapeProblem):
            moved = unit_reference(scene.beam, scene.material, LOADS[load].kind, 1.0).displacement
            base = abs(tuned.reference / moved)
        sizes = tuple(float(share * base) for share in LOAD_SHARES)
        found = [runs.under(_scene_under(scene, load, size), tuned.factor, tuned.setting) for size in sizes]
    except (ValueError, ReferenceNotConvergedError) as error:
        return LoadBand(load, nothing, nothing, np.nan, str(error))
    errors = tuple(one.error if _is_at_rest(one) else np.nan for one in found)
    why = next((one.message for one in found if not _is_at_rest(one)), "")
    why = why or next((one.drifts for one in found if abs(one.drift) > MOST_DRIFT), "")
    own = found[LOAD_SHARES.index(1.0)]
    return LoadBand(load, sizes, errors, own.definition_error + own.law_error, why)


def best_runnable_scene(
    make: "partial[Scene]", loads: Iterable[str], engine: Engine, setting: Setting, springs_alone: bool
) -> tuple[Scene, tuple[str, ...]]:
    """Scene of the best definition that an engine runs, and the definitions tried; EngineError without one."""
    body, mesh, material, load, *_ = make.args
    about: dict[str, Any] = {"load": load} if isinstance(body, Shape) else {"loads": loads}
    tried, refused = trial(body, mesh, material, **about), dict[str, str]()
    while True:
        able = [one for one in tried.choices(refused) if one.worst < np.inf and not (springs_alone and one.energies)]
        able.sort(key=lambda one: engine.springs_first and one.energies)
        if not able:
            none = "no definition has a stable network on this mesh; take another mesh"
            raise EngineError(next(iter(refused.values()), none))
        name = able[0].definition
        scene = make(definition=name)
        try:
            if abs(aside := drift(scene, scene.solve().displacements)) > MOST_DRIFT:
                why = f"definition '{name}' moves across by {error_text(aside)}"
                raise EngineError(f"{why}; take a finer mesh, or another type such as 'structured'")
            engine.start(net_of(scene), setting, 1.0)
            return scene, tried.tried
        except EngineError as error:
            refused[name] = str(error)

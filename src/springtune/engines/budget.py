"""Search for the mesh, definition, substeps and iterations that are least off within a frame's time."""

import time
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from ..handover.net import SpringNet
from ..mesh import MESH_TYPES, Mesh, MeshError
from ..mesh.groups import GroupedMesh
from ..mesh.outlines import mesh_shape
from ..prediction.choices import CASES, check_loads, check_names, predict
from ..problem.compare import error_text, unbeaten
from ..problem.geometry import Beam
from ..problem.materials import AnyMaterial
from ..problem.quantities import positive
from ..problem.shapes import Shape
from ..safe_io.tables import Tabled, TabledList, number_text
from ..scene.single import Scene
from .base import ENGINES, Engine, EngineError, Setting
from .calibration import WITHIN, EngineFit, fit_engine
from .run import in_engine, net_of

CELLS = (2, 3, 4, 6, 8, 12, 16)
"""Cells across the smaller side of a body, of the meshes that are tried."""

BUDGET_MESHES = ("structured", "right")
"""Mesh types of a beam that are tried where none are named."""

SHARES = (0.25, 0.5, 1.0)
"""Shares of the budget that settings are sought for, so that the table has cheaper ones, too."""

MOST_ITERATIONS, MOST_SUBSTEPS = 400, 256
"""Limits of a setting."""

PROBED = 16
"""Iterations of the second setting that is timed."""

WORSE = 2
"""Settings or meshes in a row that are worse than the best one before a search ends."""

Cost = Callable[[SpringNet, Setting], float]
"""Seconds of a frame of a net at a setting."""


@dataclass(frozen=True, repr=False)
class BudgetChoice(Tabled):
    """A mesh, definition and setting, with what is typed there.

    Attributes
    ----------
    mesh : str
        Name of the mesh.
    fit : EngineFit
        Scene, setting, factor and bands.
    frame_seconds : float
        Of a frame, by the cost that the search counts with [s].

    Examples
    --------
    >>> import springtune as st
    >>> beam, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    >>> meshes = {"fine": st.make_mesh(beam, "right", "20 mm")}
    >>> search = st.fit_budget(beam, rubber, "traction", "0.2 N", engine="xpbd", budget="1 ms", meshes=meshes,
    ...                        cost=lambda net, setting: 2e-7 * setting.substeps * (20 + setting.iterations * 40))
    >>> best = search.best
    >>> print(best.mesh, best.fit.scene.definition.name, best.fit.result.setting)
    >>> print(f"{1e3 * best.frame_seconds:.2f} ms, {100 * best.worst:.1f} % at worst")
    """

    mesh: str
    fit: EngineFit
    frame_seconds: float

    @property
    def worst(self) -> float:
        """Largest size of an error under the loads, with the factor [1]; without one that of the first load."""
        if not self.fit.bands:
            return abs(self.fit.error) if np.isfinite(self.fit.error) else np.inf
        errors = [abs(band.error) for band in self.fit.bands]
        return float(np.nan_to_num(max(errors, key=lambda one: np.nan_to_num(one, nan=np.inf)), nan=np.inf))

    def _rows(self) -> Iterator[tuple[str, str]]:
        setting = self.fit.result.setting
        yield "a frame", f"{1e3 * self.frame_seconds:.3g} ms"
        yield "at worst", error_text(self.worst).lstrip("+") if self.worst < np.inf else "no rest"
        yield "mesh", self.mesh
        yield "particles", str(len(self.fit.scene.mesh.points))
        yield "definition", self.fit.scene.definition.name
        yield "substeps", str(setting.substeps)
        yield "iterations", str(setting.iterations)
        yield "factor", f"{self.fit.factor:.4g}" if self.fit.factor == self.fit.factor else "none"
        for band in self.fit.bands:
            yield band.load, error_text(band.error) if band.error == band.error else "no rest"


@dataclass(frozen=True, repr=False)
class BudgetSearch(Tabled):
    """What a search within a frame's time found.

    Attributes
    ----------
    engine : str
    budget : float
        Time of a frame [s].
    tried : TabledList of BudgetChoice
        All that were calibrated, the cheapest first.

    Examples
    --------
    >>> import springtune as st
    >>> beam, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    >>> meshes = {name: st.make_mesh(beam, "right", name) for name in ("40 mm", "20 mm")}
    >>> search = st.fit_budget(beam, rubber, "traction", "0.2 N", engine="xpbd", budget="1 ms", meshes=meshes,
    ...                        cost=lambda net, setting: 1e-7 * setting.substeps * setting.iterations * len(net.springs))
    >>> print(search.best.mesh, len(search.tried), [one.mesh for one in search.unbeaten])
    """

    engine: str
    budget: float
    tried: TabledList[BudgetChoice] = field(repr=False)

    @property
    def unbeaten(self) -> TabledList[BudgetChoice]:
        """Those that no other one beats in both error and time."""
        worst = np.array([one.worst for one in self.tried])
        kept = unbeaten(worst, np.array([one.frame_seconds for one in self.tried]))
        return TabledList(one for one, there in zip(self.tried, kept) if there)

    @property
    def best(self) -> BudgetChoice | None:
        """The least error at worst, then the cheapest; None where nothing has a factor within the budget."""
        usable = [one for one in self.tried if one.fit.factor == one.fit.factor and one.worst < np.inf]
        return min(usable, key=lambda one: (one.worst, one.frame_seconds), default=None)

    def _rows(self) -> Iterator[tuple[str, str]]:
        yield "engine", self.engine
        yield "budget", number_text(self.budget, "s")
        yield "tried", str(len(self.tried))
        for label, text in self.best._rows() if self.best else ():
            yield label, text


def fit_budget(
    beam: Beam | Shape,
    material: AnyMaterial | Mapping[str, AnyMaterial],
    load: str,
    force: float | str | None = None,
    *,
    engine: str,
    budget: float | str,
    scale: float = 1.0,
    dt: float | str = "1/60",
    precision: str = "",
    loads: Iterable[str] | None = None,
    mesh_types: Sequence[str] = BUDGET_MESHES,
    meshes: Mapping[str, Mesh | GroupedMesh] | None = None,
    within: float = WITHIN,
    cost: Cost | None = None,
) -> BudgetSearch:
    """Find the mesh, definition, substeps and iterations that are least off within a frame's time.

    Parameters
    ----------
    beam : Beam or Shape
    material : Material, AnisotropicMaterial or mapping of str to those
        With a density.
    load : str
        To calibrate on.
    force : float or str, optional
        Size of the force on a beam [N].
    engine : str
        Key of `springtune.ENGINES`.
    budget : float or str
        Time of a frame on this machine [s], or a text such as ``"2 ms"``.
    scale : float, optional
        Factor on the load case of a shape [1].
    dt : float or str, optional
        Time that a frame advances [s].
    precision : str, optional
        As of `Setting`.
    loads : iterable of str, optional
        Loads whose errors count; by default traction, bending and shear of a beam, and of a shape `load` alone.
    mesh_types : sequence of str, optional
        Keys of `springtune.MESH_TYPES`, for a beam.
    meshes : mapping of str to Mesh or GroupedMesh, optional
        Meshes by name, from coarse to fine, in the place of those with 2 to 16 cells across.
    within : float, optional
        Error that bands keep [1].
    cost : callable, optional
        (net, setting) -> seconds of a frame; by default measured by short runs.

    Returns
    -------
    BudgetSearch

    Raises
    ------
    KeyError
        If no engine has the name.
    EngineError
        If the engine is not installed, or has none of the definitions.
    ValueError
        If an argument is wrong or unknown.

    Notes
    -----
    The error of a choice is the largest one of the loads with the factor that makes `load` right. On each mesh, coarse
    ones first, the two definitions count that are best at equilibrium and that the engine has. For a quarter, a half
    and all of the budget each number of substeps gets as many iterations as there is time for. One run without a factor
    shows which of these converges best, and that one is calibrated. Finer meshes are left out after two that are worse.

    Examples
    --------
    >>> import springtune as st
    >>> beam, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    >>> meshes = {name: st.make_mesh(beam, "right", name) for name in ("40 mm", "20 mm")}
    >>> search = st.fit_budget(beam, rubber, "traction", "0.2 N", engine="xpbd", budget="1 ms", meshes=meshes,
    ...                        cost=lambda net, setting: 1e-7 * setting.substeps * setting.iterations * len(net.springs))
    >>> print(search.unbeaten)
    """
    chosen = ENGINES[engine]
    limit = positive(budget, "time", "budget")
    start = Setting(dt, precision=precision)
    chosen.check(start)
    if isinstance(beam, Shape):
        names: tuple[str, ...] = tuple(loads or (load,))
        families = [meshes or _shape_meshes(beam)]
    else:
        names = check_loads(CASES if loads is None else loads)
        check_names("mesh types", mesh_types, MESH_TYPES, BUDGET_MESHES, "is unknown")
        families = [meshes] if meshes else [_beam_meshes(beam, name) for name in mesh_types]
    make = partial(Scene, beam, material=material, load=load, force=force, scale=scale)
    tried: list[BudgetChoice] = []
    refused = ""
    for family in families:
        least, worse = np.inf, 0
        for name, mesh in family.items():
            found: list[BudgetChoice] = []
            for scene in _scenes(make, mesh, beam, material, load, names):
                try:
                    net = net_of(scene)
                    chosen.start(net, start, 1.0)
                except EngineError as error:
                    refused = str(error)
                    continue
                timed = cost or _measured(chosen, net, start)
                fits = _fits(scene, engine, net, [share * limit for share in SHARES], start, timed, names, within)
                found += [BudgetChoice(name, fit, timed(net, fit.result.setting)) for fit in fits]
            tried += found
            best = min((one.worst for one in found), default=np.inf)
            worse = 0 if best < least else worse + 1
            least = min(least, best)
            if worse == WORSE:
                break
    if not tried and refused:
        raise EngineError(refused)
    if not tried:
        raise EngineError(
            f"budget: {budget!r} is less than a frame of the coarsest mesh takes in engine '{engine}'; give more"
        )
    return BudgetSearch(engine, limit, TabledList(sorted(tried, key=lambda one: (one.frame_seconds, one.worst))))


def _beam_meshes(beam: Beam, name: str) -> Mapping[str, Mesh]:
    """Meshes of a type, from coarse to fine."""
    side, found = min(beam.length, beam.height), {}
    for cells in CELLS:
        size = side / cells
        if not MESH_TYPES[name].refusal(beam.length, beam.height, size, beam.name):
            found[f"{name} {number_text(size, 'm')}"] = MESH_TYPES[name](beam.length, beam.height, size)
    return found


def _shape_meshes(shape: Shape) -> Mapping[str, GroupedMesh]:
    """Meshes of an outline, from coarse to fine; sizes that leave details out are left out."""
    side, found = float(np.ptp(shape.extent, axis=0).min()), {}
    for cells in CELLS:
        try:
            found[f"free {number_text(side / cells, 'm')}"] = mesh_shape(shape, side / cells)
        except MeshError:
            continue
    return found


def _scenes(
    make: Callable[..., Scene],
    mesh: Mesh | GroupedMesh,
    beam: Beam | Shape,
    material: AnyMaterial | Mapping[str, AnyMaterial],
    load: str,
    names: Sequence[str],
) -> Iterator[Scene]:
    """Scenes of the definitions that are worth a choice, the best at equilibrium first."""
    about: dict[str, Any] = {"load": load} if isinstance(beam, Shape) else {"loads": names}
    for choice in predict(beam, mesh, material, **about):
        if choice.worst < np.inf:
            yield make(mesh=mesh, definition=choice.definition)


def _fits(
    scene: Scene,
    engine: str,
    net: SpringNet,
    limits: Sequence[float],
    start: Setting,
    cost: Cost,
    names: Sequence[str],
    within: float,
) -> Iterator[EngineFit]:
    """Calibrate the best split of each limit into substeps and iterations."""
    damping = 2 * scene.motion().loaded_frequency
    known: dict[Setting, EngineFit] = {}
    for limit in limits:
        best: Setting | None = None
        least, worse, substeps = np.inf, 0, MOST_SUBSTEPS
        while substeps >= 1 and worse < WORSE:
            setting = _filled(replace(start, substeps=substeps), partial(cost, net), limit, ENGINES[engine].iterates)
            substeps //= 2
            if setting is None:
                continue
            error = abs(in_engine(scene, engine, setting, damping=damping, tolerance=1e-3).solver_error)
            worse = 0 if error < least else worse + 1
            if error < least:
                best, least = setting, error
        if best is not None and best not in known:
            known[best] = fit_engine(scene, engine, best, loads=names, within=within, needed=False)
            yield known[best]


def _filled(setting: Setting, cost: Callable[[Setting], float], limit: float, iterates: bool) -> Setting | None:
    """Setting with as many iterations as there is time for; None where there is not enough for one."""
    most = MOST_ITERATIONS if iterates else 1
    count = bisect_right(range(1, most + 1), limit, key=lambda number: cost(replace(setting, iterations=number)))
    return replace(setting, iterations=count) if count else None


def _measured(engine: Engine, net: SpringNet, start: Setting) -> Cost:
    """Cost of a net by two short runs: proportional to substeps, and linear in iterations."""

    def seconds(iterations: int) -> float:
        session = engine.start(net, replace(start, substeps=4, iterations=iterations), 1.0)
        session.advance(1)  # may compile
        times = []
        for _ in range(5):
            begin = time.perf_counter()
            session.advance(2)
            times.append((time.perf_counter() - begin) / 8)
        return min(times)

    one, more = seconds(1), seconds(PROBED)
    each = max((more - one) / (PROBED - 1), 0.0)
    return lambda _, setting: setting.substeps * (one + each * (setting.iterations - 1))

"""Search for the mesh, definition, substeps and iterations that are least off within a frame's time."""

import time
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from ..handover.net import SpringNet
from ..mesh import MESH_TYPES, Mesh
from ..mesh.groups import GroupedMesh
from ..mesh.outlines import mesh_shape
from ..prediction.choices import CASES, Choice, check_loads, check_names, predict
from ..problem.compare import error_text, unbeaten
from ..problem.geometry import Beam
from ..problem.materials import AnyMaterial
from ..problem.quantities import positive
from ..problem.shapes import Shape
from ..safe_io.tables import Tabled, TabledList, number_text
from ..scene.single import Scene
from .base import ENGINES, Engine, EngineAbsentError, EngineError, Setting
from .calibration import WITHIN, EngineFit, fit_engine
from .run import in_engine, net_of

CELLS_ACROSS = (1, 2, 3, 4, 6, 8, 12, 16)
"""Cells across the smaller side of a body, of the meshes that are tried."""

BUDGET_MESHES = ("structured", "right")
"""Mesh types of a beam that are tried where none are named."""

BEST_DEFINITIONS = 2
"""Definitions on a mesh that are tried."""

SHARES = (0.25, 0.5, 1.0)
"""Shares of the budget that settings are sought for, so that the table has cheaper ones, too."""

ITERATIONS_AT_MOST, SUBSTEPS_AT_MOST = 400, 256
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
    ...                        loads=["traction", "shear"],
    ...                        cost=lambda net, setting: 1e-5 * setting.substeps * setting.iterations)
    >>> best = search.best
    >>> print(best.mesh, best.fit.scene.definition.name, best.fit.result.setting)
    fine delingette dt 1/60 s, 32 substeps, 3 iterations, float64
    >>> print(f"{1e3 * best.frame_seconds:.2f} ms, {100 * best.worst:.1f} % at worst")
    0.96 ms, 6.6 % at worst
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
    >>> search = st.fit_budget(beam, rubber, "traction", "0.2 N", engine="xpbd", budget="1 ms",
    ...                        meshes={"coarse": st.make_mesh(beam, "right", "40 mm")}, loads=["traction"],
    ...                        cost=lambda net, setting: 1e-5 * setting.substeps * setting.iterations)
    >>> print(search.best.mesh, len(search.tried), len(search.unbeaten))
    coarse 6 2
    """

    engine: str
    budget: float
    tried: TabledList[BudgetChoice] = field(repr=False)

    @property
    def unbeaten(self) -> TabledList[BudgetChoice]:
        """Those with a factor that no other one beats in both error and time."""
        worst = np.array([one.worst if one.fit.factor == one.fit.factor else np.nan for one in self.tried])
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
        yield from self.best._rows() if self.best else ()


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
    springs_alone: bool = False,
    within: float | str = WITHIN,
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
        Meshes by name, from coarse to fine, in the place of those with 1 to 16 cells across.
    springs_alone : bool, optional
        Whether definitions with energies besides springs are left out.
    within : float or str, optional
        Error that bands keep, a fraction or a text such as ``"5 %"``.
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
    >>> def cost(net, setting):
    ...     return 1e-7 * setting.substeps * setting.iterations * len(net.springs)
    >>> search = st.fit_budget(beam, rubber, "traction", "0.2 N", engine="xpbd", budget="1 ms", meshes=meshes,
    ...                        loads=["traction", "shear"], cost=cost)
    >>> print(search.unbeaten)
     a frame   at worst  mesh   particles  definition  substeps  iterations  factor  traction  shear
     0.202 ms  5.92 %    40 mm  12         delingette  32        3           0.9852  +0.07 %   -5.92 %
     0.403 ms  5.86 %    40 mm  12         delingette  64        3           0.9843  +0.07 %   -5.86 %
     0.922 ms  4.45 %    20 mm  33         delingette  32        4           0.9986  +0.00 %   -4.45 %
    """
    chosen = ENGINES[engine]
    limit = positive(budget, "time", "budget")
    start = Setting(dt, precision=precision)
    chosen.check(start)
    if isinstance(beam, Shape):
        names: tuple[str, ...] = tuple(loads or (load,))
        families = [meshes or shape_meshes(beam, partial(mesh_shape, beam))]
    else:
        names = check_loads(CASES if loads is None else loads)
        check_names("mesh types", mesh_types, MESH_TYPES, BUDGET_MESHES, "is unknown")
        families = [meshes] if meshes else [_beam_meshes(beam, name) for name in mesh_types]
    about: dict[str, Any] = {"load": load} if isinstance(beam, Shape) else {"loads": names}
    tried: list[BudgetChoice] = []
    refused, taken = "", False
    for family in families:
        least, worse = np.inf, 0
        for name, mesh in family.items():
            make = partial(Scene, beam, mesh, material, load, force, scale=scale)
            choices = [one for one in predict(beam, mesh, material, **about) if not (springs_alone and one.energies)]
            scenes, refused = runnable(make, choices, chosen, start, BEST_DEFINITIONS)
            taken = taken or bool(scenes)
            found: list[BudgetChoice] = []
            for scene in scenes:
                net = net_of(scene)
                timed = cost or _measured(chosen, net, start)
                fits = _fits(scene, engine, net, [share * limit for share in SHARES], start, timed, names, within)
                found += [BudgetChoice(name, fit, timed(net, fit.result.setting)) for fit in fits]
            tried += found
            best = min((one.worst for one in found), default=np.inf)
            worse = 0 if best < least else worse + 1
            least = min(least, best)
            if worse == WORSE:
                break
    if not taken:
        raise EngineError(refused or "no definition has a stable network on these meshes; give others")
    if not tried:
        raise EngineError(
            f"budget: {budget!r} is less than a frame of the coarsest mesh takes in engine '{engine}'; give more"
        )
    return BudgetSearch(engine, limit, TabledList(sorted(tried, key=lambda one: (one.frame_seconds, one.worst))))


def _beam_meshes(beam: Beam, name: str) -> Mapping[str, Mesh]:
    """Meshes of a type, from coarse to fine."""
    side, found = min(beam.length, beam.height), {}
    for cells in CELLS_ACROSS:
        size = side / cells
        if not MESH_TYPES[name].refusal(beam.length, beam.height, size, beam.name):
            found[f"{name} {number_text(size, 'm')}"] = MESH_TYPES[name](beam.length, beam.height, size)
    return found


def shape_meshes(shape: Shape, make: Callable[[float], GroupedMesh]) -> Mapping[str, GroupedMesh]:
    """Meshes of an outline, from coarse to fine; sizes at which it cannot be meshed are left out."""
    side, found = float(np.ptp(shape.extent, axis=0).min()), {}
    for cells in CELLS_ACROSS:
        with suppress(ValueError):
            found[f"free {number_text(side / cells, 'm')}"] = make(side / cells)
    return found


def runnable(
    make: Callable[..., Scene], choices: Iterable[Choice], engine: Engine, setting: Setting, most: int
) -> tuple[list[Scene], str]:
    """Scenes of the best definitions that an engine takes, at most some; and why it refuses the last other one."""
    found: list[Scene] = []
    refused = ""
    for choice in choices:
        if len(found) == most or not choice.worst < np.inf:
            break
        scene = make(definition=choice.definition)
        try:
            engine.start(net_of(scene), setting, 1.0)
        except EngineAbsentError:
            raise
        except EngineError as error:
            refused = str(error)
        else:
            found.append(scene)
    return found, refused


def _fits(
    scene: Scene,
    engine: str,
    net: SpringNet,
    limits: Sequence[float],
    start: Setting,
    cost: Cost,
    names: Sequence[str],
    within: float | str,
) -> Iterator[EngineFit]:
    """Calibrate the best split of each limit into substeps and iterations."""
    damping = 2 * scene.motion().loaded_frequency
    known: dict[Setting, EngineFit] = {}
    for limit in limits:
        best: Setting | None = None
        least, worse, substeps = np.inf, 0, SUBSTEPS_AT_MOST
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
    most = ITERATIONS_AT_MOST if iterates else 1
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

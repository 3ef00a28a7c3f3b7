"""Search for the mesh, definition, substeps and iterations that are least off within a frame's time."""

import timeit
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from operator import itemgetter
from typing import Any, TypeVar

import numpy as np

from ..handover.net import SpringNet
from ..mesh.cells import Mesh
from ..mesh.groups import GroupedMesh
from ..mesh.outlines import mesh_shape
from ..mesh.types import MESH_TYPES
from ..prediction.choices import CASES, check_loads, check_names, trial
from ..problem.compare import error_text
from ..problem.geometry import Beam
from ..problem.materials import AnyMaterial
from ..problem.quantities import positive
from ..problem.shapes import Shape
from ..safe_io.tables import Tabled, TabledList, number_text
from ..scene.meshes import make_mesh
from ..scene.single import Scene
from .base import ENGINES, Engine, EngineError, Setting
from .calibration import WITHIN, EngineFit, fit_engine
from .run import DRIFT, drift, in_engine, net_of

CELLS_ACROSS = (4, 6, 8, 12, 16)
"""Cells across the smaller side of a body, of the meshes that are tried: fewer are too stiff in bending."""

ALIKE_ERRORS = 1e-3
"""Difference of errors up to which the choice with the factor nearer to 1 is taken."""

BUDGET_MESHES = ("structured", "right")
"""Mesh types of a beam that are tried where none are named."""

ITERATIONS_AT_MOST, SUBSTEPS = 400, tuple(2**power for power in range(8, -1, -1))
"""Limit of a setting's iterations, and its substeps that are tried."""

PROBED = 16
"""Iterations of the second setting that is timed."""

One = TypeVar("One")

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
    >>> meshes = {"coarse": st.make_mesh(beam, "structured", "40 mm")}
    >>> search = st.fit_budget(beam, rubber, "traction", "0.2 N", engine="xpbd", budget="1 ms", meshes=meshes,
    ...                        loads=["traction", "shear"],
    ...                        cost=lambda net, setting: 1e-5 * setting.substeps * setting.iterations)
    >>> best = search.best
    >>> print(best.mesh, best.fit.scene.definition.name, best.fit.result.setting)
    coarse delingette dt 1/60 s, 32 substeps, 3 iterations, float64
    >>> print(f"{1e3 * best.frame_seconds:.2f} ms, {100 * best.worst:.1f} % at worst")
    0.96 ms, 6.4 % at worst
    """

    mesh: str
    fit: EngineFit
    frame_seconds: float

    @property
    def worst(self) -> float:
        """Largest size of an error under the loads, with the factor [1]; without one that of the first load."""
        errors = [one.error for one in self.fit.bands] or [self.fit.error]
        return float(np.nan_to_num(np.abs(errors).max(), nan=np.inf))

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


class BudgetSearch(TabledList[BudgetChoice]):
    """What a search within a frame's time found: the least error at worst first, then the cheapest.

    Of those within .1 % of the least, the one whose factor is nearest to 1 is the first.

    Parameters
    ----------
    iterable : iterable of BudgetChoice

    Examples
    --------
    >>> import springtune as st
    >>> beam, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    >>> search = st.fit_budget(beam, rubber, "traction", "0.2 N", engine="xpbd", budget="1 ms",
    ...                        meshes={"coarse": st.make_mesh(beam, "structured", "40 mm")}, loads=["traction"],
    ...                        cost=lambda net, setting: 1e-5 * setting.substeps * setting.iterations)
    >>> print(search.best.mesh, len(search))
    coarse 2
    """

    @property
    def best(self) -> BudgetChoice | None:
        """The first one; None where nothing has a factor within the budget."""
        return next((one for one in self[:1] if one.fit.bands and one.worst < np.inf), None)


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
        Meshes by name, from coarse to fine, in the place of those with 4 to 16 cells across.
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
    ones first, the two definitions count that are best at equilibrium and that the engine has. Each number of substeps
    gets as many iterations as there is time for. One run without a factor shows which of these converges best, and that
    one is calibrated. Finer meshes are left out after two that are worse.

    Examples
    --------
    >>> import springtune as st
    >>> beam, rubber = st.Beam("200 mm", "40 mm"), st.Material("1 MPa", 0.3, density="1000 kg/m^3")
    >>> meshes = {name: st.make_mesh(beam, "structured", name) for name in ("40 mm", "20 mm")}
    >>> def cost(net, setting):
    ...     return 1e-7 * setting.substeps * setting.iterations * len(net.springs)
    >>> search = st.fit_budget(beam, rubber, "traction", "0.2 N", engine="xpbd", budget="0.2 ms", meshes=meshes,
    ...                        loads=["traction", "shear"], cost=cost)
    >>> print(search)
     a frame   at worst  mesh   particles  definition  substeps  iterations  factor  traction  shear
     0.184 ms  6.89 %    40 mm  13         delingette  16        5           0.9865  +0.05 %   -6.89 %
     0.184 ms  16.5 %    40 mm  13         van-gelder  16        5           1.008   -0.04 %   +16.5 %
     0.12 ms   192 %     20 mm  34         delingette  16        1           none
     0.12 ms   278 %     20 mm  34         patch-fit   16        1           none
    """
    chosen = ENGINES[engine]
    limit = positive(budget, "time", "budget")
    start = Setting(dt, precision=precision)
    chosen.check(start)
    if isinstance(beam, Shape):
        names: tuple[str, ...] = tuple(loads or (load,))
        made: list[Any] = [] if meshes else [graded_meshes(beam, "free", partial(mesh_shape, beam))]
    else:
        names = check_loads(CASES if loads is None else loads)
        check_names("mesh types", mesh_types, MESH_TYPES, BUDGET_MESHES, "is unknown")
        made = [] if meshes else [graded_meshes(beam, one, partial(make_mesh, beam, one)) for one in mesh_types]
    why = ""

    def on_mesh(named: tuple[str, Mesh | GroupedMesh]) -> list[BudgetChoice]:
        """Choices of the best definitions on a mesh."""
        nonlocal why
        make = partial(Scene, beam, named[1], material, load, force, scale=scale)
        scenes, refused, _ = runnable(make, names, chosen, start, springs_alone, most=2)
        why = why or refused
        found = []
        for scene in scenes:
            net = net_of(scene)
            seconds = partial(cost or _measured(chosen, net, start), net)
            if setting := _split(scene, chosen, start, seconds, limit):
                fit = fit_engine(scene, engine, setting, loads=names, within=within, needed=False)
                found.append(BudgetChoice(named[0], fit, seconds(setting)))
            else:
                why = f"budget: {budget!r} is less than a frame of the coarsest mesh takes in '{engine}'; give more"
        return found

    tried: list[BudgetChoice] = []
    for family in [meshes] if meshes else made:
        off = _until_worse(map(on_mesh, family.items()), lambda own: min((one.worst for one in own), default=np.inf))
        tried += [one for _, found in off for one in found]
    if not tried:
        raise EngineError(why or "no mesh can be made; give others")
    tried.sort(key=lambda one: (not one.fit.bands, one.worst, one.frame_seconds))
    alike = [one for one in tried if one.fit.bands and one.worst <= tried[0].worst + ALIKE_ERRORS]
    if alike:
        nearest = min(alike, key=lambda one: abs(np.log(one.fit.factor)))
        tried.remove(nearest)
        tried.insert(0, nearest)
    return BudgetSearch(tried)


def _until_worse(those: Iterable[One], error: Callable[[One], float]) -> Iterator[tuple[float, One]]:
    """Errors and what has them, up to two in a row that are worse than the best one before."""
    best, worse = np.inf, 0
    for one in those:
        off = float(np.nan_to_num(error(one), nan=np.inf))
        yield off, one
        best, worse = (off, 0) if off < best else (best, worse + 1)
        if worse == 2:
            return


def graded_meshes(body: Beam | Shape, name: str, make: Callable[[float], One]) -> dict[str, One]:
    """Meshes by name, from coarse to fine; sizes at which there is none are left out."""
    found = {}
    side = min(np.ptp(body.extent, axis=0)) if isinstance(body, Shape) else min(body.length, body.height)
    for cells in CELLS_ACROSS:
        with suppress(ValueError):
            found[f"{name} {number_text(side / cells, 'm')}"] = make(side / cells)
    return found


def runnable(
    make: "partial[Scene]", loads: Iterable[str], engine: Engine, setting: Setting, springs_alone: bool, most: int = 1
) -> tuple[list[Scene], str, tuple[str, ...]]:
    """Scenes of the best definitions that an engine takes, at most some; why there is no other one; what was tried."""
    body, mesh, material, load, *_ = make.args
    about: dict[str, Any] = {"load": load} if isinstance(body, Shape) else {"loads": loads}
    tried, taken, refused = trial(body, mesh, material, **about), dict[str, Scene](), dict[str, str]()
    while True:
        able = [one for one in tried.choices(refused) if one.worst < np.inf and not (springs_alone and one.energies)]
        # Of several with one stiffness matrix, and so the same errors, the first.
        names = [*{round(one.worst, 9): one.definition for one in reversed(able)}.values()][: -most - 1 : -1]
        for name in [name for name in names if name not in taken]:
            taken[name] = make(definition=name)
            try:
                if abs(aside := drift(taken[name], taken[name].solve().displacements)) > DRIFT:
                    raise EngineError(
                        f"definition '{name}' moves across by {error_text(aside)}; take a finer mesh, or another "
                        "type such as 'structured'"
                    )
                engine.start(net_of(taken[name]), setting, 1.0)
            except EngineError as error:
                refused[name] = str(error)
        if not set(names) & set(refused):
            why = next(reversed(refused.values()), "no definition has a stable network on this mesh; take another mesh")
            return [taken[name] for name in names], why, tried.tried


def _split(
    scene: Scene, engine: Engine, start: Setting, seconds: Callable[[Setting], float], limit: float
) -> Setting | None:
    """Best split of a time into substeps, with as many iterations as it has time for; None if it is too short."""
    settings = []
    iterations = range(1, (ITERATIONS_AT_MOST if engine.iterates else 1) + 1)
    for substeps in SUBSTEPS:
        setting = replace(start, substeps=substeps)
        if count := bisect_right(iterations, limit, key=lambda number: seconds(replace(setting, iterations=number))):
            settings.append(replace(setting, iterations=count))
    off = _until_worse(settings, lambda one: abs(in_engine(scene, engine.name, one, tolerance=1e-3).solver_error))
    return min(off, key=itemgetter(0))[1] if settings else None


def _measured(engine: Engine, net: SpringNet, start: Setting) -> Cost:
    """Cost of a net by two short runs: proportional to substeps, and linear in iterations."""

    def seconds(iterations: int) -> float:
        session = engine.start(net, replace(start, substeps=4, iterations=iterations), 1.0)
        session.advance(1)  # may compile
        return min(timeit.repeat(lambda: session.advance(2), repeat=5, number=1)) / 8

    one, more = seconds(1), seconds(PROBED)
    each = max((more - one) / (PROBED - 1), 0.0)
    return lambda _, setting: setting.substeps * (one + each * (setting.iterations - 1))

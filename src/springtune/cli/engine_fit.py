"""`springtune predict --engine`: what to type into an engine at its setting, or within a frame's time."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, fields, replace
from functools import partial, reduce, wraps
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from .. import __version__
from ..problem.compare import error_text
from ..safe_io.tables import aligned, number_text
from .options import AnyCommand, SheetOptions, Unmet, asked_quantity, names_from
from .recommendation import json_text

if TYPE_CHECKING:
    from ..engines.base import Setting
    from ..engines.budget import BudgetSearch
    from ..engines.calibration import EngineFit
    from ..handover.net import SpringNet
    from ..mesh import Mesh
    from ..mesh.groups import GroupedMesh
    from ..problem.geometry import Beam
    from ..problem.shapes import Shape
    from ..scene.single import Scene

FOUND = ("substeps", "iterations", "size", "definition")
"""Options of what a budget finds."""


@dataclass(frozen=True)
class EngineOptions:
    """Options of `predict` that are of engines."""

    engine: str | None
    dt: str | None
    substeps: int | None
    iterations: int | None
    precision: str | None
    force: str | None
    scale: float | None
    definition: str | None
    within: str | None
    budget: str | None

    def check(self, sheet: SheetOptions, error: str | None) -> None:
        """Refuse options that are not for each other."""
        for one in fields(self):
            value = getattr(self, one.name)
            if self.engine is None and value is not None:
                raise ValueError(f"--{one.name}: '{value}' is of engines; give --engine, such as xpbd, or leave it out")
        if error is not None and self.engine is not None:
            raise ValueError(
                f"--error: '{error}' is of equilibria, and --engine {self.engine} of settings; give --budget such as "
                "'2 ms', or leave one of them out"
            )
        for name in FOUND if self.budget is not None else ():
            value = getattr(sheet if name == "size" else self, name)
            if value is not None:
                raise ValueError(f"--{name}: '{value}' is what --budget finds; leave one of them out")

    def setting(self) -> "Setting":
        """Setting of the options."""
        from ..engines.base import ENGINES, Setting

        if self.engine not in ENGINES:
            from ..problem.quantities import nearest

            raise ValueError(f"--engine: '{self.engine}' is unknown; {nearest(str(self.engine), ENGINES)}")
        given = {name: getattr(self, name) for name in ("dt", "substeps", "iterations", "precision")}
        setting = Setting(**{name: value for name, value in given.items() if value is not None})
        ENGINES[str(self.engine)].check(setting)
        return setting


def engine_options(command: AnyCommand) -> AnyCommand:
    """Decorator that adds these options to a command, which gets them as `EngineOptions`."""
    each = (
        click.option(
            "--engine",
            shell_complete=names_from("engines.base:ENGINES"),
            help="Calibrate to an engine, such as xpbd: what to type at its setting.",
        ),
        click.option("--dt", help="Time that a frame advances, such as 1/60 or '5 ms'.  [default: 1/60]"),
        click.option("--substeps", type=int, help="Steps of a frame.  [default: 1]"),
        click.option("--iterations", type=int, help="Iterations of the engine's solver in a step.  [default: 10]"),
        click.option("--precision", help="float64 or float32.  [default: the engine's own]"),
        click.option("--force", help="Size of the force of --load on a beam, such as '0.2 N'."),
        click.option("--scale", type=float, help="Factor on the load of a shape.  [default: 1]"),
        click.option(
            "--definition",
            shell_complete=names_from("springs:DEFINITIONS"),
            help="Rule for the stiffness.  [default: the best one that the engine has]",
        ),
        click.option("--within", help="Error for which ranges of loads are printed.  [default: 5 %]"),
        click.option(
            "--budget",
            help="Time of a frame on this machine, such as '2 ms': find the mesh, definition, substeps and iterations.",
        ),
    )

    @wraps(command)
    def call(*args: Any, **given: Any) -> None:
        engine = EngineOptions(**{one.name: given.pop(one.name) for one in fields(EngineOptions)})
        command(*args, engine=engine, **given)

    return reduce(lambda made, option: option(made), reversed(each), call)


class Case(NamedTuple):
    """What is calibrated: body, material and load, its size, and a mesh, or meshes for a search."""

    body: "Beam | Shape"
    material: Any
    load: str
    force: str | None
    scale: float
    mesh: "Mesh | GroupedMesh | Any"
    mesh_name: str
    further: dict[str, Any]


def _case(sheet: SheetOptions, asked: EngineOptions, load: str | None) -> Case:
    searched = asked.budget is not None
    scale = 1.0 if asked.scale is None else asked.scale
    if sheet.shape is not None:
        of = sheet.asked_shape(load, sized=not searched)
        further: dict[str, Any] = {}
        if searched and of.shape.file:
            further["meshes"] = {of.mesh_name: of.mesh()}
        elif searched:
            from ..engines.budget import shape_meshes

            further["meshes"] = shape_meshes(of.shape, lambda size: replace(of, size=size).mesh())
        mesh = None if searched else of.mesh()
        return Case(of.shape, of.materials, of.load, None, scale, mesh, "" if searched else of.mesh_name, further)
    beam, material = sheet.asked_beam()
    lacking = {"load": (load, "traction"), "force": (asked.force, "0.2 N"), "density": (sheet.density, "1000 kg/m^3")}
    for name, (value, example) in lacking.items():
        if value is None:
            raise ValueError(f"--{name}: missing; an engine is calibrated to a load and moves masses; give '{example}'")
    if searched:
        further = {} if sheet.mesh_type is None else {"mesh_types": sheet.mesh_type.split(",")}
        return Case(beam, material, str(load), asked.force, scale, None, "", further)
    edge = sheet.edge(beam)
    return Case(beam, material, str(load), asked.force, scale, sheet.mesh(beam, edge), sheet.mesh_name(edge), {})


def fitted(
    sheet: SheetOptions, asked: EngineOptions, load: str | None, loads: str | None, springs_alone: bool
) -> "tuple[Callable[[], str], Callable[[], str], Callable[[str], SpringNet]]":
    """Text, JSON and springs of a calibration, or of a search within a budget."""
    from ..engines.budget import fit_budget
    from ..engines.calibration import WITHIN, fit_engine

    setting, engine, within = asked.setting(), str(asked.engine), asked.within or WITHIN
    names = None if loads is None else [name.strip() for name in loads.split(",") if name.strip()]
    case = _case(sheet, asked, load)
    if asked.budget is None:
        fit = fit_engine(_scene(case, asked, setting, springs_alone), engine, setting, loads=names, within=within)
        return partial(fit_text, fit, case.mesh_name), lambda: json_text(fit_json(fit)), partial(_net, fit)
    search = fit_budget(
        *case[:4],
        scale=case.scale,
        engine=engine,
        budget=asked_quantity("--budget", asked.budget, "time"),
        dt=setting.dt,
        precision=setting.precision,
        loads=names,
        within=within,
        springs_alone=springs_alone,
        **case.further,
    )
    best = search.best.fit if search.best else None
    return partial(budget_text, search), lambda: json_text(budget_json(search)), partial(_net, best)


def _scene(case: Case, asked: EngineOptions, setting: "Setting", springs_alone: bool) -> "Scene":
    """Scene of the definition that is asked for, or of the best one that the engine takes."""
    from ..engines.base import ENGINES
    from ..engines.budget import runnable
    from ..prediction.choices import predict
    from ..scene.single import Scene

    make = partial(Scene, case.body, case.mesh, case.material, case.load, case.force, scale=case.scale)
    if asked.definition is not None:
        return make(definition=asked.definition)
    about: dict[str, Any] = {"load": case.load} if case.force is None else {}
    choices = predict(case.body, case.mesh, case.material, **about)
    kept = [one for one in choices if not (springs_alone and one.energies)]
    scenes, refused = runnable(make, kept, ENGINES[str(asked.engine)], setting, 1)
    if not scenes:
        raise Unmet(refused or "no definition has a stable network on this mesh; take another mesh")
    return scenes[0]


def _net(fit: "EngineFit | None", _: str) -> "SpringNet":
    if fit is None or fit.factor != fit.factor:
        raise Unmet(f"--write: there is no factor, so nothing is written: {fit.message if fit else 'see above'}")
    return fit.net()


def fit_text(fit: "EngineFit", mesh_name: str) -> str:
    """Text of a calibration."""
    found, about, name = fit.result, fit.scene.statement, fit.scene.definition.name
    lines = [
        f"{about.body}, {mesh_name}: {len(fit.scene.mesh.points)} particles, {len(fit.scene.mesh.edges)} springs; "
        f"{about.named_materials}; {about.label}; definition {name}",
        f"engine {found.engine}: {found.setting}",
        "",
    ]
    if fit.factor == fit.factor:
        rows = [("type", "value", "unit", "formula"), *fit.typed_rows()]
        lines += [f"{fit.factor:.5g} times the stiffness of the definition:", aligned(rows, left=2)]
    else:
        lines.append(f"There is no factor: {fit.message}.")
    lines += [
        "",
        f"displacement {number_text(found.displacement, 'm')}, by finite elements {number_text(found.reference, 'm')}: "
        f"error {error_text(fit.error)}; without a factor {error_text(fit.untuned.error)}",
        f"{found.status} after {found.frames} frames, each of {1e3 * found.frame_seconds:.3g} ms here",
    ]
    if fit.bands:
        lines += ["", "errors at shares of a load:", aligned(fit.bands.table(), left=2), "", *_meaning(fit)]
    if fit.needed:
        what = "settings whose solver error is below 1 % without a factor, or that have a factor"
        lines += ["", f"under {fit.scene.load}: {what}:", aligned(fit.needed.table(), left=2)]
    return "\n".join(lines)


def _meaning(fit: "EngineFit") -> list[str]:
    """What the table of loads means, and what a factor does not mend."""
    first, *others = fit.bands
    lines = [
        f"x 1 of {first.load} is the load that was calibrated on"
        + ("; of the others, what moves finite elements as far." if others and first.unit else "."),
        "converged: the error of a converged setting without a factor, at x 1.",
        f"within {100 * first.within:g} %: sizes of the load over which the error stays within it.",
    ]
    off = [one.load for one in others if abs(one.error - one.definition_error) > one.within / 2]
    if off:
        lines.append(
            f"The factor hides from {first.load} that the solver has not converged, not from {', '.join(off)}."
        )
    return [*lines, *([f"But {fit.message}."] if fit.message else [])]


def budget_text(search: "BudgetSearch") -> str:
    """Text of a search within a budget."""
    head = (
        f"engine {search.engine}, at most {1e3 * search.budget:.3g} ms a frame: {len(search.tried)} choices were tried"
    )
    if search.best is None:
        nearest = min(search.tried, key=lambda one: one.worst)
        least = error_text(nearest.worst).lstrip("+")
        return f"{head}\n\nNo stiffness makes any of them right; the nearest is off by {least}. Take a larger budget."
    table, chosen = aligned(search.unbeaten.table(), left=2), fit_text(search.best.fit, search.best.mesh)
    return (
        f"{head}\n\nnone is both cheaper and less off than one of these:\n{table}\n\n"
        f"chosen, the least error at worst:\n{chosen}"
    )


def fit_json(fit: "EngineFit") -> dict[str, Any]:
    """Content of a calibration in SI units."""
    found = fit.result
    keys = "value", "unit", "formula"
    typed = {name: dict(zip(keys, about, strict=True)) for name, *about in fit.typed_rows()}
    result = "engine", "displacement", "reference", "error", "status", "frame_seconds"
    about: dict[str, Any] = {"springtune": __version__, "body": fit.scene.statement.body, "load": fit.scene.load}
    about |= {"size": fit.scene.statement.size, "definition": fit.scene.definition.name}
    about |= {name: getattr(found, name) for name in result} | {"setting": asdict(found.setting)}
    about |= {"factor": fit.factor, "typed": typed, "error_without_factor": fit.untuned.error, "message": fit.message}
    about["loads"] = [asdict(one) | {"sizes": [*one.sizes], "errors": [*one.errors]} for one in fit.bands]
    return about | {"needed": [asdict(one) for one in fit.needed]}


def budget_json(search: "BudgetSearch") -> dict[str, Any]:
    """Content of a search within a budget in SI units; `unbeaten` are numbers of `tried`."""
    tried = [
        {"mesh": one.mesh, "frame_seconds": one.frame_seconds, "worst": one.worst, "fit": fit_json(one.fit)}
        for one in search.tried
    ]
    return {
        "springtune": __version__,
        "engine": search.engine,
        "budget": search.budget,
        "chosen": search.tried.index(search.best) if search.best else None,
        "unbeaten": [search.tried.index(one) for one in search.unbeaten],
        "tried": tried,
    }

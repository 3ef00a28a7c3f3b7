"""`springtune predict --engine`: what to type into an engine at its setting, or within a frame's time."""

from functools import partial, reduce
from typing import TYPE_CHECKING, Any

import click

from ..problem.compare import error_text
from ..safe_io.tables import aligned
from .options import AnyCommand, SheetOptions, Unmet, asked_quantity

if TYPE_CHECKING:
    from ..engines.budget import BudgetSearch
    from ..engines.calibration import EngineFit
    from ..handover.net import SpringNet

ENGINE_OPTIONS: dict[str, dict[str, Any]] = {
    "engine": {"help": "Engine to calibrate to, such as xpbd."},
    "dt": {"help": "Time that a frame advances, such as 1/60 or '5 ms'.  [default: 1/60]"},
    "substeps": {"type": int, "help": "Steps of a frame.  [default: 1]"},
    "iterations": {"type": int, "help": "Iterations of the engine's solver in a step.  [default: 10]"},
    "precision": {"help": "float64 or float32.  [default: the engine's own]"},
    "force": {"help": "Size of the force of --load on a beam, such as '0.2 N'."},
    "scale": {"type": float, "help": "Factor on the load of a shape.  [default: 1]"},
    "definition": {"help": "Rule for stiffness.  [default: best]"},
    "within": {"help": "Error for which ranges of loads are printed.  [default: 5 %]"},
    "budget": {"help": "Time of a frame here, such as '2 ms': find the mesh, definition, substeps and iterations."},
}
"""Options of `predict` that are of engines, as click takes them."""

FOUND = ("substeps", "iterations", "size", "definition")
"""Options of what a budget finds."""


def engine_options(command: AnyCommand) -> AnyCommand:
    """Decorator that adds these options to a command."""
    return reduce(
        lambda made, name: click.option(f"--{name}", **ENGINE_OPTIONS[name])(made), reversed(ENGINE_OPTIONS), command
    )


def check_engine(options: dict[str, Any], sheet: SheetOptions, error: str | None, load: str | None) -> None:
    """Refuse options that are not for each other."""
    given = {name: value for name, value in options.items() if value is not None}
    if "engine" not in given:
        if load is not None and sheet.shape is None:
            raise ValueError(f"--load: '{load}' is of engines and shapes; give --engine or --shape, or leave it out")
        for name, value in given.items():
            raise ValueError(f"--{name}: '{value}' is of engines; give --engine, such as xpbd, or leave it out")
    elif error is not None:
        raise ValueError(f"--error: '{error}' is of equilibria; give --budget such as '2 ms', or no --engine")
    for name in FOUND if "budget" in given else ():
        if (value := options.get(name, sheet.size)) is not None:
            raise ValueError(f"--{name}: '{value}' is what --budget finds; leave one of them out")


def fitted(
    sheet: SheetOptions, options: dict[str, Any], load: str | None, loads: list[str] | None, springs_alone: bool
) -> "tuple[str, EngineFit | None]":
    """Text of a calibration, or of a search within a budget, and what is found."""
    from ..engines.base import ENGINES, Setting
    from ..engines.budget import fit_budget, graded_meshes, runnable
    from ..engines.calibration import WITHIN, fit_engine
    from ..prediction.choices import CASES
    from ..scene.sheet import chosen
    from ..scene.single import Scene

    engine, searched = chosen(ENGINES, options["engine"], "--engine"), options["budget"] is not None
    names = ("dt", "substeps", "iterations", "precision")
    setting = Setting(**{name: options[name] for name in names if options[name] is not None})
    engine.check(setting)
    how: dict[str, Any] = {"loads": loads, "within": options["within"] or WITHIN}
    scale = 1.0 if options["scale"] is None else options["scale"]
    asked = sheet.asked(load, sized=not searched)
    if asked.load is None:
        raise ValueError("--load: missing; an engine is calibrated to a load; give one such as 'traction'")
    case = asked.body, asked.material, asked.load, options["force"]
    if searched and asked.is_beam and sheet.mesh_type is not None:
        how["mesh_types"] = sheet.mesh_type.split(",")
    elif searched and not asked.is_beam:
        made = not asked.body.file
        how["meshes"] = (
            graded_meshes(asked.body, "free", partial(asked.make, "free")) if made else {asked.mesh_name: asked.mesh}
        )
    if searched:
        limit = asked_quantity("--budget", options["budget"], "time")
        how |= {"budget": limit, "dt": setting.dt, "precision": setting.precision, "scale": scale}
        search = fit_budget(*case, engine=engine.name, springs_alone=springs_alone, **how)
        return budget_text(search), search.best.fit if search.best else None
    body, *others = case
    make = partial(Scene, body, asked.mesh, *others, scale=scale)
    tried: tuple[str, ...] = ()
    if options["definition"] is not None:
        scenes, refused = [make(definition=options["definition"])], ""
    else:
        scenes, refused, tried = runnable(make, CASES, engine, setting, springs_alone)
    if not scenes:
        raise Unmet(refused)
    fit = fit_engine(scenes[0], engine.name, setting, **how)
    text = fit_text(fit, asked.mesh_name) + (f"\n\nTried: {', '.join(tried)}." if tried else "")
    return text, fit


def net_of_fit(fit: "EngineFit | None") -> "SpringNet":
    """Springs of a calibration."""
    if fit is None or fit.factor != fit.factor:
        raise Unmet(
            f"--write: there is no factor, so nothing is written: {fit.message if fit else 'take a larger budget'}"
        )
    return fit.net()


def fit_text(fit: "EngineFit", mesh_name: str) -> str:
    """Text of a calibration."""
    about, mesh = fit.scene.statement, fit.scene.mesh
    lines = [
        f"{about.body}, {mesh_name}: {len(mesh.points)} particles, {len(mesh.edges)} springs; "
        f"{about.named_materials}; {about.label}; definition {fit.scene.definition.name}",
        aligned(fit._table(), left=2),
    ]
    if fit.bands:
        converging = "" if len(fit.bands) == 1 else ": of others than the first, at what moves finite elements as far"
        lines += ["", f"errors at shares of a load{converging}:", aligned(fit.bands.table(), left=2)]
        off = [one.load for one in fit.bands[1:] if abs(one.error - one.definition_error) > one.within / 2]
        hides = f"The factor hides from {fit.scene.load} that the solver has not converged, not from {', '.join(off)}."
        lines += [hides] if off else []
    if fit.needed:
        lines += ["", f"under {fit.scene.load}, solver error below 1 % without a factor:"]
        lines.append(aligned(fit.needed.table(), left=2))
    return "\n".join(lines)


def budget_text(search: "BudgetSearch") -> str:
    """Text of a search within a budget."""
    if search.best is None:
        least = error_text(search[0].worst).lstrip("+")
        return f"No stiffness makes any of them right; the nearest is off by {least}. Take a larger budget."
    return f"{search!r}\n\nchosen, the least error at worst:\n{fit_text(search.best.fit, search.best.mesh)}"

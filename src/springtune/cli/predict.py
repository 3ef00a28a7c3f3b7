"""Recommend a definition for one mesh, or a mesh for one error, and write springs for other programs."""

import warnings
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from . import examples
from .engine_fit import check_engine, engine_options, fitted, net_of_fit
from .options import SPRING_FILES, Asked, SheetOptions, Unmet, check_target, sheet_options, writing

if TYPE_CHECKING:
    from ..handover.net import SpringNet
    from ..scene.statements import ShapeStatement
    from .recommendation import Subject


@click.command(
    epilog=examples(
        'springtune predict --beam 200x40 --size "2 mm" --material steel',
        'springtune predict --beam 200x40 --error "1 %" --loads traction,bending --material steel',
        'springtune predict --beam 200x40 --error "2 %" --material steel --mesh structured,free --springs-alone '
        "--write net.csv",
        'springtune predict --beam 80x10 --mesh free --size "1 mm" --young "3 GPa" --poisson 0.4',
        'springtune predict --beam 80x10 --mesh graded.msh --unit "1 mm" --material rubber',
        'springtune predict --shape config/shapes.yaml:cook --load shear --size "2 mm" --material third',
        'springtune predict --shape config/shapes.yaml:cook --material third --error "2 %"',
        'springtune predict --engine xpbd --dt 1/60 --substeps 20 --iterations 10 --beam 200x40 --size "13 mm" '
        '--material rubber --density "1000 kg/m^3" --load traction --force "0.2 N"',
        'springtune predict --engine xpbd --budget "0.2 ms" --beam 200x40 --material rubber --density "1000 kg/m^3" '
        '--load traction --force "0.2 N"',
    )
)
@sheet_options(
    "A mesh type, or a mesh file; with --error mesh types, such as structured,free.  "
    "[default: structured; with --error all]",
    "for the largest stable time steps",
)
@click.option("--error", help="Find the coarsest mesh that keeps this error, such as '1 %'.")
@click.option("--load", help="Load case of a shape, by default its only one; with --engine of a beam, too.")
@click.option(
    "--loads",
    help="Loads that count: some of traction, compression, bending, shear and pressure, such as traction,bending.  "
    "[default: traction,bending,shear; with --engine all]",
)
@click.option("--springs-alone", is_flag=True, help="Recommend what needs springs alone, no energies besides them.")
@click.option("--best-springs", is_flag=True, help="Also search for the best springs on the mesh, for some seconds.")
@engine_options
@click.option(
    "--write",
    "target",
    type=click.Path(path_type=Path),
    help=f"Write the springs of what is recommended to a file: {SPRING_FILES}.",
)
def predict(
    sheet: SheetOptions,
    error: str | None,
    load: str | None,
    loads: str | None,
    springs_alone: bool,
    best_springs: bool,
    target: Path | None,
    **engine: Any,
) -> None:
    """Recommend a definition and its stiffness for one mesh, with its error under some loads; or find the mesh.

    Every choice is solved on the mesh, with linear kinematics, and compared with the converged reference of small
    strain; a mesh too large for that has bands from coarser ones. With --error, meshes from coarse to fine are solved
    so, until the error is kept on one and on the finer ones tried, up to one with twice as many cells across.
    A shape of a study has errors in the quantities that its load case asks for.

    With --engine: what to type into an engine at a setting, so that the displacement under --load is that of finite
    elements; over which loads that holds; and which settings converge. With --budget the setting is found, too.
    """
    check_engine(engine, sheet, error, load)
    if best_springs and (error is not None or engine["engine"] is not None):
        raise ValueError("--best-springs: are of one mesh; leave out --error and --engine")
    if error is not None and sheet.size is not None:
        raise ValueError(f"--size: '{sheet.size}' is what --error finds; leave one of them out")
    if target is not None:
        check_target("--write", target)
    names = None if loads is None else [name.strip() for name in loads.split(",") if name.strip()]
    if engine["engine"] is not None:
        text, fit = fitted(sheet, engine, load, names, springs_alone)
        make = partial(net_of_fit, fit)
    else:
        asked = sheet.asked(load, sized=error is None)
        under = _under(asked, names)
        if error is None:
            text, definition = _on_mesh(asked, under, springs_alone, ("best-springs",) * best_springs)
        else:
            text, definition, asked = _found(asked, under, error, springs_alone, sheet.mesh_type)
        make = partial(_recommended_net, asked, under, definition, error)
    click.echo(text)
    if target is not None:
        net = make()
        with writing("--write", target):
            click.echo(f"\n{written_text(net, net.write(target))}")


def _under(asked: Asked, names: list[str] | None) -> dict[str, Any]:
    """Loads that count, as arguments of the library: loads of a beam, or the load case of a shape."""
    from ..prediction.choices import CASES, check_beam, check_loads

    if not asked.is_beam:
        return {"load": asked.load}
    check_beam(asked.body)
    return {"loads": check_loads(CASES if names is None else names)}


def _statement(asked: Asked) -> "ShapeStatement":
    from ..scene.statements import ShapeStatement

    return ShapeStatement(asked.body, asked.mesh, asked.material, str(asked.load), 1.0, "linear")


def _subject(asked: Asked, known: Any) -> "Subject":
    from .recommendation import beam_subject, shape_subject

    return beam_subject(asked.body, asked.material, known) if asked.is_beam else shape_subject(_statement(asked), known)


def _on_mesh(asked: Asked, under: dict[str, Any], springs_alone: bool, also: tuple[str, ...]) -> tuple[str, str | None]:
    """Text for one mesh, and the definition that is recommended."""
    from ..mesh.types import MESH_TYPES
    from ..prediction.bands import extrapolate
    from ..prediction.choices import SOLVED, SOLVED_FROM_FILE, predict, references, shape_references
    from .recommendation import prediction_text, recommended

    body, material, size = asked.body, asked.material, asked.size
    sizes: list[float] = []
    about = 0.0
    if asked.is_beam and size is not None:
        about = MESH_TYPES[asked.mesh_type].particles(body.length, body.height, size)
    if about > SOLVED and size is not None:
        if also:
            raise ValueError(f"--best-springs: the mesh has more than {SOLVED} particles; give a larger --size")
        known: Any = references(body, material, **under)
        found, sizes = extrapolate(asked.mesh_type, size, body, material, known, **under)
        counts = f"about {about:.2g} particles"
    else:
        mesh = asked.mesh if asked.is_beam else asked.mesh.mesh
        if len(mesh.points) > SOLVED_FROM_FILE:
            option = "--size" if size is not None else "--mesh" if asked.is_beam else "--shape"
            raise Unmet(
                f"{option}: '{asked.mesh_name}' has {len(mesh.points)} particles, more than the {SOLVED_FROM_FILE} "
                "that are solved here; give a coarser mesh, or make it a mesh of a study"
            )
        known = references(body, material, **under) if asked.is_beam else shape_references(_statement(asked))
        found = predict(body, asked.mesh, material, known, **under, also=also)
        counts = f"{len(mesh.points)} particles, {len(mesh.edges)} springs"
    found = [choice for choice in found if not (springs_alone and choice.energies)]
    return prediction_text(_subject(asked, known), asked.mesh_name, counts, found, sizes), recommended(found)[0]


def _found(
    asked: Asked, under: dict[str, Any], error: str, springs_alone: bool, mesh_types: str | None
) -> tuple[str, str | None, Asked]:
    """Text of a search for a mesh, the definition that is recommended, and the body with the mesh."""
    from ..mesh.types import MESH_TYPES
    from ..prediction.search import find_mesh, find_shape_mesh
    from .recommendation import search_text

    body = asked.body
    if asked.is_beam:
        names = None if mesh_types is None else [name.strip() for name in mesh_types.split(",")]
        for name in names or ():
            if name not in MESH_TYPES:
                why = "is a file, and --error finds sizes of mesh types" if Path(name).is_file() else "is no mesh type"
                raise ValueError(f"--mesh: '{name}' {why}; known: {', '.join(MESH_TYPES)}")
        search = find_mesh(body, asked.material, error, mesh_types=names, **under)
    elif body.file:
        raise Unmet(
            f"--error: '{error}' finds sizes of meshes that are made, and '{body.name}' has the mesh of its file; give "
            "it an outline, or leave --error out"
        )
    else:
        search = find_shape_mesh(body, asked.material, error, **under, make=partial(asked.make, asked.mesh_type))
    best = search.best_springs if springs_alone else search.best
    if mesh := best or next(reversed(search.tried), None):
        asked = replace(asked, mesh_type=mesh.mesh_type, size=mesh.size)
    text = search_text(_subject(asked, search.known), search, springs_alone)
    return text, best.choice.definition if best else None, asked


def _recommended_net(asked: Asked, under: dict[str, Any], definition: str | None, error: str | None) -> "SpringNet":
    """Springs of the definition that is recommended."""
    if definition is None:
        nothing = "nothing is recommended for this mesh, so nothing is written; take another mesh"
        if error is not None:
            nothing = f"no mesh keeps {error}, so nothing is written; allow a larger error"
        raise Unmet(f"--write: {nothing}")
    return _net(asked, definition, loads=under.get("loads"))


# -- springs for other programs ---------------------------------------------------------------------------------------


@click.command(
    epilog=examples(
        'springtune springs --beam 200x40 --size "5 mm" --material steel --definition patch --out net.csv',
        'springtune springs --beam 80x10 --mesh graded.msh --unit "1 mm" --material rubber --out net.vtu',
        'springtune springs --beam 200x40 --size "5 mm" --material steel --density "7850 kg/m^3" --load traction '
        '--force "400 kN" --out net.json',
        'springtune springs --shape config/shapes.yaml:hole --size "2 mm" --material steel --density "7850 kg/m^3" '
        "--definition lattice --out hole.xml",
    )
)
@sheet_options("A mesh type, or a mesh file.", "for masses, and the largest stable time steps", "structured")
@click.option(
    "--definition",
    default="patch",
    show_default=True,
    help="Rule for the stiffness; `springtune definitions` lists them, `springtune predict` recommends one.",
)
@click.option("--stiffness", help="Uniform stiffness, such as '170e6 N/m', for definitions that are told one.")
@click.option(
    "--load",
    help="What holds and pulls the beam, nothing without; or a shape, its only load without.",
)
@click.option("--force", help="Size of the force on a beam, such as '400 kN'.")
@click.option("--scale", type=float, default=1.0, show_default=True, help="Factor on the load of a shape.")
@click.option(
    "--mujoco",
    type=int,
    help="Version of MuJoCo that .xml is for: 3, or 4, the newest, without. Springs alone are the same in both.",
)
@click.option(
    "--out",
    "target",
    required=True,
    type=click.Path(path_type=Path),
    help=f"File: {SPRING_FILES}; one that is there is replaced.",
)
def springs(
    sheet: SheetOptions,
    definition: str,
    stiffness: str | None,
    load: str | None,
    force: str | None,
    scale: float,
    mujoco: int | None,
    target: Path,
) -> None:
    """Write the springs of a mesh: their rest lengths and stiffnesses, masses, and energies besides them.

    The file says what its numbers are: definition, formula and source, and how far off the network is under traction,
    bending, shear and the load that is given, solved on this very mesh; of a shape in the quantities that its load case
    asks for.
    """
    from ..handover.simulation import EquilibriumWarning

    check_target("--out", target)
    if load is None and force is not None:
        raise ValueError(f"--force: '{force}' is of no load; give --load such as traction, or leave --force out")
    net = _net(sheet.asked(load), definition, stiffness=stiffness, force=force, scale=scale)
    with writing("--out", target), warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always", EquilibriumWarning)
        written = net.write(target, mujoco=mujoco)
    click.echo(written_text(net, written, mujoco))
    for one in heard:
        click.echo(str(one.message))


def _net(
    asked: Asked,
    definition: str,
    *,
    loads: "Iterable[str] | None" = None,
    stiffness: str | None = None,
    force: str | None = None,
    scale: float = 1.0,
) -> "SpringNet":
    """Springs of a mesh, under a load if there is one; `scale` [1] is a factor on that of a shape."""
    from ..handover.net import SpringNet
    from ..mechanics.statics import SingularError
    from ..scene.single import Scene

    body, load, name = asked.body, asked.load, asked.mesh_name
    if not asked.is_beam and any(one.x or one.y for one in body.loads[load].supports):
        raise ValueError(
            f"--load: '{load}' of shape '{body.name}' moves a support, and files of springs have forces and directions "
            "that are held; give a load of forces"
        )
    how: dict[str, Any] = {"definition": definition, "stiffness": stiffness}
    try:
        if load is None:
            return SpringNet.from_mesh(asked.mesh, asked.material, beam=body, mesh_name=name, loads=loads, **how)
        return SpringNet.from_scene(Scene(body, asked.mesh, asked.material, load, force, scale=scale, **how), name)
    except SingularError as error:  # of the patch test that scales them
        raise Unmet(f"--definition: '{definition}' has no springs on this mesh: {error}; take another") from None


def written_text(net: "SpringNet", written: "Iterable[Path]", mujoco: int | None = None) -> str:
    """Written files and their expected errors, as text."""
    from ..handover.formats import FOR_MUJOCO, ending_of
    from ..handover.mujoco import for_versions
    from ..problem.geometry import size_text

    header = net.header
    first, *others = written
    besides = [f"{terms.kind} terms of {len(terms.cells)} cells" for terms in net.energies]
    springs = f"{len(net.springs)} springs" if net.stiffness.any() else f"{len(net.springs)} edges with no own springs"
    extent = [] if header["beam"] else [size_text(*(max(one) - min(one) for one in zip(*net.points.tolist())))]
    counts = [*extent, f"{len(net.points)} particles", springs, *besides]
    lines = [f"{first}: {', '.join(counts)} of definition {header['definition']}"]
    lines += [f"beside it: {', '.join(str(other) for other in others)}"] if others else []
    lines += [for_versions(net.energies, mujoco)] if ending_of(first) in FOR_MUJOCO else []
    errors = header["expected_error"]
    if isinstance(errors, dict):
        known = [f"{load} {100 * error:+.3g} %" for load, error in errors.items() if isinstance(error, float)]
        why: dict[str, list[str]] = {}
        for load, error in errors.items():
            if isinstance(error, str):
                why.setdefault(error, []).append(load)
        unknown = [f"{', '.join(loads)}: {reason}" for reason, loads in why.items()]
        what = "error of the displacement" if header["beam"] else "errors"
        lines += [f"{what}, solved on this mesh: {', '.join(known)}"] if known else []
        lines += unknown
    else:
        lines.append(f"error of the displacement: {errors}")
    steps = header["largest_stable_step"]
    if isinstance(steps, dict):
        step = min(step for step in steps.values() if isinstance(step, float))
        lines.append(f"largest stable step of explicit integrators, undamped: {step:.4g} s")
    return "\n".join(lines)

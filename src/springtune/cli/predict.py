"""Recommend a definition for one mesh, or a mesh for one error, and write springs for other programs."""

import re
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

from . import examples
from .engine_fit import EngineOptions, engine_options, fitted, net_of_fit
from .options import (
    SPRING_FILES,
    SheetOptions,
    Unmet,
    check_kind,
    check_target,
    refusals,
    sheet_options,
)

if TYPE_CHECKING:
    from ..handover.net import SpringNet
    from ..mesh import Mesh
    from ..mesh.groups import GroupedMesh
    from ..prediction.choices import Choice
    from ..prediction.search import MeshSearch
    from ..problem.geometry import Beam
    from ..problem.materials import Material
    from .options import AskedShape
    from .recommendation import Subject


ASKED = re.compile(
    "^(?=(beam |error:|load |load:|loads:|force:|scale:|density:|definition:|dt:|substeps:|iterations:|precision:|"
    "within:|budget:))|^mesh types?(?=:)"
)
"""Begin of messages with the name of an argument, which is an option of `predict`."""


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
    engine: EngineOptions,
    error: str | None,
    load: str | None,
    loads: str | None,
    springs_alone: bool,
    best_springs: bool,
    target: Path | None,
) -> None:
    """Recommend a definition and its stiffness for one mesh, with its error under some loads; or find the mesh.

    Every choice is solved on the mesh, with linear kinematics, and compared with the converged reference of small
    strain; a mesh too large for that has bands from coarser ones. With --error, meshes from coarse to fine are solved
    so, until the error is kept on one and on the finer ones tried, up to one with twice as many cells across.
    A shape of a study has errors in the quantities that its load case asks for.

    With --engine: what to type into an engine at a setting, so that the displacement under --load is that of finite
    elements; over which loads that holds; and which settings converge. With --budget the setting is found, too.
    """
    with refusals("--write", target, _in_options):
        check_kind(sheet.shape, sheet.beam, () if engine["engine"] is None else ("scale",))
        engine.check(sheet, error, load)
        if best_springs and (error is not None or engine["engine"] is not None):
            raise ValueError("--best-springs: are of one mesh; leave out --error and --engine")
        also = ("best-springs",) * best_springs
        if target is not None:
            check_target("--write", target)
        if engine["engine"] is not None:
            text, fit = fitted(sheet, engine, load, loads, springs_alone)
            answer = _Answer(text, "", partial(net_of_fit, fit))
        elif sheet.shape is not None:
            asked = sheet.asked_shape(load, sized=error is None)
            answer = (
                _on_shape(asked, springs_alone, also) if error is None else _find_on_shape(asked, error, springs_alone)
            )
        elif error is None:
            answer = _on_beam(sheet, loads, springs_alone, also)
        else:
            answer = _find_on_beam(sheet, loads, error, springs_alone)
        click.echo(answer.text)
        if target is None:
            return
        if answer.definition is None:
            nothing = "nothing is recommended for this mesh, so nothing is written; take another mesh"
            if error is not None:
                nothing = f"no mesh keeps {error}, so nothing is written; allow a larger error"
            raise Unmet(f"--write: {nothing}")
        net = answer.net(answer.definition)
        click.echo(f"\n{written_text(net, net.write(target))}")


def _in_options(message: str) -> str:
    """Message with options in the place of arguments."""
    return ASKED.sub(lambda found: "--mesh" if found[0] else "--", message)


class _Answer(NamedTuple):
    """What is printed, the definition that is recommended, and how its springs are made."""

    text: str
    definition: str | None
    net: "Callable[[str], SpringNet]"


def _found(subject: "Subject", search: "MeshSearch", springs_alone: bool, net: "Callable[[str], SpringNet]") -> _Answer:
    """Answer of a search for a mesh."""
    from .recommendation import search_text

    best = search.best_springs if springs_alone else search.best
    return _Answer(
        search_text(subject, search, springs_alone),
        best.choice.definition if best else None,
        net,
    )


def _asked_beam(sheet: SheetOptions, loads: str | None) -> "tuple[Beam, Material, tuple[str, ...]]":
    """Beam, material and loads of the options."""
    from ..prediction.choices import CASES, check_beam, check_loads

    beam, material = sheet.asked_beam()
    check_beam(beam)
    names = CASES if loads is None else [name.strip() for name in loads.split(",") if name.strip()]
    return beam, material, check_loads(names)


def _kept(choices: "list[Choice]", springs_alone: bool) -> "list[Choice]":
    return [choice for choice in choices if not (springs_alone and choice.energies)]


def _on_beam(sheet: SheetOptions, given: str | None, springs_alone: bool, also: tuple[str, ...]) -> _Answer:
    """Recommend a definition for a mesh of a beam."""
    from ..handover.net import SpringNet
    from ..mesh import MESH_TYPES
    from ..prediction.bands import extrapolate
    from ..prediction.choices import SOLVED, SOLVED_FROM_FILE, predict, references
    from .recommendation import beam_subject, prediction_text, recommended

    beam, material, loads = _asked_beam(sheet, given)
    mesh_type, edge = sheet.mesh_or_file, sheet.edge(beam)
    name = sheet.mesh_name(edge)

    def make() -> "Mesh":
        mesh = sheet.mesh(beam, edge)
        if edge is None and len(mesh.points) > SOLVED_FROM_FILE:
            raise Unmet(
                f"--mesh: '{mesh_type}' has {len(mesh.points)} particles, more than the {SOLVED_FROM_FILE} that are "
                "solved here; give a coarser mesh, or make it a mesh file of a study"
            )
        return mesh

    count = 0.0 if edge is None else MESH_TYPES[mesh_type].particles(beam.length, beam.height, edge)
    solved = None if count > SOLVED else make()
    known = references(beam, material, loads)
    sizes: list[float] = []
    if solved is None:
        assert edge is not None
        if also:
            raise ValueError(f"--best-springs: the mesh has more than {SOLVED} particles; give a larger --size")
        about: dict[str, object] = {"particles": float(f"{count:.2g}"), "springs": None}
        found, sizes = extrapolate(mesh_type, edge, beam, material, known, loads=loads)
    else:
        about = {"particles": len(solved.points), "springs": len(solved.edges)}
        found = predict(beam, solved, material, known, loads=loads, also=also)
    found = _kept(found, springs_alone)
    subject = beam_subject(beam, material, known)
    return _Answer(
        prediction_text(subject, name, about, found, sizes),
        recommended(found)[0],
        lambda definition: SpringNet.from_mesh(
            solved or make(), material, definition, beam=beam, mesh_name=name, loads=loads
        ),
    )


def _on_shape(asked: "AskedShape", springs_alone: bool, also: tuple[str, ...]) -> _Answer:
    """Recommend a definition for a mesh of a shape."""
    from ..prediction.choices import SOLVED_FROM_FILE, predict, shape_references
    from ..scene.statements import ShapeStatement
    from .recommendation import prediction_text, recommended, shape_subject

    grouped = asked.mesh()
    about = {"particles": len(grouped.mesh.points), "springs": len(grouped.mesh.edges)}
    if about["particles"] > SOLVED_FROM_FILE:
        option = "--shape" if asked.size is None else "--size"
        raise Unmet(
            f"{option}: {about['particles']} particles, more than the {SOLVED_FROM_FILE} that are solved here; give a "
            "coarser mesh, or run its study"
        )
    statement = ShapeStatement(asked.shape, grouped, asked.materials, asked.load, 1.0, "linear")
    known = shape_references(statement)
    found = _kept(predict(asked.shape, grouped, asked.materials, known, load=asked.load, also=also), springs_alone)
    subject = shape_subject(statement, known)
    return _Answer(
        prediction_text(subject, asked.mesh_name, about, found),
        recommended(found)[0],
        partial(net_of_shape, asked),
    )


def _find_on_beam(sheet: SheetOptions, given: str | None, error: str, springs_alone: bool) -> _Answer:
    """Find the mesh of a beam that keeps an error."""
    from ..handover.net import SpringNet
    from ..mesh import MESH_TYPES
    from ..prediction.search import find_mesh, size_text
    from .recommendation import beam_subject

    beam, material, loads = _asked_beam(sheet, given)
    if sheet.size is not None:
        raise ValueError(f"--size: '{sheet.size}' is what --error finds; leave one of them out")
    names = None if sheet.mesh_type is None else [name.strip() for name in sheet.mesh_type.split(",")]
    for name in names or ():
        if name not in MESH_TYPES:
            why = "is a file, and --error finds sizes of mesh types" if Path(name).is_file() else "is no mesh type"
            raise ValueError(f"--mesh: '{name}' {why}; known: {', '.join(MESH_TYPES)}")
    search = find_mesh(beam, material, error, loads=loads, mesh_types=names)
    best = search.best_springs if springs_alone else search.best
    subject = beam_subject(beam, material, search.known)  # type: ignore[arg-type]  # of loads

    def net(definition: str) -> "SpringNet":
        assert best is not None
        mesh = MESH_TYPES[best.mesh_type](beam.length, beam.height, best.size)
        name = f"{best.mesh_type} {size_text(best.size)}"
        return SpringNet.from_mesh(mesh, material, definition, beam=beam, mesh_name=name, loads=loads)

    return _found(subject, search, springs_alone, net)


def _find_on_shape(asked: "AskedShape", error: str, springs_alone: bool) -> _Answer:
    """Find the mesh of a shape that keeps an error."""
    from ..prediction.search import find_shape_mesh
    from ..scene.statements import ShapeStatement
    from .recommendation import shape_subject

    if asked.shape.file:
        raise Unmet(
            f"--error: '{error}' finds sizes of meshes that are made, and '{asked.shape.name}' has the mesh of its "
            "file; give it an outline, or leave --error out"
        )
    if asked.size is not None:
        raise ValueError(f"--size: '{asked.size_text}' is what --error finds; leave one of them out")

    def make(size: float) -> "GroupedMesh":
        return replace(asked, size=size).mesh()

    search = find_shape_mesh(asked.shape, asked.materials, error, load=asked.load, make=make)
    best = search.best_springs if springs_alone else search.best
    size = best.size if best else search.tried[-1].size
    statement = ShapeStatement(asked.shape, make(size), asked.materials, asked.load, 1.0, "linear")
    subject = shape_subject(statement, search.known)  # type: ignore[arg-type]  # of quantities
    return _found(subject, search, springs_alone, partial(net_of_shape, replace(asked, size=size)))


# -- springs for other programs ---------------------------------------------------------------------------------------

OPTIONS = re.compile(r"^(?=(load|force|scale|definition|stiffness|density|mujoco)\b)")
"""Begin of messages with the name of an argument, which is an option here."""


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

    with refusals("--out", target, partial(OPTIONS.sub, "--", count=1)):
        check_kind(sheet.shape, sheet.beam, ("scale",))
        check_target("--out", target)
        if sheet.shape is not None:
            net = net_of_shape(sheet.asked_shape(load), definition, scale, stiffness)
        else:
            net = _net_of_beam(sheet, definition, stiffness, load, force)
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always", EquilibriumWarning)
            written = net.write(target, mujoco=mujoco)
    click.echo(written_text(net, written, mujoco))
    for one in heard:
        click.echo(str(one.message))


@contextmanager
def _derived(definition: str) -> Iterator[None]:
    """Context in which springs are derived; a patch test that scales them may be singular."""
    from ..mechanics.statics import SingularError

    try:
        yield
    except SingularError as error:
        raise Unmet(f"--definition: '{definition}' has no springs on this mesh: {error}; take another") from None


def _net_of_beam(
    sheet: SheetOptions, definition: str, stiffness: str | None, load: str | None, force: str | None
) -> "SpringNet":
    from ..handover.net import SpringNet
    from ..scene.single import Scene

    beam, material = sheet.asked_beam()
    edge = sheet.edge(beam)
    mesh, name = sheet.mesh(beam, edge), sheet.mesh_name(edge)
    if (load is None) != (force is None):
        if load is None:
            raise ValueError(f"--force: '{force}' is of no load; give --load such as traction, or leave --force out")
        raise ValueError(f"--force: missing; give the size of the force of --load {load}, such as '400 kN'")
    with _derived(definition):
        if load is None or force is None:
            return SpringNet.from_mesh(mesh, material, definition, beam=beam, stiffness=stiffness, mesh_name=name)
        scene = Scene(beam, mesh, material, load, force, definition=definition, stiffness=stiffness)
        return SpringNet.from_scene(scene, name)


def net_of_shape(asked: "AskedShape", definition: str, scale: float = 1.0, stiffness: str | None = None) -> "SpringNet":
    """Springs of a shape under its load case; `scale` [1] is a factor on the load."""
    from ..handover.net import SpringNet
    from ..scene.single import Scene

    if any(one.x or one.y for one in asked.shape.loads[asked.load].supports):
        raise ValueError(
            f"--load: '{asked.load}' of shape '{asked.shape.name}' moves a support, and files of springs have forces "
            "and directions that are held; give a load of forces"
        )
    scene = Scene(
        asked.shape,
        asked.mesh(),
        asked.materials,
        asked.load,
        definition=definition,
        stiffness=stiffness,
        scale=scale,
    )
    with _derived(definition):
        return SpringNet.from_scene(scene, asked.mesh_name)


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

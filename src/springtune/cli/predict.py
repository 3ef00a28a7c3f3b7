"""Recommend a definition for one mesh, or a mesh for one error."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from . import examples
from .options import (
    SPRING_FILES,
    Unmet,
    asked_beam,
    asked_material,
    asked_mesh,
    asked_shape,
    asked_size,
    check_kind,
    check_target,
    is_made,
    refusals,
    sheet_options,
)

if TYPE_CHECKING:
    from ..handover.net import SpringNet
    from ..mesh import Mesh
    from ..mesh.groups import GroupedMesh
    from ..problem.geometry import Beam
    from ..problem.materials import Material
    from .options import AskedShape


@click.command(
    epilog=examples(
        'springtune predict --beam 200x40 --size "2 mm" --material steel',
        'springtune predict --beam 200x40 --error "1 %" --loads traction,bending --material steel',
        'springtune predict --beam 200x40 --error "2 %" --material steel --mesh structured,free --springs-alone '
        "--write net.csv",
        'springtune predict --beam 80x10 --mesh free --size "1 mm" --young "3 GPa" --poisson 0.4 --json',
        'springtune predict --beam 80x10 --mesh graded.msh --unit "1 mm" --material rubber',
        'springtune predict --shape config/shapes.yaml:cook --load shear --size "2 mm" --material third',
        'springtune predict --shape config/shapes.yaml:cook --material third --error "2 %"',
    )
)
@sheet_options(
    "A mesh type, or a mesh file; with --error mesh types, such as structured,free.  "
    "[default: structured; with --error all]"
)
@click.option("--density", help="Density, such as '7850 kg/m^3': for the largest stable time steps.")
@click.option("--error", help="Find the coarsest mesh that keeps this error, such as '1 %'.")
@click.option("--load", help="Load case of a shape.  [default: its only one]")
@click.option(
    "--loads",
    help="Loads that count: some of traction, compression, bending, shear and pressure, such as traction,bending.  "
    "[default: traction,bending,shear]",
)
@click.option("--springs-alone", is_flag=True, help="Recommend what needs springs alone, no energies besides them.")
@click.option("--json", "as_json", is_flag=True, help="Print everything as JSON, in SI units.")
@click.option(
    "--write",
    "target",
    type=click.Path(path_type=Path),
    help=f"Write the springs of what is recommended to a file: {SPRING_FILES}.",
)
def predict(
    beam: str | None,
    shape: str | None,
    load: str | None,
    thickness: str,
    mesh_type: str | None,
    size: str | None,
    unit: str,
    material: str | None,
    young: str | None,
    poisson: str | None,
    density: str | None,
    error: str | None,
    loads: str | None,
    springs_alone: bool,
    as_json: bool,
    target: Path | None,
) -> None:
    """Recommend a definition and its stiffness for one mesh, with its error under some loads; or find the mesh.

    Every choice is solved on the mesh, with linear kinematics, and compared with the converged reference of small
    strain; a mesh too large for that has bands from coarser ones. With --error, meshes from coarse to fine are solved
    so, until the error is kept on one and on the finer ones tried, up to one with twice as many cells across.
    A shape of a study has errors in the quantities that its load case asks for.
    """
    from ..prediction import CASES, check_beam

    with refusals("--write", target):
        check_kind(shape, beam, ("load",))
        if target is not None:
            check_target("--write", target)
        if shape is not None:
            asked = asked_shape(shape, load, material, density, size, sized=error is None)
            _on_shape(asked, error, springs_alone, as_json, target)
            return
        assert beam is not None
        sheet, solid = asked_beam(beam, thickness), asked_material(material, young, poisson, density)
        try:
            check_beam(sheet)
        except ValueError as problem:
            raise ValueError(f"--{problem}") from None
        cases = CASES if loads is None else _asked_loads(loads)
        if error is not None:
            if size is not None:
                raise ValueError(f"--size: '{size}' is what --error finds; leave one of them out")
            _find(sheet, solid, error, cases, mesh_type, springs_alone, as_json, target)
        else:
            _predict(sheet, solid, cases, mesh_type or "structured", size, unit, springs_alone, as_json, target)


def _on_shape(asked: "AskedShape", error: str | None, springs_alone: bool, as_json: bool, target: Path | None) -> None:
    """Recommend a definition for a mesh of a shape."""
    from ..prediction import SOLVED_FROM_FILE, predict, shape_references
    from ..scene.statements import ShapeStatement
    from .recommendation import shape_json, shape_text

    if error is not None:
        _find_on_shape(asked, error, springs_alone, as_json, target)
        return
    grouped = asked.mesh()
    count = len(grouped.mesh.points)
    if count > SOLVED_FROM_FILE:
        option = "--shape" if asked.size is None else "--size"
        raise Unmet(f"{option}: {count} particles, more than the {SOLVED_FROM_FILE} that are solved here; give a "
                    "coarser mesh, or run its study")  # fmt: skip
    statement = ShapeStatement(asked.shape, grouped, asked.materials, asked.load, 1.0, "linear")
    known = shape_references(statement)
    found = predict(asked.shape, grouped, asked.materials, known, load=asked.load)
    if springs_alone:
        found = [choice for choice in found if not choice.energies]
    about = {"particles": count, "springs": len(grouped.mesh.edges)}
    if as_json:
        made = asked.size is not None
        where = {"type": "free" if made else None, "file": None if made else asked.shape.file, "size": asked.size}
        click.echo(shape_json(statement, where | about, found, known))
    else:
        click.echo(shape_text(asked.mesh_name, about, statement, found, known))
    if target is not None:
        solved = [choice.definition for choice in found if choice.worst < float("inf")]
        if not solved:
            raise Unmet("--write: nothing is recommended for this mesh, so nothing is written; take another mesh")
        from .springs import net_of_shape

        net = net_of_shape(asked, solved[0])
        _say_written(net, target, as_json)


def _find_on_shape(asked: "AskedShape", error: str, springs_alone: bool, as_json: bool, target: Path | None) -> None:
    """Find the mesh of a shape that keeps an error."""
    from ..prediction import find_shape_mesh
    from ..scene.statements import ShapeStatement
    from .recommendation import shape_search_json, shape_search_text
    from .springs import net_of_shape

    if asked.shape.file:
        raise Unmet(
            f"--error: '{error}' finds sizes of meshes that are made, and '{asked.shape.name}' has the mesh of its "
            "file; give it an outline, or leave --error out"
        )
    if asked.size is not None:
        raise ValueError(f"--size: '{asked.size_text}' is what --error finds; leave one of them out")

    def make(size: float) -> "GroupedMesh":
        return replace(asked, size=size).mesh()

    try:
        search = find_shape_mesh(asked.shape, asked.materials, error, load=asked.load, make=make)
    except ValueError as problem:
        raise ValueError(f"--{problem}" if str(problem).startswith(("error:", "load ")) else str(problem)) from None
    best = search.best_springs if springs_alone else search.best
    grouped = make(best.size if best else search.tried[-1].size)
    statement = ShapeStatement(asked.shape, grouped, asked.materials, asked.load, 1.0, "linear")
    click.echo((shape_search_json if as_json else shape_search_text)(statement, search, springs_alone))
    if target is not None:
        if best is None:
            raise Unmet(f"--write: no mesh keeps {error}, so nothing is written; allow a larger error")
        _say_written(net_of_shape(replace(asked, size=best.size), best.choice.definition), target, as_json)


def _predict(
    beam: "Beam",
    material: "Material",
    loads: tuple[str, ...],
    mesh_type: str,
    size: str | None,
    unit: str,
    springs_alone: bool,
    as_json: bool,
    target: Path | None,
) -> None:
    """Recommend a definition for a mesh."""
    from ..mesh import MESH_TYPES
    from ..prediction import SOLVED, extrapolate, predict, references
    from .recommendation import prediction_json, prediction_text

    made = is_made(mesh_type)
    edge = asked_size(beam, mesh_type, size) if made else None
    count = 0.0 if edge is None else MESH_TYPES[mesh_type].particles(beam.length, beam.height, edge)
    sizes: list[float] = []
    mesh = None
    if edge is not None and count > SOLVED:
        about: dict[str, object] = {"particles": float(f"{count:.2g}"), "springs": None}
        known = references(beam, material, loads)
        found, sizes = extrapolate(mesh_type, edge, beam, material, known, loads=loads)
    else:
        mesh = _asked_mesh(beam, mesh_type, edge, unit)
        about = {"particles": len(mesh.points), "springs": len(mesh.edges)}
        known = references(beam, material, loads)
        found = predict(beam, mesh, material, known, loads=loads)
    if springs_alone:
        found = [choice for choice in found if not choice.energies]
    name = f"{mesh_type} {size}" if made else Path(mesh_type).name
    solved = [choice.definition for choice in found if choice.worst < float("inf")]
    if as_json:
        where = {"type": mesh_type if made else None, "file": None if made else mesh_type, "size": edge}
        click.echo(prediction_json(beam, material, where | about, found, known, sizes))
    else:
        click.echo(prediction_text(name, about, beam, material, found, known, sizes))
    if target is not None:
        if not solved:
            raise Unmet("--write: nothing is recommended for this mesh, so nothing is written; take another mesh")
        mesh = _asked_mesh(beam, mesh_type, edge, unit) if mesh is None else mesh
        _write(beam, mesh, material, solved[0], name, loads, target, quiet=as_json)


def _find(
    beam: "Beam",
    material: "Material",
    error: str,
    loads: tuple[str, ...],
    types: str | None,
    springs_alone: bool,
    as_json: bool,
    target: Path | None,
) -> None:
    """Find the mesh that keeps an error."""
    from ..mesh import MESH_TYPES
    from ..prediction import find_mesh
    from .recommendation import search_json, search_text, size_text

    names = None if types is None else [name.strip() for name in types.split(",")]
    for name in names or ():
        if name not in MESH_TYPES:
            why = "is a file, and --error finds sizes of mesh types" if Path(name).is_file() else "is no mesh type"
            raise ValueError(f"--mesh: '{name}' {why}; known: {', '.join(MESH_TYPES)}")
    try:
        search = find_mesh(beam, material, error, loads=loads, mesh_types=names)
    except ValueError as problem:
        raise ValueError(f"--{problem}" if str(problem).startswith(("error:", "loads:")) else str(problem)) from None
    best = search.best_springs if springs_alone else search.best
    click.echo((search_json if as_json else search_text)(beam, material, search, springs_alone))
    if target is not None:
        if best is None:
            raise Unmet(f"--write: no mesh keeps {error}, so nothing is written; allow a larger error")
        mesh = MESH_TYPES[best.mesh_type](beam.length, beam.height, best.size)
        name = f"{best.mesh_type} {size_text(best.size)}"
        _write(beam, mesh, material, best.choice.definition, name, loads, target, quiet=as_json)


def _asked_loads(text: str) -> tuple[str, ...]:
    from ..prediction.choices import check_loads

    try:
        return check_loads([name.strip() for name in text.split(",") if name.strip()])
    except ValueError as error:
        raise ValueError(f"--{error}") from None


def _asked_mesh(beam: "Beam", mesh_type: str, edge: float | None, unit: str) -> "Mesh":
    from ..prediction import SOLVED_FROM_FILE

    mesh = asked_mesh(beam, mesh_type, edge, unit)
    if edge is None and len(mesh.points) > SOLVED_FROM_FILE:
        raise Unmet(
            f"--mesh: '{mesh_type}' has {len(mesh.points)} particles, more than the {SOLVED_FROM_FILE} that are solved "
            "here; give a coarser mesh, or make it a mesh file of a study"
        )
    return mesh


def _write(
    beam: "Beam",
    mesh: "Mesh",
    material: "Material",
    definition: str,
    name: str,
    loads: tuple[str, ...],
    target: Path,
    quiet: bool,
) -> None:
    """Write the springs of a definition, and say so; not where what is printed is for a program."""
    from ..handover.net import SpringNet

    _say_written(SpringNet.from_mesh(mesh, material, definition, beam=beam, mesh_name=name, loads=loads), target, quiet)


def _say_written(net: "SpringNet", target: Path, quiet: bool) -> None:
    """Write springs, and say so."""
    from .springs import written_text

    written = net.write(target)
    click.echo(written_text(net, written) if quiet else "\n" + written_text(net, written), err=quiet)

"""Recommend a definition for one mesh."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .completion import mesh_types
from .examples import examples
from .options import MATERIALS, asked_beam, asked_material, asked_mesh, asked_size, is_made, known_materials

if TYPE_CHECKING:
    from ..mesh import Mesh
    from ..prediction import Choice, Number, References
    from ..problem.geometry import Beam
    from ..problem.materials import Material


@click.command(
    epilog=examples(
        'springtune predict --beam 200x40 --size "2 mm" --material steel',
        'springtune predict --beam 80x10 --mesh free --size "1 mm" --young "3 GPa" --poisson 0.4',
        'springtune predict --beam 80x10 --mesh graded.msh --unit "1 mm" --material rubber',
    )
)
@click.option("--beam", required=True, help="Length x height in mm, such as 200x40.")
@click.option("--thickness", default="1 mm", show_default=True, help="Thickness of the sheet.")
@click.option(
    "--mesh",
    "mesh_type",
    default="structured",
    show_default=True,
    shell_complete=mesh_types,
    help="A mesh type, or a mesh file.",
)
@click.option("--size", help="Length of an edge, such as '2 mm'; not for a mesh file.")
@click.option("--unit", default="1 m", show_default=True, help="Unit of the coordinates in a mesh file.")
@click.option(
    "--material", shell_complete=known_materials, help=f"One of {', '.join(MATERIALS)}; or give --young and --poisson."
)
@click.option("--young", help="Young's modulus, such as '210 GPa'.")
@click.option("--poisson", help="Poisson's ratio, from 0 to 0.5.")
def predict(
    beam: str,
    thickness: str,
    mesh_type: str,
    size: str | None,
    unit: str,
    material: str | None,
    young: str | None,
    poisson: str | None,
) -> None:
    """Recommend a definition and its stiffness for one mesh, with its error under three loads.

    Every choice is solved on the mesh, with linear kinematics, and compared with the converged reference of small
    strain; a mesh too large for that has bands from coarser ones.
    """
    from ..mesh import MESH_TYPES
    from ..prediction import SOLVED, extrapolate, references
    from ..prediction import predict as choices
    from ..springs import DefinitionError

    try:
        sheet, solid = asked_beam(beam, thickness), asked_material(material, young, poisson)
        made = is_made(mesh_type)
        edge = asked_size(sheet, mesh_type, size) if made else None
        sizes: list[float] = []
        count = 0.0 if edge is None else MESH_TYPES[mesh_type].particles(sheet.length, sheet.height, edge)
        if edge is not None and count > SOLVED:
            about = f"about {count:.2g} particles"
            known = references(sheet, solid)
            found, sizes = extrapolate(mesh_type, edge, sheet, solid, known)
        else:
            mesh = _asked_mesh(sheet, mesh_type, edge, unit)
            about = f"{len(mesh.points)} particles, {len(mesh.edges)} springs"
            known = references(sheet, solid)
            found = choices(sheet, mesh, solid, known)
    except (click.ClickException, DefinitionError, ValueError) as error:
        click.echo(str(getattr(error, "message", error)), err=True)
        raise SystemExit(1) from None
    name = f"{mesh_type} {size}" if made else Path(mesh_type).name
    click.echo(prediction_text(f"{sheet.label}, {name}: {about}", sheet, solid, found, known, mesh_type, sizes))


def _asked_mesh(beam: "Beam", mesh_type: str, edge: float | None, unit: str) -> "Mesh":
    from ..prediction import SOLVED_FROM_FILE

    mesh = asked_mesh(beam, mesh_type, edge, unit)
    if edge is None and len(mesh.points) > SOLVED_FROM_FILE:
        raise ValueError(
            f"--mesh: '{mesh_type}' has {len(mesh.points)} particles, more than the {SOLVED_FROM_FILE} that are solved "
            "here; give a coarser mesh, or make it a mesh file of a study"
        )
    return mesh


def prediction_text(
    title: str,
    beam: "Beam",
    material: "Material",
    choices: "Sequence[Choice]",
    known: "References",
    mesh_type: str = "",
    sizes: Sequence[float] = (),
) -> str:
    """Text of a prediction.

    Parameters
    ----------
    title : str
    beam : Beam
    material : Material
    choices : list of Choice
    known : dict
        What `springtune.prediction.references` gave.
    mesh_type : str, optional
        Of the meshes of bands.
    sizes : list of float, optional
        Mesh sizes that bands are from [m]; none where the mesh itself was solved.

    Returns
    -------
    str
    """
    from ..output.text import aligned
    from ..prediction import CASES

    young = material.young_modulus
    modulus = f"{young / 1e9:g} GPa" if young >= 1e9 else f"{young / 1e6:g} MPa"
    rows = [["definition", "springs inside", "on the outline", *CASES, "E", "nu", "besides springs"]]
    notes = [f"{load}: no reference; {found}" for load, found in known.items() if isinstance(found, str)]
    for choice in choices:
        rows.append([choice.definition])
        rows[-1] += [_bounds(value, "{:.5g} N/m".format, "each its own") for value in (choice.inside, choice.outline)]
        rows[-1] += [_bounds(getattr(choice, load), _percent, _missing(choice, load)) for load in CASES]
        missing = _missing(choice, "patch test")
        rows[-1] += [_bounds(choice.young_modulus_error, _percent, missing)]
        rows[-1] += [_bounds(choice.poisson_ratio, _three_decimals, missing), choice.extra]
        notes += [f"{choice.definition}, {part}: {reason}" for part, reason in choice.failures.items()]
    solved = [choice for choice in choices if choice.worst < float("inf")]
    names = [one.definition for one in solved[:1]], [one.definition for one in solved if not one.energies][:1]
    first, plain = (name[0] if name else "none" for name in names)
    estimates = [found.error_estimate for found in known.values() if not isinstance(found, str)]
    how = "solved on this mesh"
    if sizes:
        low, high = 1e3 * min(sizes), 1e3 * max(sizes)
        how = f"bands, extrapolated from solutions on {len(sizes)} {mesh_type} meshes of {low:.3g} to {high:.3g} mm"
    lines = [
        f"{title}; {material.name}, E = {modulus}, nu = {material.poisson_ratio:g}, t = {1e3 * beam.thickness:g} mm",
        "",
        f"recommended: {first}; with springs alone: {plain}",
        "",
        aligned(rows, left=2, right=(3, 4, 5, 6, 7)),
        "",
        f"Errors are of the displacement of the loaded side, above zero where too soft: {how},",
        "with linear kinematics (small strain), against the converged reference of small strain (error estimate "
        f"{100 * max(estimates, default=0):.1g} %).",
        "The first row is the best one by its worst error. E, its error, and nu are of a patch test between rollers.",
        *notes,
    ]
    return "\n".join(lines)


def _missing(choice: "Choice", part: str) -> str:
    """Word for a number that is not there."""
    if "springs" in choice.failures:
        return "refused"
    reason = choice.failures.get(part) or choice.failures.get("patch test")
    return "no reference" if reason is None else "unstable" if "unstable" in reason else "unsolved"


def _bounds(value: "Number", form: Callable[[float], str], missing: str) -> str:
    """A number, or the two of a band."""
    numbers = value if isinstance(value, tuple) else (value,)
    texts = [missing if number != number else form(number) for number in numbers]
    return texts[0] if len(set(texts)) == 1 else " to ".join(texts)


def _three_decimals(value: float) -> str:
    return f"{round(value, 3) + 0.0:.3f}"


def _percent(value: float) -> str:
    """An error with two decimals below 10 %, and three digits above."""
    value = 100 * value
    return f"{round(value, 2) + 0.0:+.2f} %" if abs(value) < 10 else f"{value:+.3g} %"

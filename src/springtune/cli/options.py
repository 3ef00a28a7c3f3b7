"""What options say of a beam, its mesh and its material: shared by the commands that take no study."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from ..mesh import Mesh
    from ..problem.geometry import Beam
    from ..problem.materials import Material

SAID_FROM = 1_000_000
"""Particles from which on it is said that a mesh is being made: it takes seconds."""

WRONG, FAILED = 2, 1
"""Exit codes: an option is wrong, and what it asks for cannot be had."""


class WrongCall(click.ClickException):
    """A command was called in a wrong way."""

    exit_code = WRONG


class Unmet(ValueError):
    """What is asked for cannot be had, though the options are right."""


@contextmanager
def refusals(option: str, target: Path | None, named: Callable[[str], str] = str) -> Iterator[None]:
    """Context in which what is wrong is said in one line, and the exit code is 2 where that begins with an option.

    `option` is the one of the file to be written, `target`; `named` puts options in the place of arguments in messages.
    """
    try:
        yield
    except click.UsageError:
        raise
    except OSError as error:
        why = os.strerror(error.errno) if error.errno else error
        click.echo(f"{option}: {target}: {why}; give a file that can be written", err=True)
        raise SystemExit(FAILED) from None
    except (click.ClickException, ValueError) as error:
        said = named(error.message if isinstance(error, click.ClickException) else str(error))
        click.echo(said, err=True)
        raise SystemExit(WRONG if said.startswith("--") and not isinstance(error, Unmet) else FAILED) from None


def check_target(option: str, target: Path) -> None:
    """Refuse a name whose ending is no format of springs, or whose folder is not there; ValueError names the option."""
    from ..handover import formats

    try:
        formats.check_target(target)
    except ValueError as error:
        raise ValueError(f"{option}: {error}") from None


SPRING_FILES = ".csv, .json, .vtu (ParaView), .h5, .xml or .mjcf (MuJoCo), .scn or .py (SOFA), or .xpbd.json (XPBD)"
"""Endings of files of springs, for the help."""

MATERIALS = {"steel": ("210 GPa", "0.3"), "rubber": ("1 MPa", "0.5")}
"""Young's modulus and Poisson's ratio of the paper's materials."""


def asked_quantity(option: str, text: str, kind: str) -> float:
    """Quantity above zero of an option, in SI units; ValueError names the option."""
    from ..problem.quantities import quantity

    number = quantity(text, kind, option)
    if not number > 0:
        raise ValueError(f"{option}: '{text}' is not above zero; give a size above zero")
    return number


def asked_beam(text: str, thickness: str) -> "Beam":
    """Beam of a text such as ``200x40``; ValueError names the option."""
    from ..problem.geometry import Beam

    sides = text.lower().split("x")
    try:
        length, height = (1e-3 * float(side) for side in sides)
    except ValueError:
        raise ValueError(f"--beam: '{text}' is not length x height; give millimetres such as 200x40") from None
    if not (length > 0 and height > 0):
        raise ValueError(f"--beam: '{text}' has a side that is not above zero; give millimetres such as 200x40")
    thick = asked_quantity("--thickness", thickness, "length")
    try:
        return Beam(length, height, thick, text)
    except ValueError as error:
        raise ValueError(f"--beam: {error}") from None


def asked_material(name: str | None, young: str | None, poisson: str | None, density: str | None = None) -> "Material":
    """Material of a name, or of its constants; ValueError names the option."""
    from ..problem.materials import Material

    if name is not None and name not in MATERIALS:
        raise ValueError(
            f"--material: unknown material '{name}'; known: {', '.join(MATERIALS)}; or give --young and --poisson"
        )
    if name is not None and (young or poisson):
        other = "--young" if young else "--poisson"
        raise ValueError(
            f"{other}: '{young or poisson}' is beside --material {name}, which has its own; leave --material out, and "
            "give --young and --poisson"
        )
    defaults = (None, None) if name is None else MATERIALS[name]
    young, poisson = young or defaults[0], poisson or defaults[1]
    if young is None or poisson is None:
        raise ValueError(f"--material: none; give one of {', '.join(MATERIALS)}, or --young and --poisson")
    try:
        ratio = float(poisson)
    except ValueError:
        ratio = float("nan")
    if not 0 <= ratio <= 0.5:
        raise ValueError(f"--poisson: '{poisson}' is out of range; give a number from 0 to 0.5")
    heavy = None if density is None else asked_quantity("--density", density, "density")
    return Material(asked_quantity("--young", young, "stress"), ratio, heavy, name or "material")


def is_made(mesh_type: str) -> bool:
    """Whether a mesh is of a type, not from a file."""
    from ..mesh import MESH_TYPES

    if mesh_type not in MESH_TYPES and not Path(mesh_type).is_file():
        known = ", ".join(MESH_TYPES)
        raise ValueError(f"--mesh: '{mesh_type}' is neither a mesh type nor a file; known: {known}")
    return mesh_type in MESH_TYPES


def asked_size(beam: "Beam", mesh_type: str, size: str | None) -> float:
    """Length of an edge [m] of a mesh that is made; refused before anything is, where it would be too large."""
    from ..mesh import MESH_TYPES

    if size is None:
        raise ValueError("--size: missing; give the length of an edge such as '2 mm'")
    edge = asked_quantity("--size", size, "length")
    refusal = MESH_TYPES[mesh_type].refusal(beam.length, beam.height, edge, f"beam '{beam.name}'")
    if refusal:
        raise ValueError(f"--size: '{size}' {refusal}")
    return edge


def asked_mesh(beam: "Beam", mesh_type: str, edge: float | None, unit: str) -> "Mesh":
    """Mesh of a type with edges of a length [m], or of the file of that name where there is no length."""
    from ..mesh import MESH_TYPES, read_beam_mesh

    if edge is not None:
        count = MESH_TYPES[mesh_type].particles(beam.length, beam.height, edge)
        if count > SAID_FROM:
            click.echo(f"making a {mesh_type} mesh of some {count / 1e6:.1f} million particles ...", err=True)
        return MESH_TYPES[mesh_type](beam.length, beam.height, edge)
    scale = asked_quantity("--unit", unit if unit[:1].isdigit() else f"1 {unit}", "length")
    return read_beam_mesh(mesh_type, beam.length, beam.height, scale)

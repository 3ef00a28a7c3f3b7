"""A study to begin with."""

import os
from pathlib import Path

import click

from ..registry import NAME, NAME_RULE
from .examples import examples
from .folders import CONFIG_FOLDER
from .options import WrongCall
from .run import checkout_here, checkout_of_run, how_to_get_one
from .schema import SCHEMA

TEMPLATE = """\
{schema}# `springtune scenes {path}` says what this study asks for, `springtune run {path}` does it.
# Every quantity carries its unit. Names of beams, materials and grids are yours; {manual} explains every key.
title: "{title}"
beams:
  100x20: {{length: 100 mm, height: 20 mm, thickness: 1 mm}}
materials:
  steel: {{young_modulus: 210 GPa, poisson_ratio: 0.3}}
grids:  # all combinations of the values of a grid are its scenes; [5 mm, 2 mm] are two values
  pulled:
    beam: 100x20
    mesh_type: structured  # or {mesh_types}
    mesh_size: 5 mm
    material: steel
    load: traction  # or {loads}
    force: 20 kN
    definition: [lattice, patch]  # rules for the stiffness of springs: `springtune definitions` lists them
outputs: [sensitivity, deformed, tables]
"""

SHAPE_TEMPLATE = """\
{schema}# `springtune scenes {path}` says what this study asks for, `springtune run {path}` does it.
# Every quantity carries its unit. Names of shapes, groups, loads, quantities, materials and grids are yours;
# {manual} explains every key.
title: "{title}"
materials:
  steel: {{young_modulus: 210 GPa, poisson_ratio: 0.3}}
shapes:
  plate:
    thickness: 1 mm
    outline:  # sides from corner to corner, counter-clockwise, each of a group; with a `centre` it is an arc
      - {{from: [0, 0], group: lower}}
      - {{from: [100 mm, 0], group: right}}
      - {{from: [100 mm, 40 mm], group: upper}}
      - {{from: [0, 40 mm], group: left}}
    holes: [{{circle: {{centre: [50 mm, 20 mm], radius: 8 mm}}, group: hole}}]
    # file: plate.msh  # a mesh file, with groups of its own, in the place of outline, holes, points and refined
    points: {{top: [50 mm, 28 mm]}}  # particles of every mesh, to be held, loaded or asked for
    refined: {{hole: 0.5}}  # edges there, over the mesh size
    loads:
      pull:
        supports: {{left: fixed}}  # or displacements by group or point: {{x: 0 mm}} leaves y free
        forces: {{right: [4 kN, 0]}}  # along x and y, spread over the group
        # pressures: {{hole: 1 MPa}}  # towards the body; gravity: [0, -9.81 m/s^2] needs densities
        quantities:  # what is asked; errors are theirs
          stretch: {{displacement: x, of: right}}
          peak: {{stress: xx, at: top}}
shape_grids:  # all combinations of the values of a grid are its scenes; [8 mm, 4 mm] are two values
  plate:
    shape: plate
    mesh_size: [8 mm, 4 mm]
    material: steel
    definition: [lattice, patch]  # rules for the stiffness of springs: `springtune definitions` lists them
    kinematics: linear  # small strain; nonlinear: springs keep their length law
outputs: [shapes, tables]
"""

LOADS_BY_FORCE = ("compression", "bending", "shear")
"""Loads that a person is told of first; all take a force."""


@click.command(
    epilog=examples(
        "springtune new my-study", "springtune new studies/my-study.yaml", "springtune new my-plate --shape"
    )
)
@click.argument("study")
@click.option("--shape", is_flag=True, help="A study of a shape, an outline with a hole, rather than of a beam.")
def new(study: str, shape: bool) -> None:
    """Write a small study with comments, to be changed into your own; it runs as it is.

    STUDY is its name, or the path of its file. A name alone becomes config/<name>.yaml in a checkout, and <name>.yaml
    elsewhere. What is there already is never overwritten.
    """
    from ..safe_io.atomic import write_text

    path = _path(study)
    if not NAME.fullmatch(path.stem):
        raise WrongCall(f"'{path.stem}' cannot name a study; {NAME_RULE}")
    if os.path.lexists(path):
        raise click.ClickException(f"{path}: is there already; give another name, or change that file")
    if not path.parent.is_dir():
        raise click.ClickException(f"{path.parent}: there is no such folder; make it, or name another")
    try:
        write_text(path, template_text(path, SHAPE_TEMPLATE if shape else TEMPLATE))
    except OSError as error:
        raise click.ClickException(
            f"{path}: cannot be written: {error.strerror or error}; name another place"
        ) from None
    if not path.resolve().is_relative_to(Path.cwd().resolve()):
        click.echo(f"written outside of this folder: {path.resolve()}")
    scenes = 4 if shape else 2
    if checkout_of_run():
        click.echo(f"{path}: {scenes} scenes; change it as you like, and run it:\n  springtune run {path}")
    else:
        click.echo(f"{path}: {scenes} scenes; change it as you like. To run it: {how_to_get_one(path)}")


def _path(given: str) -> Path:
    """Where a study is to be."""
    path = Path(given)
    if path.suffix not in (".yaml", ".yml"):
        if not path.name:
            return path
        path = path.with_name(f"{path.name}.yaml")
        path = CONFIG_FOLDER / path if given == path.stem and checkout_here() else path
    return path


def template_text(path: Path, template: str = TEMPLATE) -> str:
    """Text of a study to begin with."""
    from ..mesh import MESH_TYPES

    schema = _beside(path, SCHEMA)
    words = path.stem.replace("-", " ").replace("_", " ").strip() or path.stem
    return template.format(
        schema=f"# yaml-language-server: $schema={schema}\n" if schema else "",
        manual="config/README.md",
        path=path.as_posix(),
        title=words[0].upper() + words[1:],
        mesh_types=", ".join(name for name in MESH_TYPES if name.isalpha() and name != "structured"),
        loads=", ".join(LOADS_BY_FORCE),
    )


def _beside(path: Path, name: str) -> str | None:
    """A file of the checkout's config, as seen from a study; None where there is none."""
    checkout = checkout_of_run()
    file = checkout / CONFIG_FOLDER / name if checkout else None
    if file is None or not file.is_file():
        return None
    return Path(os.path.relpath(file, path.parent)).as_posix()

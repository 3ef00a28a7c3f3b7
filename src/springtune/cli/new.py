"""A study to begin with."""

import os
from pathlib import Path

import click

from ..registry import NAME, NAME_RULE
from .examples import examples
from .folders import CONFIG_FOLDER
from .options import WrongCall
from .run import checkout_here, library_checkout
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

LOADS_BY_FORCE = ("compression", "bending", "shear")
"""Loads that a person is told of first; all take a force."""


@click.command(epilog=examples("springtune new my-study", "springtune new studies/my-study.yaml"))
@click.argument("study")
def new(study: str) -> None:
    """Write a small study with comments, to be changed into your own; it runs as it is.

    STUDY is its name, or the path of its file. A name alone becomes config/<name>.yaml in a checkout, and <name>.yaml
    elsewhere. What is there already is never overwritten.
    """
    from ..jobs.atomic import write_text

    path = _path(study)
    if not NAME.fullmatch(path.stem):
        raise WrongCall(f"'{path.stem}' cannot name a study; {NAME_RULE}")
    if os.path.lexists(path):
        raise click.ClickException(f"{path}: is there already; give another name, or change that file")
    if not path.parent.is_dir():
        raise click.ClickException(f"{path.parent}: there is no such folder; make it, or name another")
    try:
        write_text(path, template_text(path))
    except OSError as error:
        raise click.ClickException(
            f"{path}: cannot be written: {error.strerror or error}; name another place"
        ) from None
    if not path.resolve().is_relative_to(Path.cwd().resolve()):
        click.echo(f"written outside of this folder: {path.resolve()}")
    click.echo(f"{path}: 2 scenes; change it as you like, and run it:\n  springtune run {path}")


def _path(given: str) -> Path:
    """Where a study is to be."""
    path = Path(given)
    if path.suffix not in (".yaml", ".yml"):
        if not path.name:
            return path
        path = path.with_name(f"{path.name}.yaml")
        path = CONFIG_FOLDER / path if given == path.stem and checkout_here() else path
    return path


def template_text(path: Path) -> str:
    """Text of a study to begin with.

    Parameters
    ----------
    path : Path
        Where it is to be.

    Returns
    -------
    str
    """
    from ..mesh import MESH_TYPES

    schema = _beside(path, SCHEMA)
    words = path.stem.replace("-", " ").replace("_", " ").strip() or path.stem
    return TEMPLATE.format(
        schema=f"# yaml-language-server: $schema={schema}\n" if schema else "",
        manual="config/README.md",
        path=path.as_posix(),
        title=words[0].upper() + words[1:],
        mesh_types=", ".join(name for name in MESH_TYPES if name.isalpha() and name != "structured"),
        loads=", ".join(LOADS_BY_FORCE),
    )


def _beside(path: Path, name: str) -> str | None:
    """A file of the checkout's config, as seen from a study; None where there is none."""
    checkout = Path() if checkout_here() else library_checkout()
    file = checkout / CONFIG_FOLDER / name if checkout else None
    if file is None or not file.is_file():
        return None
    return Path(os.path.relpath(file, path.parent)).as_posix()

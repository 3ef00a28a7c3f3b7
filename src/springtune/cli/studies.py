"""What a study asks for, and what it may ask for."""

from pathlib import Path

import click

from .completion import studies_here
from .examples import examples
from .many import allow, max_scenes


@click.command(
    epilog=examples(
        "springtune scenes config/paper.yaml",
        "springtune scenes --max-scenes 2000000 config/large.yaml",
    )
)
@max_scenes
@click.argument("config", type=click.Path(path_type=Path), shell_complete=studies_here)
def scenes(config: Path, most: int | None) -> None:
    """Say what a study asks for, before anything runs.

    Counts scenes, meshes, references and curves, and what grids share. A study with mistakes is refused with the line
    of each.
    """
    allow(most)
    from ..studies.config.kind import kinds
    from ..studies.config.messages import StudyError
    from ..studies.kinds import load_study  # here, so that --help does not wait for it
    from ..studies.kinds.scenes.summary import summary

    try:
        study = load_study(config)
    except StudyError as error:
        click.echo(str(error), err=True)
        raise SystemExit(1) from None
    parts = [(kind, study.parts[kind.name]) for kind in kinds()]
    click.echo(summary(study, [row for kind, part in parts if part for row in kind.summary(part)]))


@click.command(
    epilog=examples(
        "springtune definitions | grep area",
    )
)
def definitions() -> None:
    """List the definitions of spring stiffness."""
    from .. import DEFINITIONS
    from ..studies.output.text import aligned

    click.echo(aligned([[name, definition.summary] for name, definition in DEFINITIONS.items()], left=2))

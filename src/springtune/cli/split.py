"""A study split over several sites."""

from pathlib import Path

import click

from ..studies.output.text import aligned
from .completion import studies_here
from .examples import examples
from .many import allow, max_scenes

BY = ("mesh", "grid")
"""What may stay together: as `springtune.studies.config.sections.DEALT_BY`, which help does not wait for."""

MOST_PARTS = 1000
"""As `springtune.studies.config.sections.MOST_PARTS`."""


@click.command(
    epilog=examples(
        "springtune split config/paper.yaml --into 3",
        "springtune split config/paper.yaml --into 2 --by grid --out parts",
    )
)
@max_scenes
@click.argument("config", type=click.Path(path_type=Path), shell_complete=studies_here)
@click.option("--into", "count", type=click.IntRange(2, MOST_PARTS), required=True, help="Number of parts.")
@click.option(
    "--by",
    type=click.Choice(BY),
    default=BY[0],
    show_default=True,
    help="What stays together: the scenes of a mesh, but of one that alone is more than a part; or those of a grid.",
)
@click.option("--out", type=click.Path(path_type=Path), help="Folder of the parts; that of the study without.")
def split(config: Path, count: int, by: str, out: Path | None, most: int | None) -> None:
    """Write studies that together ask for the scenes of a study, each for its own.

    CONFIG is the study. Each part, config/<study>-1-of-3.yaml and so on, holds the whole study and says which part of
    it is asked for; it runs as any study does, at any site. `springtune merge` then puts their results together. Parts
    are about equal in what they are expected to cost; a section such as `laying` is in one of them.
    """
    allow(most)
    from ..studies.archive.parts import told, write_parts  # here, so that --help does not wait for it
    from ..studies.config.messages import StudyError
    from ..studies.kinds import load_study

    try:
        study = load_study(config)
        written = write_parts(study, count, by, config.parent if out is None else out)
    except StudyError as error:
        raise click.ClickException(str(error)) from None
    except OSError as error:
        raise click.ClickException(f"{error.filename}: cannot be written: {error.strerror}") from None
    click.echo(aligned(told(written), left=0, right=(1, 2, 3)))
    results = " ".join(f"results/{one.study.name}" for one in written)
    click.echo(f"\nspringtune run {written[0].path}   # and so on, each where it is to run; then, with all results in "
               f"one place,\nspringtune merge {config} {results}")  # fmt: skip

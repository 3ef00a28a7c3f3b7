"""What studies no longer ask for: listed, and removed on request."""

from collections import defaultdict
from pathlib import Path

import click

from ..studies.output.text import bytes_text
from .examples import examples
from .folders import idle, studies

LISTED = 12
"""Files of a folder that are listed by name."""


@click.command(epilog=examples("springtune clean config/paper.yaml", "springtune clean results/paper --remove"))
@click.argument("study", required=False, type=click.Path(path_type=Path))
@click.option("--remove", is_flag=True, help="Remove what is listed.")
def clean(study: Path | None, remove: bool) -> None:
    """List what lies in results/<study> and the study no longer asks for; nothing else is touched.

    STUDY is its YAML file, or results/<study>; without it, all folders in results. Figures and tables of values that
    were taken out, their meshes and stored results, files of jobs that are no more, and what a run that was stopped
    left unfinished. Results that an edit of the code made stale are among them.
    """
    from ..studies.config.messages import StudyError
    from ..studies.runs.orphans import orphans

    try:
        chosen = list(studies(study))
        found = {folder: orphans(one, folder) for one, folder in chosen}
    except StudyError as error:
        raise click.ClickException(f"{error}; nothing is listed or removed") from None
    for folder in found if remove else ():
        idle(folder)
    total, count = 0, 0
    for folder, paths in found.items():
        size = sum(path.stat().st_size for path in paths)
        total, count = total + size, count + len(paths)
        click.echo(f"{folder}: {len(paths)} files, {bytes_text(size)}" if paths else f"{folder}: nothing to remove")
        by_folder = defaultdict(list)
        for path in paths:
            by_folder[path.parent].append(path)
        for parent, members in by_folder.items():
            for path in members[:LISTED]:
                click.echo(f"  {path.relative_to(folder)}  {bytes_text(path.stat().st_size)}")
            if len(members) > LISTED:
                click.echo(f"  {parent.relative_to(folder)}: and {len(members) - LISTED} more")
    if not remove:
        if count:
            again = " ".join(["springtune clean", *([str(study)] if study else []), "--remove"])
            click.echo(f"{count} files, {bytes_text(total)}; `{again}` removes them")
        return
    for folder, paths in found.items():
        for path in paths:
            path.unlink(missing_ok=True)
        for parent in sorted({path.parent for path in paths} - {folder}, reverse=True):  # what is deeper comes first
            if not any(parent.iterdir()):
                parent.rmdir()
    click.echo(f"removed {count} files, {bytes_text(total)}")

"""Whether results are what was made."""

from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from ..safe_io.escapes import shown
from ..studies.output.text import aligned
from .examples import examples
from .folders import idle, studies

if TYPE_CHECKING:
    from ..studies.config.model import Study


@click.command(
    epilog=examples(
        "springtune verify config/paper.yaml",
        "springtune verify results/paper --scenes 50",
        "springtune verify results/paper.crate.zip",
        "springtune verify results/paper.crate.zip --reproduce",
    )
)
@click.argument("study", required=False, type=click.Path(path_type=Path))
@click.option("--scenes", type=click.IntRange(0), default=5, show_default=True, help="Scenes to compute again.")
@click.option("--seed", type=int, default=0, show_default=True, help="Of the drawing of these scenes.")
@click.option("--set-aside", is_flag=True, help="Rename damaged files, so that the next run makes them again.")
@click.option("--reproduce", is_flag=True, help="Compute an archive again, by the program that is in it.")
@click.option("--fresh", is_flag=True, help="Do so in a new environment, even where this one is the same.")
@click.pass_context
def verify(
    context: click.Context,
    study: Path | None,
    scenes: int,
    seed: int,
    set_aside: bool,
    reproduce: bool,
    fresh: bool,
) -> None:
    """Compare all results with their checksums, and compute some scenes again.

    STUDY is its YAML file, or results/<study>; without it, all folders in results. Every file is read: what the stages
    stored, dataset, tables, figures, page. The scenes are drawn from the dataset and computed by the config that it
    holds. Exits with 1 if anything is not as it was made; nothing is changed without --set-aside.

    STUDY may be an archive (springtune archive), of which all files are compared with their checksums. With --reproduce
    it is unpacked into a temporary folder and the whole study is run by the program in it, in this environment where
    that has the packages of its lock file and in a new one otherwise; the datasets are compared bit by bit, apart from
    times. That runs what somebody packed: do it with archives whose origin you trust.
    """
    from ..studies.config.messages import StudyError

    if study is not None and study.suffix == ".zip":
        from .archived import verified

        own = {"scenes", "seed", "set_aside"}
        given = [name for name in own if context.get_parameter_source(name) is ParameterSource.COMMANDLINE]
        if given:
            option = f"--{given[0].replace('_', '-')}"
            raise click.UsageError(
                f"{option} is for results, not for an archive, which --reproduce computes again wholly"
            )
        if not verified(study, reproduce or fresh, fresh):
            raise click.exceptions.Exit(1)
        return
    if reproduce or fresh:
        option = "--reproduce" if reproduce else "--fresh"
        raise click.UsageError(f"{option} is for an archive: springtune archive results/<study> makes one")

    try:
        faults = sum(_verified(one, folder, scenes, seed, set_aside) for one, folder in studies(study))
    except StudyError as error:
        raise click.ClickException(str(error)) from None
    if faults:
        raise click.exceptions.Exit(1)


def _verified(study: "Study", folder: Path, scenes: int, seed: int, set_aside: bool) -> int:
    """Tell of a study; the number of its faults."""
    place = folder.parent.parent
    if place.resolve() != Path.cwd():
        raise click.ClickException(f"{folder}: files are named from where the study was run; call it there: cd {place}")
    from ..studies.archive import verify
    from ..studies.config.messages import StudyError

    found = verify.files(study, folder)
    click.echo(f"{folder}: {found.compared} files compared with their checksums, faults: {len(found.faults)}")
    if found.faults:
        click.echo(aligned(map(list, found.faults), 2))
        if set_aside:
            idle(folder)
        for path in verify.set_aside(found) if set_aside else ():
            click.echo(shown(f"  set aside: {path}"))
        first = "" if set_aside else f"`springtune verify {study.path} --set-aside`, then "
        click.echo(f"  {first}`springtune run {study.path}` makes them again")
    if found.stale:
        click.echo(f"  out of date, since the study or the program changed: {', '.join(found.stale)}")
    aside = verify.left(folder)
    if aside:
        click.echo(
            f"  left behind: {len(aside)} of *.damaged, *.unfinished; `springtune clean {study.path}` lists them"
        )
    if not scenes:
        return len(found.faults)
    try:
        made = list(verify.again(folder, study.path.parent, scenes, seed))
    except (StudyError, ValueError, OSError) as error:
        click.echo(f"no scene is computed again: {shown(error)}")
        return len(found.faults) + 1
    wrong = [one for one in made if not one.agrees]
    largest = max((one.difference for one in made if one.agrees), default=0.0)
    click.echo(
        f"{len(made)} scenes computed again (seed {seed}): {len(made) - len(wrong)} agree, "
        f"to {largest:.1e} of their numbers"
    )
    for one in wrong:
        change = f"{one.before}, now {one.after}" if one.before != one.after else f"differs by {one.difference:.1e}"
        click.echo(shown(f"  {one.labels}: {change}"))
    return len(found.faults) + len(wrong)

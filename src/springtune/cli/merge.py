"""Results of a study's parts put together."""

from pathlib import Path

import click

from .completion import studies_here
from .examples import examples


@click.command(
    epilog=examples(
        "springtune merge config/paper.yaml results/paper-1-of-2 results/paper-2-of-2",
        "springtune merge config/paper.yaml results/paper-1-of-2 --incomplete",
    )
)
@click.argument("config", type=click.Path(path_type=Path), shell_complete=studies_here)
@click.argument("results", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--incomplete", is_flag=True, help="Merge what is there; the study then computes the rest.")
def merge(config: Path, results: tuple[Path, ...], incomplete: bool) -> None:
    """Put the results of a study's parts together in results/<study>, so that its run computes no scene again.

    CONFIG is the whole study, RESULTS are the folders of its parts, which `springtune split` wrote, wherever they were
    computed. All files are compared with their checksums, and parts must be of this very study, computed by the same
    code, packages and Python; nothing is written before all fits. `st.merge` in Python joins datasets of different
    studies.
    """
    from ..studies.archive.merge_parts import MergeError, merge_sites, told  # here, so that --help does not wait for it
    from ..studies.config.messages import StudyError
    from ..studies.kinds import load_study
    from ..studies.runs.locks import LockedError

    try:
        merged = merge_sites(load_study(config), results, incomplete)
    except (StudyError, MergeError, LockedError) as error:
        raise click.ClickException(str(error)) from None
    except OSError as error:
        raise click.ClickException(f"{error.filename}: {error.strerror}; the same command goes on from here") from None
    click.echo(told(merged, results))
    click.echo(f"springtune run {config}   # collects the dataset" + (", and computes the rest" if merged.left else ""))

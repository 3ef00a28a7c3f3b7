"""Commands for results: info, export, browse and archive."""

from importlib.util import find_spec
from pathlib import Path

import click

from ..registry import how_to_install
from ..safe_io.tables import aligned
from ..studies.output.text import bytes_text
from ..studies.runs.source import CONFIG_FOLDER, workflow_folder
from . import examples


@click.command(epilog=examples("springtune info results/paper", "springtune info dataset.nc --study > again.yaml"))
@click.argument("path", type=click.Path(path_type=Path))
@click.option("--study", is_flag=True, help="Print the study that made the dataset, and nothing else.")
def info(path: Path, study: bool) -> None:
    """Show a dataset's scenes by status, errors, groups, versions and inputs.

    PATH is results/<study>, or its dataset.nc.
    """
    from ..studies.output import reading, summing_up

    if study:
        with reading.open(path) as tree:
            if "config" not in tree.attrs:
                raise click.ClickException(f"{path}: has no attribute 'config'; springtune did not write it")
            click.echo(tree.attrs["config"], nl=False)
        return
    click.echo(summing_up.info(path))


@click.command(
    epilog=examples(
        "springtune export results/paper --to cells.csv",
        "springtune export results/paper --group sensitivity --to curves.parquet",
    )
)
@click.argument("path", type=click.Path(path_type=Path))
@click.option("--to", "target", required=True, type=click.Path(path_type=Path), help="File: .csv or .parquet.")
@click.option("--group", default="/", show_default=True, help="Group of the table, such as sensitivity.")
@click.option("--force", is_flag=True, help="Replace the file if it is there.")
def export(path: Path, target: Path, group: str, force: bool) -> None:
    """Write a group of a dataset as a long table, with a row for each combination of its labels.

    PATH is results/<study>, or its dataset.nc.
    """
    from ..studies.output import reading
    from ..studies.output.export import export as write

    with reading.open(path) as tree, reading.guarded(path):
        click.echo(write(tree, target, group, force))


@click.command(epilog=examples("springtune browse results/paper"))
@click.argument("path", type=click.Path(path_type=Path))
def browse(path: Path) -> None:
    """Open the page of a study's results in a browser, and print its path.

    PATH is results/<study>, or a file in it.
    """
    page = (path if path.is_dir() else path.parent) / "index.html"
    if not page.is_file():
        raise click.ClickException(f"{page}: there is no such page; run the study, which writes it")
    click.echo(str(page))
    click.launch(str(page))


@click.command(epilog=examples("springtune archive results/paper", "springtune archive results/paper --out paper.zip"))
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Zip file to write.  [default: results/<study>.crate.zip]")
@click.option("--force", is_flag=True, help="Replace a file that is there.")
def archive(folder: Path, out: Path | None, force: bool) -> None:
    """Pack the results of a study into one zip file for others.

    FOLDER is results/<study>. The file is an RO-Crate: the study with the files that it names, the dataset, page,
    figures, tables, the versions of all packages, and the SHA-256 of every file.
    """
    from ..studies.kinds import load_study
    from ..studies.runs.locks import claimed_study

    config = claimed_study(folder) or folder.parent.parent / CONFIG_FOLDER / f"{folder.name}.yaml"
    if not config.is_file():
        raise ValueError(f"{folder}: there is no {config}; give the results/<study> of a study that was run")
    if find_spec("rocrate") is None:
        raise click.ClickException(f"the library rocrate is missing; {how_to_install('archive')}")
    from ..studies.archive import pack

    target = out or folder.with_name(f"{folder.name}.crate.zip")
    if target.is_dir() or target.suffix != ".zip":
        raise click.UsageError(f"--out: {target} is no name of a zip file; give one such as {folder.name}.zip")
    if target.exists() and not force:
        raise click.ClickException(f"{target}: is there already; give --force, or another name by --out")
    names = pack(load_study(config), folder, target)
    click.echo(f"{target}: {len(names)} files, {bytes_text(target.stat().st_size)}")


@click.command(epilog=examples("springtune docs"))
def docs() -> None:
    """Print where the pages, the manual of studies and the examples are."""
    places = {"pages": "docs/README.md", "keys of a study": "config/README.md", "examples": "examples"}
    click.echo(aligned(((what, workflow_folder() / place) for what, place in places.items()), left=0))

"""Commands for results: info, export, browse and archive."""

import tempfile
from importlib.util import find_spec
from pathlib import Path

import click

from ..registry import how_to_install
from ..studies.output.text import bytes_text
from . import examples
from .options import studies


@click.command(epilog=examples("springtune info results/paper", "springtune info dataset.nc --study > again.yaml"))
@click.argument("path", type=click.Path(path_type=Path))
@click.option("--study", is_flag=True, help="Print the study that made the dataset, and nothing else.")
def info(path: Path, study: bool) -> None:
    """Show what a dataset holds: how its scenes ended, its errors, its groups, and where it comes from.

    PATH is results/<study>, or its dataset.nc.
    """
    from ..studies.output import reading, summing_up

    reading.check_opens(path)
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
        "springtune export results/paper --group sensitivity --select beam=200x30 --to curves.parquet",
        "springtune export results/paper --group fields --select beam=200x40,mesh_type=free --to network.nc",
        "springtune export results/paper --select beam=200x40,load=traction --to traction.pvd",
        "springtune export results/shapes --select shape=cook,definition=lattice --to cook.vtu",
    )
)
@click.argument("path", type=click.Path(path_type=Path))
@click.option(
    "--to",
    "target",
    required=True,
    type=click.Path(path_type=Path),
    help="File: .csv, .parquet, .zarr, .nc, .vtu or .pvd.",
)
@click.option("--group", default="/", show_default=True, help="Group of the table, such as sensitivity.")
@click.option("--variables", default="", help="Names of variables, with commas between; all without.")
@click.option("--select", "pairs", multiple=True, help="Labels to keep, such as beam=200x40,mesh_size='5 mm'.")
@click.option("--force", is_flag=True, help="Replace the file if it is there.")
def export(path: Path, target: Path, group: str, variables: str, pairs: tuple[str, ...], force: bool) -> None:
    """Write a dataset as a long table, one row a cell (CSV, Parquet), whole (Zarr), or one mesh with its fields (.nc).

    For ParaView: one scene with displacements, their error, and each spring's stiffness and force (.vtu), or a
    collection of all that are selected (.pvd); of shapes, by shape, load and definition, the networks that are drawn.

    PATH is results/<study>, or its dataset.nc.
    """
    from ..studies.output import reading
    from ..studies.output.export import export as write
    from ..studies.output.export import selected

    names = [name.strip() for name in variables.split(",") if name.strip()]
    reading.check_opens(path)
    with reading.open(path) as tree, reading.guarded(path):
        click.echo(write(tree, target, group, names, selected(pairs), force))


@click.command(
    epilog=examples(
        "springtune browse results/paper", "springtune browse results/paper/dataset.nc --port 8000 --no-open"
    )
)
@click.argument("dataset", type=click.Path(path_type=Path))
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="Port; by default one that is free.")
@click.option("--no-open", is_flag=True, help="Print the address, and open no browser.")
def browse(dataset: Path, port: int, no_open: bool) -> None:
    """Browse a study's results: serve the page of a dataset to this machine alone, until Ctrl-C.

    DATASET is results/<study>/dataset.nc, or its folder. The address holds a token, anew each time.
    """
    from ..studies.output.browse.server import Server  # here, so that --help does not wait for it
    from ..studies.output.reading import check_opens

    check_opens(dataset)
    server = Server(dataset, port)
    try:
        with server:
            click.echo(f"{server.address}\nCtrl-C ends it.")
            if no_open:
                server.serve_forever()
            # All users of the machine see a browser's arguments, so the address goes through a private file.
            with tempfile.TemporaryDirectory(prefix="springtune-") as folder:
                way = Path(folder, "browse.html")
                way.write_text(f'<meta http-equiv="refresh" content="0; url={server.address}">')
                click.launch(str(way))
                server.serve_forever()
    except KeyboardInterrupt:
        click.echo()


@click.command(
    epilog=examples("springtune archive results/paper", "springtune archive config/paper.yaml --out paper.zip")
)
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Zip file to write.  [default: results/<study>.crate.zip]")
@click.option("--force", is_flag=True, help="Replace a file that is there.")
def archive(study: Path, out: Path | None, force: bool) -> None:
    """Pack the results of a study into one zip file, to be cited and handed on.

    STUDY is its YAML file, or results/<study>. The file is an RO-Crate: the study and the files that it names, dataset,
    page, figures, tables, the versions of all packages, and the SHA-256 of every file.
    """
    [(found, folder)] = studies(study)
    if find_spec("rocrate") is None:
        raise click.ClickException(f"the library rocrate is missing; {how_to_install('archive')}")
    from ..studies.archive import pack

    target = out or folder.with_name(f"{folder.name}.crate.zip")
    if target.is_dir() or target.suffix != ".zip":
        raise click.UsageError(f"--out: {target} is no name of a zip file; give one such as {folder.name}.zip")
    if target.exists() and not force:
        raise click.ClickException(f"{target}: is there already; give --force, or another name by --out")
    names = pack(found, folder, target)
    click.echo(f"{target}: {len(names)} files, {bytes_text(target.stat().st_size)}")

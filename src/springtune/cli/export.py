"""A dataset in other forms."""

from pathlib import Path

import click

from ..safe_io.escapes import shown
from .examples import examples
from .options import WrongCall


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
    from ..studies.output.export import RequestError, selected
    from ..studies.output.export import export as write

    names = [name.strip() for name in variables.split(",") if name.strip()]
    try:
        reading.check_opens(path)
        with reading.open(path) as tree, reading.guarded(path):
            click.echo(write(tree, target, group, names, selected(pairs), force))
    except RequestError as error:
        raise WrongCall(shown(error)) from None
    except (OSError, ValueError) as error:
        raise click.ClickException(shown(error)) from None

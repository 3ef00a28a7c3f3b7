"""Serve the page of a dataset on the loopback address."""

import tempfile
from pathlib import Path

import click

from ..safe_io.escapes import shown
from .examples import examples


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

    try:
        check_opens(dataset)
        server = Server(dataset, port)
    except (OSError, ValueError) as error:
        raise click.ClickException(shown(error)) from None
    try:
        with server:
            click.echo(f"{server.address}\nCtrl-C ends it.")
            if no_open:
                server.serve_forever()
            # By way of a file that only its owner can read: what a browser is called with, all users of a machine see.
            with tempfile.TemporaryDirectory(prefix="springtune-") as folder:
                way = Path(folder, "browse.html")
                way.write_text(f'<meta http-equiv="refresh" content="0; url={server.address}">')
                click.launch(str(way))
                server.serve_forever()
    except KeyboardInterrupt:
        click.echo()

"""Make a study's outputs: figures in PNG and PDF files, and tables."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from springtune.registry import import_name
from springtune.safe_io.files import write_bytes, write_json

from ..config.kind import outputs
from . import reading

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from ..config.kind import Output


def run(dataset: str | Path, folder: str | Path, *names: str) -> list[Path]:
    """Draw the figures of outputs into ``folder/figures``, and write their other files."""
    made: list[Path] = []
    figures = Path(folder) / "figures"
    with reading.open(dataset) as tree:
        _choose_style(tree)
        for output in (outputs()[name] for name in names):
            if output.module:
                made += _draw(output, tree, figures)
            into = Path(folder) / output.into
            if output.page:
                from . import page  # here: few jobs write the page

                made += [into / name for name in page.write(tree, into)]
            if output.write:
                made += [into / name for name in import_name(output.write)(tree, into)]
    return made


def main(dataset: str, folder: str, record: str, digest: str, *names: str) -> None:
    """Make outputs and write the record of it."""
    run(dataset, folder, *names)
    write_json(record, {"digest": digest})


def _choose_style(tree: xr.DataTree) -> None:
    """Draw at the width and with the size of text that the study asks for."""
    asked = {name: tree.attrs.get(f"figure_{name}") for name in ("width", "font_size")}
    if chosen := {name: float(value) for name, value in asked.items() if value}:
        from . import style  # here: a job that only writes tables needs no matplotlib

        style.choose(**chosen)


def _draw(output: "Output", tree: xr.DataTree, folder: Path) -> Iterator[Path]:
    # Here: a job that only writes tables needs no matplotlib.
    import matplotlib.pyplot as plt
    import numpy as np

    from . import style

    single = [(output.name, style.styled(_single), {"output": output})]
    drawn: Any = single if output.draw else import_name(output.plot)(tree)
    for stem, plot, selection in drawn:
        figure = np.ravel(plot(tree, **selection))[0].figure
        for ending, content in style.png_and_pdf(figure).items():
            write_bytes(folder / f"{stem}.{ending}", content)
            yield folder / f"{stem}.{ending}"
        plt.close(figure)


def _single(tree: xr.DataTree, output: "Output") -> "Axes":
    """Draw the figure of an output that draws on one panel."""
    from . import style

    assert output.draw
    _, ((panel,),) = style.panels(None, figsize=(style.COLUMN_WIDTH, 2.4))
    output.draw(panel, tree[output.name].to_dataset())
    return panel


if __name__ == "__main__":
    import gc
    import os

    import fontTools.subset

    os.environ["MPLBACKEND"] = "Agg"
    gc.set_threshold(100_000, 20, 100)  # looking for garbage among figures takes a tenth of the drawing
    # A PDF has the place of each letter; reading how a font would place them takes a third of its time.
    # Not public: without these defaults PDFs are drawn more slowly.
    getattr(fontTools.subset.Options, "_drop_tables_default", []).extend(["GDEF", "GPOS", "GSUB"])
    main(*sys.argv[1:])

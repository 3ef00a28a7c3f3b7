"""What a study's outputs show of a dataset: figures in PNG and PDF files, and tables."""

import gc
import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from ..jobs import atomic
from ..kinds import outputs

if TYPE_CHECKING:
    from ..kinds.base import Output


def run(dataset: str | Path, folder: str | Path, *names: str) -> list[str]:
    """Draw the figures of outputs into ``folder/figures`` and write their tables into ``folder/tables``.

    Parameters
    ----------
    dataset : str or Path
    folder : str or Path
    *names : str
        Keys of `springtune.kinds.outputs`.

    Returns
    -------
    list of str
        Stems of the figures and names of the tables written.
    """
    with xr.open_datatree(dataset, engine="netcdf4") as tree:
        tree.load()
    made: list[str] = []
    for output in (outputs()[name] for name in names):
        if output.plot:
            made += _draw(output, tree, Path(folder) / "figures")
        if output.page:
            from . import page  # here: few jobs write the page

            made += page.write(tree, Path(folder) / "tables")
        elif output.write:
            made += import_module(f"springtune.{output.write}").write(tree, Path(folder) / "tables")
    return made


def _draw(output: "Output", tree: xr.DataTree, folder: Path) -> Iterator[str]:
    # Here, since what only writes tables does without.
    import matplotlib.pyplot as plt
    import numpy as np

    from ..output.canvas import png_and_pdf

    module, _, function = output.plot.partition(":")
    for stem, plot, selection in getattr(import_module(f"springtune.{module}"), function)(tree):
        figure = np.ravel(plot(tree, **selection))[0].figure
        for ending, content in png_and_pdf(figure).items():
            atomic.write_bytes(folder / f"{stem}.{ending}", content)
        plt.close(figure)
        yield stem


if __name__ == "__main__":
    import os

    os.environ["MPLBACKEND"] = "Agg"
    # What figures leave behind is less than looking for it costs.
    gc.disable()
    run(*sys.argv[1:])

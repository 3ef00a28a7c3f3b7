"""What a study's outputs show of a dataset, drawn into PNG and PDF files."""

import gc
import sys
from importlib import import_module
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

from ..jobs import atomic
from ..kinds import outputs as known
from ..output.canvas import png_and_pdf


def run(dataset, folder, *outputs):
    """Draw figures of a dataset into a folder.

    Parameters
    ----------
    dataset : str or Path
    folder : str or Path
    *outputs : str
        Names of outputs, see `springtune.kinds.outputs`.

    Returns
    -------
    list of str
        Stems of the files written.
    """
    with xr.open_datatree(dataset, engine="h5netcdf") as tree:
        tree.load()
    drawn = []
    for name in outputs:
        module, _, function = known()[name].plot.partition(":")
        for stem, plot, selection in getattr(import_module(f"springtune.{module}"), function)(tree):
            figure = np.ravel(plot(tree, **selection))[0].figure
            for ending, content in png_and_pdf(figure).items():
                atomic.write_bytes(Path(folder) / f"{stem}.{ending}", content)
            plt.close(figure)
            drawn.append(stem)
    return drawn


if __name__ == "__main__":
    matplotlib.use("Agg")
    # What figures leave behind is less than looking for it costs.
    gc.disable()
    run(*sys.argv[1:])

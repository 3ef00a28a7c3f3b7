"""Stage `figures_scenes`: error against mesh size, and deformed networks."""

import sys

import xarray as xr

from ..kinds.scenes import figure_deformed as deformed
from ..kinds.scenes import figure_size as size


def run(dataset, folder, *kinds):
    """Draw figures of a dataset's scenes into a folder: of the kinds ``size`` and ``deformed``."""
    drawers = {"size": size, "deformed": deformed}
    with xr.open_datatree(dataset, engine="h5netcdf") as tree:
        tree.load()
        for kind in kinds:
            drawers[kind].draw(tree, folder)


if __name__ == "__main__":
    run(*sys.argv[1:])

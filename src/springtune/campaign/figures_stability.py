"""Stage `figures_stability`: figures of the experiments on stability."""

import sys

import xarray as xr

from ..kinds.stability import figures as stability


def run(dataset, folder):
    """Draw the experiments on stability into a folder."""
    with xr.open_datatree(dataset, engine="h5netcdf") as tree:
        stability.draw(tree.load(), folder)


if __name__ == "__main__":
    run(*sys.argv[1:])

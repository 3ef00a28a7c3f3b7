"""Stage `figures_laying`: the figure of laid strips."""

import sys

import xarray as xr

from ..kinds.laying import figures as laying


def run(dataset, folder):
    """Draw the laid strips into a folder."""
    with xr.open_datatree(dataset, engine="h5netcdf") as tree:
        laying.draw(tree.load(), folder)


if __name__ == "__main__":
    run(*sys.argv[1:])

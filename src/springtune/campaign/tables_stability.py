"""Stage `tables_stability`: the page of the experiments on stability."""

import sys

import xarray as xr

from ..kinds.stability import tables as stability


def run(dataset, folder):
    """Write the page of the experiments on stability into a folder."""
    with xr.open_datatree(dataset, engine="h5netcdf") as tree:
        stability.write(tree.load(), folder)


if __name__ == "__main__":
    run(*sys.argv[1:])

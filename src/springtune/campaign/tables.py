"""Stage `tables`: the tables as CSV and as one HTML page."""

import sys

import xarray as xr

from ..kinds.scenes import tables as page


def run(dataset, folder):
    """Write the tables of a dataset into a folder."""
    with xr.open_datatree(dataset, engine="h5netcdf") as tree:
        page.write(tree.load(), folder)


if __name__ == "__main__":
    run(*sys.argv[1:])

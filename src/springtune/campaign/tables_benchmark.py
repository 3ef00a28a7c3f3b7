"""Stage `tables_benchmark`: the page of the benchmark."""

import sys

import xarray as xr

from ..kinds.benchmark import tables as benchmark


def run(dataset, folder):
    """Write the page of the benchmark into a folder."""
    with xr.open_datatree(dataset, engine="h5netcdf") as tree:
        benchmark.write(tree.load(), folder)


if __name__ == "__main__":
    run(*sys.argv[1:])

"""Stage `figures_benchmark`: figures of the benchmark."""

import sys

import xarray as xr

from ..kinds.benchmark import figures as benchmark


def run(dataset, folder):
    """Draw the benchmark into a folder."""
    with xr.open_datatree(dataset, engine="h5netcdf") as tree:
        benchmark.draw(tree.load(), folder)


if __name__ == "__main__":
    run(*sys.argv[1:])

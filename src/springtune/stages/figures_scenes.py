"""Stage `figures_scenes`: error against mesh size, and deformed networks."""

import sys

import xarray as xr

from ..figures import deformed, size


def run(dataset, folder):
    """Draw the figures of a dataset's scenes into a folder."""
    with xr.open_datatree(dataset, engine="h5netcdf") as tree:
        tree.load()
        size.draw(tree, folder)
        deformed.draw(tree, folder)


if __name__ == "__main__":
    run(*sys.argv[1:])

"""Stage `figures_sensitivity`: the sensitivity curves."""

import sys

import xarray as xr

from ..kinds.scenes import figure_sensitivity as sensitivity


def run(dataset, folder):
    """Draw the sensitivity curves of a dataset into a folder."""
    with xr.open_datatree(dataset, engine="h5netcdf") as tree:
        sensitivity.draw(tree.load(), folder)


if __name__ == "__main__":
    run(*sys.argv[1:])

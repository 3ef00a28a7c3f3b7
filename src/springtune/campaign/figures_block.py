"""Stage `figures_block`: the figure of a pressed block."""

import sys

import xarray as xr

from ..kinds.scenes import figure_block as block


def run(dataset, folder):
    """Draw the pressed block into a folder."""
    with xr.open_datatree(dataset, engine="h5netcdf") as tree:
        block.draw(tree.load(), folder)


if __name__ == "__main__":
    run(*sys.argv[1:])

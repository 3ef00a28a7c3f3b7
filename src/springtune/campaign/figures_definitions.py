"""Stage `figures_definitions`: figures that compare definitions."""

import sys

import xarray as xr

from ..kinds.moduli import figures as definitions


def run(dataset, folder):
    """Draw the comparison of definitions into a folder."""
    with xr.open_datatree(dataset, engine="h5netcdf") as tree:
        definitions.draw(tree.load(), folder)


if __name__ == "__main__":
    run(*sys.argv[1:])

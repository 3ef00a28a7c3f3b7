"""Stage `tables_definitions`: tables that compare definitions."""

import sys

import xarray as xr

from ..kinds.moduli import tables as definitions


def run(dataset, folder):
    """Write the tables that compare the definitions of a dataset into a folder."""
    with xr.open_datatree(dataset, engine="h5netcdf") as tree:
        definitions.write(tree.load(), folder)


if __name__ == "__main__":
    run(*sys.argv[1:])

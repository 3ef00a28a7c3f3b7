"""Write the tables of a dataset."""

import sys
from importlib import import_module

import xarray as xr


def run(dataset, folder, *modules):
    """Write tables into a folder.

    Parameters
    ----------
    dataset : str or Path
    folder : str or Path
    *modules : str
        Modules that write them, see `springtune.kinds.base.Output.write`.
    """
    with xr.open_datatree(dataset, engine="h5netcdf") as tree:
        tree.load()
        for module in modules:
            import_module(f"springtune.{module}").write(tree, folder)


if __name__ == "__main__":
    run(*sys.argv[1:])

"""Write and read a dataset with two copies of HDF5: ``python two_hdf5.py FIRST SECOND OUTPUT``.

netCDF4 and h5py each bring a copy. FIRST and SECOND are their names in the order in which they are imported.
"""

import importlib
import sys


def check(path):
    """Write numbers, flags and texts, most cells of them empty, and read them by both libraries."""
    import h5py
    import netCDF4
    import numpy as np
    import xarray as xr

    import springtune as st
    from springtune.studies.output import dataset

    cells = ("beam", "cell")
    texts = np.full((40, 4000), "", dtype=object)
    texts[7, 11:13] = "buckles, \u03bb < 1"
    wanted = xr.Dataset(
        {
            "displacement": (cells, np.random.default_rng(1).random(texts.shape), {"units": "m"}),
            "message": (cells, texts, {"units": "1"}),
            "status": (cells, (texts != "").astype("int8"), {"units": "1"}),
        },
        {"beam": ("beam", np.array([f"{n}x20" for n in range(40)], dtype=object))},
    )
    assert wanted.message.nbytes > dataset.CHUNK  # so that netCDF4 writes numbers and h5py these texts, into one file
    dataset.write(path, {"/": wanted, "/below": wanted}, {"springtune_version": "0"})

    def opened(engine):
        return xr.open_datatree(path, engine=engine) if engine else st.open(path)

    for engine in (None, "netcdf4", "h5netcdf"):
        with opened(engine) as first, opened(engine) as second:
            for tree in (first, second):
                assert tree.to_dataset().equals(wanted) and tree["below"].to_dataset().equals(wanted)
    with netCDF4.Dataset(path) as one, h5py.File(path) as other:
        assert (one["displacement"][:] == other["displacement"][:]).all()
        assert (one["message"][7] == other["message"].asstr()[7]).all()
    again = path.replace(".nc", "_again.nc")
    with opened("netcdf4") as tree:
        tree.load().to_netcdf(again, engine="h5netcdf")
    with st.open(again) as tree:
        assert tree["below"].to_dataset().equals(wanted)
    print("HDF5", netCDF4.__hdf5libversion__, "of netCDF4 and", h5py.version.hdf5_version, "of h5py")


if __name__ == "__main__":
    for name in sys.argv[1:3]:
        importlib.import_module(name)
    check(sys.argv[3])

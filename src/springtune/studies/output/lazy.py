"""Open a dataset lazily; xarray's public API reads all texts on opening."""

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import NetCDF4DataStore
from xarray.backends.netCDF4_ import NetCDF4ArrayWrapper
from xarray.core.indexing import LazilyIndexedArray

from springtune.safe_io.inputs import BeyondBound, bounded

from .dataset import CHUNK

LARGE_ARRAY = 2**20
"""Texts of arrays with more bytes are read on demand."""


class _Texts(NetCDF4ArrayWrapper):
    """Texts of a file, read within bounded memory, since their length is unknown before."""

    __slots__ = ()

    def _getitem(self, key: Any) -> Any:
        most = self.datastore.most
        try:
            with bounded(most):
                return super()._getitem(key)  # type: ignore[no-untyped-call]
        except (BeyondBound, RuntimeError):  # HDF5 says of memory that it lacks that there is an error
            raise ValueError(
                f"{self.datastore._filename}: its texts '{self.variable_name}' are damaged, or take more than "
                f"{most / 1e9:.3g} GB; select what is needed first, or run the study again"
            ) from None


class _Store(NetCDF4DataStore):
    most: float

    def open_store_variable(self, name: str, var: Any) -> xr.Variable:
        var.set_var_chunk_cache(4 * CHUNK)  # not 16 MB each
        found = super().open_store_variable(name, var)
        if found.encoding["dtype"] is not str or found.nbytes <= LARGE_ARRAY:
            return found
        # As objects, they are left in the file; as `str` all are read, and get the width of the longest.
        found.encoding["dtype"] = np.dtype(object)
        array = _Texts(name, self)  # type: ignore[no-untyped-call]
        return xr.Variable(found.dims, LazilyIndexedArray(array), found.attrs, found.encoding)


def opened(path: Path, most: float) -> xr.DataTree:
    """Open the tree of a file."""
    root = _Store.open(str(path))  # type: ignore[no-untyped-call]
    root.most = most
    found = {}
    try:
        for name in ("/", *(f"/{name}" for name in root.ds.groups)):
            store = _Store(root._manager, group=name)  # type: ignore[no-untyped-call]
            store.most = most
            found[name] = xr.open_dataset(store)
        tree = xr.DataTree.from_dict(found)
    except BaseException:
        root.close()
        raise
    tree.set_close(root.close)
    return tree

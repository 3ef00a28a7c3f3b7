"""Arrays of a netCDF-4 file by h5py, which takes a fourth of the time of h5netcdf, and without xarray."""

from __future__ import annotations

from typing import Any, NamedTuple

import h5py
import numpy as np

BARE_DIMENSION = "This is a netCDF dimension but not a netCDF variable."
"""Start of the name of a dimension without labels, which is never read."""

HIDDEN = {"CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_NCProperties", "_Netcdf4Coordinates", "_Netcdf4Dimid"}
"""Attributes by which the format knows dimensions."""


class Stored(NamedTuple):
    """Variable of an open file."""

    dims: tuple[str, ...]
    attributes: dict[str, Any]
    array: h5py.Dataset

    def read(self, cells: Any = ...) -> np.ndarray:
        """Values of cells; texts as objects, since an array of texts has the room of the longest one for each."""
        texts = h5py.check_string_dtype(self.array.dtype)
        values = (self.array.asstr(errors="replace") if texts else self.array)[cells]
        return np.asarray(values, dtype=object if texts else None)


def variables(group: h5py.Group) -> dict[str, Stored]:
    """Variables of a group by name."""
    # By address: HDF5 looks through the whole file for the name of what a reference is to.
    arrays = {name: one for name, one in group.items() if isinstance(one, h5py.Dataset)}
    above = {name: one for name, one in group.parent.items() if isinstance(one, h5py.Dataset)}
    names = {_address(one.id): name for name, one in (above | arrays).items()}
    found = {}
    for name, array in arrays.items():
        if not is_bare(array):
            scales = [one[0] for one in array.attrs.get("DIMENSION_LIST", ())]
            dims = [names[_address(h5py.h5r.dereference(scale, array.id))] for scale in scales]
            dims = dims or [name] * ("CLASS" in array.attrs)
            if array.shape is None or len(dims) != array.ndim:
                raise ValueError(f"'{name}' has no shape, or has no dimension scale for each dimension")
            found[name] = Stored(tuple(dims), attributes_of(array), array)
    return found


def _address(one: h5py.h5g.ObjectID) -> int:
    return int(h5py.h5o.get_info(one).addr)


def is_bare(array: h5py.Dataset) -> bool:
    """Return whether an array stands for a dimension without labels."""
    return str(array.attrs.get("NAME", b""), "latin-1").startswith(BARE_DIMENSION)


def attributes_of(one: h5py.Group | h5py.Dataset) -> dict[str, Any]:
    """Attributes of a group or of an array; those of one value as a scalar, and texts of netCDF's own library."""
    found = {}
    for name in one.attrs:
        if name not in HIDDEN:
            value = one.attrs[name]
            value = value.ravel()[0] if np.ndim(value) and np.size(value) == 1 else value
            found[name] = value.decode(errors="replace") if isinstance(value, bytes) else value
    return found


def add_attributes(one: h5py.Group | h5py.Dataset, given: dict[str, Any]) -> None:
    """Write attributes, numbers as arrays, as netCDF's own library does."""
    for name, value in given.items():
        one.attrs[name] = value if isinstance(value, str) else np.atleast_1d(value)


def add_dimension(group: h5py.Group, name: str, size: int) -> h5py.Dataset:
    """Dimension of the array of its labels, or of none."""
    scale = group[name] if name in group else group.create_dataset(name, (size,), ">f4")
    scale.make_scale(name if scale.dtype != ">f4" else f"{BARE_DIMENSION}{size:10d}")
    return scale

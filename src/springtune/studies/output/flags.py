"""Flags by the CF conventions, and fill values."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

NOT_REQUESTED = "not_requested"


def is_flagged(array: xr.DataArray) -> bool:
    """Return whether a variable holds flags."""
    return "flag_meanings" in array.attrs and array.dtype.kind in "iuf"


def flag_words(array: xr.DataArray) -> dict[int, str]:
    """Meanings of flags by value."""
    values = np.atleast_1d(array.attrs.get("flag_values", [])).tolist()
    return dict(zip(map(int, values), str(array.attrs["flag_meanings"]).split()))


def nothing(arrays: Sequence[xr.DataArray]) -> tuple[object, np.dtype[Any]]:
    """Fill value for some arrays, and a type that holds it and all their values."""
    if arrays[0].dtype.kind in "OUS":
        return "", np.dtype(object)
    together = np.result_type(*(array.dtype for array in arrays))
    if is_flagged(arrays[0]):
        silent = [value for value, word in flag_words(arrays[0]).items() if word == NOT_REQUESTED]
        return (silent or [-1])[0], np.dtype("int8") if together.kind == "f" else together
    return np.nan, together if together.kind == "f" else np.dtype(float)

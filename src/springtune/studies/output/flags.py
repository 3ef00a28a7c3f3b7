"""Flags, as the CF conventions have them, and what a cell without a value holds."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

NOT_REQUESTED = "not_requested"
"""Flag of a cell that a study does not ask for."""


def is_flagged(array: xr.DataArray) -> bool:
    """Whether a variable holds flags."""
    return "flag_meanings" in array.attrs and array.dtype.kind in "iuf"


def flag_words(array: xr.DataArray) -> dict[int, str]:
    """Meanings of flags by their values."""
    values = np.atleast_1d(array.attrs.get("flag_values", [])).tolist()
    return dict(zip(map(int, values), str(array.attrs["flag_meanings"]).split()))


def nothing(arrays: Sequence[xr.DataArray]) -> tuple[object, np.dtype[Any]]:
    """What a cell without a value holds, and the type that holds it beside all values of some arrays."""
    if arrays[0].dtype.kind in "OUS":
        return "", np.dtype(object)
    together = np.result_type(*(array.dtype for array in arrays))
    if is_flagged(arrays[0]):
        silent = [value for value, word in flag_words(arrays[0]).items() if word == NOT_REQUESTED]
        return (silent or [-1])[0], np.dtype("int8") if together.kind == "f" else together
    return np.nan, together if together.kind == "f" else np.dtype(float)

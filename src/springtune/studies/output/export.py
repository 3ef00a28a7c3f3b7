"""Export a group of a dataset as one long table."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pandas as pd
import xarray as xr

from springtune.problem.quantities import nearest
from springtune.problem.status import Status
from springtune.safe_io.atomic import check_folder, replacing

from ...registry import how_to_install
from .dataset import flag_words, is_flagged

TABLE_ENDINGS = (".csv", ".parquet")

MOST_NUMBERS = 50_000_000
"""Most rows times columns: a table repeats the labels of all dimensions in each row."""


class RequestError(ValueError):
    """The request does not fit the dataset, or names an unknown format."""

    wrong_call = True


def table(tree: xr.DataTree, group: str = "/") -> pd.DataFrame:
    """Return a group as a table: a row for each requested cell, a column for each dimension and variable.

    Flags are words; other values are in SI units, which are in brackets behind the names.
    """
    name = "/" + group.strip("/")
    known = [node.path for node in tree.subtree]
    if name not in known:
        raise RequestError(f"--group {group}: the dataset has no such group; {nearest(name, known)}")
    data = tree[name].to_dataset().reset_coords()
    if not data.variables:
        others = ", ".join(node.path.strip("/") for node in tree.subtree if node.data_vars)
        raise RequestError(f"--group {group}: the group has no variables; give one of {others}")
    rows = 1
    for size in data.sizes.values():
        rows *= size
    if rows * len(data.variables) > MOST_NUMBERS:
        raise ValueError(
            f"group '{group}': {rows} rows of {len(data.variables)} columns, and at most {MOST_NUMBERS} values are "
            "written; select in Python: springtune.open(path)['group'].sel(...).to_dataframe()"
        )
    asked = data.status != Status.NOT_REQUESTED if "status" in data else None
    for variable in data.data_vars:
        if is_flagged(data[variable]):
            words = flag_words(data[variable])
            found = np.array([words.get(int(value), "") for value in data[variable].values.ravel()], dtype=object)
            data[variable] = data[variable].dims, found.reshape(data[variable].shape)
    units = {
        str(one): f"{one} [{data[one].attrs['units']}]"
        for one in data.variables
        if data[one].attrs.get("units", "1") not in ("", "1")
    }
    frame = data.to_dataframe().reset_index() if data.sizes else pd.DataFrame([{n: data[n].item() for n in data}])
    if asked is not None and asked.dims:
        wanted = asked.broadcast_like(xr.Dataset(coords=data.coords)) if set(asked.dims) < set(data.sizes) else asked
        frame = frame[wanted.transpose(*data.sizes).values.ravel()]
    return frame.rename(columns=units)


def export(tree: xr.DataTree, path: Path, group: str = "/", force: bool = False) -> str:
    """Write a group as CSV or Parquet, by the ending of a path; return what was written in words."""
    if path.suffix.lower() not in TABLE_ENDINGS:
        raise RequestError(
            f"{path}: '{path.suffix}' is no format to export to; give a file in {' or '.join(TABLE_ENDINGS)}"
        )
    check_folder(path)
    if path.exists() and not force:
        raise ValueError(f"{path}: is there already; give another name, or --force to replace it")
    if path.suffix.lower() == ".parquet" and not find_spec("pyarrow"):
        raise ValueError(f"{path}: Parquet needs pyarrow, which is not installed; {how_to_install('export')}")
    frame = table(tree, group)
    with replacing(path) as unfinished:
        if path.suffix.lower() == ".csv":
            frame.to_csv(unfinished, index=False)
        else:
            frame.to_parquet(unfinished, index=False)
    return f"{path}: {len(frame)} rows, {len(frame.columns)} columns of group '{group}'"

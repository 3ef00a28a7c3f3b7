"""Results of scenes on disk: one HDF5 file a mesh and stage, results by a hash of all they depend on.

Scalars and texts of all results are one JSON text, since a group with attributes for each would cost more than solving
it; arrays are datasets. A stage computes only the results that the file does not hold. What an earlier grid asked for
stays, so going back to it computes nothing. Nothing but the dataset is meant for users.
"""

import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np

SCALARS = "scalars"
"""Dataset of what is not an array."""


def stored(path: str | Path) -> set[str]:
    """Keys of the results in a file; an unreadable file holds none.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    set of str
    """
    try:
        with h5py.File(path) as file:
            return set(_scalars(file))
    except (OSError, KeyError, ValueError):
        return set()


def _scalars(file: h5py.File) -> dict[str, dict[str, Any]]:
    scalars: dict[str, dict[str, Any]] = json.loads(file[SCALARS][()])
    return scalars


def read(path: str | Path, names: Iterable[str], fields: Sequence[str] = ()) -> dict[str, dict[str, Any]]:
    """Read results.

    Parameters
    ----------
    path : str or Path
    names : iterable of str
        Keys of the results to read.
    fields : sequence of str, optional
        Arrays to read besides scalars.

    Returns
    -------
    dict of str to dict
        Results by key: scalars, texts and the arrays asked for.
    """
    with h5py.File(path) as file:
        scalars = _scalars(file)
        results = {name: scalars[name] for name in names}
        for name, result in results.items() if fields else ():
            if name in file:
                result |= {label: file[name][label][()] for label in fields if label in file[name]}
    return results


def read_one(folder: str | Path, key: str, fields: Sequence[str] = ()) -> dict[str, Any]:
    """Read a result that has a file to itself, named by its key.

    Parameters
    ----------
    folder : str or Path
    key : str
    fields : sequence of str, optional
        Arrays to read besides scalars.

    Returns
    -------
    dict
        Scalars, texts and the arrays asked for.
    """
    return read(Path(folder) / f"{key}.h5", [key], fields)[key]


def missing(folder: str | Path, tasks: Iterable[Mapping[str, Any]]) -> Iterator[tuple[Path, Mapping[str, Any]]]:
    """Tasks whose result, a file each, named by the task's key, is not stored yet.

    Parameters
    ----------
    folder : str or Path
    tasks : iterable of dict
        Each with its ``key``.

    Yields
    ------
    path : Path
        Where the result belongs.
    task : dict
    """
    for task in tasks:
        path = Path(folder) / f"{task['key']}.h5"
        if task["key"] not in stored(path):
            yield path, task


def add(path: str | Path, results: Mapping[str, Mapping[str, Any]]) -> None:
    """Add results to a file, which changes whole or not at all.

    Parameters
    ----------
    path : str or Path
    results : dict of str to dict
        Results by key; arrays become datasets, all else one JSON text.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "results.h5"
    ...     add(path, {"one": {"displacement": 1.25e-3, "field": np.arange(3.0)}})
    ...     read(path, stored(path), ["field"])
    {'one': {'displacement': 0.00125, 'field': array([0., 1., 2.])}}
    """
    if not results:
        return
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(path.name + ".unfinished")
    scalars: dict[str, dict[str, Any]] = {}
    with h5py.File(unfinished, "w") as file:
        try:
            with h5py.File(path) as before:
                scalars = {name: kept for name, kept in _scalars(before).items() if name not in results}
                for name in before:
                    if name in scalars:
                        before.copy(name, file)
        except (OSError, KeyError, ValueError):
            pass  # there is none yet, or it cannot be read
        for name, result in results.items():
            scalars[name] = {}
            for label, value in result.items():
                if isinstance(value, np.ndarray):
                    file.create_dataset(f"{name}/{label}", data=value)
                else:
                    scalars[name][label] = value.item() if isinstance(value, np.generic) else value
        file[SCALARS] = json.dumps(scalars)
    os.replace(unfinished, path)

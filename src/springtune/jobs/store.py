"""Results of scenes on disk: one HDF5 file a mesh and stage, results by a hash of all they depend on.

Scalars and texts of all results are one JSON text, since a group with attributes for each would cost more than solving
it; arrays are datasets. A stage computes only the results that the file does not hold. What an earlier grid asked for
stays, so going back to it computes nothing. Nothing but the dataset is meant for users.
"""

import json
import os
from pathlib import Path

import h5py
import numpy as np

SCALARS = "scalars"
"""Dataset of what is not an array."""


def stored(path):
    """Keys of the results in a file; an unreadable file holds none."""
    try:
        with h5py.File(path) as file:
            return set(_scalars(file))
    except (OSError, KeyError, ValueError):
        return set()


def _scalars(file):
    return json.loads(file[SCALARS][()])


def read(path, names, fields=()):
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


def add(path, results):
    """Add results to a file, which changes whole or not at all.

    Parameters
    ----------
    path : str or Path
    results : dict of str to dict
        Results by key; arrays become datasets, all else attributes.
    """
    if not results:
        return
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(path.name + ".unfinished")
    scalars = {}
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

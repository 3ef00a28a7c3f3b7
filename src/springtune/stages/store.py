"""Results of scenes on disk: one HDF5 file a mesh and stage, one group a result, named by a hash of all it depends on.

A stage computes only the results that the file does not hold. What an earlier grid asked for stays, so going back to
it computes nothing. Nothing but the dataset is meant for users.
"""

import os
from pathlib import Path

import h5py
import numpy as np


def stored(path):
    """Keys of the results in a file; an unreadable file holds none."""
    try:
        with h5py.File(path) as file:
            return set(file)
    except OSError:
        return set()


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
    results = {}
    with h5py.File(path) as file:
        for name in names:
            group = file[name]
            result = {label: value.item() if hasattr(value, "item") else value for label, value in group.attrs.items()}
            results[name] = result | {label: group[label][()] for label in fields if label in group}
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
    with h5py.File(unfinished, "w") as file:
        try:
            with h5py.File(path) as before:
                for name in before:
                    if name not in results:
                        before.copy(name, file)
        except OSError:
            pass  # there is none yet, or it cannot be read
        for name, result in results.items():
            group = file.create_group(name)
            for label, value in result.items():
                if isinstance(value, np.ndarray):
                    group.create_dataset(label, data=value)
                else:
                    group.attrs[label] = value
    os.replace(unfinished, path)

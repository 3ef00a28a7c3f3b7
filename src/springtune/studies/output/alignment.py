"""Bring several datasets onto the same axes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Mapping, Sequence
from functools import reduce
from typing import Any

import numpy as np
import xarray as xr

SAME_NUMBER = 1e-9
"""Relative difference below which two numbers are one label."""


def joined(name: str, datasets: Sequence[xr.Dataset]) -> Any:
    """Index of a dimension of all datasets: texts in their order, numbers sorted; numbers from 0 without labels.

    Examples
    --------
    >>> one, other = (xr.Dataset(coords={"mesh_size": sizes}) for sizes in ([2e-3, 5e-3], [5e-3, 1e-3]))
    >>> joined("mesh_size", [one, other]).tolist()
    [0.001, 0.002, 0.005]
    """
    there = [data for data in datasets if name in data.sizes]
    if len({name in data.indexes for data in there}) > 1:
        raise ValueError(f"dimension '{name}' has labels in one dataset and none in another; run the studies again")
    if name not in there[0].indexes:
        return xr.DataArray(range(max(data.sizes[name] for data in there)), dims=name).to_index()
    indexes = [data.indexes[name] for data in there]
    numeric = {_is_numeric(data, name) for data in there if data.sizes[name]}
    if len(numeric) > 1:
        raise ValueError(f"dimension '{name}' has numbers in one dataset and texts in another; run the studies again")
    for index in indexes:
        if not index.is_unique:
            twice = index[index.duplicated()][0]
            raise ValueError(f"dimension '{name}' has the label {twice} twice; run the study again")
    labels = reduce(lambda one, other: one.union(other, sort=False), indexes)
    return labels.sort_values() if numeric == {True} else labels


def _is_numeric(data: xr.Dataset, name: Hashable) -> bool:
    return data[name].dtype.kind not in "OUS"


def on_common_axes(trees: Sequence[xr.DataTree]) -> list[xr.DataTree]:
    """Spell each number of a dimension alike."""
    labels: dict[Hashable, list[float]] = defaultdict(list)
    for tree in trees:
        for node in tree.subtree:
            data = node.to_dataset(inherit=False)
            for name in data.indexes:
                labels[name] += data.indexes[name].tolist() if _is_numeric(data, name) else []
    spelling = {name: _spelling(np.array(known, dtype=float)) for name, known in labels.items() if known}
    if all(label == spelt for known in spelling.values() for label, spelt in known.items()):
        return [*trees]
    return [tree.map_over_datasets(_spelt, kwargs={"spelling": spelling}) for tree in trees]


def _spelling(labels: np.ndarray) -> dict[float, float]:
    """The first of several numbers that are one label, by each of them."""
    order = np.argsort(labels, kind="stable")
    ordered = labels[order]
    apart = np.diff(ordered, prepend=-np.inf) > SAME_NUMBER * np.abs(ordered)
    first = np.minimum.reduceat(order, np.flatnonzero(apart))[np.cumsum(apart) - 1]
    return dict(zip(ordered.tolist(), labels[first].tolist()))


def _spelt(data: xr.Dataset, spelling: Mapping[Hashable, Mapping[float, float]]) -> xr.Dataset:
    known = {name: data.indexes[name].tolist() for name in data.indexes if _is_numeric(data, name)}
    spelt = {name: [spelling[name][label] for label in labels] for name, labels in known.items()}
    changed = {name: (name, labels, data[name].attrs) for name, labels in spelt.items() if labels != known[name]}
    return data.assign_coords(changed) if changed else data

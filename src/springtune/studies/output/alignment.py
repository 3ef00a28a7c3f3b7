"""Bring several datasets onto the same axes: labels, and parameters that only some of them sweep."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from springtune.problem.parameters import STATED, SWEPT, UNCHANGED

from .dataset import nothing

SAME_NUMBER = 1e-9
"""Relative difference below which two numbers are one label."""


@dataclass(frozen=True)
class Axis:
    """A dimension with the labels of all datasets; `places` are each dataset's own labels among them."""

    name: str
    labels: np.ndarray
    places: tuple[np.ndarray, ...]
    units: str
    labelled: bool

    def common(self) -> tuple[np.ndarray, ...]:
        """Places of common labels: on the axis, then in each dataset."""
        kept = set(range(len(self.labels))).intersection(*(found.tolist() for found in self.places))
        among = np.array(sorted(kept), dtype=int)
        own = []
        for places in self.places:
            back = np.full(len(self.labels), -1)
            back[places] = np.arange(len(places))
            own.append(back[among])
        return among, *own

    def alone(self, side: int) -> list[str | float]:
        """Labels of only one of the datasets."""
        others = np.concatenate([places for number, places in enumerate(self.places) if number != side])
        found: list[str | float] = self.labels[np.setdiff1d(self.places[side], others)].tolist()
        return found


def axis(name: str, datasets: Sequence[xr.Dataset]) -> Axis:
    """Join a dimension of several datasets.

    Examples
    --------
    >>> import xarray as xr
    >>> one, other = (xr.Dataset(coords={"mesh_size": sizes}) for sizes in ([2e-3, 5e-3], [5e-3 + 1e-18, 1e-3]))
    >>> found = axis("mesh_size", [one, other])
    >>> found.labels.tolist(), [places.tolist() for places in found.places]
    ([0.001, 0.002, 0.005], [[1, 2], [2, 0]])
    """
    there = [data for data in datasets if name in data.sizes]
    labelled = [name in data.coords for data in there]
    if not all(labelled):
        if any(labelled):
            raise ValueError(f"dimension '{name}' has labels in one dataset and none in another; run the studies again")
        places = tuple(np.arange(data.sizes.get(name, 0)) for data in datasets)
        return Axis(name, np.arange(max(map(len, places))), places, "1", False)
    values = [data[name].values if name in data.sizes else np.empty(0) for data in datasets]
    numeric = {own.dtype.kind not in "OUS" for own in values if len(own)}
    if len(numeric) > 1:
        raise ValueError(f"dimension '{name}' has numbers in one dataset and texts in another; run the studies again")
    labels, found = _numbers(values) if numeric == {True} else _texts(values)
    for own, taken in zip(values, found):
        if len(np.unique(taken)) != len(own):
            twice = own[next(at for at in range(len(own)) if taken[at] in taken[:at])]
            raise ValueError(f"dimension '{name}' has the label {twice} twice; run the study again")
    units = next((str(data[name].attrs["units"]) for data in there if "units" in data[name].attrs), "1")
    return Axis(name, labels, found, units, True)


def _numbers(values: Sequence[np.ndarray]) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    together = np.concatenate(values).astype(float)
    order = np.argsort(together, kind="stable")
    ordered = together[order]
    # The first of those that are one stands for all.
    apart = np.abs(np.diff(ordered)) > SAME_NUMBER * np.maximum(np.abs(ordered[1:]), np.abs(ordered[:-1]))
    numbers = np.empty(len(order), dtype=int)
    numbers[order] = np.concatenate([[0], np.cumsum(apart)])[: len(order)]
    labels = np.empty(int(numbers.max()) + 1 if len(numbers) else 0)
    labels[numbers[::-1]] = together[::-1]
    ends = np.cumsum([len(own) for own in values])[:-1]
    return labels, tuple(np.split(numbers, ends))


def _texts(values: Sequence[np.ndarray]) -> tuple[np.ndarray, tuple[np.ndarray, ...]]:
    known: dict[str, int] = {}
    found = [np.array([known.setdefault(str(one), len(known)) for one in own], dtype=int) for own in values]
    return np.array(list(known), dtype=object), tuple(found)


# -- swept parameters --------------------------------------------------------------------------------------------------


def with_swept(trees: Sequence[xr.DataTree]) -> list[xr.DataTree]:
    """Add a dimension for each parameter that any dataset sweeps."""
    made = [*trees]
    for name in SWEPT:
        sweeping = [tree for tree in trees if name in tree.dims]
        if not sweeping:
            continue
        # No study need have all groups: what a parameter matters to is asked of all.
        over = {
            (node.path, str(variable))
            for tree in sweeping
            for node in tree.subtree
            for variable, array in node.data_vars.items()
            if name in array.dims
        }
        for number, tree in enumerate(made):
            stated = _stated(tree, name)
            if name not in tree.dims and stated is not None:
                made[number] = _swept(tree, name, stated, sweeping[0][name].attrs, over)
    return made


def _stated(tree: xr.DataTree, name: str) -> xr.DataArray | None:
    """A study's value of a parameter over its dimensions; None if unstated."""
    if name in UNCHANGED:
        return xr.DataArray(UNCHANGED[name])
    found = tree.to_dataset().get(STATED[name])
    return None if found is None else abs(found)


def _swept(
    tree: xr.DataTree,
    name: str,
    stated: xr.DataArray,
    attributes: Mapping[Any, Any],
    over: Collection[tuple[str, str]],
) -> xr.DataTree:
    """Add a dimension to the variables `over`, pairs of path and name."""
    known = np.unique(stated.values[np.isfinite(stated.values)])
    if not len(known):
        return tree
    labels = known[np.concatenate([[True], np.diff(known) > SAME_NUMBER * known[1:]])]
    axis = xr.DataArray(labels, dims=name, name=name, attrs=dict(attributes))
    here = xr.concat([abs(stated - label) <= SAME_NUMBER * label for label in labels], name).assign_coords({name: axis})
    groups = {}
    for node in tree.subtree:
        data = node.to_dataset()
        found = data.drop_vars(name, errors="ignore")
        for variable in found.data_vars:
            if (node.path, str(variable)) not in over:
                continue
            array = found[variable]
            empty, dtype = nothing([array])
            mask = here.any([one for one in here.dims if one not in (*array.dims, name)])
            spread = array.astype(dtype).where(mask, np.array(empty, dtype)).transpose(*array.dims, name)
            found[variable] = spread.assign_attrs(array.attrs)
        groups[node.path] = found
    made = xr.DataTree.from_dict(groups)
    made.attrs = tree.attrs
    return made

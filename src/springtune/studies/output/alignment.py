"""Labels of several datasets on one axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

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

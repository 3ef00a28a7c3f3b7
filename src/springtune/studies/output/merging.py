"""Datasets of several studies in one."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import Any

import numpy as np
import xarray as xr

from springtune.safe_io.tables import number_text

from .alignment import joined, on_common_axes
from .comparison import MEASURED, Tolerance, Values
from .dataset import STATUS, nothing
from .text import cell_text, variable_name

SAME_VALUE = 1e-9
"""Relative difference below which values of a scene agree."""

FOUND_ANYHOW = (*MEASURED, "*message", "iterations", "residual", "definition_evaluations")
"""Variables on how a solution was found: the first dataset counts."""

MOST_BYTES = 2e9

JOINED = ("title", "study", "springtune_version", "git_commit", "study_commit")
"""Attributes whose different texts are joined."""


def merge(datasets: Sequence[xr.DataTree], relative: float = SAME_VALUE) -> xr.DataTree:
    """Join the datasets of several studies: every label of each, cells that no study has asked for empty.

    Unlike with `xarray.merge`, flags stay flags and texts stay texts where a study has no cell, ``not_requested`` and
    ``""``; a cell that one study solved and another did not ask for is no conflict; numbers that differ in the last
    digits, as mesh sizes and references of several runs do, are one; a parameter that one study sweeps, such as a
    force, is a dimension of all.

    Parameters
    ----------
    datasets : sequence of xarray.DataTree
        As of `springtune.open`.
    relative : float, optional
        By how much values of a scene that several datasets have may differ, of the larger one; the first counts.

    Returns
    -------
    xarray.DataTree
        In memory. Its attribute ``study`` names all, and ``config`` has the files of all, one after the other.

    Raises
    ------
    ValueError
        If a label means two things, such as a beam of two lengths, if a scene has two values, or if a variable has
        other dimensions or units; the message names label and both values.

    Examples
    --------
    >>> import springtune as st, xarray as xr
    >>> scenes, others = (xr.DataTree(tree.to_dataset().sel(beam=[name])) for name in ("100x20", "200x40"))
    >>> both = st.merge([scenes, others])
    >>> both.beam.values.tolist(), both.status.dtype.name, both.beam_length.values.tolist()
    (['100x20', '200x40'], 'int8', [0.1, 0.2])
    """
    trees = list(datasets)
    for tree in trees:
        if not isinstance(tree, xr.DataTree):
            raise ValueError(f"datasets: {type(tree).__name__} is no dataset; give what springtune.open returns")
    if not trees:
        raise ValueError("datasets: there are none; give what springtune.open returns, in a list")
    return _Merger(trees, relative).merged()


class _Merger:
    """Aligned contents of several datasets."""

    def __init__(self, trees: Sequence[xr.DataTree], relative: float) -> None:
        self.trees, self.relative = on_common_axes(trees), relative
        names = [str(tree.attrs.get("study", "")) or f"number {number}" for number, tree in enumerate(trees, 1)]
        twice = {name for name in names if names.count(name) > 1}
        self.names = [f"{name} (number {number})" if name in twice else name for number, name in enumerate(names, 1)]
        self.held: dict[str, dict[int, xr.Dataset]] = {}
        for number, tree in enumerate(self.trees):
            for node in tree.subtree:
                self.held.setdefault(node.path, {})[number] = node.to_dataset()
        roots = self.held["/"]
        self.axes: dict[tuple[str, str], Any] = {}
        for path, held in self.held.items():
            for name in dict.fromkeys(str(one) for data in held.values() for one in data.sizes):
                # Groups of a tree have the labels of its root.
                of_root = any(name in data.indexes for data in roots.values())
                self.axes[path, name] = joined(name, [*(roots if of_root else held).values()])

    def merged(self) -> xr.DataTree:
        """Merge all groups."""
        tree = xr.DataTree.from_dict({path: self._group(path, held) for path, held in self.held.items()})
        tree.attrs = self._attributes()
        return tree

    def _group(self, path: str, held: dict[int, xr.Dataset]) -> xr.Dataset:
        first = next(iter(held.values()))
        # What a label means comes first: a beam of two lengths is told, not what follows from it.
        ranks: dict[str, int] = {}
        for data in held.values():
            for name, variable in data.variables.items():
                if name not in data.dims:
                    ranks[str(name)] = max(variable.ndim, ranks.get(str(name), 0))
        made = {name: self._variable(path, name, held) for name in sorted(ranks, key=ranks.__getitem__)}
        used = dict.fromkeys(str(one) for data in held.values() for one in data.sizes)
        coordinates = {}
        for name in used:
            attributes = next((data[name].attrs for data in held.values() if name in data.indexes), None)
            if attributes is not None:
                coordinates[name] = xr.Variable(name, self.axes[path, name], attributes)
        found = xr.Dataset({name: made[name] for name in ranks}, coordinates)
        further = {str(name) for data in held.values() for name in data.coords if name not in data.dims}
        found = found.set_coords(sorted(further))
        if path != "/":
            found.attrs = self._group_attributes(path, held, first)
        return found

    def _variable(self, path: str, name: str, held: dict[int, xr.Dataset]) -> xr.Variable:
        arrays = {number: data[name] for number, data in held.items() if name in data}
        first_number, first = next(iter(arrays.items()))
        full = variable_name(path, name)
        for number, array in arrays.items():
            for what, one, other in (
                ("the dimensions", ", ".join(sorted(map(str, first.dims))), ", ".join(sorted(map(str, array.dims)))),
                ("the unit", str(first.attrs.get("units", "1")), str(array.attrs.get("units", "1"))),
                ("the flags", str(first.attrs.get("flag_meanings", "")), str(array.attrs.get("flag_meanings", ""))),
            ):
                if one != other:
                    raise ValueError(
                        f"{full} has {what} ({one}) in {self.names[first_number]} and ({other}) in "
                        f"{self.names[number]}; sweep the same parameters in both studies, and run them again"
                    )
        dims = [str(one) for one in first.dims]
        shape = [len(self.axes[path, one]) for one in dims]
        size = 8.0 * float(np.prod(np.array(shape, dtype=float)))
        if size > MOST_BYTES:
            sizes = ", ".join(f"{one} {count}" for one, count in zip(dims, shape))
            raise ValueError(
                f"{full}: {size / 1e9:.3g} GB over all labels together ({sizes}); select what is needed of each "
                "dataset first"
            )
        empty, dtype = nothing([*arrays.values()])
        values = np.full(shape, empty, dtype)
        source = np.full(shape, -1, dtype="int32")
        for number, array in arrays.items():
            places = [
                self.axes[path, one].get_indexer(array.indexes[one]) if one in array.indexes else np.arange(size)
                for one, size in zip(dims, array.transpose(*dims).shape)
            ]
            place = np.ix_(*places)
            own = np.asarray(array.transpose(*dims).values, dtype)
            known = np.asarray(values[place], dtype)
            of_both = Values(first, array, Tolerance(self.relative))
            there = ~of_both.missing(1, own)
            both = there & (source[place] >= 0)
            if both.any() and not any(fnmatchcase(name, one) for one in FOUND_ANYHOW):
                excess, _ = of_both.excess((known, own), (there, there), own.ndim, np.array(np.nan))
                if (both & (excess > 1.0)).any():
                    at = tuple(int(one) for one in np.argwhere(both & (excess > 1.0))[0])
                    labels = {one: self.axes[path, one][own[n]] for one, own, n in zip(dims, places, at)}
                    sides = ((of_both.said(0, known[at]), source[place][at]), (of_both.said(1, own[at]), number))
                    two = (f"{_value(value, of_both.units)} in {self.names[side]}" for value, side in sides)
                    self._refuse(path, full, labels, " and ".join(two))
            new = there & ~both
            values[place] = np.where(new, own, known)
            source[place] = np.where(new, number, source[place])
        whole = all(array.dtype.kind in "iu" for array in arrays.values())
        if whole and values.dtype.kind == "f" and not np.isnan(values).any():
            values = values.astype(first.dtype)
        return xr.Variable(dims, values, first.attrs)

    def _refuse(self, path: str, full: str, labels: dict[str, object], two: str) -> None:
        """Raise for a cell with two values."""
        held = [data[one] for one in labels for data in self.held[path].values() if one in data.indexes]
        at = cell_text(labels, {str(one.name): str(one.attrs.get("units", "1")) for one in reversed(held)})
        if len(labels) == 1:
            (one,) = labels
            raise ValueError(
                f"{one} '{at}' is two things: {full} is {two}; give one of them another label in its study"
            )
        raise ValueError(
            f"{full}{f' of {at}' if at else ''} is {two}; give what differs another label in its study, "
            f"leave the group out with tree.drop_nodes, or allow more than relative={self.relative:g}"
        )

    def _group_attributes(self, path: str, held: dict[int, xr.Dataset], first: xr.Dataset) -> dict[str, object]:
        found: dict[str, object] = {}
        source: dict[str, int] = {}
        for number, data in held.items():
            for key, value in data.attrs.items():
                name = str(key)
                if name in found and not isinstance(value, str) and value != found[name]:
                    raise ValueError(
                        f"{path}: {name} is {found[name]} in {self.names[source[name]]} and {value} in "
                        f"{self.names[number]}; leave the group out of one with tree.drop_nodes"
                    )
                if name in found and value != found[name]:
                    value = f"{found[name]}; {value}"
                found[name] = value
                source.setdefault(name, number)
        return found

    def _attributes(self) -> dict[str, str]:
        """Attributes of the root: equal ones, and joined ones."""
        every = [{str(name): str(text) for name, text in tree.attrs.items()} for tree in self.trees]
        found = {name: text for name, text in every[0].items() if all(own.get(name) == text for own in every)}
        for name in JOINED:
            texts = dict.fromkeys(own[name] for own in every if own.get(name))
            if texts:
                found[name] = (" + " if name == "study" else ", ").join(texts)
        if "config" not in found:
            parts = [f"# {name}\n{own['config']}" for name, own in zip(self.names, every) if "config" in own]
            found |= {"config": "\n---\n".join(parts)} if parts else {}
        histories = [own["history"] for own in every if "history" in own]
        found["history"] = "\n".join(dict.fromkeys([*histories, f"merged from {', '.join(self.names)}"]))
        return found


def _value(value: float | str, units: str) -> str:
    if isinstance(value, str):
        return value if value in STATUS else f"'{value}'"
    return number_text(value, units) if abs(value) < 1e6 else f"{value:.10g} {units}"

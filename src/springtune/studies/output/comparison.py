"""Compare two datasets cell by cell, with tolerances."""

from __future__ import annotations

import math
from collections.abc import Collection, Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

import numpy as np
import pandas as pd
import xarray as xr

from springtune.problem.quantities import nearest

from .dataset import NOT_REQUESTED, flag_words, is_flagged
from .text import NUMBER, from_json, without_numbers

RELATIVE = 1e-6
"""Default relative tolerance."""

MEASURED = ("seconds", "*_seconds", "seconds_*", "solver", "spring_updates")
"""Variables that depend on the machine."""

UNTOLD = {"created", "history", "config", "config_sha256", "software", "inputs", "source", "Conventions", "references"}
"""Attributes that are not told as they are."""

Labels = dict[str, str | float]


@dataclass(frozen=True)
class Tolerance:
    """Tolerances; either is enough.

    `relative` refers to the larger number, or to the largest of a curve or field. `absolute` is in the numbers' unit;
    None is 0, or `relative` for numbers without unit.
    """

    relative: float = RELATIVE
    absolute: float | None = None


@dataclass(frozen=True)
class Change:
    """A changed cell, or the most changed point of a curve or field.

    Missing values are NaN or "". `excess` is the difference over the tolerance, infinite without one.
    """

    group: str
    variable: str
    labels: Labels
    before: float | str
    after: float | str
    units: str
    excess: float

    @property
    def difference(self) -> float:
        """After minus before; NaN for texts and flags."""
        if isinstance(self.before, str) or isinstance(self.after, str):
            return float("nan")
        return self.after - self.before


@dataclass(frozen=True)
class VariableChanges:
    """Changes of one variable; `rows` are the largest."""

    name: str
    compared: int
    changed: int
    rows: list[Change]


@dataclass(frozen=True)
class Alone:
    """Cells of only one dataset: their number, and the labels of the first."""

    count: int = 0
    rows: Sequence[Labels] = ()


@dataclass
class GroupChanges:
    """Changes of a group; `labels` and `cells` are those of only one dataset, `sizes` count the labels of both."""

    name: str
    sizes: dict[str, int]
    units: dict[str, str]
    labels: dict[str, tuple[list[str | float], ...]]
    cells: tuple[Alone, ...] = (Alone(), Alone())
    both: int = 0
    variables: tuple[list[str], ...] = ([], [])
    unlike: dict[str, str] = field(default_factory=dict)
    flags: list[VariableChanges] = field(default_factory=list)
    values: list[VariableChanges] = field(default_factory=list)

    @property
    def different(self) -> bool:
        """Whether the group differs."""
        changed = any(one.changed for one in (*self.flags, *self.values)) or any(one.count for one in self.cells)
        return bool(changed or self.labels or any(self.variables) or self.unlike)


@dataclass(frozen=True)
class Comparison:
    """Differences of two datasets; differing `attributes` do not count as different results."""

    groups: list[GroupChanges]
    alone: tuple[list[str], ...]
    attributes: dict[str, tuple[str, str]]

    @property
    def different(self) -> bool:
        """Whether groups, labels, cells, variables, statuses or values differ."""
        return any(self.alone) or any(group.different for group in self.groups)

    @property
    def changes(self) -> list[Change]:
        """Changed values, largest first."""
        rows = [row for group in self.groups for one in group.values for row in one.rows]
        return sorted(rows, key=lambda row: -row.excess)


def compare(
    before: xr.DataTree,
    after: xr.DataTree,
    tolerance: Tolerance | None = None,
    groups: Collection[str] = (),
    ignored: Collection[str] = (),
    most: int | None = None,
) -> Comparison:
    """Compare two datasets by label; of each variable so many changes are listed.

    Numeric labels match in nine digits; NaN equals NaN. Values of cells that one study does not request
    are not compared. Numbers inside texts are compared as numbers. `MEASURED` is left out.

    Examples
    --------
    >>> one = xr.DataTree(tree.to_dataset())  # the root alone
    >>> compare(one, one).different
    False
    >>> other = one.copy(deep=True)
    >>> other["stiffness"][0, 0, 0, 0, 0, 0, 0] *= 2
    >>> [(row.variable, row.labels["beam"], row.after / row.before) for row in compare(one, other).changes]
    [('stiffness', '100x20', 2.0)]
    """
    nodes = [{node.path: _rounded(node.to_dataset()) for node in tree.subtree} for tree in (before, after)]
    held = sorted({str(name) for side in nodes for data in side.values() for name in data.variables})
    for pattern in ignored:
        if not any(fnmatchcase(name, pattern) for name in held):
            raise ValueError(f"--ignore {pattern}: neither has it; {nearest(pattern, held)}")
    left_out = {name for name in held if any(fnmatchcase(name, one) for one in (*MEASURED, *ignored))}
    known = sorted({*nodes[0], *nodes[1]})
    wanted = {"/" + name.strip("/") for name in groups} or {*known}
    for name in sorted(wanted - {*known}):
        raise ValueError(f"--group {name.strip('/')}: neither has it; known: {', '.join(known)}")
    roots = [side["/"] for side in nodes]
    chosen = [[path for path in side if path in wanted] for side in nodes]
    found = [
        _Group(path, [side[path] for side in nodes], roots, tolerance or Tolerance(), most).compared(left_out)
        for path in chosen[0]
        if path in chosen[1]
    ]
    facts = [_facts(tree.attrs) for tree in (before, after)]
    told = {name: (facts[0].get(name, ""), facts[1].get(name, "")) for name in facts[0] | facts[1]}
    inputs = [from_json(tree.attrs.get("inputs")) for tree in (before, after)]
    told |= {name: (inputs[0][name], inputs[1][name]) for name in inputs[0] if name in inputs[1]}
    return Comparison(found, _only(chosen), {name: (old, new) for name, (old, new) in told.items() if old != new})


def _rounded(data: xr.Dataset) -> xr.Dataset:
    """A dataset whose numeric labels have nine digits, so that those of two machines are the same."""
    for name, index in data.indexes.items():
        if not index.is_unique:
            raise ValueError(f"dimension '{name}' has the label {index[index.duplicated()][0]} twice; run it again")
        if index.dtype.kind == "f":
            data = data.assign_coords({name: (name, [float(f"{label:.9g}") for label in index], data[name].attrs)})
    return data


def _only(sides: Sequence[Collection[str]]) -> tuple[list[str], ...]:
    """Names of each side that the other has not."""
    one, other = sides
    return [name for name in one if name not in other], [name for name in other if name not in one]


def _facts(attributes: Mapping[Hashable, object]) -> dict[str, str]:
    """Attributes to tell, and versions of packages."""
    found = {str(name): value for name, value in attributes.items()} | from_json(attributes.get("software"))
    return {name: str(value) for name, value in found.items() if name not in UNTOLD}


class _Group:
    """Comparison of a group that both datasets have."""

    def __init__(
        self,
        path: str,
        pair: Sequence[xr.Dataset],
        roots: Sequence[xr.Dataset],
        tolerance: Tolerance,
        most: int | None,
    ) -> None:
        self.path, self.given, self.tolerance, self.most = path, pair, tolerance, most
        self.cell_dimensions = _cell_dimensions(pair, roots)
        numbered = [{name: range(size) for name, size in one.sizes.items() if name not in one.indexes} for one in pair]
        self.pair = [data.assign_coords(numbers) for data, numbers in zip(pair, numbered)]
        self.asked = [_asked(data, root) for data, root in zip(self.pair, roots)]

    def compared(self, left_out: Collection[str]) -> GroupChanges:
        """Compare labels, cells and all variables but some."""
        sizes = {str(name): size for one in self.pair for name, size in one.sizes.items()}
        units: dict[str, str] = {}
        labels: dict[str, tuple[list[str | float], ...]] = {}
        for name in sizes:
            axes = [data[name] for data in self.pair if name in data.dims]
            sizes[name] = len(axes[0].to_index().union(axes[-1].to_index(), sort=False))
            units[name] = str(axes[0].attrs.get("units", "1"))
            if len(axes) == 2 and all(data.sizes[name] and name in data.indexes for data in self.given):
                one, other = (axis.to_index() for axis in axes)
                alone = one.difference(other, sort=False).tolist(), other.difference(one, sort=False).tolist()
                labels |= {name: alone} if any(alone) else {}
        found = GroupChanges(self.path, sizes, units, labels)
        names = [
            [str(name) for name in data.variables if name not in data.dims and name not in left_out]
            for data in self.pair
        ]
        found.variables = _only(names)
        if all("status" in data for data in self.pair) and not self._unlike("status"):
            found.cells, found.both = self._cells()
        for name in (name for name in names[0] if name in names[1]):
            if reason := self._unlike(name):
                found.unlike[name] = reason
                continue
            (found.flags if is_flagged(self.pair[0][name]) else found.values).append(self._variable(name))
        return found

    def _unlike(self, name: str) -> str:
        """Return why a variable cannot be compared, or an empty string."""
        a, b = (data[name] for data in self.pair)
        if set(a.dims) != set(b.dims):
            said = (f"({', '.join(map(str, one.dims))})" for one in (a, b))
            return "has other dimensions: {} before, {} after".format(*said)
        if (a.dtype.kind in "OUS") != (b.dtype.kind in "OUS"):
            return "is a text in one dataset and a number in the other"
        units = [str(one.attrs["units"]) for one in (a, b) if "units" in one.attrs]
        return f"has other units: {units[0]} before, {units[1]} after" if len(set(units)) > 1 else ""

    def _cells(self) -> tuple[tuple[Alone, ...], int]:
        """Cells requested by one side only, and the number requested by both."""
        masks = [mask for mask in self.asked if mask is not None]
        masks = [mask.any([name for name in mask.dims if name not in self.cell_dimensions]) for mask in masks]
        alone, both = [], 0
        for mask, other in zip(masks, masks[::-1]):
            # On the labels of one side: the union of all may be the square of either.
            there = other.reindex_like(mask, fill_value=False).transpose(*mask.dims).values
            places = np.flatnonzero(mask.values & ~there)
            rows = [_labels(mask, np.unravel_index(place, mask.shape)) for place in places[: self.most]]
            alone.append(Alone(len(places), rows))
            both = int((mask.values & there).sum())
        return tuple(alone), both

    def _variable(self, name: str) -> VariableChanges:
        """Compare a variable on the labels of both sides; of a curve or field its worst point."""
        names = sorted(map(str, self.pair[0][name].dims), key=lambda one: one not in self.cell_dimensions)
        arrays = (_bare(data[name]).transpose(*names) for data in self.pair)
        one, other = xr.align(*arrays, join="inner", copy=False)
        if not one.size:
            return VariableChanges(name, 0, 0, [])
        flagged = is_flagged(one) and is_flagged(other)
        a, b = (_as_words(side) if flagged else side.values for side in (one, other))
        texts = flagged or one.dtype.kind in "OUS"
        missing = [values == "" if texts else np.isnan(values) for values in (a, b)]
        asked = [_on(mask, one) for mask in self.asked]
        unmatched = (missing[0] & ~missing[1] & asked[0]) | (missing[1] & ~missing[0] & asked[1])
        both = ~missing[0] & ~missing[1]
        differ = both & (a != b)
        excess = np.where(unmatched, np.inf, 0.0)
        points = tuple(range(sum(one in self.cell_dimensions for one in names), one.ndim))
        units = str(one.attrs.get("units", other.attrs.get("units", "1")))
        if texts:
            excess[differ] = [_of_texts(str(x), str(y), self.tolerance.relative) for x, y in zip(a[differ], b[differ])]
        elif differ.any():
            excess[differ] = _of_numbers(a, b, both, points, units, self.tolerance)[differ]
        length = math.prod(one.shape[axis] for axis in points)
        beyond = np.flatnonzero(excess > 1.0)
        found = pd.DataFrame({"place": beyond, "cell": beyond // length, "excess": excess.ravel()[beyond]})
        worst = found.sort_values("excess", ascending=False, kind="stable").drop_duplicates("cell")
        said = str if texts else float
        rows = [
            Change(
                self.path,
                name,
                _labels(one, np.unravel_index(place, one.shape)),
                said(a.flat[place]),
                said(b.flat[place]),
                units,
                over,
            )
            for place, over in worst[["place", "excess"]][: self.most].itertuples(index=False)
        ]
        compared = (both | unmatched).reshape(-1, length).any(axis=1).sum()
        return VariableChanges(name, int(compared), len(worst), rows)


def _cell_dimensions(pair: Sequence[xr.Dataset], roots: Sequence[xr.Dataset]) -> set[str]:
    """Dimensions of cells: those of messages, or else of a status, and those with text labels."""
    found: set[Hashable] = set()
    for data, root in zip(pair, roots):
        judged = [name for name in data.data_vars if str(name).endswith("message")] or ["status"]
        found = found.union(*(data[name].dims for name in judged if name in data))
        found |= {*root["status"].dims} if "status" in root else set()
        found |= {name for name in data.indexes if data[name].dtype.kind in "OUS"}
    return set(map(str, found))


def _asked(data: xr.Dataset, root: xr.Dataset) -> xr.DataArray | None:
    """Requested cells of a group by its or the root's status; None without one."""
    status = next((one["status"] for one in (data, root) if "status" in one.data_vars), None)
    if status is None:
        return None
    words = flag_words(status) if is_flagged(status) else {0: NOT_REQUESTED}
    silent = [value for value, word in words.items() if word == NOT_REQUESTED]
    return _bare(~status.isin([*silent, np.nan]).compute())


def _on(mask: xr.DataArray | None, array: xr.DataArray) -> np.ndarray:
    """Mask on the labels of an array, broadcastable to it; true without a common dimension."""
    shared = [name for name in array.dims if mask is not None and name in mask.dims]
    if mask is None or not shared:
        return np.array(True)
    mask = mask.any([name for name in mask.dims if name not in shared])
    mask = mask.reindex({name: array.indexes[name] for name in shared}, fill_value=False)
    values: np.ndarray = mask.broadcast_like(array).transpose(*array.dims).values
    return values


def _bare(array: xr.DataArray) -> xr.DataArray:
    """An array with the labels of its dimensions alone."""
    return array.drop_vars(set(array.coords) - set(array.dims))


def _labels(array: xr.DataArray, place: Iterable[int]) -> Labels:
    found = {str(name): array.indexes[name][int(at)] for name, at in zip(array.dims, place)}
    return {name: label if isinstance(label, str | int) else float(label) for name, label in found.items()}


def _as_words(array: xr.DataArray) -> np.ndarray:
    """Flags as words, empty where nothing was requested."""
    known, back = np.unique(array.values, return_inverse=True)
    words = flag_words(array)
    said = [words.get(int(one), NOT_REQUESTED).replace(NOT_REQUESTED, "") for one in known]
    return np.array(said, dtype=object)[back.ravel()].reshape(array.shape)


def _of_numbers(
    a: np.ndarray, b: np.ndarray, both: np.ndarray, points: tuple[int, ...], units: str, tolerance: Tolerance
) -> np.ndarray:
    """Difference over tolerance of numbers, infinite without one."""
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        size = np.maximum(np.abs(a), np.abs(b)).astype(float)
        if points:
            size = np.where(both & np.isfinite(size), size, 0.0).max(axis=points, keepdims=True)
        absolute = tolerance.absolute or 0.0
        if tolerance.absolute is None and units in ("", "1"):
            absolute = tolerance.relative
        ratio = np.abs(b - a) / np.maximum(tolerance.relative * size, absolute)
    return np.where(np.isfinite(ratio), ratio, np.inf)


def _of_texts(a: str, b: str, relative: float) -> float:
    """Difference over tolerance of texts that differ only in numbers; infinite for others."""
    if without_numbers(a) != without_numbers(b) or not relative:
        return math.inf
    pairs = [tuple(float(one[0]) for one in NUMBER.finditer(text)) for text in (a, b)]
    return max((abs(y - x) / (relative * max(abs(x), abs(y))) for x, y in zip(*pairs) if x != y), default=0.0)

"""Compare two datasets cell by cell, with tolerances."""

import math
from collections.abc import Collection, Hashable, Iterable, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from springtune.problem.quantities import Status, nearest

from .dataset import as_words, is_flagged, records
from .text import NUMBER, from_json, without_numbers

RELATIVE_TOLERANCE = 1e-6  # default relative tolerance

MEASURED_VARIABLES = ("seconds", "*_seconds", "seconds_*", "solver", "spring_updates")
"""Variables that depend on the machine."""

HIDDEN_ATTRIBUTES = {"created", "history", "config", "config_sha256", "software", "inputs", "source", "Conventions",
                     "references"}  # fmt: skip
"""Attributes that a comparison does not note."""

Labels = dict[str, str | float]

Pair = Sequence[xr.Dataset]
Arrays = Sequence[xr.DataArray]  # before and after


@dataclass(frozen=True)
class Tolerance:
    """Tolerances, of which either is enough; `relative` refers to the larger number, or the largest of a curve.

    `absolute` is in the numbers' unit; None is 0, or `relative` for numbers without unit.
    """

    relative: float = RELATIVE_TOLERANCE
    absolute: float | None = None

    def __post_init__(self) -> None:
        for name, value in (("relative", self.relative), ("absolute", self.absolute)):
            if value is not None and not 0 <= value < math.inf:  # with NaN nothing would differ
                raise ValueError(f"{name}: {value} is no tolerance; give a number from 0 on")


class Change(NamedTuple):
    """A changed cell, or a curve's most changed point; `excess` is the difference over the tolerance, or infinite."""

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
            return math.nan
        return self.after - self.before


class VariableChanges(NamedTuple):
    """Changes of one variable; `rows` are the largest."""

    name: str
    compared: int
    changed: int
    rows: list[Change]


@dataclass
class GroupChanges:
    """Changes of a group; `labels` and `cells` are those of only one dataset, `sizes` count the labels of both."""

    name: str
    variables: tuple[list[str], ...]
    sizes: dict[str, int] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    labels: dict[str, tuple[list[str | float], ...]] = field(default_factory=dict)
    cells: tuple[list[Labels], ...] = ([], [])
    unlike: dict[str, str] = field(default_factory=dict)
    flags: list[VariableChanges] = field(default_factory=list)
    values: list[VariableChanges] = field(default_factory=list)

    @property
    def different(self) -> bool:
        """Whether the group differs."""
        changed = (one.changed for one in (*self.flags, *self.values))
        return any([*changed, *self.cells, *self.variables, self.labels, self.unlike])


class Comparison(NamedTuple):
    """Differences of two datasets; differing `attributes` do not count as different results."""

    groups: list[GroupChanges]
    only_groups: tuple[list[str], ...]
    attributes: dict[str, tuple[str, str]]

    @property
    def different(self) -> bool:
        """Whether groups, labels, cells, variables, statuses or values differ."""
        return any(self.only_groups) or any(group.different for group in self.groups)

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
    """Compare two datasets by label; list at most `most` changes of each variable.

    Numeric labels match in nine digits, NaN equals NaN, and `MEASURED_VARIABLES` is left out.
    """
    trees = before, after
    nodes = [{node.path: _rounded(node.to_dataset()) for node in tree.subtree} for tree in trees]
    held = sorted({str(name) for side in nodes for data in side.values() for name in data.variables})
    for pattern in ignored:
        if not any(fnmatchcase(name, pattern) for name in held):
            raise ValueError(f"--ignore {pattern}: neither has it; {nearest(pattern, held)}")
    left_out = {name for name in held if any(fnmatchcase(name, one) for one in (*MEASURED_VARIABLES, *ignored))}
    known = sorted({*nodes[0], *nodes[1]})
    requested = {"/" + name.strip("/") for name in groups} or {*known}
    for name in sorted(requested - {*known}):
        raise ValueError(f"--group {name.strip('/')}: neither has it; known: {', '.join(known)}")
    roots = [side["/"] for side in nodes]
    chosen = [[path for path in side if path in requested] for side in nodes]
    both = {path: [side[path] for side in nodes] for path in chosen[0] if path in chosen[1]}
    found = [_compare_group(one, pair, roots, left_out, tolerance or Tolerance(), most) for one, pair in both.items()]
    facts = [one.attrs | from_json(one.attrs.get("software")) | from_json(one.attrs.get("inputs")) for one in trees]
    names = [str(name) for name in facts[0] | facts[1] if name not in HIDDEN_ATTRIBUTES]
    pairs = ((name, tuple(str(side.get(name, "")) for side in facts)) for name in names)
    return Comparison(found, _names_of_one(chosen), {name: (old, new) for name, (old, new) in pairs if old != new})


def _rounded(data: xr.Dataset) -> xr.Dataset:
    """Round numeric labels to nine digits, so that labels of two machines match."""
    for name, index in data.indexes.items():
        if not index.is_unique:
            raise ValueError(f"dimension '{name}' has the label {index[index.duplicated()][0]} twice; run it again")
        if index.dtype.kind == "f":
            data = data.assign_coords({name: (name, [float(f"{label:.9g}") for label in index], data[name].attrs)})
    return data


def _names_of_one(sides: Sequence[Collection[str]]) -> tuple[list[str], ...]:
    """Names that only one side has, for each side."""
    return tuple([name for name in one if name not in other] for one, other in (sides, sides[::-1]))


def _compare_group(
    path: str, given: Pair, roots: Pair, left_out: Collection[str], tolerance: Tolerance, most: int | None
) -> GroupChanges:
    """Compare labels, cells and all variables of a group but those that are left out."""
    numbers = [{name: range(size) for name, size in one.sizes.items() if name not in one.indexes} for one in given]
    pair = [data.reset_coords().assign_coords(number) for data, number in zip(given, numbers)]
    asked = [_asked(data, root) for data, root in zip(pair, roots)]
    dimensions = _cell_dimensions(given, roots)
    names = [[str(name) for name in data.data_vars if name not in left_out] for data in pair]
    found = GroupChanges(path, variables=_names_of_one(names))
    for name in dict.fromkeys(str(name) for data in pair for name in data.dims):
        axes = [data.indexes[name] for data in pair if name in data.dims]
        axis, other = axes[0], axes[-1]
        found.sizes[name] = len(axis.union(other, sort=False))
        found.units[name] = next(str(data[name].attrs.get("units", "1")) for data in pair if name in data.dims)
        of_one = axis.difference(other, sort=False).tolist(), other.difference(axis, sort=False).tolist()
        if any(of_one) and all(data.sizes[name] and name in data.indexes for data in given):
            found.labels[name] = of_one
    if all("status" in data for data in pair) and not _why_unlike(*(data["status"] for data in pair)):
        found.cells = _cells_of_one(asked, dimensions)
    both: tuple[Any, ...] = xr.align(*pair, *asked, join="inner", copy=False)
    for name in (name for name in names[0] if name in names[1]):
        arrays = [data[name] for data in both[:2]]
        if reason := _why_unlike(*arrays):
            found.unlike[name] = reason
            continue
        changes = found.flags if is_flagged(arrays[0]) else found.values
        changes.append(_compare_variable(path, arrays, both[2:], dimensions, tolerance, most))
    return found


def _why_unlike(one: xr.DataArray, other: xr.DataArray) -> str:
    """Return why two variables cannot be compared, or an empty string."""
    if set(one.dims) != set(other.dims):
        before, after = (", ".join(map(str, side.dims)) for side in (one, other))
        return f"has other dimensions: ({before}) before, ({after}) after"
    if (one.dtype.kind in "OUS") != (other.dtype.kind in "OUS"):
        return "is a text in one dataset and a number in the other"
    units = [str(side.attrs["units"]) for side in (one, other) if "units" in side.attrs]
    return f"has other units: {units[0]} before, {units[1]} after" if len(set(units)) > 1 else ""


def _cells_of_one(asked: Arrays, dimensions: set[str]) -> tuple[list[Labels], ...]:
    """Cells that only one side requests, for each side."""
    masks = [mask.any([name for name in mask.dims if name not in dimensions]) for mask in asked]
    # On the labels of one side: the union of all may be the square of either.
    of_one = (mask & ~other.reindex_like(mask, fill_value=False) for mask, other in zip(masks, masks[::-1]))
    return tuple(records(xr.Dataset(), cells, ()) for cells in of_one)


def _compare_variable(
    group: str, pair: Arrays, asked: Arrays, dimensions: set[str], tolerance: Tolerance, most: int | None
) -> VariableChanges:
    """Compare a variable on common labels; a curve or field counts by its worst point."""
    names = sorted(map(str, pair[0].dims), key=lambda name: name not in dimensions)
    one, other = (side.transpose(*names) for side in pair)
    name = str(one.name)
    if not one.size:
        return VariableChanges(name, 0, 0, [])
    flagged = is_flagged(one) and is_flagged(other)
    texts = flagged or one.dtype.kind in "OUS"
    a, b = (as_words(side) if flagged else side.values for side in (one, other))
    if flagged:
        a, b = (np.where(side == str(Status.NOT_REQUESTED), "", side) for side in (a, b))
    of_both = [mask.any([dim for dim in mask.dims if dim not in names]).broadcast_like(one) for mask in asked]
    masks = [mask.transpose(*names).values for mask in of_both]
    points = math.prod(one.sizes[name] for name in names if name not in dimensions)
    a, b, *masks = (values.reshape(-1, points) for values in (a, b, *masks))
    there = [values != "" if texts else ~np.isnan(values) for values in (a, b)]
    unmatched = (there[0] != there[1]) & np.where(there[0], masks[1], masks[0])
    both = there[0] & there[1]
    differ = both & (a != b)
    excess = np.where(unmatched, np.inf, 0.0)
    units = str(one.attrs.get("units", other.attrs.get("units", "1")))
    if texts:
        excess[differ] = [_excess_of_texts(str(x), str(y), tolerance.relative) for x, y in zip(a[differ], b[differ])]
    elif differ.any():
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            sizes = np.maximum(np.abs(a), np.abs(b))
            size = np.where(both & np.isfinite(sizes), sizes, 0.0).max(axis=1, keepdims=True)
            no_unit = tolerance.absolute is None and units in ("", "1")
            absolute = tolerance.relative if no_unit else tolerance.absolute or 0.0
            ratio = np.abs(b - a) / np.maximum(tolerance.relative * size, absolute)
        excess[differ] = np.where(np.isfinite(ratio), ratio, np.inf)[differ]
    worst, value, rows = excess.max(axis=1), str if texts else float, []
    changed = np.argsort(-worst, kind="stable")[: np.count_nonzero(worst > 1.0)]
    for cell in changed[:most]:
        at = cell, excess[cell].argmax()
        labels = _labels(one, np.unravel_index(np.ravel_multi_index(at, excess.shape), one.shape))
        rows.append(Change(group, name, labels, value(a[at]), value(b[at]), units, float(worst[cell])))
    return VariableChanges(name, int((both | unmatched).any(axis=1).sum()), len(changed), rows)


def _cell_dimensions(pair: Pair, roots: Pair) -> set[str]:
    """Dimensions of cells: those of messages, or else of a status, and those with text labels."""
    found: set[Hashable] = set()
    for data, root in zip(pair, roots):
        judged = [name for name in data.data_vars if str(name).endswith("message")] or ["status"]
        found = found.union(*(data[name].dims for name in judged if name in data))
        found |= {*root["status"].dims} if "status" in root else set()
        found |= {name for name in data.indexes if data[name].dtype.kind in "OUS"}
    return set(map(str, found))


def _asked(data: xr.Dataset, root: xr.Dataset) -> xr.DataArray:
    """Requested cells of a group by its or the root's status, on the group's labels; true without a status."""
    status = next((one["status"] for one in (data, root) if "status" in one.data_vars), None)
    if status is None:
        return xr.DataArray(True)
    mask = (status.reset_coords(drop=True) > Status.NOT_REQUESTED).compute()
    mask = mask.any([name for name in mask.dims if name not in data.dims])
    return mask.reindex({name: data.indexes[name] for name in mask.dims}, fill_value=False)


def _labels(array: xr.DataArray, place: Iterable[int]) -> Labels:
    found = {str(name): array.indexes[name][int(at)] for name, at in zip(array.dims, place)}
    return {name: label if isinstance(label, str | int) else float(label) for name, label in found.items()}


def _excess_of_texts(a: str, b: str, relative: float) -> float:
    """Difference over tolerance of texts that differ only in numbers; infinite for others."""
    if without_numbers(a) != without_numbers(b) or not relative:
        return math.inf
    pairs = zip(*((float(one[0]) for one in NUMBER.finditer(text)) for text in (a, b)))
    return max((abs(y - x) / (relative * max(abs(x), abs(y))) for x, y in pairs if x != y), default=0.0)

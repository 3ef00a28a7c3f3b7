"""Compare two datasets cell by cell, with tolerances."""

from __future__ import annotations

import difflib
import json
from collections.abc import Collection, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase

import numpy as np
import xarray as xr

from springtune.problem.quantities import nearest

from .alignment import Axis, axis, with_swept
from .dataset import NOT_REQUESTED, flag_words, is_flagged
from .text import NUMBER, without_numbers

RELATIVE = 1e-6
"""Default relative tolerance."""

MEASURED = (
    "seconds", "*_seconds", "seconds_*", "solver", "peak_memory", "machine_load", "pareto", "cost_exponent",
    "explicit_steps", "spring_updates", "*_bandwidth",
)  # fmt: skip
"""Variables that depend on the machine."""

TOLD_ATTRIBUTES = ("title", "study", "springtune_version", "git_commit")

UNTOLD = {"created", "history", "host", "git_diff", "config", "config_sha256", "software", "inputs", "source"}
UNTOLD |= {"Conventions", "references", "accepted", "tolerances"}

OF_CELLS = "tolerance"
"""Variable of relative tolerances by cell."""

AT_ONCE = 2**26
"""Bytes of an array compared at once."""

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
    point: Labels
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
    """Changes of one variable."""

    name: str
    compared: int
    changed: int
    rows: list[Change]


@dataclass(frozen=True)
class Alone:
    """Cells of only one dataset: their number, and the labels of the first."""

    count: int
    rows: list[Labels]


@dataclass
class GroupChanges:
    """Changes of a group; `cells` counts those requested in one dataset only."""

    name: str
    axes: dict[str, Axis]
    cells: tuple[Alone, Alone] = (Alone(0, []), Alone(0, []))
    both: int = 0
    variables: tuple[list[str], list[str]] = ([], [])
    unlike: dict[str, str] = field(default_factory=dict)
    flags: list[VariableChanges] = field(default_factory=list)
    values: list[VariableChanges] = field(default_factory=list)

    @property
    def labels(self) -> dict[str, tuple[list[str | float], list[str | float]]]:
        """Labels of only one dataset by common dimension."""
        found = {
            name: (one.alone(0), one.alone(1))
            for name, one in self.axes.items()
            if one.labelled and all(map(len, one.places))
        }
        return {name: (a, b) for name, (a, b) in found.items() if a or b}

    @property
    def different(self) -> bool:
        """Whether the group differs."""
        return bool(
            self.labels
            or any(alone.count for alone in self.cells)
            or any(self.variables)
            or self.unlike
            or any(one.changed for one in (*self.flags, *self.values))
        )


@dataclass(frozen=True)
class Comparison:
    """Differences of two datasets; differing `attributes` do not count as different results."""

    groups: list[GroupChanges]
    alone: tuple[list[str], list[str]]
    attributes: dict[str, tuple[str, str]]
    config: list[str]

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
    own: Mapping[str, Tolerance] | None = None,
    part: bool = False,
    block: int = AT_ONCE,
) -> Comparison:
    """Compare two datasets by label.

    Numeric labels match within `alignment.SAME_NUMBER`; NaN equals NaN. Values of cells that one study does not request
    are not compared. Numbers inside texts are compared as numbers. `MEASURED` is left out. A parameter that only one
    study sweeps becomes a dimension of both. `own` holds tolerances by `variable_name`, ``""`` for all others; a
    variable `OF_CELLS` of the first dataset is the relative tolerance of its cells.

    Examples
    --------
    >>> found = compare(tree, tree)
    >>> found.different
    False
    >>> other = tree.copy(deep=True)
    >>> other["stiffness"][0, 0, 0, 0, 0, 0, 0] *= 2
    >>> [(row.variable, row.labels["beam"], row.after / row.before) for row in compare(tree, other).changes]
    [('stiffness', '100x20', 2.0)]
    """
    nodes = [{node.path: node.to_dataset() for node in tree.subtree} for tree in with_swept([before, after])]
    held = sorted({variable for own in nodes for data in own.values() for variable in map(str, data.variables)})
    for pattern in ignored:
        if not any(fnmatchcase(name, pattern) for name in held):
            raise ValueError(f"--ignore {pattern}: neither has it; {nearest(pattern, held)}")
    if groups:
        wanted = {"/" + name.strip("/") for name in groups}
        for name in sorted(wanted - set(nodes[0]) - set(nodes[1])):
            known = sorted(set(nodes[0]) | set(nodes[1]))
            raise ValueError(f"--group {name.strip('/')}: neither has it; known: {', '.join(known)}")
        chosen = [{path: data for path, data in own.items() if path in wanted} for own in nodes]
    else:
        chosen = [*nodes]
    if part:
        chosen[1] = {path: data for path, data in chosen[1].items() if path in chosen[0]}
    shared = [path for path in chosen[0] if path in chosen[1]]
    alone = (
        [path for path in chosen[0] if path not in chosen[1]],
        [path for path in chosen[1] if path not in chosen[0]],
    )
    roots = (nodes[0]["/"], nodes[1]["/"])
    own = own or {}
    how = _How(tolerance or own.get("", Tolerance()), own, (*MEASURED, *ignored), most, part, block)
    found = [_Group(path, (nodes[0][path], nodes[1][path]), roots, how).compared() for path in shared]
    kept = {name: text for name, text in after.attrs.items() if not part or name in before.attrs}
    attributes, config = _attributes(before.attrs, kept)
    return Comparison(found, alone, attributes, config)


def variable_name(group: str, variable: str) -> str:
    """Name of a variable with its group; the root's name is left out.

    Examples
    --------
    >>> variable_name("/", "force"), variable_name("/sensitivity", "displacement")
    ('force', 'sensitivity/displacement')
    """
    return f"{group.strip('/')}/{variable}".lstrip("/")


@dataclass(frozen=True)
class _How:
    tolerance: Tolerance
    own: Mapping[str, Tolerance]
    ignored: Collection[str]
    most: int | None
    part: bool
    block: int


class _Group:
    """Comparison of a group that both datasets have."""

    def __init__(
        self, path: str, pair: tuple[xr.Dataset, xr.Dataset], roots: tuple[xr.Dataset, xr.Dataset], how: _How
    ) -> None:
        self.path, self.pair, self.how = path, pair, how
        self.axes = {name: axis(name, pair) for name in dict.fromkeys(str(one) for own in pair for one in own.sizes)}
        self.cell_dimensions = cell_dimensions(pair, roots)
        self.asked = [_asked(data, root) for data, root in zip(pair, roots)]
        self.reduced: dict[tuple[object, ...], np.ndarray] = {}

    def compared(self) -> GroupChanges:
        found = GroupChanges(self.path, self.axes)
        names = [[str(name) for name in data.variables if name not in data.dims] for data in self.pair]
        left_out = [name for own in names for name in own if any(fnmatchcase(name, one) for one in self.how.ignored)]
        left_out += [OF_CELLS]
        found.variables = (
            [name for name in names[0] if name not in names[1] and name not in left_out],
            [name for name in names[1] if name not in [*names[0], *left_out] and not self.how.part],
        )
        own = all("status" in data for data in self.pair) and self._comparable("status") is None
        if own:
            found.cells, found.both = self._cells()
        for name in names[0]:
            if name not in names[1] or name in left_out:
                continue
            reason = self._comparable(name)
            if reason:
                found.unlike[name] = reason
                continue
            changes = self._variable(name)
            (found.flags if is_flagged(self.pair[0][name]) else found.values).append(changes)
        return found

    def _comparable(self, name: str) -> str | None:
        """Return why a variable cannot be compared, or None."""
        a, b = self._arrays(name)
        if set(a.dims) != set(b.dims):
            said = (f"({', '.join(map(str, one.dims))})" for one in (a, b))
            return "has other dimensions: {} before, {} after".format(*said)
        if (a.dtype.kind in "OUS") != (b.dtype.kind in "OUS"):
            return "is a text in one dataset and a number in the other"
        units = [str(one.attrs["units"]) for one in (a, b) if "units" in one.attrs]
        if len(set(units)) > 1:
            return f"has other units: {units[0]} before, {units[1]} after"
        return None

    def _cells(self) -> tuple[tuple[Alone, Alone], int]:
        """Cells requested by one side only, and the number requested by both."""
        asked = self.asked
        assert asked[0] is not None and asked[1] is not None
        names = [str(name) for name in asked[0].dims if name in self.cell_dimensions]
        shape = [len(self.axes[name].labels) for name in names]
        spread = []
        for side, mask in enumerate(asked):
            assert mask is not None
            own = mask.any([name for name in mask.dims if name not in names]).transpose(*names).values
            whole = np.zeros(shape, dtype=bool)
            whole[np.ix_(*(self.axes[name].places[side] for name in names))] = own
            spread.append(whole)
        sides = []
        for side in (0, 1):
            places = np.argwhere(spread[side] & ~spread[1 - side])
            rows = [self._labels(names, place) for place in places[: self.how.most]]
            sides.append(Alone(len(places), rows))
        return (sides[0], sides[1]), int((spread[0] & spread[1]).sum())

    def _labels(self, names: Sequence[str], place: Sequence[int]) -> Labels:
        found: Labels = {}
        for name, at in zip(names, place):
            label = self.axes[name].labels[at]
            found[name] = label if isinstance(label, str) else label.item()
        return found

    def _arrays(self, name: str) -> tuple[xr.DataArray, xr.DataArray]:
        a, b = self.pair[0][name], self.pair[1][name]
        if self.how.part and set(b.dims) < set(a.dims):
            b = b.expand_dims(
                {one: self.pair[1][one] for one in a.dims if one in self.pair[1].coords and one not in b.dims}
            )
        return a, b

    def _variable(self, name: str) -> VariableChanges:
        a, b = self._arrays(name)
        names = sorted(map(str, a.dims), key=lambda one: one not in self.cell_dimensions)  # cells first, then points
        cells = sum(one in self.cell_dimensions for one in names)
        common = {one: self.axes[one].common() for one in names}
        if not all(len(places[0]) for places in common.values()):
            return VariableChanges(name, 0, 0, [])
        kind = _Kind(a, b, self.how.own.get(variable_name(self.path, name), self.how.tolerance))
        shape = [len(common[one][0]) for one in names]
        compared = changed = 0
        rows: list[Change] = []
        for block in _blocks(shape, cells, a.dtype.itemsize, self.how.block):
            places = [common[one] if at != block[0] else tuple(p[block[1]] for p in common[one])
                      for at, one in enumerate(names)]  # fmt: skip
            values = [_values(array, names, [own[1 + side] for own in places]) for side, array in enumerate((a, b))]
            asked = [self._asked_of(side, names, [own[1 + side] for own in places]) for side in (0, 1)]
            further = self._further(names, [own[1] for own in places])
            excess, there = kind.excess(values[0], values[1], asked[0], asked[1], cells, further)
            flat = excess.reshape(*excess.shape[:cells], -1)
            worst = flat.argmax(axis=-1)
            largest = np.take_along_axis(flat, worst[..., None], axis=-1)[..., 0]
            compared += int(there.reshape(flat.shape).any(axis=-1).sum())
            beyond = np.argwhere(largest > 1.0)
            changed += len(beyond)
            sizes = largest[tuple(beyond.T)] if cells else np.atleast_1d(largest[largest > 1.0])
            order = np.argsort(-sizes, kind="stable")[: self.how.most]
            for at in beyond[order]:
                point = np.unravel_index(int(worst[tuple(at)]), excess.shape[cells:]) if names[cells:] else ()
                where = (*at, *point)
                among = [int(own[0][index]) for own, index in zip(places, where)]
                said = (kind.said(0, values[0][tuple(where)]), kind.said(1, values[1][tuple(where)]))
                rows.append(
                    Change(
                        self.path,
                        name,
                        self._labels(names[:cells], among[:cells]),
                        self._labels(names[cells:], among[cells:]),
                        *said,
                        kind.units,
                        float(largest[tuple(at)]),
                    )  # fmt: skip
                )
        rows.sort(key=lambda row: -row.excess)
        return VariableChanges(name, compared, changed, rows[: self.how.most])

    def _further(self, names: Sequence[str], places: Sequence[np.ndarray]) -> np.ndarray:
        """Relative tolerances of cells, broadcastable to a variable; NaN if unset."""
        if OF_CELLS not in self.pair[0].data_vars or not set(self.pair[0][OF_CELLS].dims) <= set(names):
            return np.full([1] * len(names), np.nan)
        array = self.pair[0][OF_CELLS]
        shared = [name for name in names if name in array.dims]
        chosen = array.transpose(*shared).values[np.ix_(*(own for name, own in zip(names, places) if name in shared))]
        return chosen[tuple(slice(None) if name in shared else np.newaxis for name in names)]

    def _asked_of(self, side: int, names: Sequence[str], places: Sequence[np.ndarray]) -> np.ndarray:
        """Requested cells of a variable, broadcastable to it."""
        mask = self.asked[side]
        shared = [name for name in names if mask is not None and name in mask.dims]
        if mask is None or not shared:
            return np.ones([1] * len(names), dtype=bool)
        key = (side, *shared)
        if key not in self.reduced:
            others = [name for name in mask.dims if name not in shared]
            self.reduced[key] = mask.any(others).transpose(*shared).values
        chosen = self.reduced[key][np.ix_(*(own for name, own in zip(names, places) if name in shared))]
        return chosen[tuple(slice(None) if name in shared else np.newaxis for name in names)]


class _Kind:
    """Comparison of numbers, flags or texts."""

    def __init__(self, a: xr.DataArray, b: xr.DataArray, tolerance: Tolerance) -> None:
        self.units = str(a.attrs.get("units", b.attrs.get("units", "1")))
        self.tolerance = tolerance
        self.words = [flag_words(one) for one in (a, b)] if is_flagged(a) and is_flagged(b) else None
        self.text = a.dtype.kind in "OUS"

    def said(self, side: int, value: np.generic) -> float | str:
        """Value for a report, flags as words."""
        if self.words is not None:
            return self.words[side].get(int(value), "")
        return str(value) if self.text else float(value)

    def excess(
        self, a: np.ndarray, b: np.ndarray, asked_a: np.ndarray, asked_b: np.ndarray, cells: int, further: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Difference over tolerance in the values' shape, and where it is defined."""
        if self.words is not None:
            return self._of_flags(a, b, asked_a, asked_b)
        missing = [one == "" for one in (a, b)] if self.text else [np.isnan(one) for one in (a, b)]
        unmatched = (missing[0] & ~missing[1] & asked_a) | (missing[1] & ~missing[0] & asked_b)
        both = ~missing[0] & ~missing[1]
        there = both | unmatched
        excess = np.where(unmatched, np.inf, 0.0)
        if self.text:
            for at in np.argwhere(both & (a != b)):
                excess[tuple(at)] = self._of_texts(str(a[tuple(at)]), str(b[tuple(at)]))
            return excess, there
        with np.errstate(invalid="ignore", over="ignore"):
            difference = np.abs(b - a)
            size = np.maximum(np.abs(a), np.abs(b))
        points = tuple(range(cells, a.ndim))
        if points:
            size = np.where(both & np.isfinite(size), size, 0.0).max(axis=points, keepdims=True)
        relative = np.where(np.isnan(further), self.tolerance.relative, further)
        dimensionless = self.units in ("", "1")
        least = relative if self.tolerance.absolute is None and dimensionless else self.tolerance.absolute or 0.0
        allowed = np.maximum(relative * size, least)
        with np.errstate(invalid="ignore", divide="ignore"):
            ratio = np.where(allowed > 0, difference / allowed, np.inf)
        ratio = np.where(np.isfinite(ratio), ratio, np.inf)
        excess = np.where(both & (a != b), ratio, excess)
        return excess, there

    def _of_flags(
        self, a: np.ndarray, b: np.ndarray, asked_a: np.ndarray, asked_b: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        assert self.words is not None
        known = {word: number for number, word in enumerate({*self.words[0].values(), *self.words[1].values()})}
        known[NOT_REQUESTED] = -1
        told = []
        for own, words in zip((a, b), self.words):
            values, back = np.unique(own, return_inverse=True)
            told.append(
                np.array([known.get(words.get(int(one), NOT_REQUESTED), -1) for one in values])[back.reshape(own.shape)]
            )
        absent = [one < 0 for one in told]
        there = (~absent[0] & ~absent[1]) | (absent[0] & ~absent[1] & asked_a) | (absent[1] & ~absent[0] & asked_b)
        return np.where(there & (told[0] != told[1]), np.inf, 0.0), there

    def _of_texts(self, a: str, b: str) -> float:
        """Difference over tolerance of texts that differ only in numbers."""
        if without_numbers(a) != without_numbers(b):
            return float("inf")
        pairs = zip((float(one[0]) for one in NUMBER.finditer(a)), (float(one[0]) for one in NUMBER.finditer(b)))
        allowed = self.tolerance.relative
        return (
            max((abs(y - x) / (allowed * max(abs(x), abs(y))) for x, y in pairs if x != y), default=0.0)
            if allowed
            else float("inf")
        )


def _asked(data: xr.Dataset, root: xr.Dataset) -> xr.DataArray | None:
    """Requested cells of a group by its or the root's status; None without one."""
    status = next((one["status"] for one in (data, root) if "status" in one.data_vars), None)
    if status is None:
        return None
    words = flag_words(status) if is_flagged(status) else {0: NOT_REQUESTED}
    silent = [value for value, word in words.items() if word == NOT_REQUESTED]
    return ~status.isin([*silent, np.nan]).compute()


def cell_dimensions(pair: Sequence[xr.Dataset], roots: Sequence[xr.Dataset]) -> set[str]:
    """Dimensions of cells: those of messages, or else of a status, and those with text labels."""
    found: set[str] = set()
    for data, root in zip(pair, roots):
        judged = [data[name] for name in data.data_vars if str(name).endswith("message")]
        judged = judged or [data["status"] for _ in range("status" in data)]
        judged += [root["status"] for _ in range("status" in root)]
        found |= {str(name) for array in judged for name in array.dims}
        texts = (str(name) for name in data.dims if name in data.coords and data[name].dtype.kind in "OUS")
        found |= set(texts)
    return found


def _blocks(shape: Sequence[int], cells: int, itemsize: int, size: int) -> Iterator[tuple[int, slice]]:
    """Axis and range of each block compared at once."""
    if not cells:
        yield -1, slice(None)
        return
    longest = int(np.argmax(shape[:cells]))
    row = itemsize * int(np.prod(shape)) // shape[longest]
    step = max(1, size // max(1, row))
    for start in range(0, shape[longest], step):
        yield longest, slice(start, start + step)


def _values(array: xr.DataArray, names: Sequence[str], places: Sequence[np.ndarray]) -> np.ndarray:
    """Values at chosen places, dimensions in the given order; from files only their range is read."""
    ranges, left = {}, []
    for name, own in zip(names, places):
        low, high = int(own.min()), int(own.max()) + 1
        ranges[name] = slice(low, high)
        left.append(own - low)
    # A new array: what was read is not kept with the dataset.
    part = array.variable.isel(ranges).transpose(*names)
    values: np.ndarray = np.asarray(part.values)
    if any(len(own) != size or (np.diff(own) != 1).any() for own, size in zip(left, values.shape)):
        values = values[np.ix_(*left)]
    return values.astype(str) if values.dtype == object else values


def _attributes(
    before: Mapping[Hashable, object], after: Mapping[Hashable, object]
) -> tuple[dict[str, tuple[str, str]], list[str]]:
    """Differing attributes, and the diff of the config."""
    found: dict[str, tuple[str, str]] = {}
    pairs: list[tuple[str, object, object]] = [
        (name, before.get(name, ""), after.get(name, "")) for name in TOLD_ATTRIBUTES
    ]
    for name in ("software", "inputs"):
        parts = [_json(attributes.get(name)) for attributes in (before, after)]
        names = {*parts[0]} & {*parts[1]} if name == "inputs" else {*parts[0], *parts[1]}
        pairs += [(one, parts[0].get(one, ""), parts[1].get(one, "")) for one in sorted(names)]
    further = sorted({str(name) for name in (*before, *after)} - UNTOLD - set(TOLD_ATTRIBUTES))
    pairs += [(name, before.get(name, ""), after.get(name, "")) for name in further]
    for name, old, new in pairs:
        if str(old) != str(new):
            found[name] = str(old), str(new)
    texts = [str(attributes.get("config", "")).splitlines() for attributes in (before, after)]
    return found, list(difflib.unified_diff(texts[0], texts[1], "before", "after", lineterm=""))


def _json(text: object) -> dict[str, object]:
    try:
        return dict(json.loads(str(text or "{}")))
    except ValueError:
        return {}

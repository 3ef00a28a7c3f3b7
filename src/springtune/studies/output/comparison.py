"""Compare two datasets cell by cell, with tolerances."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any, SupportsInt

import numpy as np
import xarray as xr

from springtune.problem.quantities import nearest

from .alignment import joined, on_common_axes
from .dataset import NOT_REQUESTED, flag_words, is_flagged
from .selection import judged
from .text import NUMBER, from_json, variable_name, without_numbers

RELATIVE = 1e-6
"""Default relative tolerance."""

MEASURED: tuple[str, ...] = (
    "seconds", "*_seconds", "seconds_*", "solver", "peak_memory", "machine_load", "pareto", "cost_exponent",
    "explicit_steps", "spring_updates", "*_bandwidth",
)  # fmt: skip
"""Variables that depend on the machine."""

NOT_MEASURED = "not measured"
"""How messages of times begin that a busy machine did not give."""

TOLD_ATTRIBUTES = ("title", "study", "springtune_version", "git_commit", "study_commit")

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
    """Changes of a group; `labels` and `cells` are those of only one dataset, `sizes` count the labels of both."""

    name: str
    sizes: dict[str, int]
    units: dict[str, str]
    labels: dict[str, tuple[list[str | float], list[str | float]]]
    cells: tuple[Alone, Alone] = (Alone(0, []), Alone(0, []))
    both: int = 0
    variables: tuple[list[str], list[str]] = ([], [])
    unlike: dict[str, str] = field(default_factory=dict)
    flags: list[VariableChanges] = field(default_factory=list)
    values: list[VariableChanges] = field(default_factory=list)

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
    nodes = [{node.path: node.to_dataset() for node in tree.subtree} for tree in on_common_axes([before, after])]
    held = sorted({str(name) for side in nodes for data in side.values() for name in data.variables})
    for pattern in ignored:
        if not any(fnmatchcase(name, pattern) for name in held):
            raise ValueError(f"--ignore {pattern}: neither has it; {nearest(pattern, held)}")
    known = sorted({*nodes[0], *nodes[1]})
    wanted = {"/" + name.strip("/") for name in groups} or {*known}
    for name in sorted(wanted - {*known}):
        raise ValueError(f"--group {name.strip('/')}: neither has it; known: {', '.join(known)}")
    sides = [[path for path in side if path in wanted] for side in nodes]
    alone = (
        [path for path in sides[0] if path not in sides[1]],
        [path for path in sides[1] if path not in sides[0] and not part],
    )
    roots = (nodes[0]["/"], nodes[1]["/"])
    own = own or {}
    how = _How(tolerance or own.get("", Tolerance()), own, (*MEASURED, *ignored), most, part, block)
    shared = [path for path in sides[0] if path in sides[1]]
    found = [_Group(path, (nodes[0][path], nodes[1][path]), roots, how).compared() for path in shared]
    kept = {name: text for name, text in after.attrs.items() if not part or name in before.attrs}
    attributes, config = _attributes(before.attrs, kept)
    return Comparison(found, alone, attributes, config)


def compare_definitions(before: xr.DataTree, after: xr.DataTree, groups: Collection[str] = ()) -> list[dict[str, Any]]:
    """Compare the errors of definitions in two datasets, each over all its solved cells whose reference applies.

    A row has a group, a definition, and before and after the number of absolute errors, their median and the largest.
    """
    sides = {"before": _of_definitions(before), "after": _of_definitions(after)}
    known = dict.fromkeys(key for side in sides.values() for key in side)
    wanted = {"/" + name.strip("/") for name in groups} or {group for group, _ in known}
    for name in sorted(wanted - {group for group, _ in known}):
        raise ValueError(f"--group {name.strip('/')}: neither has errors of definitions there; leave --group out")
    return [
        {"group": key[0], "definition": key[1]}
        | {what: {name: of(side[key]) if key in side else None for name, side in sides.items()} for what, of in JUDGED}
        for key in known
        if key[0] in wanted
    ]


JUDGED = (
    ("scenes", len),
    ("median", lambda errors: float(np.median(errors))),
    ("worst", lambda errors: float(errors.max())),
)
"""Numbers of the errors of a definition."""


def _of_definitions(tree: xr.DataTree) -> dict[tuple[str, str], np.ndarray]:
    """Absolute errors by group and definition."""
    finite = tree["finite_strain"].to_dataset() if "finite_strain" in tree.children else None
    found = {}
    for node in tree.subtree:
        data = node.to_dataset()
        for name in {"deformation_error", "error"} & {*data} if "status" in data else ():
            if "definition" not in data[name].dims:
                continue
            errors = abs(judged(data, finite if node.path == "/" else None, name))
            for definition in data.definition.values.tolist():
                values = errors.sel(definition=definition).values
                if np.isfinite(values).any():
                    found[node.path, definition] = values[np.isfinite(values)]
    return found


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
        self.path, self.how = path, how
        names = dict.fromkeys(str(one) for own in pair for one in own.sizes)
        self.sizes = {name: len(joined(name, pair)) for name in names}
        self.cell_dimensions = cell_dimensions(pair, roots)
        self.labels = {}
        for name in self.sizes:
            if all(data.sizes.get(name) and name in data.indexes for data in pair):
                one, other = (data.indexes[name] for data in pair)
                self.labels[name] = (
                    one.difference(other, sort=False).tolist(),
                    other.difference(one, sort=False).tolist(),
                )
        self.pair = [
            data.assign_coords({name: np.arange(size) for name, size in data.sizes.items() if name not in data.indexes})
            for data in pair
        ]
        self.asked = [_asked(data, root) for data, root in zip(self.pair, roots)]

    def compared(self) -> GroupChanges:
        units = {
            name: str(data[name].attrs.get("units", "1"))
            for data in reversed(self.pair)
            for name in self.sizes
            if name in data.dims
        }
        labels = {name: both for name, both in self.labels.items() if any(both)}
        found = GroupChanges(self.path, self.sizes, units, labels)
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
        masks = [mask for mask in self.asked if mask is not None]
        names = [str(name) for name in masks[0].dims if name in self.cell_dimensions]
        asked = [mask.any(set(mask.dims) - set(names)).transpose(*names) for mask in masks]

        # On the labels of one side: the union of all may be the square of either.
        def there(other: xr.DataArray, one: xr.DataArray) -> xr.DataArray:
            return other.reindex({name: one.indexes[name] for name in names}, fill_value=False)

        def alone(one: xr.DataArray, other: xr.DataArray) -> Alone:
            places = np.argwhere((one & ~there(other, one)).values)
            return Alone(len(places), [_labels(one, names, place) for place in places[: self.how.most]])

        return (alone(*asked), alone(*reversed(asked))), int((asked[0] & there(asked[1], asked[0])).sum())

    def _arrays(self, name: str) -> tuple[xr.DataArray, xr.DataArray]:
        a, b = self.pair[0][name], self.pair[1][name]
        if self.how.part and set(b.dims) < set(a.dims):
            b = b.expand_dims(
                {one: self.pair[1][one] for one in a.dims if one in self.pair[1].coords and one not in b.dims}
            )
        return a, b

    def _variable(self, name: str) -> VariableChanges:
        pair = self._arrays(name)
        names = sorted(map(str, pair[0].dims), key=lambda one: one not in self.cell_dimensions)  # cells, then points
        cells = sum(one in self.cell_dimensions for one in names)
        a, b = (_bare(one).transpose(*names) for one in pair)
        pair = xr.align(a, b, join="inner", copy=False)
        if not pair[0].size:
            return VariableChanges(name, 0, 0, [])
        kind = Values(*pair, self.how.own.get(variable_name(self.path, name), self.how.tolerance))
        tolerances = self.pair[0].get(OF_CELLS)
        tolerances = tolerances if tolerances is not None and set(tolerances.dims) <= set(names) else None
        asked = [None if mask is None else mask.any(set(mask.dims) - set(names)) for mask in self.asked]
        compared = changed = 0
        rows: list[Change] = []
        for part in _blocks(pair[0], cells, self.how.block):
            here = [one.isel(part) for one in pair]
            values = [one.values.astype(str) if one.dtype == object else one.values for one in here]
            if name.endswith("message") and all(one.dtype.kind == "U" for one in values):
                values = [np.where(np.char.startswith(one, NOT_MEASURED), "", one) for one in values]
            excess, there = kind.excess(
                values,
                [_over(mask, here[0], True) for mask in asked],
                cells,
                _over(tolerances, here[0], np.nan),
            )
            flat = excess.reshape(*excess.shape[:cells], -1)
            worst, largest = flat.argmax(axis=-1), flat.max(axis=-1)
            compared += int(there.reshape(flat.shape).any(axis=-1).sum())
            beyond = np.argwhere(largest > 1.0)
            changed += len(beyond)
            order = np.argsort(-largest[largest > 1.0], kind="stable")[: self.how.most]
            for at in map(tuple, beyond[order]):
                point = np.unravel_index(int(worst[at]), excess.shape[cells:]) if names[cells:] else ()
                where = (*at, *point)
                rows.append(
                    Change(
                        self.path,
                        name,
                        _labels(here[0], names[:cells], at),
                        _labels(here[0], names[cells:], point),
                        kind.said(0, values[0][where]),
                        kind.said(1, values[1][where]),
                        kind.units,
                        float(largest[at]),
                    )
                )
        rows.sort(key=lambda row: -row.excess)
        return VariableChanges(name, compared, changed, rows[: self.how.most])


def _bare(array: xr.DataArray) -> xr.DataArray:
    """An array with the labels of its dimensions alone."""
    return array.drop_vars(set(array.coords) - set(array.dims))


def _labels(array: xr.DataArray, names: Sequence[str], place: Sequence[SupportsInt]) -> Labels:
    found = {name: array.indexes[name][int(at)] for name, at in zip(names, place)}
    return {name: label if isinstance(label, str | int) else float(label) for name, label in found.items()}


def _over(array: xr.DataArray | None, block: xr.DataArray, default: object) -> np.ndarray:
    """Values of cells, broadcastable to a block; `default` without any."""
    shared = [name for name in block.dims if array is not None and name in array.dims]
    if array is None or not shared:
        return np.array(default)
    chosen = _bare(array).reindex({name: block.indexes[name] for name in shared})
    found: np.ndarray = (
        chosen.expand_dims([name for name in block.dims if name not in shared]).transpose(*block.dims).values
    )
    return found


class Values:
    """Comparison of two variables with numbers, flags or texts."""

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

    def missing(self, side: int, values: np.ndarray) -> np.ndarray:
        """Return where values are missing, or flags say that nothing was requested."""
        if self.words is not None:
            values = _as_words(values, self.words[side])
        return values == "" if values.dtype.kind in "OUS" else np.isnan(values)

    def excess(
        self, values: Sequence[np.ndarray], asked: Sequence[np.ndarray], cells: int, tolerances: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Difference over tolerance in the values' shape, and where it is defined."""
        text = self.text or self.words is not None
        a, b = values if self.words is None else map(_as_words, values, self.words)
        missing = [self.missing(side, one) for side, one in enumerate(values)]
        unmatched = (missing[0] & ~missing[1] & asked[0]) | (missing[1] & ~missing[0] & asked[1])
        both = ~missing[0] & ~missing[1]
        excess = np.where(unmatched, np.inf, 0.0)
        if text:
            for at in map(tuple, np.argwhere(both & (a != b))):
                excess[at] = self._of_texts(str(a[at]), str(b[at]))
            return excess, both | unmatched
        with np.errstate(invalid="ignore", over="ignore"):
            difference = np.abs(b - a)
            size = np.maximum(np.abs(a), np.abs(b))
        points = tuple(range(cells, a.ndim))
        if points:
            size = np.where(both & np.isfinite(size), size, 0.0).max(axis=points, keepdims=True)
        relative = np.where(np.isnan(tolerances), self.tolerance.relative, tolerances)
        dimensionless = self.units in ("", "1")
        least = relative if self.tolerance.absolute is None and dimensionless else self.tolerance.absolute or 0.0
        allowed = np.maximum(relative * size, least)
        with np.errstate(invalid="ignore", divide="ignore"):
            ratio = np.where(allowed > 0, difference / allowed, np.inf)
        ratio = np.where(np.isfinite(ratio), ratio, np.inf)
        return np.where(both & (a != b), ratio, excess), both | unmatched

    def _of_texts(self, a: str, b: str) -> float:
        """Difference over tolerance of texts that differ only in numbers."""
        allowed = self.tolerance.relative
        if without_numbers(a) != without_numbers(b) or not allowed:
            return float("inf")
        pairs = zip((float(one[0]) for one in NUMBER.finditer(a)), (float(one[0]) for one in NUMBER.finditer(b)))
        return max((abs(y - x) / (allowed * max(abs(x), abs(y))) for x, y in pairs if x != y), default=0.0)


def _as_words(values: np.ndarray, words: Mapping[int, str]) -> np.ndarray:
    """Flags as words, empty where nothing was requested."""
    known, back = np.unique(values, return_inverse=True)
    said = [words.get(int(one), NOT_REQUESTED).replace(NOT_REQUESTED, "") for one in known]
    return np.array(said, dtype=object)[back.ravel()].reshape(values.shape)


def _asked(data: xr.Dataset, root: xr.Dataset) -> xr.DataArray | None:
    """Requested cells of a group by its or the root's status; None without one."""
    status = next((one["status"] for one in (data, root) if "status" in one.data_vars), None)
    if status is None:
        return None
    words = flag_words(status) if is_flagged(status) else {0: NOT_REQUESTED}
    silent = [value for value, word in words.items() if word == NOT_REQUESTED]
    return _bare(~status.isin([*silent, np.nan]).compute())


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


def _blocks(array: xr.DataArray, cells: int, size: int) -> Iterator[dict[Hashable, slice]]:
    """Parts of an array that are compared at once, along its longest dimension of cells."""
    if not cells:
        yield {}
        return
    longest = int(np.argmax(array.shape[:cells]))
    step = max(1, size // max(1, max(8, array.dtype.itemsize) * array.size // array.shape[longest]))
    for start in range(0, array.shape[longest], step):
        yield {array.dims[longest]: slice(start, start + step)}


def _attributes(
    before: Mapping[Hashable, object], after: Mapping[Hashable, object]
) -> tuple[dict[str, tuple[str, str]], list[str]]:
    """Differing attributes, and the diff of the config."""
    found: dict[str, tuple[str, str]] = {}
    pairs: list[tuple[str, object, object]] = [
        (name, before.get(name, ""), after.get(name, "")) for name in TOLD_ATTRIBUTES
    ]
    for name in ("software", "inputs"):
        parts = [from_json(attributes.get(name)) for attributes in (before, after)]
        names = {*parts[0]} & {*parts[1]} if name == "inputs" else {*parts[0], *parts[1]}
        pairs += [(one, parts[0].get(one, ""), parts[1].get(one, "")) for one in sorted(names)]
    further = sorted({str(name) for name in (*before, *after)} - UNTOLD - set(TOLD_ATTRIBUTES))
    pairs += [(name, before.get(name, ""), after.get(name, "")) for name in further]
    for name, old, new in pairs:
        if str(old) != str(new):
            found[name] = str(old), str(new)
    texts = [str(attributes.get("config", "")).splitlines() for attributes in (before, after)]
    return found, list(difflib.unified_diff(texts[0], texts[1], "before", "after", lineterm=""))

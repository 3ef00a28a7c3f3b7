"""Accepted values and curves with tolerances, in a file for review."""

from __future__ import annotations

import json
import math
from collections.abc import Hashable, Iterator, Mapping, Sequence
from fnmatch import fnmatchcase
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from springtune import __version__
from springtune.problem.status import Status
from springtune.safe_io.atomic import write_text
from springtune.safe_io.inputs import fault

from . import dataset, reading
from .alignment import on_common_axes
from .comparison import MEASURED, OF_CELLS, RELATIVE, Tolerance, cell_dimensions
from .dataset import flag_words, is_flagged
from .text import NUMBER, place_text, variable_name

DEFAULTS = {
    "/": ("status", "displacement", "deformation_error", "stiffness"),
    "/sensitivity": ("deformation_error", "best_stiffness"),
}
"""Variables accepted by default, by group."""

MOST_NUMBERS = 20_000
"""Most numbers of a YAML file."""

ACCEPTED, TOLERANCES = "accepted", "tolerances"
"""Attributes: the study, and tolerances as JSON."""

EXPECTED_ENDINGS = (".yaml", ".nc")

FURTHER_DIGITS = 3
"""Digits in YAML beyond the tolerance."""

EXAMPLE = "accept the results anew, or see docs/how-to/compare-studies.md"


# -- from a dataset ----------------------------------------------------------------------------------------------------


def accepted(tree: xr.DataTree, variables: Sequence[str] = ()) -> xr.DataTree:
    """Select accepted values of a dataset.

    Examples
    --------
    >>> kept = accepted(tree, ["deformation_error"])
    >>> sorted(kept.data_vars), kept.attrs["accepted"]
    (['deformation_error', 'status'], 'mine')
    """
    groups: dict[str, xr.Dataset] = {}
    for path, names in _chosen(tree, variables).items():
        data = tree[path].to_dataset()
        kept = {name: data[name].variable.compute() for name in names}
        found = xr.Dataset(
            kept, {name: data[name].variable for one in kept.values() for name in one.dims if name in data.coords}
        )
        if path == "/" or found.data_vars:
            groups[path] = found.drop_attrs(deep=False)
    if not any(_known(array).any() for data in groups.values() for array in data.data_vars.values()):
        raise ValueError("there is nothing to accept: the dataset has no scene with a status; name --variables")
    made = xr.DataTree.from_dict(groups)
    made.attrs = {
        ACCEPTED: str(tree.attrs.get("study", "unknown")),
        "springtune_version": str(tree.attrs.get("springtune_version", __version__)),
        TOLERANCES: _tolerance_json({}),
    }
    return made


def _chosen(tree: xr.DataTree, variables: Sequence[str]) -> dict[str, list[str]]:
    """Names of variables by group; the root is always included."""
    found: dict[str, list[str]] = {"/": []}
    if not variables:
        for node in tree.subtree:
            data = node.to_dataset(inherit=False)
            if node.path in DEFAULTS:
                found[node.path] = [name for name in DEFAULTS[node.path] if name in data]
            elif "status" in data:
                found[node.path] = [
                    str(name) for name, array in data.data_vars.items() if _is_kept(str(name), array, data)
                ]
        return found
    for name in variables:
        group, _, own = name.strip("/").rpartition("/")
        path = f"/{group}"
        known = [
            variable_name(node.path, str(one))
            for node in tree.subtree
            for one in node.to_dataset(inherit=False).data_vars
        ]
        if name.strip("/") not in known:
            from springtune.problem.quantities import nearest

            raise ValueError(f"--variables {name}: there is none; {nearest(name.strip('/'), known)}")
        array = tree[name.strip("/")]
        if array.dtype.kind in "OUS":
            raise ValueError(f"--variables {name}: is a text; only numbers and flags can be accepted, leave it out")
        found.setdefault(path, []).append(own)
    if "status" in tree.data_vars and "status" not in found["/"]:
        found["/"].insert(0, "status")
    return found


def _is_kept(name: str, array: xr.DataArray, data: xr.Dataset) -> bool:
    """Return whether a variable of another group is kept by default: status, and numbers of its cells."""
    if name == "status":
        return True
    measured = any(fnmatchcase(name, one) for one in MEASURED)
    return array.dims == data["status"].dims and array.dtype.kind == "f" and not measured


def unsolved(tree: xr.DataTree) -> list[tuple[str, str, str, str]]:
    """Requested cells without a solution."""
    found = []
    for node in tree.subtree:
        data = node.to_dataset()
        if "status" not in data.data_vars:
            continue
        status = data["status"]
        lost = status.isin([one for one in Status if one not in (Status.NOT_REQUESTED, Status.SOLVED)])
        messages = data["message"].values if "message" in data and data["message"].dims == status.dims else None
        for place in map(tuple, np.argwhere(lost.values)):
            why = "" if messages is None else str(messages[place])
            found.append((node.path, place_text(data, status.dims, place), str(Status(int(status.values[place]))), why))
    return found


def tolerances(tree: xr.DataTree) -> dict[str, Tolerance]:
    """Tolerances by variable name, see `with_tolerances`."""
    return {name: Tolerance(**one) for name, one in json.loads(tree.attrs.get(TOLERANCES, "{}")).items()}


def with_tolerances_of(tree: xr.DataTree, former: xr.DataTree) -> xr.DataTree:
    """Copy with the tolerances of former expected values."""
    held = {
        variable_name(node.path, str(name))
        for node in tree.subtree
        for name, array in node.data_vars.items()
        if _known(array).any()
    }
    made = with_tolerances(tree, {name: one for name, one in tolerances(former).items() if name in {"", *held}})
    made, former = on_common_axes([made, former])
    for node in former.subtree:
        if OF_CELLS in node.data_vars and (node.path == "/" or node.path[1:] in made.children):
            here, own = made[node.path].to_dataset(), node.to_dataset()[OF_CELLS]
            if {*own.dims} <= {*here.sizes}:
                made[f"{node.path.rstrip('/')}/{OF_CELLS}"] = own.reindex({name: here[name] for name in own.dims})
    return made


def with_tolerances(tree: xr.DataTree, given: Mapping[str, Tolerance]) -> xr.DataTree:
    """Copy with other tolerances by variable name; ``""`` is for all others."""
    made = tree.copy()
    made.attrs = tree.attrs | {TOLERANCES: _tolerance_json(given)}
    return made


def cells(tree: xr.DataTree) -> dict[str, int]:
    """Number of cells with expected values by group."""
    found = {}
    for node in tree.subtree:
        data = node.to_dataset()
        kept = cell_dimensions([data], [tree.to_dataset()])
        there = []
        for array in node.data_vars.values():
            there.append(_known(array).any([name for name in array.dims if name not in kept]))
        if there:
            found[node.path] = int(reduce(lambda one, other: one | other, there).sum())
    return found


def _known(array: xr.DataArray) -> xr.DataArray:
    """Return where an array has values."""
    return array != 0 if array.dtype.kind in "iu" else array.notnull()


# -- files -------------------------------------------------------------------------------------------------------------


def is_expected(path: str | Path) -> bool:
    """Return whether a YAML file holds expected values instead of a study."""
    if fault(path):
        return False
    try:
        with open(path, encoding="utf-8") as file:
            return any(line.startswith(f"{ACCEPTED}:") for _, line in zip(range(50), file))
    except (OSError, ValueError):
        return False


def read(path: str | Path) -> xr.DataTree:
    """Read expected values."""
    path = Path(path)
    if not path.is_file():
        raise FileNotFoundError(f"{path}: there are no expected values; call `springtune accept results/<study>` first")
    if path.suffix == ".nc":
        reading.check_opens(path)
        with reading.open(path) as tree, reading.guarded(path):
            if ACCEPTED not in tree.attrs:
                raise ValueError(f"{path}: is the dataset of a study, not what was accepted of one; {EXAMPLE}")
            return tree.load()
    return _Yaml(path).tree()


def write(path: str | Path, tree: xr.DataTree) -> None:
    """Write expected values atomically."""
    path = Path(path)
    if path.suffix == ".nc":
        groups = {node.path: node.to_dataset(inherit=False) for node in tree.subtree}
        groups["/"] = groups["/"].drop_attrs(deep=False)
        dataset.write(path, groups, {str(name): str(text) for name, text in tree.attrs.items()})
        return
    if path.suffix != ".yaml":
        raise ValueError(f"{path}: '{path.suffix}' is no form of expected values; give a file ending in .yaml or .nc")
    arrays = [array for node in tree.subtree for array in node.data_vars.values()]
    count = sum(int(_known(array).sum()) for array in arrays)
    if count > MOST_NUMBERS:
        raise ValueError(
            f"{path}: {count} numbers are more than a text to review ({MOST_NUMBERS}); give a file ending in .nc, or "
            "fewer --variables"
        )
    write_text(path, "\n".join(_lines(tree)) + "\n")


# -- YAML --------------------------------------------------------------------------------------------------------------


def _lines(tree: xr.DataTree) -> Iterator[str]:
    """Lines of the YAML file."""
    own = tolerances(tree)
    general = own.pop("", Tolerance())
    yield f"# What is accepted as right of the study {tree.attrs[ACCEPTED]}, in SI units but for labels."
    yield "# `springtune accept --check` compares results with it, and `springtune accept` renews it. Tolerances are"
    yield "# yours, and stay; a line may have a relative one of its own: {..., tolerance: 1e-3}."
    yield f"{ACCEPTED}: {tree.attrs[ACCEPTED]}"
    yield f"springtune_version: {tree.attrs['springtune_version']}"
    yield f"{TOLERANCES}:"
    yield f"  all: {_tolerance_text(general)}"
    for name, one in own.items():
        yield f"  {name}: {_tolerance_text(one)}"
    yield "groups:"
    roots = [tree.to_dataset()]
    for node in tree.subtree:
        data = node.to_dataset()
        if any(_known(array).any() for array in node.data_vars.values()):
            yield f"  {node.path}:"
            yield from (
                f"    {line}" for line in _group_lines(node.path, data[list(node.data_vars)], roots, own, general)
            )


def _group_lines(
    path: str, data: xr.Dataset, roots: Sequence[xr.Dataset], own: Mapping[str, Tolerance], general: Tolerance
) -> Iterator[str]:
    cells = cell_dimensions([data], roots)
    used = {str(name) for array in data.data_vars.values() for name in array.dims}
    by = [str(name) for name in data.sizes if name in used and name in cells]
    along = [str(name) for name in data.sizes if name in used and name not in cells]
    yield f"by: {{{', '.join(f'{name}: {_unit(data, name)}' for name in by)}}}"
    if along:
        yield "along:"
        for name in along:
            labels = data[name].values.tolist() if name in data.coords else list(range(data.sizes[name]))
            yield f"  {name}: [{', '.join(repr(label) for label in labels)}]"
    texts, digits, lists = {}, {}, set()
    for variable, array in data.data_vars.items():
        name = str(variable)
        order = [one for one in (*by, *along) if one in array.dims]
        shape = [array.sizes[one] if one in array.dims else 1 for one in (*by, *along)]
        lists |= {name} if {*along} & {*order} else set()
        texts[name] = array.transpose(*order).values.reshape(shape)
        relative = own.get(variable_name(path, name), general).relative
        digits[name] = min(17, max(6, math.ceil(-math.log10(relative)) + FURTHER_DIGITS)) if relative > 0 else 17
    yield "values:"
    sizes = [data.sizes[name] for name in by]
    words = dict(enumerate(dataset.STATUS))
    if "status" in data and is_flagged(data["status"]):
        words = flag_words(data["status"])
    for place in np.ndindex(*sizes):
        parts = []
        for name, values in texts.items():
            here = values[tuple(min(at, size - 1) for at, size in zip(place, values.shape))]
            if name == "status":
                said = words.get(int(here.flat[0]), "not_requested")
                if name not in lists and said != "not_requested":
                    parts.append(f"status: {said}")
            elif not np.isnan(here).all():
                numbers = [f"{number:.{digits[name]}g}" for number in here.ravel().tolist()]
                parts.append(f"{name}: [{', '.join(numbers)}]" if name in lists else f"{name}: {numbers[0]}")
        if parts:
            labels = ", ".join(_label(data, name, at) for name, at in zip(by, place))
            yield f"  {labels or 'all'}: {{{', '.join(parts)}}}"


def _unit(data: xr.Dataset, name: str) -> str:
    """Unit of a dimension's labels; empty for names."""
    if name in data.coords and data[name].dtype.kind in "OUS":
        return "name"
    units = str(data[name].attrs.get("units", "1")) if name in data.coords else "1"
    return "mm" if units == "m" else "number" if units in ("", "1") else units


def _label(data: xr.Dataset, name: str, at: int) -> str:
    label = data[name].values[at] if name in data.coords else at
    unit = _unit(data, name)
    if unit == "name":
        return str(label)
    number = f"{(1e3 if unit == 'mm' else 1) * float(label):.12g}"
    return number if unit == "number" else f"{number} {unit}"


def _tolerance_json(given: Mapping[str, Tolerance]) -> str:
    return json.dumps({name: {"relative": one.relative, "absolute": one.absolute} for name, one in given.items()})


def _tolerance_text(one: Tolerance) -> str:
    return f"{{relative: {one.relative:g}" + ("}" if one.absolute is None else f", absolute: {one.absolute:g}}}")


class _Yaml:
    """YAML file of expected values; faults name their place."""

    def __init__(self, path: Path) -> None:
        from ..config.messages import read_yaml

        self.path = path
        try:
            text = path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            raise ValueError(f"{path}: not UTF-8 text; save the file in UTF-8, or accept the results anew") from None
        self.content, self.lines = read_yaml(text, str(path))

    def stop(self, message: str, *keys: str | int) -> ValueError:
        """Create the error for a place in the file."""
        line = next((self.lines[keys[:size]] for size in range(len(keys), 0, -1) if keys[:size] in self.lines), 0)
        return ValueError(
            f"{self.path}:{line}: {'.'.join(map(str, keys))}: {message}" if line else f"{self.path}: {message}"
        )

    def tree(self) -> xr.DataTree:
        """Read all values."""
        if not isinstance(self.content, dict) or ACCEPTED not in self.content:
            raise ValueError(f"{self.path}: holds no expected values; {EXAMPLE}")
        groups = {path: self._group(path) for path in self._mapping(self.content.get("groups"), "groups")}
        # Groups of a tree have the labels of its root.
        axes: dict[Hashable, np.ndarray] = {}
        for data in groups.values():
            for name, labels in data.indexes.items():
                axes[name] = _together([*axes.get(name, []), *labels])
        for path, data in groups.items():
            fill = {name: 0 if name == "status" else np.nan for name in data.data_vars}
            groups[path] = data.reindex({name: axes[name] for name in data.dims}, fill_value=fill)
        tree = xr.DataTree.from_dict({"/": xr.Dataset()} | groups)
        tree.attrs = {
            ACCEPTED: str(self.content[ACCEPTED]),
            "springtune_version": str(self.content.get("springtune_version", "unknown")),
            TOLERANCES: _tolerance_json(self._tolerances()),
        }
        return tree

    def _mapping(self, given: Any, *keys: str) -> dict[str, Any]:
        if not isinstance(given, dict):
            raise self.stop(f"is no mapping; {EXAMPLE}", *keys)
        return given

    def _number(self, text: object, *keys: str) -> float:
        try:
            return float(text)  # type: ignore[arg-type]
        except (TypeError, ValueError):
            raise self.stop(f"'{text}' is no number; give one such as 1e-6, or nan", *keys) from None

    def _tolerances(self) -> dict[str, Tolerance]:
        found: dict[str, Tolerance] = {}
        for name, one in self._mapping(self.content.get(TOLERANCES, {}), TOLERANCES).items():
            parts = self._mapping(one, TOLERANCES, name)
            for key in parts:
                if key not in ("relative", "absolute"):
                    raise self.stop("is no part of a tolerance; give relative or absolute", TOLERANCES, name, key)
            numbers = {key: self._number(text, TOLERANCES, name, key) for key, text in parts.items()}
            for key, number in numbers.items():
                if not (math.isfinite(number) and number >= 0):
                    raise self.stop(f"{number:g} is no tolerance; give 0 or more", TOLERANCES, name, key)
            group, _, own = name.rpartition("/")
            held = self.content["groups"].get(f"/{group}", {}).get("values") or {}
            if name != "all" and not any(isinstance(row, dict) and own in row for row in held.values()):
                raise self.stop("no value has this name; leave it out", TOLERANCES, name)
            found["" if name == "all" else name] = Tolerance(
                numbers.get("relative", 0.0 if "absolute" in numbers else RELATIVE), numbers.get("absolute")
            )
        return found

    def _group(self, path: str) -> xr.Dataset:
        """Read a group's lines."""
        keys = ("groups", path)
        group = self._mapping(self.content["groups"][path], *keys)
        by = {name: str(unit) for name, unit in self._mapping(group.get("by", {}), *keys, "by").items()}
        axes: dict[str, np.ndarray] = {}
        for name, labels in self._mapping(group.get("along", {}), *keys, "along").items():
            if not isinstance(labels, list):
                raise self.stop("is no list of numbers", *keys, "along", name)
            axes[name] = np.array([self._number(label, *keys, "along", name) for label in labels])
            if len(set(axes[name])) != len(labels):
                raise self.stop("has a label twice", *keys, "along", name)
        points = [len(labels) for labels in axes.values()]
        values = self._mapping(group.get("values"), *keys, "values")
        rows = {text: self._labels(by, text, *keys, "values") for text in values}
        axes = {name: _together([row[name] for row in rows.values()]) for name in by} | axes
        places = {name: {label: at for at, label in enumerate(axes[name].tolist())} for name in by}
        shape = [len(axes[name]) for name in by]
        arrays: dict[str, np.ndarray] = {}
        for text, row in rows.items():
            at = tuple(places[name][label] for name, label in row.items())
            for name, value in self._mapping(values[text], *keys, "values", text).items():
                where = (*keys, "values", text, name)
                if name == "status":
                    if value not in dataset.STATUS:
                        raise self.stop(f"'{value}' is no status; known: {', '.join(dataset.STATUS)}", *where)
                    arrays.setdefault(name, np.zeros(shape, dtype="int8"))[at] = dataset.STATUS.index(value)
                    continue
                whole = isinstance(value, list)
                array = arrays.setdefault(name, np.full([*shape, *points] if whole else shape, np.nan))
                if whole != (array.ndim > len(shape)):
                    raise self.stop("is a list in one line and a number in another, or along nothing", *where)
                numbers = [self._number(one, *where) for one in (value if whole else [value])]
                if len(numbers) != array[at].size:
                    count = array[at].size
                    raise self.stop(f"{len(numbers)} numbers; give {count}, one for each place along it", *where)
                array[at] = np.reshape(numbers, array[at].shape)
        found = xr.Dataset({name: (list(axes)[: array.ndim], array) for name, array in arrays.items()})
        for name, labels in axes.items():
            unit = by.get(name, "number")
            found.coords[name] = (name, labels, {"units": {"mm": "m", "number": "1", "name": "1"}.get(unit, unit)})
        if "status" in found:
            flags = np.arange(len(dataset.STATUS), dtype="int8")
            found["status"].attrs |= {"flag_values": flags, "flag_meanings": " ".join(dataset.STATUS)}
        return found

    def _labels(self, by: Mapping[str, str], text: str, *keys: str) -> dict[str, str | float]:
        """Read the labels of a line."""
        words = [word.strip() for word in str(text).split(", ")] if by else []
        if len(words) != len(by):
            raise self.stop(f"{len(words)} labels; give {len(by)}: {', '.join(by)}", *keys, text)
        found: dict[str, str | float] = {}
        for (name, unit), word in zip(by.items(), words):
            number = NUMBER.match(word)
            if unit == "name":
                found[name] = word
            elif number and word[number.end() :].strip() == ("" if unit == "number" else unit):
                value = float(number[0])
                found[name] = float(f"{value / 1e3:.12g}") if unit == "mm" else value
            else:
                raise self.stop(f"{name} '{word}' is no number{'' if unit == 'number' else f' in {unit}'}", *keys, text)
        return found


def _together(labels: Sequence[Any]) -> np.ndarray:
    """Labels of a dimension: texts in their order, numbers sorted."""
    if labels and isinstance(labels[0], str):
        return np.array(list(dict.fromkeys(labels)), dtype=object)
    return np.unique(np.array(labels, dtype=float))

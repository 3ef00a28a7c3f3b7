"""Numbers of a paper by name: declared beside its text, read from datasets, formatted once.

``numbers.yaml`` declares numbers and tables, ``printed.yaml`` what another publication prints. A number is a variable
of a study's dataset at some labels, reduced where that leaves several cells, or a formula of other numbers:

    largest_error:  {study: paper, variable: deformation_error, at: {definition: lattice}, reduce: largest,
                     absolute: true, unit: "%", digits: 2}
    lattice_rule:   {formula: sqrt(3) / 2 * sheet, unit: N/m, digits: 1}
"""

import hashlib
import json
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pandas as pd
import xarray as xr
import yaml
from jinja2 import StrictUndefined, TemplateError
from jinja2.sandbox import SandboxedEnvironment
from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError

from ..output import reading
from ..output.dataset import STATUS
from ..runs import keys
from . import PaperError

HASH_DIGITS = 12


@dataclass(frozen=True)
class Dataset:
    """A dataset in memory with its origin; `sha256` includes stored run times."""

    path: Path
    tree: xr.DataTree
    sha256: str

    @property
    def study(self) -> str:
        """Name of its study."""
        return str(self.tree.attrs["study"])

    def origin(self) -> dict[str, object]:
        """Versions, date and hash, for the statement on reproducibility."""
        attributes = self.tree.attrs
        return {
            "study": self.study,
            "title": attributes["title"],
            "version": attributes["springtune_version"],
            "commit": attributes["git_commit"][:HASH_DIGITS] or "no commit",
            "changed": attributes["git_commit"].endswith(keys.CHANGED_ENDING),
            "created": attributes["created"][:10],
            "software": json.loads(attributes["software"]),
            "sha256": self.sha256[:HASH_DIGITS],
        }


def read(paths: Iterable[str | Path]) -> dict[str, Dataset]:
    """Read datasets."""
    found: dict[str, Dataset] = {}
    for path in map(Path, paths):
        try:
            with reading.open(path) as tree:
                one = Dataset(path, tree.load(), hashlib.sha256(path.read_bytes()).hexdigest())
        except (OSError, ValueError) as error:
            raise PaperError(str(error)) from None
        found[one.study] = one
    return found


def dataset_of(datasets: Mapping[str, Dataset], study: str, what: str) -> Dataset:
    """Return the dataset of a study."""
    if study not in datasets:
        raise PaperError(
            f"{what}: no dataset of the study '{study}' was given; given are {', '.join(datasets) or 'none'}: "
            f"run config/{study}.yaml and give its results/{study}/dataset.nc"
        )
    return datasets[study]


# -- declarations ------------------------------------------------------------------------------------------------------

TEXT_UNITS = {
    "": ("1", 1.0), "%": ("1", 1e-2),
    "µm": ("m", 1e-6), "mm": ("m", 1e-3), "mm²": ("m2", 1e-6),
    "s": ("s", 1.0), "ms": ("s", 1e-3), "µs": ("s", 1e-6), "ns": ("s", 1e-9),
    "mN": ("N", 1e-3), "N": ("N", 1.0), "kN": ("N", 1e3), "N/m": ("N/m", 1.0), "N/mm": ("N/m", 1e3),
    "×10⁶ N/m": ("N/m", 1e6), "MPa": ("Pa", 1e6), "GPa": ("Pa", 1e9), "J": ("J", 1.0), "MB": ("byte", 1e6),
}  # fmt: skip
"""Text units: the dataset's unit and the factor."""

Selection = Annotated[list[dict[str, Any]], BeforeValidator(lambda at: at if isinstance(at, list) else [at])]

REDUCTIONS: dict[str, Callable[[np.ndarray], float]] = {
    "mean": np.mean,
    "median": np.median,
    "smallest": np.min,
    "largest": np.max,
    "count": len,
}
"""Reductions of several cells, without empty ones."""


class Entry(BaseModel):
    """An entry of a file of a paper."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Number(Entry):
    """Declaration of a number, or of a part of a table's, which is the product of its rows and columns.

    `variable` includes its group, as in ``sensitivity/best_stiffness``. `at` maps dimensions to labels; cells of a list
    of such mappings count together. `over` names a divisor of the same group. `where` tests flags: ``status=unstable``,
    ``status!=not_requested``. `cells` is the number of values that `reduce` needs. `marks` maps a mark to a variable
    whose text or status sets it. `title` and `group` belong to tables; ``{beam}`` stands for its label.
    """

    study: str = ""
    variable: str = ""
    at: Selection = [{}]
    over: str = ""
    minus: float = 0.0
    where: str = ""
    reduce: Literal["", "mean", "median", "smallest", "largest", "count"] = ""
    absolute: bool = False
    cells: int | None = None
    formula: str = ""
    unit: Literal[tuple(TEXT_UNITS)] = ""  # type: ignore[valid-type]  # the keys
    digits: int | None = None
    figures: int | None = None
    sign: bool = False
    optional: bool = False
    marks: dict[str, str] = {}
    title: str = ""
    group: str = ""

    def text(self, value: float) -> str:
        """Format a value without its unit."""
        value = value / TEXT_UNITS[self.unit][1]
        text = f"{value:z.{self.digits or 0}f}" if self.figures is None else _significant(value, self.figures)
        plus = "+" if self.sign and not text.startswith("-") and float(text.partition("×")[0]) else ""
        return (plus + text).replace("-", "−")

    def source(self) -> str:
        """Describe the source."""
        if self.formula:
            return self.formula
        labels = "; ".join(", ".join(f"{name}={label}" for name, label in at.items()) for at in self.at)
        return f"{self.reduce} {self.study}:/{self.variable}[{labels}]".strip()


class Printed(Entry):
    """A number from another publication."""

    printed: str
    unit: Literal[tuple(TEXT_UNITS)] = ""  # type: ignore[valid-type]  # the keys
    where: str


class Table(Entry):
    """Declaration of a table; `rows` and `columns` override its common entries."""

    all: dict[str, Any] = {}
    rows: list[dict[str, Any]]
    columns: list[dict[str, Any]]


def load(path: Path) -> dict[str, Any]:
    """Read a YAML file."""
    try:
        return yaml.safe_load(path.read_text(encoding="utf-8")) or {}
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise PaperError(f"{path}: cannot be read: {error}") from None


def numbers(declared: Mapping[str, Any], printed: Mapping[str, Any], datasets: Mapping[str, Dataset]) -> dict[str, Any]:
    """Evaluate all numbers of a paper."""
    if twice := sorted(declared.keys() & printed.keys()):
        raise PaperError(f"{', '.join(twice)}: declared twice, in numbers.yaml and printed.yaml; rename one")
    found: dict[str, Any] = {}
    for name, entry in printed.items():
        one = validate_entry(Printed, entry, name)
        value = float(one.printed) * TEXT_UNITS[one.unit][1]
        found[name] = {"text": one.printed.replace("-", "−"), "unit": one.unit, "value": value, "source": one.where}
    wrong = []
    for name, entry in declared.items():
        try:
            found[name] = _evaluate(validate_entry(Number, entry, name), found, datasets, name)
        except PaperError as error:  # reported together with what else is wrong
            wrong.append(str(error))
            found[name] = {"text": None, "unit": "", "value": None, "source": ""}
    if wrong:
        raise PaperError("\n".join(wrong))
    return found


def _evaluate(number: Number, found: Mapping[str, Any], datasets: Mapping[str, Dataset], name: str) -> dict[str, Any]:
    if number.formula:
        value, why = _formula(number.formula, found, name), f"the formula '{number.formula}' has no value"
    else:
        cells = _cells(number, datasets, name)
        value, reason = _reduce(number, cells, name), next((f": {one}" for one in map(str, cells.message) if one), "")
        why = (
            f"{datasets[number.study].path} has no value of {number.source()}{reason}; run config/{number.study}.yaml "
            "again with what it needs, or declare the number optional and give the text a branch without it"
        )
    there = math.isfinite(value)
    if not there and not number.optional:
        raise PaperError(f"{name}: {why}")
    shown = {"text": number.text(value), "value": value} if there else {"text": None, "value": None}
    return shown | {"unit": number.unit, "source": number.source()}


def table(declared: Mapping[str, Any], datasets: Mapping[str, Dataset], name: str) -> dict[str, Any]:
    """Evaluate a table: titles and formatted cells."""
    made = validate_entry(Table, declared, name)
    columns = [validate_entry(Number, entry, name) for entry in made.columns]
    rows, studies = [], set()
    for entry in made.rows:
        texts = []
        for column in made.columns:
            at = {key: label for part in (made.all, entry, column) for key, label in part.get("at", {}).items()}
            number = validate_entry(Number, {**made.all, **entry, **column, "at": at}, name)
            studies.add(number.study)
            cells = _cells(number, datasets, name, of_table=True)
            value = _reduce(number, cells, name)
            texts.append(number.text(value) + _marks(number, cells) if math.isfinite(value) else "–")
        rows.append(_heading(validate_entry(Number, entry, name)) | {"cells": texts})
    data = "; ".join(f"{study}, sha256 {datasets[study].sha256[:HASH_DIGITS]}" for study in sorted(studies))
    return {"columns": [_heading(one) for one in columns], "rows": rows, "data": data}


def _heading(number: Number) -> dict[str, str]:
    """Title and group of a row or column, with labels filled in."""
    labels = {name: f"{1e3 * one:g} mm" if name == "mesh_size" else str(one) for name, one in number.at[0].items()}
    filled = {"title": number.title, "group": number.group}
    for name, label in labels.items():
        filled = {key: text.replace(f"{{{name}}}", label) for key, text in filled.items()}
    return filled | {"unit": number.unit}


def validate_entry(model: type[Any], entry: object, name: str) -> Any:
    """Validate a declaration by its model."""
    try:
        return model.model_validate(entry)
    except ValidationError as error:
        wrong = "; ".join(f"{'.'.join(map(str, one['loc'])) or 'entry'}: {one['msg']}" for one in error.errors())
        raise PaperError(f"{name}: {wrong}") from None


def _cells(number: Number, datasets: Mapping[str, Dataset], name: str, of_table: bool = False) -> pd.DataFrame:
    """Cells of a number: ``value``, ``message``, and its marks by name; of a table, variables may lack labels."""
    if not number.study or not number.variable:
        raise PaperError(f"{name}: give a study and a variable, or a formula")
    one = dataset_of(datasets, number.study, name)
    group, _, variable = number.variable.rpartition("/")
    if group and group not in one.tree.children:
        raise PaperError(f"{name}: {one.path} has no group /{group}; give one that it has, or run the study again")
    data = (one.tree[group] if group else one.tree).to_dataset()
    flag, _, status = number.where.partition("=")
    columns = {"value": variable, "over": number.over, "flag": flag.rstrip("!")} | {key: key for key in number.marks}
    for column in filter(None, columns.values()):
        if column not in data.variables:
            raise PaperError(f"{name}: {one.path} has no variable '{column}' in /{group}; give one that it has")
    if number.where and status not in STATUS:
        raise PaperError(f"{name}: '{status}' is no status; give one of {', '.join(STATUS)}")
    array = data[variable]
    columns["units"] = array.attrs.get("units_variable", "")
    columns["message"] = "message" if "message" in data and set(data.message.dims) <= set(array.dims) else ""
    whole = xr.Dataset({key: data[held] for key, held in columns.items() if held})
    parts = []
    for place, at in enumerate(number.at):
        part = whole.expand_dims(place=[place])
        for dimension, label in at.items():
            if not of_table or dimension not in data.dims or dimension in array.dims:
                part = _selected(part, variable, dimension, label, number.optional, name)
        parts.append(part.to_dataframe())
    cells = pd.concat(parts)
    cells = cells.assign(**{key: "" for key in ("units", "message") if key not in cells})
    if array.dtype.kind not in "fiu":  # texts can only be counted
        cells["value"] = 0.0 if number.reduce == "count" else math.nan
    cells["value"] = cells.value / (cells.over if number.over else 1) - number.minus
    if number.where:
        cells["value"] = cells.value.where((cells.flag == STATUS.index(status)) == (not flag.endswith("!")))
    units = {*cells.units, str(array.attrs.get("units", "")) if not columns["units"] else ""} - {""}
    if len(units) > 1:
        raise PaperError(
            f"{name}: cells of '{variable}' are in {', '.join(sorted(units))}; choose labels that leave one of them"
        )
    if units - {TEXT_UNITS[number.unit][0]} and not number.over and number.reduce != "count":
        remedy = f"which '{number.unit}' does not show; give another unit"
        raise PaperError(f"{name}: '{variable}' is in {''.join(units)}, {remedy}")
    return cells


def _selected(data: xr.Dataset, variable: str, dimension: str, label: Any, optional: bool, name: str) -> xr.Dataset:
    """Select the cells at one or several labels; none if an optional number lacks a label."""
    array = data["value"]
    if dimension not in array.dims:
        known = ", ".join(str(one) for one in array.dims if one != "place")
        raise PaperError(f"{name}: '{variable}' has no dimension '{dimension}'; it has {known}")
    labels = array[dimension].values.tolist()
    lacking = [one for one in (label if isinstance(label, list) else [label]) if one not in labels]
    if not lacking:
        return data.sel({dimension: label})
    if optional:
        return data.isel({dimension: []})
    raise PaperError(f"{name}: {dimension} {lacking[0]!r} is not in the dataset; it has {', '.join(map(repr, labels))}")


def _reduce(number: Number, cells: pd.DataFrame, name: str) -> float:
    values = cells.value[np.isfinite(cells.value)].to_numpy()
    if number.cells is not None and len(values) != number.cells:
        raise PaperError(
            f"{name}: {len(values)} of {number.cells} cells have a value in {number.source()}; run "
            f"config/{number.study}.yaml again with what it needs, or correct 'cells' and say in the text what lacks"
        )
    if number.reduce == "count":
        return len(values)
    if not len(values):
        return math.nan
    if len(values) > 1 and not number.reduce:
        raise PaperError(
            f"{name}: {len(values)} cells are left; choose labels, or reduce them by {', '.join(REDUCTIONS)}"
        )
    return float(REDUCTIONS[number.reduce or "mean"](np.abs(values) if number.absolute else values))


def _marks(number: Number, cells: pd.DataFrame) -> str:
    """Marks of a table cell that is not solved, or that has a text."""
    usual = {"status": STATUS.index("solved")}
    return "".join(mark for name, mark in number.marks.items() if (cells[name] != usual.get(name, "")).any())


FORMULAS = SandboxedEnvironment(undefined=StrictUndefined)
FORMULAS.globals = {"abs": abs, "max": max, "min": min, "pi": math.pi, "sqrt": math.sqrt}


def _formula(text: str, found: Mapping[str, Any], name: str) -> float:
    known = {key: math.nan if one["value"] is None else one["value"] for key, one in found.items()}
    try:
        value: Any = FORMULAS.compile_expression(text, undefined_to_none=False)(**known)
        return float(value)
    except (TemplateError, ArithmeticError, TypeError, ValueError) as error:
        raise PaperError(
            f"{name}: the formula '{text}' cannot be computed: {error}; give numbers that are declared above, "
            f"+ - * / ** and {', '.join(FORMULAS.globals)}"
        ) from None


SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def _significant(value: float, figures: int) -> str:
    """Format significant digits, with a power of ten far from one."""
    mantissa, _, power = f"{value:.{figures - 1}e}".partition("e")
    exponent = int(power)
    if -4 <= exponent < 5:
        return f"{float(f'{mantissa}e{power}'):.{max(figures - 1 - exponent, 0)}f}"
    return f"{mantissa} × 10{str(exponent).translate(SUPERSCRIPTS)}"

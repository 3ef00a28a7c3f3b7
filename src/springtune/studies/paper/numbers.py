"""Numbers of a paper by name: declared beside its text, read from datasets, formatted once.

``numbers.yaml`` declares numbers and tables, ``printed.yaml`` what another publication prints. A number is a variable
of a study's dataset at some labels, reduced where that leaves several cells, or a formula of other numbers:

    largest_error:  {study: paper, variable: deformation_error, at: {definition: lattice}, reduce: largest,
                     absolute: true, unit: "%", digits: 2}
    lattice_rule:   {formula: sqrt(3) / 2 * sheet, unit: N/m, digits: 1}

A table is the product of its rows and columns, each a part of such a declaration.
"""

import ast
import hashlib
import json
import math
import operator
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import xarray as xr
import yaml
from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError

from ..output import reading
from ..output.dataset import STATUS
from ..runs import provenance
from . import PaperError

HASH_SHOWN = 12


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
        """Facts for a statement on reproducibility."""
        attributes = self.tree.attrs
        return {
            "study": self.study,
            "title": attributes["title"],
            "version": attributes["springtune_version"],
            "commit": attributes["git_commit"][:HASH_SHOWN] or "no commit",
            "changed": attributes["git_commit"].endswith(provenance.CHANGED),
            "created": attributes["created"][:10],
            "software": json.loads(attributes["software"]),
            "sha256": self.sha256[:HASH_SHOWN],
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


def chosen(datasets: Mapping[str, Dataset], study: str, what: str) -> Dataset:
    """Dataset of a study."""
    if study not in datasets:
        raise PaperError(
            f"{what}: no dataset of the study '{study}' was given; there is {', '.join(datasets) or 'none'}: "
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


class Number(BaseModel):
    """Declaration of a number.

    `variable` includes its group, as in ``sensitivity/best_stiffness``. `at` maps dimensions to labels; cells of a list
    of such mappings count together. `over` names a divisor of the same group. `where` tests flags: ``status=unstable``,
    ``status!=not_requested``. `reduce` is of `REDUCTIONS`, and `cells` the number of values that it needs. `formula`
    computes from other numbers in SI units, in place of a variable. `optional` numbers may be missing. `marks` maps a
    mark to a variable whose text or status sets it. `title` and `group` belong to tables; ``{beam}`` stands for its
    label.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

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
        if self.figures is not None:
            text = _significant(value, self.figures)
        else:
            text = f"{value:.{self.digits or 0}f}"
            if float(text) == 0:
                text = text.lstrip("-")
        if self.sign and not text.startswith("-") and float(text.partition("×")[0]) != 0:
            text = "+" + text
        return text.replace("-", "−")

    def source(self) -> str:
        """Describe the source."""
        if self.formula:
            return self.formula
        labels = "; ".join(", ".join(f"{name}={label}" for name, label in at.items()) for at in self.at)
        return f"{self.reduce} {self.study}:/{self.variable}[{labels}]".strip()


class Printed(BaseModel):
    """A number from another publication."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    printed: str
    unit: Literal[tuple(TEXT_UNITS)] = ""  # type: ignore[valid-type]  # the keys
    where: str


class Table(BaseModel):
    """Declaration of a table; `rows` and `columns` override its common entries."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    all: dict[str, Any] = {}
    rows: list[dict[str, Any]]
    columns: list[dict[str, Any]]


def load(path: Path) -> dict[str, Any]:
    """Content of a YAML file."""
    try:
        return yaml.safe_load(path.read_text(encoding="utf-8")) or {}
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise PaperError(f"{path}: cannot be read: {error}") from None


def numbers(declared: Mapping[str, Any], printed: Mapping[str, Any], datasets: Mapping[str, Dataset]) -> dict[str, Any]:
    """Evaluate all numbers of a paper."""
    twice = sorted(set(declared) & set(printed))
    if twice:
        raise PaperError(f"{', '.join(twice)}: declared twice, in numbers.yaml and printed.yaml; rename one")
    found: dict[str, Any] = {}
    for name, entry in printed.items():
        one = checked(Printed, entry, name)
        value = float(one.printed) * TEXT_UNITS[one.unit][1]
        found[name] = {"text": one.printed.replace("-", "−"), "unit": one.unit, "value": value, "source": one.where}
    wrong = []
    for name, entry in declared.items():
        try:
            found[name] = _read(checked(Number, entry, name), found, datasets, name)
        except PaperError as error:  # told together with what else is wrong
            wrong.append(str(error))
            found[name] = {"text": None, "unit": "", "value": None, "source": ""}
    if wrong:
        raise PaperError("\n".join(wrong))
    return found


def _read(number: Number, found: Mapping[str, Any], datasets: Mapping[str, Dataset], name: str) -> dict[str, Any]:
    value = _formula(number.formula, found, name) if number.formula else _value(number, datasets, name)
    there = math.isfinite(value)
    if not there and not number.optional:
        raise PaperError(_lacking(number, datasets, name))
    return {
        "text": number.text(value) if there else None,
        "unit": number.unit,
        "value": value if there else None,
        "source": number.source(),
    }


def table(declared: Mapping[str, Any], datasets: Mapping[str, Dataset], name: str) -> dict[str, Any]:
    """Evaluate a table: titles and formatted cells."""
    made = checked(Table, declared, name)
    columns = [checked(Number, entry, name) for entry in made.columns]
    rows, studies = [], set()
    for entry in made.rows:
        cells = []
        for column in made.columns:
            number = _without(checked(Number, _together(made.all, entry, column), name), datasets, name)
            studies.add(number.study)
            value = _value(number, datasets, name)
            cells.append(number.text(value) + _marks(number, datasets, name) if math.isfinite(value) else "–")
        rows.append(_head(checked(Number, entry, name)) | {"cells": cells})
    data = "; ".join(f"{study}, sha256 {datasets[study].sha256[:HASH_SHOWN]}" for study in sorted(studies))
    return {"columns": [_head(one) for one in columns], "rows": rows, "data": data}


def checked(model: type[Any], entry: object, name: str) -> Any:
    """Validate a declaration."""
    try:
        return model.model_validate(entry)
    except ValidationError as error:
        wrong = "; ".join(f"{'.'.join(map(str, one['loc'])) or 'entry'}: {one['msg']}" for one in error.errors())
        raise PaperError(f"{name}: {wrong}") from None


def _together(*parts: Mapping[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    at: dict[str, Any] = {}
    for part in parts:
        found |= part
        at |= part.get("at", {})
    return found | {"at": at}


def _without(number: Number, datasets: Mapping[str, Dataset], name: str) -> Number:
    """Drop labels of dimensions that the variable lacks but its dataset has."""
    data, variable = _group(number, datasets, name)
    kept = [dimension for dimension in number.at[0] if dimension in data[variable].dims or dimension not in data.dims]
    return number.model_copy(update={"at": [{dimension: number.at[0][dimension] for dimension in kept}]})


def _titled(text: str, number: Number) -> str:
    """Fill labels into a title, mesh sizes in mm."""
    for name, label in number.at[0].items():
        shown = f"{1e3 * label:g} mm" if name == "mesh_size" else f"{label}"
        text = text.replace(f"{{{name}}}", shown)
    return text


def _head(number: Number) -> dict[str, str]:
    return {"title": _titled(number.title, number), "group": _titled(number.group, number), "unit": number.unit}


def _group(number: Number, datasets: Mapping[str, Dataset], name: str) -> tuple[xr.Dataset, str]:
    if not number.study or not number.variable:
        raise PaperError(f"{name}: give a study and a variable, or a formula")
    one = chosen(datasets, number.study, name)
    group, _, variable = number.variable.rpartition("/")
    if group and group not in one.tree.children:
        raise PaperError(f"{name}: {one.path} has no group /{group}; give one that it has, or run the study again")
    data = (one.tree[group] if group else one.tree).to_dataset()
    for wanted in filter(None, (variable, number.over, _flag(number.where)[0], *number.marks)):
        if wanted not in data.variables:
            raise PaperError(f"{name}: {one.path} has no variable '{wanted}' in /{group}; give one that it has")
    shown, kept = TEXT_UNITS[number.unit][0], _units(number, data, variable, name)
    if kept and kept != shown and not number.over and number.reduce != "count":
        raise PaperError(f"{name}: '{variable}' is in {kept}, which '{number.unit}' does not show; give another unit")
    return data, variable


def _units(number: Number, data: xr.Dataset, variable: str, name: str) -> str:
    """Units of a variable, or of its chosen cells if they differ."""
    array = data[variable]
    if "units_variable" not in array.attrs:
        return str(array.attrs.get("units", ""))
    units = data[array.attrs["units_variable"]]
    chosen_at = [{key: label for key, label in at.items() if key in units.dims} for at in number.at]
    found = {str(one) for at in chosen_at for one in np.ravel(_selected(units, at, name, number.optional)) if one}
    if len(found) > 1:
        raise PaperError(
            f"{name}: cells of '{variable}' are in {', '.join(sorted(found))}; choose labels that leave one of them"
        )
    return "".join(found)


def _selected(array: xr.DataArray, at: Mapping[str, Any], name: str, optional: bool = False) -> xr.DataArray:
    for dimension, label in at.items():
        if dimension not in array.dims:
            raise PaperError(
                f"{name}: '{array.name}' has no dimension '{dimension}'; it has {', '.join(map(str, array.dims))}"
            )
        labels = array[dimension].values.tolist()
        lacking = [one for one in (label if isinstance(label, list) else [label]) if one not in labels]
        if lacking and optional:
            return array.isel({dimension: []})
        if lacking:
            raise PaperError(
                f"{name}: {dimension} {lacking[0]!r} is not in the dataset; it has {', '.join(map(repr, labels))}"
            )
        array = array.sel({dimension: label})
    return array


def _value(number: Number, datasets: Mapping[str, Dataset], name: str) -> float:
    data, variable = _group(number, datasets, name)
    array = data[variable] / data[number.over] if number.over else data[variable]
    array = array.rename(variable)
    if array.dtype.kind not in "fiu":
        return float(_selected(array, number.at[0], name).size) if number.reduce == "count" else math.nan
    array = (array - number.minus).rename(variable) if number.minus else array
    if number.where:
        flag, equal, wanted = _flag(number.where)
        if wanted not in STATUS:
            raise PaperError(f"{name}: '{wanted}' is no status; give one of {', '.join(STATUS)}")
        array = array.where((data[flag] == STATUS.index(wanted)) == equal)
    values = np.concatenate([np.ravel(_selected(array, at, name, number.optional).values) for at in number.at])
    values = values[np.isfinite(values)]
    if number.cells is not None and len(values) != number.cells:
        raise PaperError(
            f"{name}: {len(values)} of {number.cells} cells have a value in {number.source()}; run "
            f"config/{number.study}.yaml again with what it needs, or correct 'cells' and say in the text what lacks"
        )
    if number.reduce == "count":
        return len(values)
    if not len(values):
        return math.nan
    if number.absolute:
        values = np.abs(values)
    if number.reduce:
        return float(REDUCTIONS[number.reduce](values))
    if len(values) > 1:
        raise PaperError(
            f"{name}: {len(values)} cells are left; choose labels, or reduce them by {', '.join(REDUCTIONS)}"
        )
    return float(values[0])


def _flag(where: str) -> tuple[str, bool, str]:
    """Split a condition into variable, equality and value."""
    variable, _, wanted = where.partition("=")
    return variable.rstrip("!"), not variable.endswith("!"), wanted


def _marks(number: Number, datasets: Mapping[str, Dataset], name: str) -> str:
    data, _ = _group(number, datasets, name)
    text = ""
    for variable, mark in number.marks.items():
        array = data[variable]
        here = {dimension: label for dimension, label in number.at[0].items() if dimension in array.dims}
        found = np.ravel(_selected(array, here, name).values)
        marked = (found != STATUS.index("solved")).any() if variable == "status" else any(map(str, found))
        text += mark if marked else ""
    return text


def _lacking(number: Number, datasets: Mapping[str, Dataset], name: str) -> str:
    """Message on a missing number: request, state in the dataset, remedy."""
    if number.formula:
        return f"{name}: the formula '{number.formula}' has no value"
    data, variable = _group(number, datasets, name)
    said = ""
    if "message" in data and set(data.message.dims) <= set(data[variable].dims):
        messages = np.concatenate([np.ravel(_selected(data.message, at, name).values.astype(str)) for at in number.at])
        said = next((f": {message}" for message in messages if message), "")
    path = chosen(datasets, number.study, name).path
    return (
        f"{name}: {path} has no value of {number.source()}{said}; run config/{number.study}.yaml again with what it "
        "needs, or declare the number optional and give the text a branch without it"
    )


_OPERATORS: dict[type[ast.AST], Callable[..., float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
}
_FUNCTIONS: dict[str, Callable[..., float]] = {"abs": abs, "max": max, "min": min, "sqrt": math.sqrt}


def _formula(text: str, found: Mapping[str, Any], name: str) -> float:
    """Evaluate arithmetic of earlier numbers; NaN if one is missing."""

    def value(node: ast.AST) -> float:
        match node:
            case ast.Expression(body):
                return value(body)
            case ast.Constant(int() | float() as number):
                return number
            case ast.Name("pi"):
                return math.pi
            case ast.Name(other) if other in found:
                known = found[other]["value"]
                return math.nan if known is None else known
            case ast.BinOp(left, kind, right) if type(kind) in _OPERATORS:
                return _OPERATORS[type(kind)](value(left), value(right))
            case ast.UnaryOp(kind, operand) if type(kind) in _OPERATORS:
                return _OPERATORS[type(kind)](value(operand))
            case ast.Call(ast.Name(function), arguments, []) if function in _FUNCTIONS:
                return _FUNCTIONS[function](*map(value, arguments))
        raise PaperError(
            f"{name}: '{ast.unparse(node)}' of the formula is not known; give a number that is declared above, "
            f"+ - * / ** or {', '.join(_FUNCTIONS)}"
        )

    try:
        return value(ast.parse(text, mode="eval"))
    except (SyntaxError, ArithmeticError, ValueError) as error:
        raise PaperError(f"{name}: the formula '{text}' cannot be computed: {error}") from None


_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def _significant(value: float, figures: int) -> str:
    """Format significant digits, with a power of ten far from one."""
    mantissa, _, power = f"{value:.{figures - 1}e}".partition("e")
    exponent = int(power)
    if -4 <= exponent < 5:
        return f"{float(f'{mantissa}e{power}'):.{max(figures - 1 - exponent, 0)}f}"
    return f"{mantissa} × 10{str(exponent).translate(_RAISED)}"

"""Declaration of a study kind, for the study, the plan, the dataset, figures, tables and the rules."""

from __future__ import annotations

import csv
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from springtune.registry import import_name

if TYPE_CHECKING:
    from .messages import Problems
    from .model import Study

_PACKAGES = Path(__file__).parents[1] / "kinds"

_FIRST = ("bodies", "moduli", "laying", "stability", "benchmark", "samples")

KINDS = _FIRST + tuple(sorted({path.parent.name for path in _PACKAGES.glob("*/kind.py")} - {*_FIRST}))
"""Packages of the study kinds, in the order of the dataset's groups; other kinds come last."""

VIEWS = "views.yaml"
"""File of a study kind with its views on the page to browse."""

FORMATS = ("png", "pdf")
"""Endings of a figure's files."""

Variables = dict[str, tuple[tuple[str, ...], str, str, Any]]
"""Dimensions, units, long name and value of an empty cell, by name."""

EMPTY_VALUES = {"": np.nan, "text": "", "0": 0, "-1": -1, "float32": np.float32(np.nan), "int8": np.int8(0)}
EMPTY_VALUES |= {"int32": np.int32(0), "no node": np.int32(-1)}
"""Values of empty cells by their names in tables of variables."""


def declared_variables(module: str, group: str = "", **dimensions: tuple[str, ...]) -> Variables:
    """Variables by the table beside a module's file, of one of its groups; `dimensions` stand for names in it."""
    found = {}
    for row in _declared(module):
        if row.get("group", "") == group and row["dimensions"] != row["name"]:
            own = tuple(name for word in row["dimensions"].split() for name in dimensions.get(word, (word,)))
            found[row["name"]] = own, row["units"], row["long_name"], EMPTY_VALUES[row["empty"]]
    return found


def declared_dimensions(module: str) -> dict[str, str | tuple[str, str]]:
    """Long names and units of the dimensions in the table beside a module's file: rows whose dimension is the name."""
    return {
        row["name"]: (row["long_name"], row["units"]) for row in _declared(module) if row["dimensions"] == row["name"]
    }


def _declared(module: str) -> list[dict[str, str]]:
    with Path(module).with_suffix(".csv").open(newline="", encoding="utf-8") as file:
        return [*csv.DictReader(file)]


@dataclass(frozen=True)
class Output:
    """Figures and tables that a study may request under ``outputs``; code is a module, or ``"module:function"``."""

    name: str
    meaning: str  # for the manual
    figures: Callable[[Study], Mapping[str, Mapping[str, object]]] = lambda study: {}  # selected labels, by file stem
    collect: str = ""  # module with `groups(study, folder)`, further groups of the dataset
    plot: str = ""  # function that yields stem, plotting function and selection of each figure of a tree
    job: str = "further"  # outputs share a job, which starts and opens the dataset in as much time as ten figures take
    tables: Callable[[Study], Iterable[str]] = lambda study: []  # file names
    write: str = ""  # function of a tree and a folder that writes the tables and returns their names
    into: str = "tables"  # folder of the tables
    page: bool = False  # whether it is the page of all tables
    draw: Callable[[Any, Any], object] | None = None  # draws its group of the dataset on Axes: one figure, one panel
    shows: str = ""  # what it shows of its kind's part, for the refusal where a study has none
    lack: Callable[[Study], str] = lambda study: ""  # what else a study lacks for it, with the remedy
    usual: bool = False  # whether it is made by default

    @property
    def module(self) -> str:
        """Module that draws the figures."""
        own = self.draw.__module__.partition(".")[2] if self.draw else ""
        return own or self.plot.partition(":")[0]


@dataclass(frozen=True)
class Stage:
    """A stage before the dataset, with a rule of its name; a job needs that of the same bundle of the stage `like`."""

    name: str
    module: str  # does one task, see `springtune.studies.runs.attempts`
    tasks: Callable[[Study], Iterable[Any]]  # see `springtune.studies.runs.plan.Task`
    folder: str = ""  # of its files, within the study's folder; by default its name
    like: str = ""  # stage whose bundles it shares
    alone: bool = False  # whether a job has tasks of one name and the whole machine, to measure seconds
    endings: tuple[str, ...] = (".h5",)  # of the files of a result

    def __post_init__(self) -> None:
        object.__setattr__(self, "folder", self.folder or self.name)


@dataclass(frozen=True, eq=False)
class StudyKind:
    """A study kind: ``KIND`` in the module ``kind`` of its package, which imports neither scipy, xarray nor matplotlib.

    Rows of results become its group of the dataset if it has ``variables``; otherwise ``groups(study, folder)`` of a
    module ``collect`` returns groups by name. A module ``outputs`` with ``OUTPUTS`` makes drawing faster.
    """

    name: str  # of its package, and of its part of a study
    study_fields: dict[str, tuple[Any, Any]] = field(default_factory=dict)  # keys it adds: type and pydantic field
    grid_fields: dict[str, tuple[Any, Any]] = field(default_factory=dict)
    alone: tuple[str, ...] = ()  # keys that a study may have instead of grids; by default its optional keys
    reads: tuple[str, ...] = ()  # other keys of a study that it reads
    files: Callable[[Any], Iterable[Path]] = lambda part: ()  # further input files
    check: Callable[[Any, Problems], None] = lambda config, problems: None
    expand: Callable[[Any, Any], Any] = lambda config, declared: ()  # part of a study, of its config and `Declared`
    axes: Callable[[Any], Mapping[str, Collection[str | float]]] = lambda part: {}  # labels by dimension
    summary: Callable[[Any], list[list[object]]] = lambda part: []  # rows of `springtune scenes`
    variables: Variables = field(default_factory=dict)
    dimensions: dict[str, str | tuple[str, str]] = field(default_factory=dict)
    flags: dict[str, tuple[str, ...]] = field(default_factory=dict)
    sparse: bool = False  # whether variables that no result has are left out
    attributes: Callable[[Any], Mapping[str, object]] = lambda part: {}
    stages: tuple[Stage, ...] = ()
    outputs: tuple[Output, ...] = ()
    tables: Callable[[Study], list[str]] | None = None  # stems of its tables on the page

    def wanted(self, config: Any) -> bool:
        """Return whether a config has one of its sections; a kind without any depends on the grids."""
        return not self.study_fields or any(getattr(config, key) for key in (*self.study_fields, *self.reads))


def stem(name: str, selection: Mapping[str, str]) -> str:
    """Stem of the files of a figure with a selection."""
    return "_".join([name, *selection.values()])


def distinct(name: str, labels: Iterable[str], cells: Iterable[Mapping[str, Any]]) -> dict[str, dict[str, str]]:
    """Distinct selections of the dimensions `labels` among a study's cells, in order, by stem."""
    chosen = [{label: cell[label] for label in labels} for cell in cells]
    return {stem(name, one): one for one in chosen}


def kind_files(name: str) -> list[Path]:
    """Files of a name in the packages of the study kinds."""
    return [path for kind in KINDS if (path := _PACKAGES / kind / name).is_file()]


def modules(*names: str) -> list[str]:
    """Modules of these names that the packages of the study kinds have."""
    return [
        f"studies.kinds.{kind}.{name}" for kind in KINDS for name in names if (_PACKAGES / kind / f"{name}.py").exists()
    ]


@cache
def kinds() -> tuple[StudyKind, ...]:
    """All study kinds."""
    return tuple(import_name(f"studies.kinds.{name}.kind:KIND") for name in KINDS)


@cache
def outputs(*names: str) -> dict[str, Output]:
    """Outputs of all study kinds by name; of kinds up to those of some names, since a module ``kind`` takes long."""
    apart, found = modules("outputs"), dict[str, Output]()
    for kind in KINDS:
        if names and found.keys() >= {*names}:
            break
        module = f"studies.kinds.{kind}.outputs"
        own = (
            import_name(f"{module}:OUTPUTS")
            if module in apart
            else import_name(f"studies.kinds.{kind}.kind:KIND").outputs
        )
        found |= {output.name: output for output in own}
    return found

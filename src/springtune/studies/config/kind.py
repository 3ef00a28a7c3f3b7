"""What a study kind is: all that study, plan, collect, drawing, tables and the rules loop over."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from springtune.registry import imported

if TYPE_CHECKING:
    from .messages import Problems
    from .model import Study

_PACKAGES = Path(__file__).parents[1] / "kinds"

_FIRST = ("scenes", "moduli", "laying", "stability", "benchmark", "samples", "refinement", "shapes")

KINDS = _FIRST + tuple(sorted({path.parent.name for path in _PACKAGES.glob("*/kind.py")} - {*_FIRST}))
"""Packages of the study kinds, in the order of the dataset's groups: these first, then any other."""


FORMATS = ("png", "pdf")
"""Endings of a figure's files."""


@dataclass(frozen=True)
class Output:
    """Figures and tables that are made from a dataset where a study asks for them under ``outputs``.

    Attributes
    ----------
    name : str
        As a study writes it.
    meaning : str
        What it is, for the manual.
    figures : callable, optional
        Of a study: labels that each figure selects, a dict, by the stem of its files.
    collect : str
        Module with ``groups(study, folder)``: groups of the dataset that this output alone needs; from the package on.
    plot : str
        ``"module:function"`` of what draws the figures, from the package on: a function from a dataset's tree to
        triples of the stem, the function that plots and its selection.
    job : str
        Name of the job that makes it; outputs that share it are made by one process. By default its own name.
    tables : callable, optional
        Of a study: names of the files of its tables.
    write : str
        Module with ``write(tree, folder)``, which writes them, and may write more that they name; from the package on.
    into : str
        Folder of these files, in the study's.
    page : bool
        Whether it is the page of all tables, `springtune.studies.output.page`.
    lack : callable, optional
        Of a study: what it would need for this output and has not, with the remedy; empty where it has all.
    usual : bool
        Whether it is made where a study does not say what.
    """

    name: str
    meaning: str
    figures: Callable[[Study], Mapping[str, Mapping[str, object]]] = lambda study: {}
    collect: str = ""
    plot: str = ""
    job: str = ""
    tables: Callable[[Study], Iterable[str]] = lambda study: []
    write: str = ""
    into: str = "tables"
    page: bool = False
    lack: Callable[[Study], str] = lambda study: ""
    usual: bool = False

    @property
    def made_by(self) -> str:
        """Name of the job that makes it."""
        return self.job or self.name

    @property
    def module(self) -> str:
        """Module that draws the figures, from the package on."""
        return self.plot.partition(":")[0]


@dataclass(frozen=True)
class Stage:
    """A stage before the dataset: jobs that each work off a bundle of tasks.

    Its module says what one task is, see `springtune.studies.runs.driver`. Most stages follow from their tasks, see
    `springtune.studies.runs.stages`.

    Attributes
    ----------
    name : str
        Name of the rule, and first part of the names of its files.
    module : str
        From the package on.
    message : str
        What a job does.
    content : callable
        Of a study, its folder and the values of a bundle's members: content of the task file; nothing where there is
        nothing to do.
    products : callable
        Of that content: files that a job makes besides its record.
    members : callable, optional
        Of a study and a machine's `springtune.studies.runs.plan.Costs`: by name, the seconds that it takes and a
        value. Not of a stage that works on the bundles of another one.
    like : str
        Stage whose bundles it works on.
    same, every : tuple of str
        Stages that it waits for: for the job of the same bundle, and for all jobs.
    alone : bool
        Whether a job has a single member and the machine to itself, since other jobs would be in its seconds.
    folder : str
        Folder of its files in the study's.
    tasks : callable, optional
        Of a study: its tasks, of a stage that follows from these.
    """

    name: str
    module: str
    message: str
    content: Callable[[Study, Path, list[Any]], dict[str, Any] | None]
    products: Callable[[dict[str, Any]], Iterable[Path]]
    members: Callable[[Study, Any], Mapping[str, tuple[float, Any]]] | None = None
    like: str = ""
    same: tuple[str, ...] = ()
    every: tuple[str, ...] = ()
    alone: bool = False
    folder: str = ""
    tasks: Callable[[Study], Iterable[Any]] | None = None


@dataclass(frozen=True)
class Kind:
    """A study kind.

    Its package has a module ``kind`` with ``KIND``, which imports neither scipy, xarray nor matplotlib. ``variables``
    say what its group of the dataset has, where each task has a cell of it; else a module ``collect`` has
    ``groups(study, folder)``: groups of the dataset by name. A module ``outputs`` with ``OUTPUTS``, which imports no
    pydantic, saves time where figures are drawn.

    Attributes
    ----------
    name : str
        Name of its package, and of its part of a study, `Study.parts`.
    study_fields, grid_fields : dict of str to tuple
        Keys that it adds to a study and to its grids: type and pydantic's field.
    alone : tuple of str
        Those keys of a study in the place of which it may have neither beams nor grids.
    files : callable, optional
        Of its part of a study: files that it is made from besides.
    check : callable, optional
        Of a config and a `springtune.studies.config.messages.Problems`: adds what is wrong with its values.
    expand : callable, optional
        Of a config and `springtune.studies.config.expand.Declared`: its part of a study; nothing where it has none.
    axes : callable, optional
        Of that part: labels of the dimensions of its groups.
    summary : callable, optional
        Of that part: rows of what `springtune scenes` prints, each a name, a number and a remark.
    variables : dict of str to tuple
        Variables of its group, see `springtune.studies.output.dataset.Group`.
    stages : tuple of Stage
    outputs : tuple of Output
    tables : callable, optional
        Of a study: stems of its tables on the page of all tables; ``tables(tree)`` in its module ``tables`` makes them.
    costs : dict of str to tuple
        Seconds of a task by its name in records, in any case and per unit, before any was measured.
    pieces : callable, optional
        Of a study, `springtune.studies.runs.plan.Costs` and a `springtune.studies.kinds.division.Division`: seconds
        of each piece that a part of a study may have of it, by name. A kind without is in one part as a whole.
    take : callable, optional
        Of a study and names of pieces: the study with these alone.
    """

    name: str
    study_fields: dict[str, tuple[Any, Any]] = field(default_factory=dict)
    grid_fields: dict[str, tuple[Any, Any]] = field(default_factory=dict)
    alone: tuple[str, ...] = ()
    files: Callable[[Any], Iterable[Path]] = lambda part: ()
    check: Callable[[Any, Problems], None] = lambda config, problems: None
    expand: Callable[[Any, Any], Any] = lambda config, declared: ()
    axes: Callable[[Any], Mapping[str, Collection[str | float]]] = lambda part: {}
    summary: Callable[[Any], list[list[object]]] = lambda part: []
    variables: dict[str, tuple[tuple[str, ...], str, str, Any]] = field(default_factory=dict)
    stages: tuple[Stage, ...] = ()
    outputs: tuple[Output, ...] = ()
    tables: Callable[[Study], list[str]] | None = None
    costs: dict[str, tuple[float, float]] = field(default_factory=dict)
    pieces: Callable[[Study, Any, Any], Mapping[tuple[str | int, ...], float]] | None = None
    take: Callable[[Study, Collection[tuple[str | int, ...]]], Study] | None = None

    def module(self, name: str) -> ModuleType:
        """A module of its package."""
        found: ModuleType = imported(f"studies.kinds.{self.name}.{name}")
        return found


def stem(name: str, selection: Mapping[str, str]) -> str:
    """Stem of the files of a figure that has one for each selection."""
    return "_".join([name, *selection.values()])


def distinct(name: str, labels: Iterable[str], cells: Iterable[Mapping[str, str]]) -> dict[str, dict[str, str]]:
    """Distinct selections of a study's cells, in order, by stem.

    Parameters
    ----------
    name : str
        First part of the stem.
    labels : tuple of str
        Dimensions that a figure selects.
    cells : iterable of dict
        Labels of each cell that the study has.

    Returns
    -------
    dict of str to dict
    """
    chosen = [{label: cell[label] for label in labels} for cell in cells]
    return {stem(name, one): one for one in chosen}


def modules(*names: str) -> list[str]:
    """Modules of these names that the packages of the study kinds have."""
    return [
        f"studies.kinds.{kind}.{name}" for kind in KINDS for name in names if (_PACKAGES / kind / f"{name}.py").exists()
    ]


@cache
def kinds() -> tuple[Kind, ...]:
    """All study kinds.

    Returns
    -------
    tuple of Kind
    """
    return tuple(imported(f"studies.kinds.{name}.kind:KIND") for name in KINDS)


@cache
def outputs() -> dict[str, Output]:
    """What is made from a dataset, of all study kinds.

    Returns
    -------
    dict of str to Output
        By name.
    """
    apart = {name.split(".")[2]: imported(f"{name}:OUTPUTS") for name in modules("outputs")}
    found = (apart[name] if name in apart else imported(f"studies.kinds.{name}.kind:KIND").outputs for name in KINDS)
    return {output.name: output for outputs in found for output in outputs}

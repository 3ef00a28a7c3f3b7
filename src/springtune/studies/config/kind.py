"""Declaration of a study kind, for the study, the plan, the dataset, figures, tables and the rules."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from springtune.registry import imported

if TYPE_CHECKING:
    from .messages import Problems
    from .model import Study

_PACKAGES = Path(__file__).parents[1] / "kinds"

_FIRST = ("bodies", "moduli", "laying", "stability", "benchmark", "samples")

KINDS = _FIRST + tuple(sorted({path.parent.name for path in _PACKAGES.glob("*/kind.py")} - {*_FIRST}))
"""Packages of the study kinds, in the order of the dataset's groups; other kinds come last."""

FORMATS = ("png", "pdf")
"""Endings of a figure's files."""


@dataclass(frozen=True)
class Output:
    """Figures and tables of a dataset that a study may request under ``outputs``.

    Attributes
    ----------
    name : str
        Name in a study.
    meaning : str
        Description for the manual.
    figures : callable, optional
        From a study to the selected labels of each figure, by the stem of its files.
    collect : str
        Module with ``groups(study, folder)``, the groups of the dataset for this output; a name within the package.
    plot : str
        ``"module:function"`` that yields the figures of a dataset's tree: stem, plotting function and selection.
    draw : callable, optional
        Draws on Axes the dataset's group of the output's name: a figure of one panel, of that name.
    job : str
        Name of the job that makes it, by default its own; outputs may share a job.
    tables : callable, optional
        From a study to the file names of its tables.
    write : str
        ``"module:function"`` of a tree and a folder, which writes the tables and files and returns their names.
    into : str
        Folder of the tables, within the study's folder.
    page : bool
        Whether it is the page of all tables, see `springtune.studies.output.page`.
    shows : str
        What it shows of its kind's part of a study, for the refusal where the study has none.
    lack : callable, optional
        From a study to what else it lacks for this output, with the remedy; an empty string if nothing.
    usual : bool
        Whether it is made by default.
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
    draw: Callable[[Any, Any], object] | None = None
    shows: str = ""
    lack: Callable[[Study], str] = lambda study: ""
    usual: bool = False

    @property
    def module(self) -> str:
        """Module that draws the figures."""
        own = self.draw.__module__.partition(".")[2] if self.draw else ""
        return own or self.plot.partition(":")[0]


@dataclass(frozen=True)
class Stage:
    """A stage before the dataset; each of its jobs does a bundle of tasks.

    Attributes
    ----------
    name : str
        Name of the rule, and first part of the names of its files.
    module : str
        Module that does one task, from the package on, see `springtune.studies.runs.attempts`.
    tasks : callable
        From a study to its tasks, see `springtune.studies.runs.plan.Task`.
    folder : str
        Folder of its files, within the study's folder; by default its name.
    like : str
        Stage whose bundles it shares, and whose job of the same bundle it needs. All else that a job needs is input of
        its rule in ``workflow/rules/stages.smk``.
    alone : bool
        Whether a job has the tasks of one name and the whole machine, so that its seconds can be measured.
    endings : tuple of str
        Endings of the files of a result.
    """

    name: str
    module: str
    tasks: Callable[[Study], Iterable[Any]]
    folder: str = ""
    like: str = ""
    alone: bool = False
    endings: tuple[str, ...] = (".h5",)

    def __post_init__(self) -> None:
        object.__setattr__(self, "folder", self.folder or self.name)


@dataclass(frozen=True, eq=False)
class Kind:
    """A study kind.

    Its package has a module ``kind`` with ``KIND``, which imports neither scipy, xarray nor matplotlib. If results
    are rows of a group of the dataset, ``variables`` declare the group; otherwise ``groups(study, folder)`` of a
    module ``collect`` returns groups by name. A module ``outputs`` with ``OUTPUTS``, without pydantic, makes drawing
    faster.

    Attributes
    ----------
    name : str
        Name of its package and of its part of a study in `Study.parts`.
    study_fields, grid_fields : dict of str to tuple
        Keys that it adds to a study and to grids, with type and pydantic field.
    alone : dict of str to tuple
        Keys that a study may have instead of grids, and what each needs; by default its optional keys, which need beams
        and materials.
    reads : tuple of str
        Other keys of a study that it reads, such as ``grids``.
    files : callable, optional
        From its part of a study to further input files.
    check : callable, optional
        Adds the mistakes of a config with its sections to `springtune.studies.config.messages.Problems`.
    expand : callable, optional
        From a config with its sections and `springtune.studies.config.expand.Declared` to its part of a study, which
        is empty in other studies.
    axes : callable, optional
        From that part to the labels of its groups' dimensions.
    summary : callable, optional
        From that part to rows of `springtune scenes`: name, number and remark.
    variables, dimensions : dict
        Variables and own dimensions of its group, see `springtune.studies.output.dataset.Group`.
    flags : dict of str to tuple
        Meanings of its flags, see `springtune.studies.output.dataset.Group`.
    sparse : bool
        Whether variables that no result has are left out of its group.
    attributes : callable, optional
        From that part to the attributes of its group.
    stages : tuple of Stage
    outputs : tuple of Output
    tables : callable, optional
        From a study to the stems of its tables on the page, which ``tables(tree)`` of a module ``outputs`` or
        ``tables`` makes.
    """

    name: str
    study_fields: dict[str, tuple[Any, Any]] = field(default_factory=dict)
    grid_fields: dict[str, tuple[Any, Any]] = field(default_factory=dict)
    alone: dict[str, tuple[str, ...]] = field(default_factory=dict)
    reads: tuple[str, ...] = ()
    files: Callable[[Any], Iterable[Path]] = lambda part: ()
    check: Callable[[Any, Problems], None] = lambda config, problems: None
    expand: Callable[[Any, Any], Any] = lambda config, declared: ()
    axes: Callable[[Any], Mapping[str, Collection[str | float]]] = lambda part: {}
    summary: Callable[[Any], list[list[object]]] = lambda part: []
    variables: dict[str, tuple[tuple[str, ...], str, str, Any]] = field(default_factory=dict)
    dimensions: dict[str, str | tuple[str, str]] = field(default_factory=dict)
    flags: dict[str, tuple[str, ...]] = field(default_factory=dict)
    sparse: bool = False
    attributes: Callable[[Any], Mapping[str, object]] = lambda part: {}
    stages: tuple[Stage, ...] = ()
    outputs: tuple[Output, ...] = ()
    tables: Callable[[Study], list[str]] | None = None

    def wanted(self, config: Any) -> bool:
        """Return whether a config has one of its sections; a kind without any depends on the grids."""
        return not self.study_fields or any(getattr(config, key) for key in (*self.study_fields, *self.reads))


def stem(name: str, selection: Mapping[str, str]) -> str:
    """Stem of the files of a figure with a selection."""
    return "_".join([name, *selection.values()])


def distinct(name: str, labels: Iterable[str], cells: Iterable[Mapping[str, str]]) -> dict[str, dict[str, str]]:
    """Distinct selections of the dimensions `labels` among a study's cells, in order, by stem."""
    chosen = [{label: cell[label] for label in labels} for cell in cells]
    return {stem(name, one): one for one in chosen}


def modules(*names: str) -> list[str]:
    """Modules of these names that the packages of the study kinds have."""
    return [
        f"studies.kinds.{kind}.{name}" for kind in KINDS for name in names if (_PACKAGES / kind / f"{name}.py").exists()
    ]


@cache
def kinds() -> tuple[Kind, ...]:
    """All study kinds."""
    return tuple(imported(f"studies.kinds.{name}.kind:KIND") for name in KINDS)


@cache
def outputs() -> dict[str, Output]:
    """Outputs of all study kinds, by name."""
    apart = {name.split(".")[2]: imported(f"{name}:OUTPUTS") for name in modules("outputs")}
    found = [apart[name] if name in apart else imported(f"studies.kinds.{name}.kind:KIND").outputs for name in KINDS]
    return {output.name: output for outputs in found for output in outputs}

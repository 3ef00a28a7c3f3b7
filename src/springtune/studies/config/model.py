"""Expanded study, with meshes, scenes and curves once and sorted, and the declaration of study kinds."""

from __future__ import annotations

import csv
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np

from springtune.problem.materials import AnyMaterial, Material
from springtune.problem.quantities import choose
from springtune.problem.shapes import Beam, Shape
from springtune.registry import import_name

FINITE_STRAIN_REFERENCE = "neo-hooke-plane-stress"
"""Reference of sheets at finite strain for networks with nonlinear kinematics."""

STRAINED_REFERENCE = "neo-hooke-plane-strain"
"""Reference in plane strain; also for materials in plane stress, to compare."""

TESTED_REFERENCE = "yeoh-plane-stress"  # reference of materials with a uniaxial test, by the fitted law

FURTHER_REFERENCES = (FINITE_STRAIN_REFERENCE, STRAINED_REFERENCE, TESTED_REFERENCE)


Labels = dict[str, str | float]  # label of a cell of the dataset, by dimension


@dataclass(frozen=True)
class MeshSpec:
    """A mesh of a study, with `mesh_size` [m]; `unit` is that of the file's coordinates [m]."""

    beam: Beam
    mesh_type: str
    mesh_size: float
    file: Path | None = None
    unit: float = 1.0

    @cached_property
    def _hash(self) -> int:
        return hash((self.beam, self.mesh_type, self.mesh_size, self.file, self.unit))

    def __hash__(self) -> int:
        # Plans look meshes up a hundred thousand times.
        return self._hash

    @cached_property
    def labels(self) -> Labels:
        """Labels of its cell of the dataset."""
        return {"beam": self.beam.name, "mesh_type": self.mesh_type, "mesh_size": self.mesh_size}


MeshFiles = dict[tuple[str, str, float], MeshSpec]


@dataclass
class SceneSpec:
    """A boundary-value problem on one mesh, with tensile `force` [N] and a factor on all stiffnesses [1]."""

    mesh: MeshSpec
    material: Material
    load: str
    force: float
    definition: str
    kinematics: str
    stiffness_scale: float = 1.0

    def labels(self, swept: Iterable[str]) -> Labels:
        """Labels of its cell of the dataset."""
        own = {"material": self.material.name, "load": self.load, "definition": self.definition}
        values = {name: swept_value(self, self.mesh.beam, name) for name in swept}
        return {**self.mesh.labels, **own, "kinematics": self.kinematics, **values}

    @cached_property
    def _hash(self) -> int:
        # Only the main properties of the material: hashing all of it takes longer than the rest.
        body = self.mesh, self.material.name, self.material.young_modulus, self.material.poisson_ratio
        return hash((body, self.load, self.force, self.definition, self.kinematics, self.stiffness_scale))

    def __hash__(self) -> int:
        # As for meshes.
        return self._hash


@dataclass(frozen=True)
class CurveSpec:
    """A sensitivity curve; its stiffness runs through `Study.stiffness_ratios`."""

    mesh: MeshSpec
    material: Material
    load: str
    force: float
    kinematics: str

    def labels(self, swept: Iterable[str]) -> Labels:
        """Labels of its cell of the dataset."""
        found = self.mesh.labels | {"material": self.material.name, "load": self.load, "kinematics": self.kinematics}
        return found | {name: swept_value(self, self.mesh.beam, name) for name in swept if name != "stiffness_scale"}


@dataclass(frozen=True)
class Reference:
    """A finite-element reference solution."""

    beam: Beam
    material: Material
    load: str
    force: float

    def labels(self, swept: Iterable[str]) -> Labels:
        """Labels of its cell of the dataset."""
        found: Labels = {"beam": self.beam.name, "material": self.material.name, "load": self.load}
        return found | {name: swept_value(self, self.beam, name) for name in swept if name != "stiffness_scale"}


@dataclass(frozen=True)
class Grid:
    """Scenes and curves of one grid, also those that other grids share."""

    name: str
    scenes: tuple[SceneSpec, ...]
    curves: tuple[CurveSpec, ...]


@dataclass(frozen=True, eq=False)
class Study:
    """A study, ready to run: tuples without duplicates, in the order of beams, materials, mesh types, sizes, loads."""

    name: str
    path: Path
    text: str
    title: str
    meshes: tuple[MeshSpec, ...]
    scenes: tuple[SceneSpec, ...]
    curves: tuple[CurveSpec, ...]
    references: tuple[Reference, ...]
    mesh_files: MeshFiles  # by mesh type, beam's name and mesh size
    outputs: tuple[str, ...]
    style: dict[str, float]  # width [m] and font size [pt] of figures, where they are given
    further_references: tuple[str, ...]
    materials: dict[str, AnyMaterial]
    parts: dict[str, Any]  # by study kind
    grids: tuple[Grid, ...]
    stiffness_ratios: tuple[float, ...]  # k / (E t) along every curve, ascending [1]
    stiffness_table: dict[tuple[str, str], float]  # of `paper`, by mesh type and material [N/m]
    calibration: tuple[str, str] | None  # beam and load of the curves that calibrate `calibrated`
    printed: tuple[Any, ...]  # of `PrintedCell`
    printed_path: Path | None
    axes: dict[str, tuple[str | float, ...]]  # labels of each dimension of the dataset
    swept: tuple[str, ...] = ()  # parameters of `SWEPT` that are dimensions
    files: tuple[Path, ...] = ()  # that it names

    def __repr__(self) -> str:
        scenes = len(self.scenes) + len(self.shapes.scenes if self.shapes else ())
        return f"Study({self.name}, {scenes} scenes: {self.title})"

    @property
    def plane_strain(self) -> tuple[str, ...]:
        """Names of the declared materials in plane strain."""
        return tuple(name for name, one in self.materials.items() if getattr(one, "plane", "") == "strain")

    @property
    def shapes(self) -> Any:
        """Shapes of the study, `springtune.studies.kinds.bodies.shapes.Shapes`, or None."""
        return self.parts["bodies"]["shapes"] if self.parts["bodies"] else None

    def material(self, name: str) -> AnyMaterial:
        """Return a material that the study declares, by name."""
        return choose(self.materials, name, "material")

    def shape(self, name: str) -> Shape:
        """Return a shape that the study declares, with its loads, by name.

        >>> import springtune as st
        >>> study = st.load_study("config/shapes.yaml")
        >>> cook = study.shape("cook")
        >>> choices = st.predict(cook, st.mesh_shape(cook, "4 mm"), study.materials_of("cook", "third"), load="shear")
        >>> print(f"{choices[0].definition}: {100 * choices[0].errors['edge']:+.1f} %")
        patch: -0.4 %
        """
        if not self.shapes:
            raise ValueError(f"shape: '{name}' is unknown; the study has none; add it under 'shapes'")
        return choose(self.shapes.shape, name, "shape")

    def materials_of(self, shape: str, material: str) -> dict[str, AnyMaterial]:
        """Material of each part of a shape, as the study declares it, and that of the main part, ``""``."""
        self.shape(shape)
        own = self.shapes.parts[shape]
        return {"": self.material(material)} | {part: self.material(name) for part, name in own.items()}

    def labels(self, one: SceneSpec | CurveSpec | Reference) -> dict[str, str | float]:
        """Labels of the dataset cell of a scene, curve or reference."""
        return one.labels(self.swept)


def swept_value(one: SceneSpec | CurveSpec | Reference, beam: Beam, name: str) -> float:
    """Value of a swept parameter."""
    if name == "force":
        return abs(one.force)
    if name == "thickness":
        return beam.thickness
    return float(getattr(one if name == "stiffness_scale" else one.material, name))


# -- study kinds -------------------------------------------------------------------------------------------------------

_PACKAGES = Path(__file__).parents[1] / "kinds"

_FIRST_KINDS = ("bodies", "moduli", "laying", "stability", "benchmark", "samples")

KINDS = _FIRST_KINDS + tuple(sorted({path.parent.name for path in _PACKAGES.glob("*/kind.py")} - {*_FIRST_KINDS}))
"""Packages of the study kinds, in the order of the dataset's groups; other kinds come last."""

FORMATS = ("png", "pdf")  # endings of a figure's files

Variables = dict[str, tuple[tuple[str, ...], str, str, Any]]
"""Dimensions, units, long name and value of an empty cell, by name."""

EMPTY_VALUES = {"": np.nan, "text": "", "0": 0, "-1": -1, "float32": np.float32(np.nan), "int8": np.int8(0)}
EMPTY_VALUES |= {"int32": np.int32(0), "no node": np.int32(-1)}
"""Values of empty cells by their names in tables of variables."""


def declared(module: str, group: str = "", **names: tuple[str, ...]) -> dict[str, Any]:
    """Variables of a group, and dimensions, by the table beside a module's file; `names` stand for several dimensions.

    A row whose dimension is its name declares a dimension.
    """
    variables, dimensions = {}, {}
    with Path(module).with_suffix(".csv").open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            if row["dimensions"] == row["name"]:
                dimensions[row["name"]] = row["long_name"], row["units"]
            elif row.get("group", "") == group:
                own = tuple(one for word in row["dimensions"].split() for one in names.get(word, (word,)))
                variables[row["name"]] = own, row["units"], row["long_name"], EMPTY_VALUES[row["empty"]]
    return {"variables": variables, "dimensions": dimensions}


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
    write: str = ""  # function of a tree and a folder that writes the tables
    into: str = "tables"  # folder of the tables
    page: bool = False  # whether it is the page of all tables
    draw: Callable[[Any, Any], object] | None = None  # draws its group of the dataset on Axes: one figure, one panel
    shows: str = ""  # what it shows of its kind's part, for the refusal where a study has none
    lack: Callable[[Study], str] = lambda study: ""  # what else a study lacks for it, with the remedy
    usual: bool = False  # whether it is made by default

    @property
    def module(self) -> str:
        """Module that draws the figures."""
        return self.draw.__module__.partition(".")[2] if self.draw else self.plot.partition(":")[0]


@dataclass(frozen=True)
class Stage:
    """A stage before the dataset, with a rule of its name; a job needs that of the same bundle of the stage `like`."""

    name: str
    module: str  # does one task, see `springtune.studies.runs.attempts`
    tasks: Callable[[Study], Iterable[Any]]  # see `springtune.studies.runs.plan.Task`
    folder: str = ""  # of its files, within the study's folder; by default its name
    like: str = ""  # stage whose bundles it shares
    timed: bool = False  # whether a job has tasks of one name and the whole machine, to measure seconds
    endings: tuple[str, ...] = (".h5",)  # of the files of a result
    unkeyed: tuple[str, ...] | None = None  # the only values of its tasks that are not in their keys, if known

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
    instead_of_grids: tuple[str, ...] = ()  # keys that a study may have instead of grids; by default its optional keys
    reads: tuple[str, ...] = ()  # other keys of a study that it reads
    files: Callable[[Any], Iterable[Path]] = lambda part: ()  # further input files
    check: Callable[[Any, Any], None] = lambda config, problems: None
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

    def requested_by(self, config: Any) -> bool:
        """Return whether a config has one of its sections; a kind without any depends on the grids."""
        return not self.study_fields or any(getattr(config, key) for key in (*self.study_fields, *self.reads))


def stem(name: str, selection: Mapping[str, str]) -> str:
    """Stem of the files of a figure with a selection."""
    return "_".join([name, *selection.values()])


def view_files() -> list[Path]:
    """Files with the views of the study kinds on the page to browse."""
    return [path for kind in KINDS if (path := _PACKAGES / kind / "views.yaml").is_file()]


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
    """Outputs of study kinds by name: of all, or of as few as have some names, since importing a kind takes long."""
    apart, found = modules("outputs"), dict[str, Output]()
    for package in (f"studies.kinds.{kind}" for kind in KINDS):
        if names and found.keys() >= {*names}:
            break
        is_apart = f"{package}.outputs" in apart
        own = import_name(f"{package}.outputs:OUTPUTS") if is_apart else import_name(f"{package}.kind:KIND").outputs
        found |= {output.name: output for output in own}
    return found

"""What a study asks for: meshes, scenes, curves and all else, free of duplicates and in a canonical order."""

from dataclasses import dataclass
from pathlib import Path

from ..problem.geometry import Beam, Strip, Trapezoid
from ..problem.materials import Material

KINEMATICS = ("nonlinear", "linear")
"""Kinematics of a network: springs that keep their length law, or their tangent at rest."""

OUTPUTS = ("sensitivity", "size", "deformed", "tables", "definitions", "block", "laying", "stability", "benchmark")
"""What is made from a dataset: figures of curves, of errors against mesh size and of deformed networks; tables as the
paper's; figures and tables that compare definitions; the figure of a pressed block, that of laid strips, and figures
and the pages of the experiments on stability and of the benchmark."""

FURTHER_REFERENCES = ("neo-hooke-plane-stress", "neo-hooke-plane-strain")
"""Kinds of reference besides the small-strain one."""


@dataclass(frozen=True)
class MeshSpec:
    """A mesh that a study asks for.

    Attributes
    ----------
    beam : Beam
    mesh_type : str
        Key of `springtune.mesh.MESH_TYPES`, or the name of meshes from files.
    mesh_size : float
        Asked length of an edge [m].
    file : Path or None
        The file that it is read from.
    unit : float
        Unit of the coordinates in the file [m].
    """

    beam: Beam
    mesh_type: str
    mesh_size: float
    file: Path | None = None
    unit: float = 1.0

    @property
    def name(self):
        """File stem, e.g. ``"200x40_structured_5mm"``."""
        return f"{self.beam.name}_{self.mesh_type}_{1e3 * self.mesh_size:g}mm"


@dataclass(frozen=True)
class Scene:
    """One boundary-value problem on one mesh.

    Attributes
    ----------
    mesh : MeshSpec
    material : Material
    load : str
        Key of `springtune.problem.loads.LOADS`.
    force : float
        Force on the loaded side, tension positive [N].
    definition : str
        Key of `springtune.springs.DEFINITIONS`.
    kinematics : str
        One of `KINEMATICS`.
    """

    mesh: MeshSpec
    material: Material
    load: str
    force: float
    definition: str
    kinematics: str

    @property
    def name(self):
        """Readable name, unique in a study."""
        return f"{self.mesh.name}_{self.material.name}_{self.load}_{self.definition}_{self.kinematics}"


@dataclass(frozen=True)
class Curve:
    """A sensitivity curve: attributes as a `Scene`'s, its stiffness running through `Study.stiffness_ratios`."""

    mesh: MeshSpec
    material: Material
    load: str
    force: float
    kinematics: str


@dataclass(frozen=True)
class Reference:
    """A finite-element answer: attributes as a `Scene`'s."""

    beam: Beam
    material: Material
    load: str
    force: float


@dataclass(frozen=True)
class Moduli:
    """Effective moduli of a definition on a patch, see `Study.patch`.

    Attributes
    ----------
    definition : str
        Key of `springtune.springs.DEFINITIONS`.
    mesh_type : str
    mesh_size : float
        Length of an edge [m].
    poisson_ratio : float
        Poisson's ratio that the definition is asked for [1].
    """

    definition: str
    mesh_type: str
    mesh_size: float
    poisson_ratio: float


@dataclass(frozen=True)
class Laying:
    """A strip to lay on a trapezoid, see `springtune.kinds.laying.lay`.

    Attributes
    ----------
    strip : Strip
    trapezoid : Trapezoid
    material, support : Material
        Of the strip and of the trapezoid.
    definition : str
        Key of `springtune.springs.DEFINITIONS`.
    mesh_size : float
        Length of an edge [m].
    loading : str
        One of `springtune.problem.loads.LOADINGS`.
    pressure : float
        Pressure on the strip, or its weight over its upper face [Pa].
    friction : float
        Coulomb's coefficient [1].
    """

    strip: Strip
    trapezoid: Trapezoid
    material: Material
    support: Material
    definition: str
    mesh_size: float
    loading: str
    pressure: float
    friction: float


@dataclass(frozen=True)
class Experiment:
    """An experiment on numerical stability, see `springtune.kinds.stability.experiments`.

    Attributes
    ----------
    name : str
        Key of `springtune.kinds.stability.names.EXPERIMENTS`.
    beam : Beam
    material : Material
        With a density.
    force : float
        Traction [N].
    definition : str
        Key of `springtune.springs.DEFINITIONS`.
    mesh_type : str
    mesh_sizes : tuple of float
        Lengths of an edge [m], ascending.
    """

    name: str
    beam: Beam
    material: Material
    force: float
    definition: str
    mesh_type: str
    mesh_sizes: tuple


@dataclass(frozen=True)
class Race:
    """A scene of the benchmark, see `springtune.kinds.benchmark.measure`.

    Attributes
    ----------
    name : str
    beam : Beam
    material : Material
        With a density.
    load : str
        Key of `springtune.problem.loads.LOADS`.
    force : float
        Force on the loaded side, tension positive [N].
    methods : tuple of str
    mesh_sizes : tuple of float
        Lengths of an edge [m], ascending.
    most_seconds, most_thorough : float
        Seconds that a run may take: of most methods, and of those below.
    thorough : tuple of str
    second_beam : Beam or None
        Beam on which errors are checked.
    """

    name: str
    beam: Beam
    material: Material
    load: str
    force: float
    methods: tuple
    mesh_sizes: tuple
    most_seconds: float
    most_thorough: float
    thorough: tuple
    second_beam: Beam | None


@dataclass(frozen=True)
class Grid:
    """What one grid of a study asks for, whether or not other grids ask for it, too.

    Attributes
    ----------
    name : str
    scenes : tuple of Scene
    curves : tuple of Curve
    moduli : tuple of Moduli
    """

    name: str
    scenes: tuple
    curves: tuple
    moduli: tuple = ()


@dataclass(frozen=True)
class PrintedCell:
    """A cell of a printed table, as printed.

    Attributes
    ----------
    table : int
        Number of the table.
    beam, mesh_type, material, load : str
        Labels of the cell.
    mesh_size : float
        Length of an edge [m].
    force : float
        Force, without sign [N].
    stiffness : float
        Stiffness of the springs [N/m].
    reference_displacement, displacement : float
        Displacement by finite elements and of the network, without sign [m].
    deformation_error : float
        Deformation error, without sign [1].
    remark : str
        Where the print contradicts itself; empty otherwise.
    """

    table: int
    beam: str
    mesh_type: str
    mesh_size: float
    material: str
    load: str
    force: float
    stiffness: float
    reference_displacement: float
    displacement: float
    deformation_error: float
    remark: str


@dataclass(frozen=True)
class Study:
    """A study, ready to run.

    All tuples are free of duplicates and ordered by beam and material as declared, then by mesh type, mesh size, load,
    definition and kinematics, whatever the order of grids and of the lists in them.

    Attributes
    ----------
    name : str
        Stem of the file.
    path : Path
        The file.
    text : str
        The file as read.
    title : str
    meshes : tuple of MeshSpec
    scenes : tuple of Scene
    curves : tuple of Curve
    references : tuple of Reference
    moduli : tuple of Moduli
    patch : Beam or None
        Box on whose meshes moduli are measured; its thickness does not matter.
    mesh_files : dict
        `MeshSpec` of meshes from files by (mesh type, beam's name, mesh size).
    outputs : tuple of str
        What is made from the dataset: of `OUTPUTS`.
    further_references : tuple of str
        Of `FURTHER_REFERENCES`.
    laying : tuple of Laying
    laying_references : tuple of Laying
        Strips of finite elements that the others are compared with: one a loading and friction.
    stability : tuple of Experiment
    benchmark : tuple of Race
    grids : tuple of Grid
        In the order of the file.
    stiffness_ratios : tuple of float
        k / (E t) along every curve, ascending [1].
    stiffness_table : dict
        Stiffness [N/m] of the definition ``paper`` by (mesh type, material).
    calibration : tuple of str or None
        Beam and load whose curves calibrate the definition ``calibrated``.
    printed : tuple of PrintedCell
    printed_path : Path or None
        File of the printed values.
    axes : dict of str to tuple
        Labels of each dimension of the dataset: texts, for ``mesh_size`` numbers [m].
    """

    name: str
    path: Path
    text: str
    title: str
    meshes: tuple
    scenes: tuple
    curves: tuple
    references: tuple
    moduli: tuple
    patch: Beam | None
    mesh_files: dict
    outputs: tuple
    further_references: tuple
    laying: tuple
    laying_references: tuple
    stability: tuple
    benchmark: tuple
    grids: tuple
    stiffness_ratios: tuple
    stiffness_table: dict
    calibration: tuple | None
    printed: tuple
    printed_path: Path | None
    axes: dict

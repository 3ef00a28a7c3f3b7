"""A study: its meshes, scenes and curves, free of duplicates and in a canonical order."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from springtune.problem.geometry import Beam
from springtune.problem.materials import AnyMaterial, Material
from springtune.problem.quantities import nearest

from .messages import Problems

if TYPE_CHECKING:
    from springtune.problem.shapes import Shape

FINITE_STRAIN_REFERENCE = "neo-hooke-plane-stress"
"""Reference of sheets at finite strain: networks of nonlinear kinematics are compared with it where a study has it."""

TESTED_REFERENCE = "yeoh-plane-stress"
"""The same of materials that have a uniaxial test: by the law that is fitted to it."""

FURTHER_REFERENCES = (FINITE_STRAIN_REFERENCE, "neo-hooke-plane-strain", TESTED_REFERENCE)
"""Kinds of reference besides the small-strain one."""


@dataclass(frozen=True)
class MeshSpec:
    """A mesh that a study asks for.

    Attributes
    ----------
    mesh_type : str
        Key of `springtune.mesh.MESH_TYPES`, or the name of meshes from files.
    mesh_size : float
        Asked length of an edge [m].
    unit : float
        Unit of the coordinates in the file [m].
    """

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

    @property
    def name(self) -> str:
        """File stem, e.g. ``"200x40_structured_5mm"``."""
        return f"{self.beam.name}_{self.mesh_type}_{1e3 * self.mesh_size:g}mm"


MeshFiles = dict[tuple[str, str, float], MeshSpec]
"""Meshes from files by (mesh type, beam's name, mesh size)."""


@dataclass(frozen=True)
class SceneSpec:
    """A scene that a study asks for: one boundary-value problem on one mesh.

    Attributes
    ----------
    force : float
        Force on the loaded side, tension positive [N].
    stiffness_scale : float
        Factor on all stiffnesses of the definition [1].
    """

    mesh: MeshSpec
    material: Material
    load: str
    force: float
    definition: str
    kinematics: str
    stiffness_scale: float = 1.0

    @cached_property
    def _hash(self) -> int:
        # Of the material what tells most apart: hashing all of it takes longer than the rest.
        body = self.mesh, self.material.name, self.material.young_modulus, self.material.poisson_ratio
        return hash((body, self.load, self.force, self.definition, self.kinematics, self.stiffness_scale))

    def __hash__(self) -> int:
        # As a mesh's.
        return self._hash


@dataclass(frozen=True)
class CurveSpec:
    """A sensitivity curve that a study asks for: attributes as a `SceneSpec`'s.

    Its stiffness runs through `Study.stiffness_ratios`.
    """

    mesh: MeshSpec
    material: Material
    load: str
    force: float
    kinematics: str


@dataclass(frozen=True)
class Reference:
    """A finite-element answer: attributes as a `SceneSpec`'s."""

    beam: Beam
    material: Material
    load: str
    force: float


@dataclass(frozen=True)
class Grid:
    """What one grid of a study asks for, whether or not other grids ask for it, too."""

    name: str
    scenes: tuple[SceneSpec, ...]
    curves: tuple[CurveSpec, ...]


@dataclass(frozen=True)
class PrintedCell:
    """A cell of a printed table, as printed.

    Attributes
    ----------
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
class Part:
    """Which part of a study a file asks for.

    Attributes
    ----------
    by : str
        What stays together, of `springtune.studies.config.sections.DEALT_BY`.
    """

    number: int
    of: int
    by: str
    study: str


@dataclass(frozen=True)
class Study:
    """A study, ready to run.

    All tuples are free of duplicates and ordered by beam and material as declared, then by mesh type, mesh size, load,
    definition and kinematics, whatever the order of grids and of the lists in them.

    Attributes
    ----------
    mesh_files : dict
        `MeshSpec` of meshes from files by (mesh type, beam's name, mesh size).
    parts : dict
        What further study kinds ask for, by their names; nothing where the study does not have them.
    limits : dict
        ``seconds`` of the processor and ``memory`` [byte] that one task may take.
    stiffness_ratios : tuple of float
        k / (E t) along every curve, ascending [1].
    stiffness_table : dict
        Stiffness [N/m] of the definition ``paper`` by (mesh type, material).
    calibration : tuple of str or None
        Beam and load whose curves calibrate the definition ``calibrated``.
    axes : dict of str to tuple
        Labels of each dimension of the dataset: texts, for ``mesh_size`` numbers [m].
    swept : tuple of str
        Of `springtune.problem.parameters.SWEPT`: those that are dimensions, too, their labels numbers.
    test_files : tuple of Path
        Of the tests of rubber that materials are fitted to or compared with.
    part : Part or None
        Which part of a study this is. Its scenes, curves, meshes, references and `parts` are its own; grids, axes and
        all else are those of the whole study.
    """

    name: str
    path: Path
    text: str
    title: str
    meshes: tuple[MeshSpec, ...]
    scenes: tuple[SceneSpec, ...]
    curves: tuple[CurveSpec, ...]
    references: tuple[Reference, ...]
    mesh_files: MeshFiles
    outputs: tuple[str, ...]
    further_references: tuple[str, ...]
    materials: dict[str, AnyMaterial]
    parts: dict[str, Any]
    limits: dict[str, float]
    grids: tuple[Grid, ...]
    stiffness_ratios: tuple[float, ...]
    stiffness_table: dict[tuple[str, str], float]
    calibration: tuple[str, str] | None
    printed: tuple[PrintedCell, ...]
    printed_path: Path | None
    axes: dict[str, tuple[str | float, ...]]
    swept: tuple[str, ...] = ()
    test_files: tuple[Path, ...] = ()
    row_files: tuple[Path, ...] = ()
    part: Part | None = None

    def material(self, name: str) -> AnyMaterial:
        """A material that the study declares.

        Examples
        --------
        >>> import springtune as st
        >>> st.load_study("config/shapes.yaml").material("steel").young_modulus
        210000000000.0
        """
        if name not in self.materials:
            raise ValueError(f"material: '{name}' is unknown; {nearest(name, self.materials)}")
        return self.materials[name]

    def shape(self, name: str) -> Shape:
        """A shape that the study declares, with its loads.

        Examples
        --------
        From a study to the error of each definition:

        >>> import springtune as st
        >>> study = st.load_study("config/shapes.yaml")
        >>> cook = study.shape("cook")
        >>> choices = st.predict(cook, st.mesh_shape(cook, "4 mm"), study.material("third"), load="shear")
        >>> print(f"{choices[0].definition}: {100 * choices[0].errors['edge']:+.1f} %")
        patch: -0.4 %
        """
        known = {name: one for part in self.parts.values() for name, one in getattr(part, "declared", {}).items()}
        if name not in known:
            there = nearest(name, known) if known else "the study has none; add it under 'shapes'"
            raise ValueError(f"shape: '{name}' is unknown; {there}")
        found: Shape = known[name]
        return found

    def labels(self, one: SceneSpec | CurveSpec | Reference) -> dict[str, str | float]:
        """Cell of the dataset that is of a scene, a curve or a reference."""
        found: dict[str, str | float]
        if isinstance(one, Reference):
            beam = one.beam
            found = {"beam": beam.name, "material": one.material.name, "load": one.load}
        else:
            mesh = one.mesh
            beam = mesh.beam
            found = {
                "beam": beam.name,
                "mesh_type": mesh.mesh_type,
                "mesh_size": mesh.mesh_size,
                "material": one.material.name,
                "load": one.load,
            }
            if isinstance(one, SceneSpec):
                found["definition"] = one.definition
            found["kinematics"] = one.kinematics
        for name in self.swept:
            if name != "stiffness_scale" or isinstance(one, SceneSpec):
                found[name] = swept_value(one, beam, name)
        return found

    def name_of(self, scene: SceneSpec) -> str:
        """Readable name of a scene, unique in the study."""
        labels = self.labels(scene) | {"mesh_size": f"{1e3 * scene.mesh.mesh_size:g}mm"}
        words = (f"{name}={label:.9g}" if isinstance(label, float) else label for name, label in labels.items())
        return "_".join(words)


def swept_value(one: SceneSpec | CurveSpec | Reference, beam: Beam, name: str) -> float:
    """Value of a parameter that is a dimension."""
    if name == "force":
        return abs(one.force)
    if name == "thickness":
        return beam.thickness
    return float(getattr(one if name == "stiffness_scale" else one.material, name))


class StudyOutput(Protocol):
    """What a study needs to know of an output, see `springtune.studies.config.kind.Output`."""

    @property
    def name(self) -> str:
        """As a study writes it."""

    @property
    def meaning(self) -> str:
        """What it is, for the manual."""

    @property
    def usual(self) -> bool:
        """Whether it is made where a study does not say what."""

    @property
    def lack(self) -> Callable[[Study], str]:
        """What a study would need for it and has not."""


class StudyKind(Protocol):
    """What a study needs to know of its kinds, see `springtune.studies.config.kind.Kind`."""

    @property
    def name(self) -> str:
        """Name of its part of a study."""

    @property
    def study_fields(self) -> Mapping[str, tuple[Any, Any]]:
        """Keys that it adds to a study."""

    @property
    def grid_fields(self) -> Mapping[str, tuple[Any, Any]]:
        """Keys that it adds to its grids."""

    @property
    def alone(self) -> Sequence[str]:
        """Keys in the place of which a study may have neither beams nor grids."""

    @property
    def check(self) -> Callable[[Any, Problems], None]:
        """Adds what is wrong with a config's values."""

    @property
    def expand(self) -> Callable[[Any, Any], Any]:
        """Its part of a study."""

    @property
    def axes(self) -> Callable[[Any], Mapping[str, Collection[str | float]]]:
        """Labels of the dimensions of its groups."""

    @property
    def outputs(self) -> Sequence[StudyOutput]:
        """What is made of it."""

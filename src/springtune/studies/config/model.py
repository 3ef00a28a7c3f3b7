"""Expanded study: meshes, scenes and curves without duplicates, sorted."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from springtune.problem.materials import AnyMaterial, Material
from springtune.problem.quantities import nearest, shown_order
from springtune.problem.shapes import Beam

if TYPE_CHECKING:
    from springtune.problem.shapes import Shape

FINITE_STRAIN_REFERENCE = "neo-hooke-plane-stress"
"""Reference of sheets at finite strain for networks with nonlinear kinematics."""

STRAINED_REFERENCE = "neo-hooke-plane-strain"
"""Reference in plane strain; also for materials in plane stress, to compare."""

TESTED_REFERENCE = "yeoh-plane-stress"
"""The same for materials with a uniaxial test, using the fitted law."""

FURTHER_REFERENCES = (FINITE_STRAIN_REFERENCE, STRAINED_REFERENCE, TESTED_REFERENCE)


Labels = dict[str, str | float]
"""Label of a cell of the dataset, by dimension."""


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
        """A material that the study declares."""
        if name not in self.materials:
            raise ValueError(f"material: '{name}' is unknown; {nearest(name, self.materials)}")
        return self.materials[name]

    def shape(self, name: str) -> Shape:
        """A shape that the study declares, with its loads.

        >>> import springtune as st
        >>> study = st.load_study("config/shapes.yaml")
        >>> cook = study.shape("cook")
        >>> choices = st.predict(cook, st.mesh_shape(cook, "4 mm"), study.materials_of("cook", "third"), load="shear")
        >>> print(f"{choices[0].definition}: {100 * choices[0].errors['edge']:+.1f} %")
        patch: -0.4 %
        """
        known = self.shapes.shape if self.shapes else {}
        if name not in known:
            there = nearest(name, known) if known else "the study has none; add it under 'shapes'"
            raise ValueError(f"shape: '{name}' is unknown; {there}")
        found: Shape = known[name]
        return found

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


cache_by_study = lru_cache(maxsize=8)
"""Decorator of a function of a study whose last answers are kept."""


def keeps_fields(study: Study) -> bool:
    """Return whether a study's dataset has whole fields, its group `/fields`."""
    return "deformed" in study.outputs or "paraview" in study.outputs


def shown(scenes: Iterable[SceneSpec], swept: Iterable[str]) -> frozenset[SceneSpec]:
    """Scenes on the coarsest mesh, with one value of each swept parameter."""
    names, bodies, found = tuple(swept), defaultdict[tuple[str, ...], list[SceneSpec]](list), set[SceneSpec]()
    for scene in scenes:
        bodies[scene.mesh.beam.name, scene.mesh.mesh_type, scene.material.name, scene.load].append(scene)
    for own in bodies.values():
        coarsest = max(scene.mesh.mesh_size for scene in own)
        ranks = {
            scene: [shown_order(name, swept_value(scene, scene.mesh.beam, name)) for name in names]
            for scene in own
            if scene.mesh.mesh_size == coarsest
        }
        last = max(ranks.values())
        found |= {scene for scene, rank in ranks.items() if rank == last}
    return frozenset(found)

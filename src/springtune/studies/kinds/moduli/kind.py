"""Effective moduli of definitions: a flag of a grid, and the box on whose meshes they are measured."""

from dataclasses import asdict, dataclass
from itertools import product
from math import nan

from pydantic import Field

from springtune.mesh.types import MESH_TYPES
from springtune.problem.geometry import Beam
from springtune.springs.base import DEFINITIONS

from ...config.checks import check_particles
from ...config.fields import Flag, Length, Section, default
from ...config.kind import Kind
from ...config.model import MeshSpec
from ...runs.keys import definition_key, mesh_type_key
from ...runs.stages import Task, stage
from ..scenes.plan import expected_seconds, mesh_key, mesh_parameters, mesh_source, particles
from .outputs import OUTPUTS


class PatchConfig(Section):
    """Box on whose meshes effective moduli are measured: between rollers for E and nu, under even shear for G.

    Its mesh is that of a beam of this extent: give the extent of the beam to compare with.
    """

    length: Length = default("100 mm")
    """Extent along x."""

    height: Length = default("20 mm")
    """Extent along y."""


@dataclass(frozen=True)
class Measurement:
    """Effective moduli of a definition on a patch, for a wanted Poisson's ratio."""

    definition: str
    mesh_type: str
    mesh_size: float
    poisson_ratio: float


@dataclass(frozen=True)
class Measurements:
    """Measurements of a study, and the box of their meshes; its thickness does not matter."""

    patch: Beam
    measurements: tuple[Measurement, ...]


def _check(config, problems):
    for name, grid in config.grids.items():
        made = grid.moduli and any(mesh_type in MESH_TYPES for mesh_type in grid.mesh_type)
        if made:
            box = config.patch.length, config.patch.height
            check_particles(problems, ("grids", name, "mesh_size"), grid.mesh_size, *box)


def _expand(config, declared):
    """Moduli of definitions that derive a stiffness, on every grid that asks for them."""
    found = {}
    for grid in config.grids.values():
        if grid.moduli:
            derived = [name for name in grid.definition if DEFINITIONS[name].needs != "stiffness"]
            own = (declared.materials[name].in_plane.poisson_ratio for name in grid.material)
            ratios = dict.fromkeys(grid.poisson_ratio or own)
            found |= dict.fromkeys(product(derived, grid.mesh_type, grid.mesh_size, ratios))
    if not found:
        return None
    box = Beam(config.patch.length, config.patch.height, min(config.patch.length, config.patch.height), "patch")
    return Measurements(box, tuple(Measurement(*labels) for labels in sorted(found)))


def _axes(moduli):
    return {"poisson_ratio": tuple(sorted({one.poisson_ratio for one in moduli.measurements}))}


def _summary(moduli):
    patches = {(one.mesh_type, one.mesh_size) for one in moduli.measurements}
    on = "1 patch" if len(patches) == 1 else f"{len(patches)} patches"
    return [["moduli", len(moduli.measurements), f"measured on {on}"]]


def _tasks(study):
    for one in study.parts["moduli"].measurements:
        mesh, name = _mesh_of(study, one), f"{one.mesh_type}_{1e3 * one.mesh_size:g}mm"
        yield Task(
            {"definition": one.definition, "poisson_ratio": one.poisson_ratio},
            (mesh_parameters(mesh), mesh_type_key(one.mesh_type), definition_key(one.definition)),
            labels=asdict(one),
            seconds=expected_seconds(particles(mesh), one.definition),
            name=name,
            file=name,
            shared={"mesh": mesh_source(mesh)},
        )


def _mesh_of(study, one):
    """Mesh of a patch test: of the box, or from the file of the shortest beam."""
    if one.mesh_type in MESH_TYPES:
        return MeshSpec(study.parts["moduli"].patch, one.mesh_type, one.mesh_size)
    found = [mesh for label, mesh in study.mesh_files.items() if label[::2] == (one.mesh_type, one.mesh_size)]
    return min(found, key=lambda mesh: (mesh.beam.length, mesh.beam.height, mesh_key(mesh)))


PATCH = ("definition", "mesh_type", "mesh_size", "poisson_ratio")


def _attributes(moduli):
    box = {"patch_length": moduli.patch.length, "patch_height": moduli.patch.height}
    return {"comment": "of the mesh that a beam of this length and height [m] gets"} | box


KIND = Kind(
    "moduli",
    study_fields={
        "patch": (
            PatchConfig,
            Field(default_factory=PatchConfig, description="Box on whose meshes moduli are measured."),
        )
    },
    grid_fields={
        "moduli": (
            Flag,
            default(
                "false",
                description="Whether effective moduli are measured for each definition, mesh type, mesh size and "
                "Poisson's ratio, on the box under `patch`. Definitions with a given stiffness have none.",
            ),
        )
    },
    check=_check,
    expand=_expand,
    axes=_axes,
    summary=_summary,
    variables={
        "young_modulus_error": (PATCH, "1", "error of Young's modulus along x, effective / asked - 1", nan),
        "effective_poisson_ratio": (PATCH, "1", "effective Poisson's ratio under load along x", nan),
        "shear_modulus_error": (PATCH, "1", "error of the shear modulus, effective / asked - 1", nan),
        "definition_seconds": (PATCH, "s", "time to derive the springs' parameters", nan),
        "definition_evaluations": (PATCH, "1", "solves that deriving the springs' parameters took", nan),
        "spring_ratio": (PATCH, "1", "largest spring stiffness over the smallest", nan),
        "status": (PATCH, "1", "what became of the patch test", 0),
        "message": (PATCH, "1", "why there are no moduli", ""),
    },
    dimensions={"poisson_ratio": "Poisson's ratio that the definition is asked for"},
    attributes=_attributes,
    stages=(stage("moduli", "studies.kinds.moduli.solve", "Measuring effective moduli", _tasks),),
    outputs=OUTPUTS,
)

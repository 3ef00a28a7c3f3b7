"""Effective moduli of definitions: a flag of a grid, and the box on whose meshes they are measured."""

from itertools import product

from pydantic import Field

from springtune.mesh.cells import MESH_TYPES
from springtune.problem.shapes import Beam
from springtune.springs.base import DEFINITIONS

from ...config.checks import check_particles
from ...config.fields import Flag, Length, Section, default
from ...config.model import MeshSpec, Output, Stage, StudyKind, declared
from ...runs.keys import definition_key, mesh_type_key
from ...runs.plan import Task
from ..bodies.kind import expected_seconds, mesh_key, mesh_source, parameters, particles


class PatchConfig(Section):
    """The box for effective moduli: between rollers for E and nu, under even shear for G.

    Give the extent of the beam to compare with.
    """

    length: Length = default("100 mm")
    """Extent along x."""

    height: Length = default("20 mm")
    """Extent along y."""


PATCH = ("definition", "mesh_type", "mesh_size", "poisson_ratio")


def _check(config, problems):
    for name, grid in config.grids.items():
        if grid.moduli and not MESH_TYPES.keys().isdisjoint(grid.mesh_type):
            box = config.patch.length, config.patch.height
            check_particles(problems, ("grids", name, "mesh_size"), grid.mesh_size, *box)


def _expand(config, declared):
    """Box of the patches, and labels of each definition that derives a stiffness; thickness does not matter."""
    found = {}
    for grid in config.grids.values():
        if grid.moduli:
            derived = [name for name in grid.definition if DEFINITIONS[name].needs != "stiffness"]
            own = (declared.materials[name].in_plane.poisson_ratio for name in grid.material)
            ratios = dict.fromkeys(grid.poisson_ratio or own)
            found |= dict.fromkeys(product(derived, grid.mesh_type, grid.mesh_size, ratios))
    sides = config.patch.length, config.patch.height
    return (Beam(*sides, min(sides), "patch"), [dict(zip(PATCH, one)) for one in sorted(found)]) if found else None


def _summary(moduli):
    patches = len({(labels["mesh_type"], labels["mesh_size"]) for labels in moduli[1]})
    return [["moduli", len(moduli[1]), f"measured on {patches} patch{'es' * (patches != 1)}"]]


def _tasks(study):
    box, cells = study.parts["moduli"]
    for labels in cells:
        definition, mesh_type, size, ratio = labels.values()
        mesh, name = _patch_mesh(study, box, mesh_type, size), f"{mesh_type}_{1e3 * size:g}mm"
        code = parameters(mesh_source(mesh)), mesh_type_key(mesh_type), definition_key(definition)
        values = {"definition": definition, "poisson_ratio": ratio}
        seconds = expected_seconds(particles(mesh.beam.length * mesh.beam.height, size), definition)
        yield Task(values, code, labels, seconds, name, file=name, shared={"mesh": mesh_source(mesh)})


def _patch_mesh(study, box, mesh_type, size):
    """Mesh of a patch test: generated for the box, or the file of the smallest beam."""
    if mesh_type in MESH_TYPES:
        return MeshSpec(box, mesh_type, size)
    found = [mesh for label, mesh in study.mesh_files.items() if label[::2] == (mesh_type, size)]
    return min(found, key=lambda mesh: (mesh.beam.length, mesh.beam.height, mesh_key(mesh)))


def _attributes(moduli):
    comment = "of the mesh that a beam of this length and height [m] gets"
    return {"comment": comment, "patch_length": moduli[0].length, "patch_height": moduli[0].height}


def _figures(study):
    mesh_types = dict.fromkeys(scene.mesh.mesh_type for scene in study.scenes)
    return {"definitions_moduli": {}} | {f"definitions_loads_{name}": {"mesh_type": name} for name in mesh_types}


def _lack(study):
    return "" if study.parts["moduli"] else "compares moduli and no grid has them; add 'moduli: true' to a grid"


PLOTS = "studies.kinds.moduli.figures"

KIND = StudyKind(
    "moduli",
    study_fields={"patch": (PatchConfig, Field(default_factory=PatchConfig, description="Box for effective moduli."))},
    grid_fields={"moduli": (Flag, default("false", description="Measure effective moduli on the box under `patch`."))},
    check=_check,
    expand=_expand,
    axes=lambda moduli: {"poisson_ratio": sorted({labels["poisson_ratio"] for labels in moduli[1]})},
    summary=_summary,
    **declared(__file__),
    attributes=_attributes,
    stages=(Stage("moduli", "studies.kinds.moduli.solve", _tasks),),
    outputs=(Output("definitions", "comparison of definitions", _figures, plot=f"{PLOTS}:definitions", lack=_lack),),
    tables=lambda study: ["definitions"] if study.parts["moduli"] and study.scenes else [],
)

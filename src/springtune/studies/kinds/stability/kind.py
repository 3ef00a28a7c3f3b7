"""Experiments on numerical stability: a study's section ``stability``."""

from dataclasses import asdict
from typing import Annotated

from pydantic import Field

from springtune.mesh.types import MESH_TYPES

from ...config import fields
from ...config.checks import check_beam_material, check_density, check_for_triangles, check_particles
from ...config.fields import OneOrMore, Section, default, one_of, optional
from ...config.kind import Kind
from ...runs.keys import beam_key, definition_key, material_key, mesh_type_key
from ...runs.stages import Task, stage
from . import AXES, EXPERIMENTS, ONCE, Experiment
from .outputs import OUTPUTS

ExperimentName = Annotated[str, one_of("experiment", EXPERIMENTS)]


class StabilityConfig(Section):
    """Experiments on numerical stability: a beam in traction, in motion and under stress far beyond the study's own."""

    beam: fields.BeamName
    """Beam."""

    material: fields.MaterialName
    """Material, with a density."""

    force: fields.Force
    """Traction on the right end."""

    definition: fields.DefinitionNames
    """Definitions that derive a stiffness and need no reference; the first one stands for all where an experiment
    is not about definitions."""

    mesh_type: fields.MeshType = default("structured")
    """Mesh type of triangles."""

    mesh_size: Annotated[list[fields.Length], OneOrMore()]
    """Lengths of an edge; most experiments take the coarsest."""

    experiment: Annotated[list[ExperimentName], OneOrMore()] = Field(
        list(EXPERIMENTS),
        description="; ".join(f"`{name}`: {text}" for name, text in EXPERIMENTS.items()) + ". All of them without.",
    )


def _check(config, problems):
    section = config.stability
    check_beam_material(problems, ("stability", "material"), section.material, config)
    check_density(config, section.material, ("stability", "material"), problems)
    check_for_triangles(section.definition, ("stability", "definition"), problems)
    made = [name for name, one in MESH_TYPES.items() if one.corners == 3]
    if section.mesh_type not in made:
        message = f"'{section.mesh_type}' is no mesh type of triangles that is made; choose of {', '.join(made)}"
        problems.add(("stability", "mesh_type"), message)
    if section.beam in config.beams:
        beam = config.beams[section.beam]
        check_particles(problems, ("stability", "mesh_size"), section.mesh_size, beam.length, beam.height)
        side = min(beam.length, beam.height)
        if max(section.mesh_size) > 0.3 * side:
            message = f"{1e3 * max(section.mesh_size):g} mm leaves few particles inside; give at most {300 * side:g} mm"
            problems.add(("stability", "mesh_size"), message)


def _expand(config, declared):
    """Experiments: one a definition, or one in all."""
    section = config.stability
    beam, material = declared.beams[section.beam], declared.materials[section.material]
    sizes = tuple(sorted(section.mesh_size))
    return tuple(
        Experiment(name, beam, material, section.force, definition, section.mesh_type, sizes)
        for name in EXPERIMENTS
        if name in section.experiment
        for definition in (section.definition[:1] if name in ONCE else section.definition)
    )


def _axes(experiments):
    shared = {
        "definition": {one.definition for one in experiments},
        "mesh_size": {size for one in experiments for size in one.mesh_sizes},
    }
    return shared | AXES | {"experiment": tuple(dict.fromkeys(one.name for one in experiments))}


def _tasks(study):
    for one in study.parts["stability"]:
        own = {"beam": beam_key(one.beam), "material": material_key(one.material, density=True)}
        also = mesh_type_key(one.mesh_type), definition_key(one.definition)
        labels = {"experiment": one.name, "definition": one.definition}
        yield Task(asdict(one) | own, also, labels, one, seconds=3.0)


STAGE = stage("stability", "studies.kinds.stability.solve", "Experiments on stability", _tasks)

KIND = Kind(
    "stability",
    study_fields={
        "stability": optional(StabilityConfig, "Experiments on numerical stability; they make the group `/stability`.")
    },
    check=_check,
    expand=_expand,
    axes=_axes,
    summary=lambda part: [["experiments", len(part), "on numerical stability"]],
    stages=(STAGE,),
    outputs=OUTPUTS,
)

"""Study kind `lengths`: the shortest and the longest spring of meshes; one task a mesh type."""

from math import nan
from typing import Annotated

from pydantic import Field

from springtune.mesh import MESH_TYPES
from springtune.studies.config.checks import check_known
from springtune.studies.config.fields import BeamName, Length, OneOrMore, one_of
from springtune.studies.config.kind import Kind, Output
from springtune.studies.config.sections import Section
from springtune.studies.runs.keys import mesh_type_key
from springtune.studies.runs.stages import Task, stage


class LengthsConfig(Section):
    """Meshes of a beam whose springs are measured."""

    beam: BeamName = Field(description="Beam.")
    mesh_type: Annotated[list[Annotated[str, one_of("mesh type", MESH_TYPES)]], OneOrMore()] = Field(
        description="Mesh types."
    )
    mesh_size: Length = Field(description="Length of an edge.")


def _check(config, problems):
    check_known(problems, ("lengths", "beam"), "beam", config.lengths.beam, config.beams)


def _expand(config, declared):
    section = config.lengths
    beam = declared.beams[section.beam]
    box = {"length": beam.length, "height": beam.height, "mesh_size": section.mesh_size}
    return tuple(box | {"mesh_type": name} for name in section.mesh_type)


def _tasks(study):
    for mesh in study.parts["lengths"]:
        yield Task(mesh, [mesh_type_key(mesh["mesh_type"])], labels={"mesh_type": mesh["mesh_type"]})


KIND = Kind(
    "lengths",
    package="springtune_example",
    study_fields={"lengths": (LengthsConfig | None, Field(None, description="Lengths of springs; make `/lengths`."))},
    check=_check,
    expand=_expand,
    axes=lambda meshes: {"mesh_type": {mesh["mesh_type"] for mesh in meshes}},
    summary=lambda meshes: [["measured", len(meshes), "meshes, their shortest and longest spring"]],
    variables={
        "shortest": (("mesh_type",), "m", "shortest spring of the mesh", nan),
        "longest": (("mesh_type",), "m", "longest spring of the mesh", nan),
        "status": (("mesh_type",), "1", "what became of the mesh", 0),
        "message": (("mesh_type",), "1", "why there are no lengths", ""),
    },
    stages=(stage("lengths", "springtune_example.solve", "Measuring springs", _tasks),),
    outputs=(
        Output(
            "lengths",
            "the figure of lengths",
            figures=lambda study: {"lengths": {}},
            plot="springtune_example.figures:lengths",
            lack=lambda study: "" if study.parts["lengths"] else "has no lengths to show; add a section 'lengths'",
        ),
    ),
)

"""Experiments on numerical stability: a study's section ``stability``."""

from typing import Annotated

from pydantic import Field

from springtune.mechanics import BEHAVIOURS
from springtune.mesh.cells import MESH_TYPES

from ...config import fields
from ...config.checks import check_beam_material, check_density, check_fit, check_particles
from ...config.fields import OneOrMore, Section, default, one_of, optional
from ...config.model import Output, Stage, StudyKind, declared
from ...runs.keys import beam_key, definition_key, material_key, mesh_type_key
from ...runs.plan import Task
from . import AXES, DEFINITION_FREE, EXPERIMENTS

TABLES = ("limits", "rest", "slivers", "strains", "perturbation", "buckling")
"""Experiments with a table, see `springtune.studies.kinds.stability.figures`."""

MESHES = [name for name, one in MESH_TYPES.items() if one.corners == 3]
MeshType = Annotated[str, *one_of("mesh type of triangles", MESHES)]
ExperimentName = Annotated[str, *one_of("experiment", EXPERIMENTS)]


class StabilityConfig(Section):
    """Experiments on numerical stability of a beam in traction."""

    beam: fields.BeamName
    """Beam."""

    material: fields.MaterialName
    """Material, with a density."""

    force: fields.Force
    """Traction on the right end."""

    definition: fields.DefinitionNames
    """Definitions that derive a stiffness without a reference. Some experiments use only the first."""

    mesh_type: MeshType = default("structured")
    """Mesh type of triangles."""

    mesh_size: OneOrMore[fields.Length]
    """Lengths of edges; most experiments use the coarsest."""

    experiment: OneOrMore[ExperimentName] = Field(
        list(EXPERIMENTS),
        description="; ".join(f"`{name}`: {text}" for name, text in EXPERIMENTS.items()) + ". All by default.",
    )


def _check(config, problems):
    section = config.stability
    check_beam_material(problems, ("stability", "material"), section.material, config)
    check_density(config, section.material, ("stability", "material"), problems)
    check_fit(problems, ("stability", "definition"), section.definition, ["structured"])
    extent = config.beams[section.beam].length, config.beams[section.beam].height
    check_particles(problems, ("stability", "mesh_size"), section.mesh_size, *extent)
    if (largest := max(section.mesh_size)) > 0.3 * min(extent):
        message = f"{1e3 * largest:g} mm leaves few particles inside; give at most {300 * min(extent):g} mm"
        problems.add(("stability", "mesh_size"), message)


def _expand(config, declared):
    """Values of each experiment and definition; some experiments need only the first definition."""
    section = config.stability
    shared = {
        "beam": beam_key(declared.beams[section.beam]),
        "material": material_key(declared.materials[section.material], density=True),
        "force": section.force,
        "mesh_type": section.mesh_type,
        "mesh_sizes": sorted(section.mesh_size),
    }
    names = [name for name in EXPERIMENTS if name in section.experiment]
    pairs = [(name, one) for name in names for one in section.definition[: 1 if name in DEFINITION_FREE else None]]
    return {pair: shared | dict(zip(("name", "definition"), pair)) for pair in pairs}


def _axes(experiments):
    names, definitions = (tuple(dict.fromkeys(found)) for found in zip(*experiments))
    sizes = next(iter(experiments.values()))["mesh_sizes"]
    return AXES | {"definition": set(definitions), "mesh_size": set(sizes), "experiment": names}


def _tasks(study):
    for (name, definition), values in study.parts["stability"].items():
        code = mesh_type_key(values["mesh_type"]), definition_key(definition)
        yield Task(values, code, {"experiment": name, "definition": definition}, seconds=3.0)


def _shown(study, names):
    """Stems of the tables or figures of the experiments of a study."""
    asked = {name for name, _ in study.parts["stability"]}
    return [f"stability_{name}" for name in names if name in asked]


def _figures(study):
    return dict.fromkeys(_shown(study, ("maps", "strains")), {})


PLOTS = "studies.kinds.stability.figures"

KIND = StudyKind(
    "stability",
    study_fields={"stability": optional(StabilityConfig, "Experiments on numerical stability: group `/stability`.")},
    check=_check,
    expand=_expand,
    axes=_axes,
    summary=lambda part: [["experiments", len(part), "on numerical stability"]],
    **declared(__file__),
    flags={"behaviour": BEHAVIOURS},
    sparse=True,
    stages=(Stage("stability", "studies.kinds.stability.solve", _tasks),),
    outputs=(
        Output("stability", "experiments on stability", _figures, plot=f"{PLOTS}:stability", shows="experiments"),
    ),
    tables=lambda study: _shown(study, TABLES),
)

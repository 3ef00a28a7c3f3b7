"""Strips laid on a trapezoid: every combination of the values of a study's section ``laying``."""

from dataclasses import asdict, dataclass
from itertools import product
from typing import Annotated

from springtune.problem.geometry import Strip, Trapezoid
from springtune.problem.materials import Material
from springtune.springs.base import DEFINITIONS

from ...config import fields
from ...config.checks import check_beam_material, check_for_triangles, check_particles, check_product
from ...config.fields import OneOrMore, Section, default, number, one_of, optional
from ...config.kind import Kind
from ...runs.keys import definition_key, material_key, mesh_type_key
from ...runs.stages import Task, stage
from .outputs import OUTPUTS

LOADINGS = ("pressure", "gravity", "ends")
"""What lays a strip: a pressure on its upper face, its weight, or its ends, which are drawn down to the floor."""

REFERENCE_SIZES = (1.0, 1.25, 1.6)
"""Mesh sizes of a reference over the given one; the first gives the answer, all of them its band."""

LAYING_WAY = ("loading", "friction")
LAID = ("definition", "mesh_size", *LAYING_WAY)
"""Labels of a reference and of a strip of springs."""

MOST_STRIPS = 10_000
"""Most strips that a study lays; each takes seconds."""

Friction = Annotated[float, number("a coefficient from 0 to 2, such as 0.3", 0, 2)]
Loading = Annotated[str, one_of("loading", LOADINGS)]


class TrapezoidConfig(Section):
    """A symmetric trapezoid that stands on its lower base."""

    lower_base: fields.Length
    """Length of the base on the floor."""

    upper_base: fields.Length
    """Length of the upper base."""

    height: fields.Length
    """Height."""


class LayingConfig(Section):
    """A strip laid on a trapezoid: every combination of the values listed, as in a grid.

    The reference of a loading and friction is a strip of linear triangles on a mesh of its own. Two coarser meshes give
    the band of its error.
    """

    strip: fields.BeamName
    """Beam that is the strip."""

    trapezoid: TrapezoidConfig
    """Trapezoid below the strip."""

    material: fields.MaterialName
    """Material of the strip."""

    support: fields.MaterialName
    """Material of the trapezoid, which is rigid from 1e4 times the strip's modulus on."""

    definition: fields.DefinitionNames
    """Definitions that derive a stiffness and need no reference."""

    mesh_size: Annotated[list[fields.Length], OneOrMore()]
    """Lengths of an edge."""

    reference_size: fields.Length = default("1 mm")
    """Length of an edge of the reference's finest mesh."""

    loading: Annotated[list[Loading], OneOrMore()] = default("pressure")
    """`pressure`: on the upper face, following it; `gravity`: the same force as weight; `ends`: draws the ends down
    to the floor."""

    pressure: fields.Stress
    """Pressure, or weight over the upper face."""

    friction: Annotated[list[Friction], OneOrMore()] = default("0")
    """Coulomb's coefficients of friction."""


@dataclass(frozen=True)
class LayingScene:
    """A strip to lay on a trapezoid; `pressure` is its pressure, or its weight over its upper face [Pa]."""

    definition: str
    mesh_size: float
    loading: str
    friction: float
    strip: Strip
    trapezoid: Trapezoid
    material: Material
    support: Material
    pressure: float


@dataclass(frozen=True)
class Laying:
    """Strips of a study, and those of finite elements that they are compared with, on several meshes."""

    strips: tuple[LayingScene, ...]
    references: tuple[LayingScene, ...]


def _check(config, problems):
    for key in ("material", "support"):
        check_beam_material(problems, ("laying", key), getattr(config.laying, key), config)
    check_for_triangles(config.laying.definition, ("laying", "definition"), problems)
    check_product(problems, config.laying, ("laying",), LAID, MOST_STRIPS)
    if config.laying.strip in config.beams:
        beam = config.beams[config.laying.strip]
        check_particles(problems, ("laying", "mesh_size"), config.laying.mesh_size, beam.length, beam.height)
        finest = [config.laying.reference_size]
        check_particles(problems, ("laying", "reference_size"), finest, beam.length, beam.height)
    base = config.laying.trapezoid
    if not base.upper_base < base.lower_base:
        problems.add(("laying", "trapezoid", "upper_base"), "is not below 'lower_base'; give a shorter upper base")


def _expand(config, declared):
    section = config.laying
    beam, base = declared.beams[section.strip], section.trapezoid
    parts = {
        "strip": Strip(beam.length, beam.height, beam.thickness),
        "trapezoid": Trapezoid(base.lower_base, base.upper_base, base.height),
        "material": declared.materials[section.material],
        "support": declared.materials[section.support],
        "pressure": section.pressure,
    }
    ways = list(product(section.loading, section.friction))
    names = [name for name in DEFINITIONS if name in section.definition]
    strips = product(names, sorted(section.mesh_size), ways)
    references = product(ways, [ratio * section.reference_size for ratio in REFERENCE_SIZES])
    return Laying(
        tuple(LayingScene(name, size, *way, **parts) for name, size, way in strips),
        tuple(LayingScene("delingette", size, *way, **parts) for way, size in references),
    )


def _axes(laying):
    strips = laying.strips
    return {
        "definition": {one.definition for one in strips},
        "mesh_size": {one.mesh_size for one in strips},
        "loading": tuple(name for name in LOADINGS if any(one.loading == name for one in strips)),
        "friction": tuple(sorted({one.friction for one in strips})),
    }


def _tasks(study):
    laying = study.parts["laying"]
    for one, names in [(one, LAID) for one in laying.strips] + [(one, LAYING_WAY) for one in laying.references]:
        values = asdict(one) | {"material": material_key(one.material), "support": material_key(one.support)}
        # The trapezoid is of Delingette's springs.
        also = mesh_type_key("structured"), definition_key(one.definition), definition_key("delingette")
        labels = {name: getattr(one, name) for name in names}
        yield Task(values, also, labels, one, seconds=1.5 * (1e-3 / one.mesh_size) ** 3)


STAGE = stage("laying", "studies.kinds.laying.solve", "Laying the strips", _tasks)

KIND = Kind(
    "laying",
    study_fields={"laying": optional(LayingConfig, "A strip laid on a trapezoid; it makes the group `/laying`.")},
    check=_check,
    expand=_expand,
    axes=_axes,
    summary=lambda part: [["strips", len(part.strips), "laid on a trapezoid"]],
    stages=(STAGE,),
    outputs=OUTPUTS,
    tables=lambda study: ["laying"] if study.parts["laying"] else [],
    tables_by="outputs",
)

"""Strips laid on a trapezoid: every combination of the values of a study's section ``laying``."""

from itertools import product
from typing import Annotated

from pydantic import Field

from springtune.springs.base import DEFINITIONS

from ...config import fields
from ...config.checks import check_beam_material, check_fit, check_particles, check_product
from ...config.fields import OneOrMore, Section, default, one_of, optional
from ...config.model import Output, Stage, StudyKind, declared
from ...runs.keys import beam_key, definition_key, material_key, mesh_type_key
from ...runs.plan import Task

LOADINGS = ("pressure", "gravity", "ends")
"""Loadings: a pressure on the upper face, the weight, or ends pulled down to the floor."""

REFERENCE_SIZES = (1.0, 1.25, 1.6)
"""Mesh sizes of a reference over the given one; the first gives the answer, all give the error band."""

LOADING, NETWORK = ("loading", "friction"), ("definition", "mesh_size")
STRIP = (*NETWORK, *LOADING)  # dimensions of a loading, of a network, and of a network under a loading

MOST_STRIPS = 10_000  # most strips of a study; each takes seconds

Friction = Annotated[float, Field(ge=0, le=2, title="a coefficient from 0 to 2, such as 0.3")]
Loading = Annotated[str, *one_of("loading", LOADINGS)]


class TrapezoidConfig(Section):
    """A symmetric trapezoid that stands on its lower base."""

    lower_base: fields.Length
    """Base on the floor."""

    upper_base: fields.Length
    """Upper base."""

    height: fields.Length
    """Height."""


class LayingConfig(Section):
    """A strip laid on a trapezoid; every combination of the values, as in a grid.

    The reference is a strip of finite elements. Two coarser meshes estimate its error.
    """

    strip: fields.BeamName
    """Beam that is the strip."""

    trapezoid: TrapezoidConfig
    """Trapezoid below the strip."""

    material: fields.MaterialName
    """Material of the strip."""

    support: fields.MaterialName
    """Material of the trapezoid; rigid from 1e4 times the strip's modulus."""

    definition: fields.DefinitionNames
    """Definitions that derive a stiffness without a reference."""

    mesh_size: OneOrMore[fields.Length]
    """Lengths of an edge."""

    reference_size: fields.Length = default("1 mm")
    """Finest mesh size of the finite-element reference."""

    loading: OneOrMore[Loading] = default("pressure")
    """`pressure`: follows the upper face; `gravity`: the same force as weight; `ends`: pulls the ends down to the
    floor."""

    pressure: fields.Stress
    """Pressure, or weight per upper face."""

    friction: OneOrMore[Friction] = default("0")
    """Coefficients of friction."""


def _check(config, problems):
    for key in ("material", "support"):
        check_beam_material(problems, ("laying", key), getattr(config.laying, key), config)
    check_fit(problems, ("laying", "definition"), config.laying.definition, ["structured"])
    check_product(problems, config.laying, ("laying",), STRIP, MOST_STRIPS)
    beam = config.beams[config.laying.strip]
    for key, sizes in (("mesh_size", config.laying.mesh_size), ("reference_size", [config.laying.reference_size])):
        check_particles(problems, ("laying", key), sizes, beam.length, beam.height)
    base = config.laying.trapezoid
    if not base.upper_base < base.lower_base:
        problems.add(("laying", "trapezoid", "upper_base"), "is not below 'lower_base'; give a shorter upper base")


def _expand(config, declared):
    """Labels and values of network strips, and of finite-element strips to compare with."""
    section = config.laying
    shared = {
        "strip": beam_key(declared.beams[section.strip]),
        "trapezoid": section.trapezoid.model_dump(),
        "material": material_key(declared.materials[section.material]),
        "support": material_key(declared.materials[section.support]),
        "pressure": section.pressure,
    }
    names = [name for name in DEFINITIONS if name in section.definition]
    ways = [*product([name for name in LOADINGS if name in section.loading], sorted(section.friction))]
    strips = [dict(zip(STRIP, (*one, *way))) for *one, way in product(names, sorted(section.mesh_size), ways)]
    found = [(labels, labels["definition"], [labels["mesh_size"]]) for labels in strips]
    sizes = [ratio * section.reference_size for ratio in REFERENCE_SIZES]
    found += [(dict(zip(LOADING, way)), "delingette", sizes) for way in ways]
    return [(labels, shared | labels | {"definition": name, "mesh_sizes": sizes}) for labels, name, sizes in found]


def _tasks(study):
    for labels, values in study.parts["laying"]:
        # The trapezoid is of Delingette's springs.
        code = mesh_type_key("structured"), definition_key(values["definition"]), definition_key("delingette")
        yield Task(values, code, labels, seconds=1.5 * (1e-3 / min(values["mesh_sizes"])) ** 3)


PLOTS = "studies.kinds.laying.figures"

KIND = StudyKind(
    "laying",
    study_fields={"laying": optional(LayingConfig, "A strip laid on a trapezoid: group `/laying`.")},
    check=_check,
    expand=_expand,
    axes=lambda part: {name: {one[name] for one, _ in part if name in one} for name in NETWORK},
    summary=lambda part: [["strips", sum("definition" in labels for labels, _ in part), "laid on a trapezoid"]],
    **declared(__file__),
    stages=(Stage("laying", "studies.kinds.laying.solve", _tasks),),
    outputs=(
        Output("laying", "laid strips", lambda study: {"laying": {}}, plot=f"{PLOTS}:laying", shows="laid strips"),
    ),
    tables=lambda study: ["laying"] if study.parts["laying"] else [],
)

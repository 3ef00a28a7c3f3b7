"""Refinement: a study's section ``refine``, one task a refinement and definition."""

from collections import defaultdict
from dataclasses import asdict, dataclass
from math import inf
from typing import Annotated

from pydantic import Field
from pydantic_core import PydanticCustomError

from springtune.mesh import MESH_TYPES
from springtune.problem.geometry import Beam, warn_of_thickness
from springtune.problem.loads import LOADS
from springtune.problem.materials import Material
from springtune.springs import DEFINITIONS

from ...config.checks import check_able, check_beam_material, check_compressible, check_known, check_made
from ...config.fields import (
    POISSON_RATIO,
    BeamName,
    DefinitionNames,
    Force,
    Kinematics,
    Length,
    Load,
    MadeType,
    MaterialName,
    Named,
    Scalar,
    number,
    one_of,
    quantity,
)
from ...config.kind import Kind
from ...config.messages import refuse, show
from ...config.sections import Section, default, optional
from ...runs.checked_json import hash_of
from ...runs.keys import beam_key, definition_key, material_key, mesh_type_key, stage_key
from ...runs.stages import Task, stage
from .batches import Rule
from .outputs import OUTPUTS, SPACINGS, VARIED

MOST_REFINED = 10_001

MADE = ("mesh_size", "force")
"""Parameters that a refinement states unless it varies them; beam and material have the others."""


def _read_share(value: str) -> float:
    text = value.strip()
    try:
        share = float(text.removesuffix("%")) / (100 if text.endswith("%") else 1)
    except ValueError:
        raise refuse(f"{show(value)} is not a share; give one such as '1 %'") from None
    if not 0 < share < 1:  # a plain 1 is meant as 1 %, as likely as not
        raise refuse(f"{show(value)} is out of range; give a share above 0 % and below 100 %, such as '1 %'")
    return share


Share = Annotated[
    float, Scalar(_read_share, {"type": ["string", "number"], "examples": ["1 %"]}, "a share such as '1 %'")
]
End = Annotated[
    str, Scalar(str, {"type": ["string", "number"], "examples": ["1 mm"]}, "a value of the parameter, such as '1 mm'")
]
Count = Annotated[int, number("a whole number from 2 to 10001, such as 33", 2, MOST_REFINED, whole=True)]
ENDS = {
    "mesh_size": quantity("length"),
    "force": quantity("force"),
    "thickness": quantity("length"),
    "young_modulus": quantity("stress"),
    "poisson_ratio": POISSON_RATIO,
    "stiffness_scale": number("a value above 0, such as 0.5", 0, inf, above=True),
}
"""How the ends of each parameter are read."""

ParameterName = Annotated[str, one_of("parameter", VARIED)]
Spacing = Annotated[str, one_of("spacing", SPACINGS)]


class RefinementConfig(Section):
    """Values of one parameter, added in batches where the error changes its sign or crosses a tolerance.

    The first batch is evenly spaced. Every further one halves all intervals in which the deformation error crosses
    zero or the tolerance, of either sign. It ends when intervals are as narrow as `resolution`, or with `most` values.
    Each definition has values of its own. A larger `most` goes on where a smaller one ended.
    """

    beam: BeamName = Field(description="Beam.")
    mesh_type: MadeType = default("structured", description="Generated mesh type.")
    mesh_size: Length | None = Field(None, description="Length of an edge; required unless it is the parameter.")
    material: MaterialName = Field(description="Material.")
    load: Load = Field(description="Load.")
    force: Force | None = Field(None, description="Magnitude; required unless it is the parameter.")
    definition: DefinitionNames = Field(description="Definitions that derive a stiffness and need no reference.")
    kinematics: Kinematics = default("nonlinear", description="Kinematics of the network.")
    parameter: ParameterName = Field(description="Parameter to vary: " + "; ".join(
        f"`{name}`, {one.meaning}" for name, one in VARIED.items()) + ".")  # fmt: skip
    start: End = Field(alias="from", description="Smallest value, with its unit.")
    stop: End = Field(alias="to", description="Largest value, with its unit.")
    points: Count = default("5", description="Values of the first batch, both ends included.")
    spacing: Spacing = default("linear", description="Whether values or their logarithms are evenly spaced.")
    tolerance: Share = default("1 %", description="Size of the error that matters.")
    resolution: Share = default(
        "0.1 %", description="Width of the narrowest intervals, as a share of the distance between the ends."
    )
    most: Count = default("33", description="Most values of each definition.")


@dataclass(frozen=True)
class Refinement:
    """A refinement of one definition; ``force`` [N] has its sign, ``mesh_size`` [m] is 0 where it is the parameter."""

    name: str
    beam: Beam
    material: Material
    load: str
    force: float
    mesh_type: str
    mesh_size: float
    definition: str
    kinematics: str
    parameter: str
    rule: Rule


def _check(config, problems):
    for name, section in config.refine.items():
        path = "refine", name
        check_known(problems, (*path, "beam"), "beam", section.beam, config.beams)
        check_beam_material(problems, (*path, "material"), section.material, config)
        _check_definitions(section, path, problems)
        material = config.materials.get(section.material)
        if material and material.uniaxial_test and section.parameter in ("young_modulus", "poisson_ratio"):
            problems.add(
                (*path, "material"),
                f"'{section.material}' has a uniaxial_test, which says its moduli; vary another parameter, or take "
                "another material",
            )
        for made in MADE:
            given = getattr(section, made) is not None
            if given and made == section.parameter:
                problems.add((*path, made), "is the parameter that is varied; remove it, or vary another one")
            elif not given and made != section.parameter:
                example = {"mesh_size": "2 mm", "force": "10 kN"}[made]
                problems.add(path, f"no {made}; give one such as {made}: {example}, or vary it")
        if section.most < section.points:
            problems.add((*path, "most"), f"{section.most} is below 'points', {section.points}; give at least as many")
        ends = _ends(section, path, problems)
        sizes = {"mesh_size": section.mesh_size} if section.mesh_size else {}
        if section.parameter == "poisson_ratio" and 0.5 in ends:
            check_compressible(problems, (*path, "to"), section.material, config)
        if section.parameter == "mesh_size":
            sizes = dict(zip(("from", "to"), ends))
        for key, size in sizes.items():
            check_made(problems, (*path, key), section.mesh_type, size, section.beam, config)


def _ends(section, path, problems):
    """Both ends of a refinement in SI units; none if they are wrong, which is noted."""
    found = []
    for key, text in (("from", section.start), ("to", section.stop)):
        try:
            found.append(ENDS[section.parameter].read(text))
        except PydanticCustomError as error:
            problems.add((*path, key), error.context["message"])
    if len(found) < 2:
        return []
    if not found[0] < found[1]:
        problems.add((*path, "from"), f"'{section.start}' is not below 'to', '{section.stop}'; give a smaller 'from'")
    elif section.spacing == SPACINGS[1] and not found[0] > 0:
        problems.add((*path, "from"), f"{found[0]:g} has no logarithm; give a larger one, or spacing: linear")
    else:
        return found
    return []


def _check_definitions(section, path, problems):
    why = (
        "needs a reference or a stated stiffness, or other cells or loads; on "
        f"'{section.mesh_type}' meshes in {section.load}"
    )
    corners, stretched = MESH_TYPES[section.mesh_type].corners, LOADS[section.load].kind.uniaxial
    check_able(problems, (*path, "definition"), section.definition, why, corners, stretched)


def _expand(config, declared):
    found = []
    for name, section in config.refine.items():
        ends = [ENDS[section.parameter].read(text) for text in (section.start, section.stop)]
        how = section.points, section.spacing == SPACINGS[1], section.tolerance, section.resolution, section.most
        beam, material = declared.beams[section.beam], declared.materials[section.material]
        if section.parameter == "thickness":
            warn_of_thickness(max(ends), (beam.length, beam.height), f"refine.{name}")
        force = LOADS[section.load].sign * (1.0 if section.force is None else section.force)
        body = beam, material, section.load, force, section.mesh_type, section.mesh_size or 0.0
        found += [
            Refinement(name, *body, definition, section.kinematics, section.parameter, Rule(*ends, *how))
            for definition in DEFINITIONS
            if definition in section.definition
        ]
    return tuple(found)


def _axes(refinements):
    return {
        "definition": {one.definition for one in refinements},
        "refinement": tuple(dict.fromkeys(one.name for one in refinements)),
    }


def _summary(refinements):
    first, most = (sum(getattr(one.rule, name) for one in refinements) for name in ("points", "most"))
    return [["refined", first, f"values to begin with, at most {most}, where errors cross zero or a tolerance"]]


REFINER = "studies.kinds.refinement.solve"

USUAL_PARTICLES = 1e3
"""Particles of a mesh of unknown size, for costs."""


def _parameters(one):
    """What all values of a refinement have in common: refinements that differ in their ends alone share a file."""
    load = LOADS[one.load]
    same = ("force", "mesh_type", "mesh_size", "definition", "kinematics", "parameter")
    return {name: getattr(one, name) for name in same} | {
        "beam": beam_key(one.beam),
        "material": material_key(one.material),
        "kind": load.kind.name,
        "follower": load.follower and one.kinematics == "nonlinear",
    }


def file_key(one):
    """Key of the file of a refinement: of all that its results depend on besides their values."""
    return hash_of(_parameters(one), [stage_key(REFINER), mesh_type_key(one.mesh_type), definition_key(one.definition)])


def _tasks(study):
    """A task for all refinements that share a file."""
    families = defaultdict(list)
    for one in study.parts["refinement"]:
        families[file_key(one)].append(one)
    for key, family in families.items():
        values = _parameters(family[0]) | {"rules": [asdict(one.rule) for one in family]}
        yield Task(values, costs=[_cost(one) for one in family], name=key, key=key)


def _cost(one):
    """Expected cost: half of the values that a refinement may add, on its largest known mesh."""
    size = one.mesh_size or one.rule.first
    particles = one.beam.length * one.beam.height / (0.866 * size**2) if size else USUAL_PARTICLES
    return "refinement", particles, 0.5 * (one.rule.points + one.rule.most)


KIND = Kind(
    "refinement",
    study_fields={
        "refine": optional(
            Annotated[dict[str, RefinementConfig], Named("refinement", for_files=False)],
            "Values that are added where an error matters; they make the group `/refinement`.",
        )
    },
    check=_check,
    expand=_expand,
    axes=_axes,
    summary=_summary,
    stages=(stage("refinement", REFINER, "Refining where errors matter", _tasks),),
    outputs=OUTPUTS,
    costs={"refinement": (3e-2, 1.2e-5)},
)

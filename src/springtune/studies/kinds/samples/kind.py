"""Samples: a study's section ``samples``."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any

from pydantic import Field, GetCoreSchemaHandler, create_model
from pydantic_core import CoreSchema, core_schema

from springtune.mesh.types import MESH_TYPES
from springtune.problem.geometry import warn_of_size, warn_of_thickness
from springtune.problem.loads import LOADS
from springtune.problem.parameters import MOST_SCENES
from springtune.problem.quantities import LEAST
from springtune.safe_io.tables import number_text
from springtune.springs.base import DEFINITIONS

from ...config.checks import MORE_SCENES, check_able, check_particles, in_mm, most_scenes
from ...config.fields import (
    POISSON_RATIO,
    DefinitionNames,
    Flag,
    Kinematics,
    Load,
    OneOrMore,
    Scalar,
    Section,
    default,
    number,
    one_of,
    optional,
    quantity,
)
from ...config.kind import Kind
from ...config.messages import refuse, show
from ...runs.keys import definition_key, mesh_type_key, stage_key
from ...runs.source import hash_of
from ...runs.stages import Task, stage
from ..scenes.plan import expected_solves
from .designs import DESIGNS, PARAMETERS, SMALLEST_SIZE, SOBOL_INDICES, blocks, roles, varied
from .outputs import OUTPUTS

DISTRIBUTION_KEYS = {
    "uniform": ("from", "to"),
    "log-uniform": ("from", "to"),
    "triangular": ("from", "mode", "to"),
    "normal": ("mean", "deviation"),
}

DEVIATIONS = 4.0
"""Standard deviations from the mean at which a normal distribution ends by default."""

MOST_DEVIATIONS = 8.0
"""Largest distance of the range of a normal distribution from its mean, in standard deviations."""

LEGAL = {"poisson_ratio": (math.nextafter(-1.0, 0.0), 0.5), "relative_mesh_size": (LEAST, 1.0)}
"""Range of the parameters that are not just positive."""

_NUMBERS = {
    "poisson_ratio": POISSON_RATIO,
    "relative_mesh_size": number("a number above 0 and at most 1, such as 0.2", 0, 1, above=True),
}


class DistributionConfig(Section):
    """The distribution to draw a parameter from; `Distributed` adds its numbers."""

    distribution: Annotated[str, one_of("distribution", DISTRIBUTION_KEYS)] = "uniform"

    @classmethod
    def _needed(cls, given: Mapping[str, object]) -> dict[str, str]:
        name = given.get("distribution", "uniform")
        keys = DISTRIBUTION_KEYS.get(name, ()) if isinstance(name, str) else ()
        return {key: f": a {name} distribution needs {' and '.join(keys)}" for key in keys}


class Distributed:
    """Annotation of a parameter: a value, or the distribution to draw it from."""

    def __init__(self, name: str, example: str) -> None:
        self.name, self.scalar = name, _NUMBERS.get(name) or quantity(PARAMETERS[name][0])
        self.words = f"{self.scalar.words}, or a range such as `{example}`"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        number = Annotated[float, self.scalar]
        keys: dict[str, Any] = {key: (number | None, None) for key in ("mode", "mean", "deviation")}
        keys |= {name: (number | None, Field(None, alias=key)) for name, key in (("low", "from"), ("high", "to"))}
        section = create_model(f"{self.name}_distribution", __base__=DistributionConfig, **keys)
        fixed = core_schema.no_info_after_validator_function(
            lambda value: {"distribution": "fixed", "low": value, "high": value}, handler.generate_schema(number)
        )
        drawn = core_schema.no_info_after_validator_function(self._checked, handler.generate_schema(section))
        choices: dict[Any, CoreSchema] = {"fixed": fixed, "drawn": drawn}
        return core_schema.tagged_union_schema(
            choices, lambda value: "drawn" if isinstance(value, dict | list) else "fixed"
        )

    def _checked(self, section: DistributionConfig) -> dict[str, Any]:
        read = {key: value for key, value in section if value is not None}
        name = read["distribution"]
        for key in read.keys() - {"distribution", "low", "high", *DISTRIBUTION_KEYS[name]}:
            raise refuse(f"a {name} distribution has no '{key}'; remove it", key)
        if name == "normal":
            read = self._ended(read)
        low, high = read["low"], read["high"]
        if not low < high:
            ends = f"{self._shown(low)} is not below 'to', {self._shown(high)}"
            raise refuse(f"{ends}; exchange them, or give one value for a parameter that does not vary", "from")
        if name == "log-uniform" and not low > 0:
            raise refuse(f"{self._shown(low)} has no logarithm; give a 'from' above zero, or a uniform one", "from")
        if name == "triangular" and not low <= read["mode"] <= high:
            raise refuse(
                f"{self._shown(read['mode'])} is not between 'from' and 'to'; give a mode between them", "mode"
            )
        return read

    def _shown(self, value: float) -> str:
        return show(number_text(value, PARAMETERS[self.name][2]))

    def _ended(self, read: dict[str, Any]) -> dict[str, Any]:
        """Add the ends of a normal distribution: by default some deviations from the mean, within its legal range."""
        mean, deviation = read["mean"], read["deviation"]
        if not deviation > 0:
            raise refuse("'0' is no deviation; give one above zero, or one value", "deviation")
        least, most = LEGAL.get(self.name, (0.0, math.inf))
        below, above = mean - DEVIATIONS * deviation, mean + DEVIATIONS * deviation
        if "low" not in read and below <= least and self.name != "poisson_ratio":
            why = f"{DEVIATIONS:g} deviations below the mean are not above zero"
            raise refuse(f"{why}; give where the distribution ends, from: <smallest value>", "deviation")
        read = {"low": max(least, below), "high": min(most, above)} | read
        far = MOST_DEVIATIONS * deviation
        if where := "below 'from'" if mean + far <= read["low"] else "above 'to'" if mean - far >= read["high"] else "":
            raise refuse(f"{self._shown(mean)} is far {where}; give ends near the mean", "mean")
        return read


MOST_SOLVED = 1024
"""Most rows of a sample whose references are solved one by one where they cannot be interpolated."""

UNIFORM = "uniform"
"""Definition whose networks give the best uniform stiffness."""

SOLVE, INTERPOLATE = "studies.kinds.samples.solve", "studies.kinds.samples.interpolate"

Drawn = dict[str, Any]


class ParametersConfig(Section):
    """Parameters of sampled scenes: each is a value, or a distribution to draw it from.

    `{from: 100 mm, to: 400 mm}` is uniform; `{from: 1 MPa, to: 1 GPa, distribution: log-uniform}` has a uniform
    logarithm; `{from: 1 mm, mode: 2 mm, to: 5 mm, distribution: triangular}`; `{mean: 40 mm, deviation: 2 mm,
    distribution: normal}` ends at `from` and `to`, by default 4 deviations from the mean or at the last legal value.
    """

    length: Annotated[Drawn, Distributed("length", "{from: 100 mm, to: 400 mm}")] = Field(
        description="Extent along x, the direction of the load."
    )
    height: Annotated[Drawn, Distributed("height", "{from: 20 mm, to: 80 mm}")] = Field(description="Extent along y.")
    thickness: Annotated[Drawn, Distributed("thickness", "{from: 1 mm, to: 2 mm}")] = default(
        "1 mm", description="Extent out of the plane."
    )
    mesh_size: Annotated[Drawn, Distributed("mesh_size", "{from: 2 mm, to: 5 mm}")] | None = Field(
        None, description="Length of an edge; at most the smaller side of any beam. Give this or `relative_mesh_size`."
    )
    relative_mesh_size: Annotated[Drawn, Distributed("relative_mesh_size", "{from: 0.1, to: 0.3}")] | None = Field(
        None, description="Length of an edge over the height."
    )
    young_modulus: Annotated[Drawn, Distributed("young_modulus", "{from: 1 GPa, to: 210 GPa}")] = Field(
        description="Young's modulus E."
    )
    poisson_ratio: Annotated[Drawn, Distributed("poisson_ratio", "{from: 0, to: 0.5}")] = Field(
        description="Poisson's ratio nu."
    )
    force: Annotated[Drawn, Distributed("force", "{from: 1 kN, to: 20 kN}")] = Field(
        description="Magnitude of the force. The load's name carries the sign."
    )


def _read_size(value: str) -> int:
    try:
        size = int(value)
    except ValueError:
        raise refuse(f"{show(value)} is not a whole number; give a power of two such as 1024") from None
    if size < SMALLEST_SIZE or size & (size - 1):
        above = max(SMALLEST_SIZE, 1 << max(0, size - 1).bit_length())
        below = f"{above // 2} or " if above > SMALLEST_SIZE else ""
        raise refuse(
            f"{show(value)} is not a power of two from {SMALLEST_SIZE} on, which keeps a sample even and lets it be "
            f"doubled; give {below}{min(above, MOST_SCENES)}"
        )
    return size


Size = Annotated[int, Scalar(_read_size, {"type": "integer", "minimum": SMALLEST_SIZE}, "a power of two such as 1024")]
Seed = Annotated[int, number("a whole number from 0, such as 1", 0, 2**31, whole=True)]
Design = Annotated[str, one_of("design", DESIGNS)]
MadeType = Annotated[str, one_of("mesh type", MESH_TYPES)]


class SamplesConfig(Section):
    """Scenes whose parameters are drawn from distributions, and which of these parameters matter.

    A sample of twice the size keeps its scenes and adds as many. Stored scenes are not solved again.
    """

    design: Design = Field(
        SOBOL_INDICES,
        description="`sobol-indices`: Saltelli's design for first- and total-order Sobol indices, with `size` x "
        "(varied parameters + 2) points; `sobol`: scrambled Sobol points.",
    )
    size: Size = Field(description="Number of points: a power of two. For `sobol-indices`, of base samples.")
    seed: Seed = default("1", description="Seed of the random numbers.")
    mesh_type: MadeType = default("structured", description="Generated mesh type.")
    load: Annotated[list[Load], OneOrMore()] = Field(description="Loads; each acts on every point's scene.")
    definition: DefinitionNames = Field(description="Definitions that need no reference and no stated stiffness.")
    kinematics: Kinematics = default(
        "linear",
        description="`linear` solves scenes once that differ in thickness, Young's modulus and force alone; "
        "`nonlinear` solves each scene, which takes some ten times as long.",
    )
    best_stiffness: Flag = default(
        "true", description="Whether to find the uniform stiffness without an error, too; with linear kinematics only."
    )
    parameters: ParametersConfig = Field(description="Parameters of the scenes.")


@dataclass(frozen=True)
class Sample:
    """What a study samples."""

    design: str
    size: int
    seed: int
    mesh_type: str
    loads: tuple[str, ...]
    definitions: tuple[str, ...]
    kinematics: str
    best_stiffness: bool
    parameters: dict[str, dict[str, Any]]

    @property
    def varied(self) -> tuple[str, ...]:
        """Parameters that are not fixed."""
        return tuple(varied(self.parameters))

    @property
    def rows(self) -> int:
        """Number of points whose scenes are solved."""
        return self.size * len(roles(self.design, self.varied))

    @property
    def scenes(self) -> int:
        """Number of scenes."""
        return self.rows * len(self.loads) * len(self.definitions)


def _check(config, problems):
    section = config.samples
    where, sample = ("samples", "parameters"), _sample(section)
    if (section.parameters.mesh_size is None) == (section.parameters.relative_mesh_size is None):
        if section.parameters.mesh_size is not None:
            problems.add((*where, "relative_mesh_size"), "both this and 'mesh_size'; remove one")
        else:
            remedy = "give one such as {from: 2 mm, to: 5 mm}, or a 'relative_mesh_size'"
            problems.add(where, f"'mesh_size' is missing; {remedy}")
    else:
        _check_sizes(sample, problems)
    if not sample.varied:
        problems.add(where, "nothing varies; give at least one parameter a range such as {from: 100 mm, to: 400 mm}")
    _check_definitions(section, problems)
    most = most_scenes()
    if sample.scenes > most:
        each = f"{sample.rows // sample.size} rows x {len(sample.loads)} loads x {len(sample.definitions)} definitions"
        problems.add(
            ("samples", "size"),
            f"{sample.size} points make {sample.scenes} scenes ({each} each); a sample has at most {most}: "
            f"give a smaller size, or fewer loads and definitions, {MORE_SCENES}",
        )


def _check_definitions(section, problems):
    path, why = ("samples", "definition"), "needs a reference, a stated stiffness or other cells than those of"
    corners = MESH_TYPES[section.mesh_type].corners
    check_able(problems, path, section.definition, f"{why} {section.mesh_type} meshes;", corners)
    unstretched = [load for load in section.load if not LOADS[load].kind.uniaxial]
    for name in section.definition:
        for load in unstretched if DEFINITIONS[name].uniaxial and corners in DEFINITIONS[name].cells else ():
            why = "is for loads that stretch a beam along its length"
            problems.add(path, f"'{name}' {why}, and '{load}' does not; remove one")


def _check_sizes(sample, problems):
    """Check mesh sizes against the smallest and the largest beam of a sample."""
    name = "relative_mesh_size" if "relative_mesh_size" in sample.parameters else "mesh_size"
    path, relative = ("samples", "parameters", name), name == "relative_mesh_size"
    size, length, height = (sample.parameters[one] for one in (name, "length", "height"))
    largest = size["high"] * (height["high"] if relative else 1.0)
    side = length["low"] if relative else min(length["low"], height["low"])
    if largest > side:
        remedy = "a smaller 'to', or longer beams" if relative else f"at most {in_mm(side)}, or a 'relative_mesh_size'"
        what = f"up to {in_mm(largest)} is larger than the smallest side of a beam, {in_mm(side)}"
        problems.add(path, f"{what}; give {remedy}")
    smallest = size["low"] * (height["low"] if relative else 1.0)
    check_particles(problems, path, [smallest], length["high"], height["low" if relative else "high"])


def _sample(section):
    given = {name: getattr(section.parameters, name) for name in PARAMETERS}
    same = ("design", "size", "seed", "mesh_type", "kinematics")
    return Sample(
        **{name: getattr(section, name) for name in same},
        loads=tuple(name for name in LOADS if name in section.load),
        definitions=tuple(name for name in DEFINITIONS if name in section.definition),
        best_stiffness=section.best_stiffness and section.kinematics == "linear",
        parameters={name: one for name, one in given.items() if one is not None},
    )


def _expand(config, declared):
    sample = _sample(config.samples)
    sides = [sample.parameters[name] for name in ("length", "height")]
    smallest = tuple(side["low"] for side in sides)
    warn_of_size((*smallest, *(side["high"] for side in sides)), "samples")
    warn_of_thickness(sample.parameters["thickness"]["high"], smallest, "samples")
    return sample


def _summary(sample):
    design = "for Sobol indices" if sample.design == SOBOL_INDICES else "Sobol points"
    each = f"{sample.size} x {sample.rows // sample.size} points" if sample.design == SOBOL_INDICES else "points"
    times = [f"{len(names)} {what}s" for names, what in ((sample.loads, "load"), (sample.definitions, "definition"))
             if len(names) > 1]  # fmt: skip
    return [["samples", sample.scenes, f"scenes, {' x '.join([each, *times])}, {design}: {', '.join(sample.varied)}"]]


def solved_definitions(sample):
    """Definitions whose networks are solved."""
    wanted = (UNIFORM,) if sample.best_stiffness and UNIFORM not in sample.definitions else ()
    return (*sample.definitions, *wanted)


def reference_box(sample):
    """First and last aspect ratio, and first and last Poisson's ratio."""
    length, height, ratio = (sample.parameters[name] for name in ("length", "height", "poisson_ratio"))
    return [length["low"] / height["high"], length["high"] / height["low"]], [ratio["low"], ratio["high"]]


def reference_key(sample, kind):
    """Key of the references of a kind of load, as one function."""
    code = stage_key(INTERPOLATE, without=("studies.kinds.samples.designs",))
    return hash_of(kind.name, reference_box(sample), code)


def block_key(sample, first, last):
    """Key of the parameters of some base samples, and stem of the file of their results on meshes of any type."""
    code = stage_key("studies.kinds.samples.designs")
    return hash_of(sample.design, sample.seed, sample.parameters, first, last, code)


@cache
def _solved_with(mesh_type, definition):
    return hash_of(stage_key(SOLVE), mesh_type_key(mesh_type), definition_key(definition))


def _load_of(sample, load):
    """What results depend on of a load; linear ones are for 1 N."""
    found = {"kind": LOADS[load].kind.name}
    nonlinear = {"sign": LOADS[load].sign, "follower": LOADS[load].follower}
    return found if sample.kinematics == "linear" else found | nonlinear


def result_key(sample, load, definition):
    """Key of the scenes of a load and definition in the file of any base samples."""
    solved_with = _solved_with(sample.mesh_type, definition)
    return hash_of(_load_of(sample, load), sample.mesh_type, sample.kinematics, solved_with)


def _references(study):
    """Tasks of the references, one a kind of load."""
    sample = study.parts["samples"]
    drawn, box = None, reference_box(sample)
    seconds = 3e-2 * expected_solves(box)
    if sample.rows <= MOST_SOLVED:
        drawn = {"design": sample.design, "seed": sample.seed, "parameters": sample.parameters}
        drawn |= {"first": 0, "last": sample.size}
    for kind in dict.fromkeys(LOADS[name].kind for name in sample.loads):
        key = reference_key(sample, kind)
        values = {"kind": kind.name, "box": box}
        yield Task(values, seconds=seconds, name=kind.name, file=key, key=key, shared={"sample": drawn})


def _blocks(study):
    """Tasks of some base samples each; those of a sample of half the size are the first of them."""
    sample = study.parts["samples"]
    scenes = {
        result_key(sample, load, definition): _load_of(sample, load) | {"definition": definition}
        for load in sample.loads
        for definition in solved_definitions(sample)
    }
    shared = {
        **{name: getattr(sample, name) for name in ("design", "seed", "parameters", "mesh_type", "kinematics")},
        "meshed": hash_of(stage_key(SOLVE), mesh_type_key(sample.mesh_type)),
        "results": scenes,
    }
    for first, last in blocks(sample.design, sample.size):
        key, seconds = block_key(sample, first, last), 0.05 + 6e-4 * (last - first) * _scenes_each(sample)
        values = {"first": first, "last": last}
        yield Task(values, seconds=seconds, name=f"{first}-{last}", file=key, key=key, shared=shared)


def _scenes_each(sample):
    """Number of networks of a base sample."""
    return sample.rows // sample.size * len(sample.loads) * len(solved_definitions(sample))


def _tables(study):
    sample = study.parts["samples"]
    return ["sobol"] if sample and sample.design == SOBOL_INDICES else []


KIND = Kind(
    "samples",
    study_fields={
        "samples": optional(SamplesConfig, "Sampled scenes; they make the groups `/samples`, `/effects` and `/sobol`.")
    },
    alone={"samples": ()},
    check=_check,
    expand=_expand,
    axes=lambda sample: {"load": set(sample.loads), "definition": set(sample.definitions)},
    summary=_summary,
    stages=(
        stage("interpolate", INTERPOLATE, "Interpolating the references of samples", _references, folder="samples"),
        stage("sample", SOLVE, "Solving the networks of samples", _blocks, folder="samples"),
    ),
    outputs=OUTPUTS,
    tables=_tables,
    tables_by="outputs",
)

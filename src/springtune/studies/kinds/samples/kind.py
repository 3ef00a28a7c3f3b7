"""Samples: a study's section ``samples``."""

from functools import cache
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, TypeAdapter, WithJsonSchema, create_model

from springtune.problem.loads import LOADS
from springtune.problem.quantities import MOST_SCENES
from springtune.problem.shapes import warn_of_body
from springtune.safe_io import number_text
from springtune.springs.base import DEFINITIONS

from ...config import fields
from ...config.checks import MORE_SCENES_REMEDY, check_fit, check_particles, most_scenes
from ...config.fields import OneOrMore, Section, default, one_of, optional, quantity
from ...config.messages import refuse, show, words
from ...config.model import Output, Stage, StudyKind, stem
from ...runs.keys import definition_key, mesh_type_key, stage_key
from ...runs.plan import Task
from ...runs.source import hash_of
from ..bodies.kind import REFERENCES_OF_SHAPES
from . import DESIGNS, PARAMETERS, SMALLEST_SIZE, SOBOL_INDICES, blocks, roles, varied

SHAPE_KEYS = {"uniform": (), "log-uniform": (), "triangular": ("mode",), "normal": ("mean", "deviation")}
"""Keys of each distribution besides `from` and `to`."""

_NUMBERS: dict[str, Any] = {
    "poisson_ratio": fields.PoissonRatio,
    "relative_mesh_size": Annotated[float, Field(gt=0, le=1, title="a number above 0 and at most 1, such as 0.2")],
}


class DistributionConfig(Section):
    """The distribution to draw a parameter from; `parameter` adds its numbers."""

    distribution: Annotated[str, *one_of("distribution", SHAPE_KEYS)] = "uniform"


def parameter(name: str, example: str) -> Any:
    """Notes of a parameter: a value, or the distribution to draw it from."""
    kind: Any = _NUMBERS.get(name) or Annotated[float, *quantity(PARAMETERS[name][0])]
    keys: dict[str, Any] = {key: (kind, Field(alias=alias)) for key, alias in (("low", "from"), ("high", "to"))}
    keys |= {key: (kind | None, None) for key in ("mode", "mean", "deviation")}
    section = create_model(f"{name}_distribution", __base__=DistributionConfig, **keys)
    single = TypeAdapter(kind, config=ConfigDict(defer_build=True))

    def read(value: object) -> dict[str, Any]:
        if isinstance(value, dict | list):
            return _distribution(name, section.model_validate(value))
        number = single.validate_python(value)
        return {"distribution": "fixed", "low": number, "high": number}

    def or_section(schema: dict[str, Any]) -> None:
        schema.pop("additionalProperties"), schema.pop("type")
        schema["anyOf"] = [single.json_schema(), section.model_json_schema()]

    title = f"{words(kind)}, or a range such as `{example}`"
    return BeforeValidator(read), Field(title=title, json_schema_extra=or_section)


def _distribution(name: str, section: DistributionConfig) -> dict[str, Any]:
    """Check that the keys of a distribution fit, and return them."""
    kind = section.distribution
    read = {key: value for key, value in section if key != "distribution" and value is not None}
    texts = {key: show(number_text(value, PARAMETERS[name][2])) for key, value in read.items()}
    low, high = read["low"], read["high"]
    for key in SHAPE_KEYS[kind]:
        if key not in read:
            raise refuse(f"'{key}' is missing; a {kind} distribution needs {' and '.join(SHAPE_KEYS[kind])}", key)
    for key in read.keys() - {"low", "high", *SHAPE_KEYS[kind]}:
        raise refuse(f"a {kind} distribution has no '{key}'; remove it", key)
    if not low < high:
        ends = f"{texts['low']} is not below 'to', {texts['high']}"
        raise refuse(f"{ends}; exchange them, or give one value for a parameter that does not vary", "from")
    if kind == "log-uniform" and not low > 0:
        raise refuse(f"{texts['low']} has no logarithm; give a 'from' above zero, or a uniform one", "from")
    for key in {"mode", "mean"} & read.keys():
        if not low <= read[key] <= high:
            raise refuse(f"{texts[key]} is not between 'from' and 'to'; give a {key} between them", key)
    if not read.get("deviation", 1.0) > 0:
        raise refuse(f"{texts['deviation']} is no deviation; give one above zero, or one value", "deviation")
    return {"distribution": kind} | read


MOST_SOLVED_ROWS = 1024  # most rows of a sample whose references are solved one by one if they cannot be interpolated

UNIFORM_DEFINITION = "uniform"  # definition of the best uniform stiffness

SOLVE, INTERPOLATE = "studies.kinds.samples.solve", "studies.kinds.samples.interpolate"

Drawn = dict[str, Any]


class ParametersConfig(Section):
    """Each parameter is a value or a distribution.

    `{from: 100 mm, to: 400 mm}` is uniform; `{from: 1 MPa, to: 1 GPa, distribution: log-uniform}` has a uniform
    logarithm; `{from: 1 mm, mode: 2 mm, to: 5 mm, distribution: triangular}`; `{from: 32 mm, mean: 40 mm,
    deviation: 2 mm, to: 48 mm, distribution: normal}` is cut off at its ends.
    """

    length: Annotated[Drawn, *parameter("length", "{from: 100 mm, to: 400 mm}")]
    """Along x."""

    height: Annotated[Drawn, *parameter("height", "{from: 20 mm, to: 80 mm}")]
    """Along y."""

    thickness: Annotated[Drawn, *parameter("thickness", "{from: 1 mm, to: 2 mm}")] = default("1 mm")
    """Out of the plane."""

    mesh_size: Annotated[Drawn, *parameter("mesh_size", "{from: 2 mm, to: 5 mm}")] | None = None
    """At most the smaller side of any beam. Give this or `relative_mesh_size`."""

    relative_mesh_size: Annotated[Drawn, *parameter("relative_mesh_size", "{from: 0.1, to: 0.3}")] | None = None
    """Mesh size over height."""

    young_modulus: Annotated[Drawn, *parameter("young_modulus", "{from: 1 GPa, to: 210 GPa}")]
    """Young's modulus E."""

    poisson_ratio: Annotated[Drawn, *parameter("poisson_ratio", "{from: 0, to: 0.5}")]
    """Poisson's ratio nu."""

    force: Annotated[Drawn, *parameter("force", "{from: 1 kN, to: 20 kN}")]
    """Size of the force. The load gives the sign."""


def _power_of_two(size: int) -> int:
    if not SMALLEST_SIZE <= size <= MOST_SCENES or size & (size - 1):
        why = f"is not a power of two from {SMALLEST_SIZE} to {MOST_SCENES}, which keeps a sample even"
        raise refuse(f"'{size}' {why} and lets it be doubled; give one such as 1024")
    return size


Size = Annotated[
    int,
    AfterValidator(_power_of_two),
    WithJsonSchema({"type": "integer", "minimum": SMALLEST_SIZE}),
    Field(title="a power of two such as 1024"),
]
Seed = Annotated[int, Field(ge=0, le=2**31, title="a whole number from 0, such as 1")]
Design = Annotated[str, *one_of("design", DESIGNS)]


class SamplesConfig(Section):
    """Linear scenes with random parameters, and which parameters matter.

    Doubling `size` keeps the stored scenes.
    """

    design: Design = Field(SOBOL_INDICES)
    """`sobol-indices`: Saltelli's design for first- and total-order Sobol indices, with `size` x (varied parameters
    + 2) points; `sobol`: scrambled Sobol points."""

    size: Size
    """Number of points, or of base samples for `sobol-indices`."""

    seed: Seed = default("1")
    """Seed of the random numbers."""

    mesh_type: fields.MadeType = default("structured")
    """Generated mesh type."""

    load: Annotated[OneOrMore[fields.Load], AfterValidator(lambda names: sorted(names, key=[*LOADS].index))]
    """Loads of every scene."""

    definition: Annotated[fields.DefinitionNames, AfterValidator(lambda names: sorted(names, key=[*DEFINITIONS].index))]
    """Definitions that derive a stiffness without a reference."""

    parameters: ParametersConfig
    """Parameters."""

    @property
    def solved(self) -> list[str]:
        """Definitions whose networks are solved; uniform springs give the best stiffness."""
        return list(dict.fromkeys([*self.definition, UNIFORM_DEFINITION]))

    @property
    def drawn(self) -> dict[str, Drawn]:
        """Distribution of each given parameter."""
        return {name: one for name, one in self.parameters if one is not None}

    @property
    def drawing(self) -> dict[str, Any]:
        """Arguments of `draw` besides the base samples."""
        return {"design": self.design, "seed": self.seed, "parameters": self.drawn}

    @property
    def varied(self) -> list[str]:
        """Parameters that are not fixed."""
        return varied(self.drawn)

    @property
    def each(self) -> int:
        """Number of points of a base sample."""
        return len(roles(self.design, self.varied))

    @property
    def rows(self) -> int:
        """Number of points whose scenes are solved."""
        return self.size * self.each

    @property
    def scenes(self) -> int:
        """Number of scenes."""
        return self.rows * len(self.load) * len(self.definition)


def _check(config, problems):
    sample, where = config.samples, ("samples", "parameters")
    if not {"mesh_size", "relative_mesh_size"} & sample.drawn.keys():
        remedy = "give one such as {from: 2 mm, to: 5 mm}, or a 'relative_mesh_size'"
        problems.add(where, f"'mesh_size' is missing; {remedy}")
    elif {"mesh_size", "relative_mesh_size"} <= sample.drawn.keys():
        problems.add((*where, "relative_mesh_size"), "both this and 'mesh_size'; remove one")
    else:
        _check_sizes(sample, problems)
    if not sample.varied:
        problems.add(where, "nothing varies; give at least one parameter a range such as {from: 100 mm, to: 400 mm}")
    check_fit(problems, ("samples", "definition"), sample.definition, [sample.mesh_type], sample.load)
    most = most_scenes(problems)
    if sample.scenes > most:
        each = f"{sample.each} rows x {len(sample.load)} loads x {len(sample.definition)} definitions"
        what = f"{sample.size} points make {sample.scenes} scenes ({each} each); a sample has at most {most}"
        problems.add(("samples", "size"), f"{what}: give fewer points, loads or definitions, {MORE_SCENES_REMEDY}")


def _check_sizes(sample, problems):
    """Check mesh sizes against the smallest and the largest beam of a sample."""
    relative = "relative_mesh_size" in sample.drawn
    path = ("samples", "parameters", "relative_mesh_size" if relative else "mesh_size")
    size, length, height = (sample.drawn[one] for one in (path[-1], "length", "height"))
    largest = size["high"] * (height["high"] if relative else 1.0)
    side = length["low"] if relative else min(length["low"], height["low"])
    if largest > side:
        most = number_text(side, "m")
        remedy = "a smaller 'to', or longer beams" if relative else f"at most {most}, or a 'relative_mesh_size'"
        what = f"up to {number_text(largest, 'm')} is larger than the smallest side of a beam, {most}"
        problems.add(path, f"{what}; give {remedy}")
    smallest = size["low"] * (height["low"] if relative else 1.0)
    check_particles(problems, path, [smallest], length["high"], height["low" if relative else "high"])


def _expand(config, declared):
    drawn = config.samples.drawn
    smallest, largest = (tuple(drawn[name][end] for name in ("length", "height")) for end in ("low", "high"))
    warn_of_body((*smallest, *largest), drawn["thickness"]["high"], "samples")
    return config.samples


def _summary(sample):
    counts = sample.size, sample.each, len(sample.load), len(sample.definition)
    named = zip(counts, ("base samples", "rows", "loads", "definitions"))
    of = " x ".join(f"{count} {what}" for count, what in named if count > 1)
    return [["samples", sample.scenes, f"scenes, {of}, design '{sample.design}': {', '.join(sample.varied)}"]]


def reference_box(sample):
    """Range of aspect ratios, and of Poisson's ratios."""
    length, height, ratio = (sample.drawn[name] for name in ("length", "height", "poisson_ratio"))
    return [length["low"] / height["high"], length["high"] / height["low"]], [ratio["low"], ratio["high"]]


def reference_key(sample, kind):
    """Key of the interpolated references of a kind of load."""
    other = *REFERENCES_OF_SHAPES, "reference.finite_strain", "studies.kinds.samples"
    return hash_of(kind.name, reference_box(sample), stage_key(INTERPOLATE, without=other))


def block_key(sample, first, last):
    """Key of the parameters of some base samples; it names the file of their results."""
    return hash_of(sample.design, sample.seed, sample.drawn, first, last, stage_key("studies.kinds.samples"))


@cache
def _code_of_networks(mesh_type, definition):
    return hash_of(stage_key(SOLVE), mesh_type_key(mesh_type), definition_key(definition))


def result_key(sample, load, definition):
    """Key of the scenes of a load and definition in the file of a block."""
    return hash_of(LOADS[load].kind.name, sample.mesh_type, _code_of_networks(sample.mesh_type, definition))


def _reference_tasks(study):
    """Yield the task of the references of each kind of load."""
    sample = study.parts["samples"]
    box, few = reference_box(sample), sample.rows <= MOST_SOLVED_ROWS
    drawn = sample.drawing | {"first": 0, "last": sample.size} if few else None
    for kind in dict.fromkeys(LOADS[name].kind for name in sample.load):
        key, values = reference_key(sample, kind), {"kind": kind.name, "box": box}
        yield Task(values, seconds=1.0, name=kind.name, file=key, key=key, shared={"sample": drawn})


def _block_tasks(study):
    """Yield a task for each block of base samples; half the size has the first of them."""
    sample = study.parts["samples"]
    scenes = {
        result_key(sample, load, definition): {"kind": LOADS[load].kind.name, "definition": definition}
        for load in sample.load
        for definition in sample.solved
    }
    shared = sample.drawing | {"mesh_type": sample.mesh_type, "results": scenes}
    shared["meshed"] = hash_of(sample.mesh_type, stage_key(SOLVE), mesh_type_key(sample.mesh_type))
    for first, last in blocks(sample.design, sample.size):
        key, seconds = block_key(sample, first, last), 6e-4 * (last - first) * sample.each * len(scenes)
        values = {"first": first, "last": last}
        yield Task(values, seconds=seconds, name=f"{first}-{last}", file=key, key=key, shared=shared)


def _lack(study):
    design = getattr(study.parts["samples"], "design", SOBOL_INDICES)
    lack = f"shows Sobol indices, which the design '{design}' lacks; give design: {SOBOL_INDICES}"
    return "" if design == SOBOL_INDICES else lack


def _figures(study):
    sample = study.parts["samples"]
    return {stem("sobol", {"load": load}): {"load": load} for load in sample.load} if sample else {}


PLOTS = "studies.kinds.samples.figures"

KIND = StudyKind(
    "samples",
    study_fields={"samples": optional(SamplesConfig, "Sampled scenes: groups `/samples` and `/sobol`.")},
    check=_check,
    expand=_expand,
    axes=lambda sample: {"load": set(sample.load), "definition": set(sample.definition)},
    summary=_summary,
    stages=(
        Stage("interpolate", INTERPOLATE, _reference_tasks, folder="samples"),
        Stage("sample", SOLVE, _block_tasks, folder="samples"),
    ),
    outputs=(Output("sobol", "Sobol indices", _figures, plot=f"{PLOTS}:sobol", shows="sampled scenes", lack=_lack),),
    tables=lambda study: ["sobol"] if study.parts["samples"] and not _lack(study) else [],
)

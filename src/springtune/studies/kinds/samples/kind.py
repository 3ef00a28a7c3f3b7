"""Samples: a study's section ``samples``."""

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field

from springtune.mesh import MESH_TYPES
from springtune.mesh.types import MOST_MESHED
from springtune.problem.geometry import warn_of_thickness
from springtune.problem.loads import LOADS
from springtune.problem.parameters import MOST_SCENES
from springtune.springs import DEFINITIONS

from ...config.checks import MORE_SCENES, most_scenes
from ...config.fields import DefinitionName, Flag, Kinematics, Load, OneOrMore, Scalar, number, one_of
from ...config.kind import Kind
from ...config.messages import refuse, show
from ...config.sections import Section
from .designs import DESIGNS, PARAMETERS, SMALLEST_SIZE, SOBOL_INDICES, roles, varied
from .distributions import Distributed
from .outputs import OUTPUTS
from .plan import STAGES, pieces, take

DROP = "drop"

FAILURES = (DROP, "withhold")
"""What becomes of indices where scenes have no value."""

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
    thickness: Annotated[Drawn, Distributed("thickness", "{from: 1 mm, to: 2 mm}")] = Field(
        "1 mm", validate_default=True, description="Extent out of the plane."
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
FailurePolicy = Annotated[str, one_of("policy", FAILURES)]


class SamplesConfig(Section):
    """Scenes whose parameters are drawn from distributions, and which of these parameters matter.

    A sample of twice the size keeps its scenes and adds as many. Stored scenes are not solved again.
    """

    design: Design = Field(
        SOBOL_INDICES,
        validate_default=True,
        description="`sobol-indices`: Saltelli's design for first- and total-order Sobol indices, with `size` x "
        "(varied parameters + 2) points; `sobol`: scrambled Sobol points; `latin-hypercube`.",
    )
    size: Size = Field(description="Number of points: a power of two. For `sobol-indices`, of base samples.")
    seed: Seed = Field("1", validate_default=True, description="Seed of the random numbers.")
    mesh_type: MadeType = Field("structured", validate_default=True, description="Generated mesh type.")
    load: Annotated[list[Load], OneOrMore()] = Field(description="Loads; each acts on every point's scene.")
    definition: Annotated[list[DefinitionName], OneOrMore()] = Field(
        description="Definitions that need no reference and no stated stiffness."
    )
    kinematics: Kinematics = Field(
        "linear",
        validate_default=True,
        description="`linear` solves scenes once that differ in thickness, Young's modulus and force alone; "
        "`nonlinear` solves each scene, which takes some ten times as long.",
    )
    best_stiffness: Flag = Field(
        "true",
        validate_default=True,
        description="Whether to find the uniform stiffness without an error, too; with linear kinematics only.",
    )
    failures: FailurePolicy = Field(
        DROP,
        validate_default=True,
        description="If scenes have no value, `drop` leaves their whole base samples out of indices, and `withhold` "
        "gives no indices. Both count them.",
    )
    parameters: ParametersConfig = Field(description="Parameters of the scenes.")


@dataclass(frozen=True)
class Sample:
    """What a study samples; `blocks` are the tasks of a part of a study, and empty for a whole study."""

    design: str
    size: int
    seed: int
    mesh_type: str
    loads: tuple[str, ...]
    definitions: tuple[str, ...]
    kinematics: str
    best_stiffness: bool
    failures: str
    parameters: dict[str, dict[str, Any]]
    blocks: tuple[tuple[int, int], ...] = ()

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
    if not section:
        return
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
    corners = MESH_TYPES[section.mesh_type].corners
    able = [name for name, one in DEFINITIONS.items() if not one.needs and corners in one.cells]
    for name in section.definition:
        if name not in able:
            problems.add(
                ("samples", "definition"),
                f"'{name}' needs a reference, a stated stiffness or other cells than those of {section.mesh_type} "
                f"meshes; choose of {', '.join(able)}",
            )
        elif DEFINITIONS[name].uniaxial:
            for load in (load for load in section.load if not LOADS[load].kind.uniaxial):
                problems.add(
                    ("samples", "definition"),
                    f"'{name}' is for loads that stretch a beam along its length, and '{load}' does not; remove one",
                )


def _check_sizes(sample, problems):
    """Check mesh sizes against the smallest and the largest beam of a sample."""
    name = "relative_mesh_size" if "relative_mesh_size" in sample.parameters else "mesh_size"
    path, relative = ("samples", "parameters", name), name == "relative_mesh_size"
    size, length, height = (sample.parameters[one] for one in (name, "length", "height"))
    if relative:
        largest = size["high"] * height["high"]
        if largest > length["low"]:
            problems.add(path, f"{size['high']:g} of a height of {_mm(height['high'])} is {_mm(largest)}, larger than "
                         f"a length of {_mm(length['low'])}; give a smaller 'to', or longer beams")  # fmt: skip
    else:
        largest, side = size["high"], min(length["low"], height["low"])
        if largest > side:
            problems.add(path, f"up to {_mm(largest)} is larger than the smallest side of a beam, {_mm(side)}; give at "
                         f"most {_mm(side)}, or a 'relative_mesh_size'")  # fmt: skip
    box = length["high"], height["low" if relative else "high"]
    smallest = size["low"] * (height["low"] if relative else 1.0)
    particles = MESH_TYPES[sample.mesh_type].particles(*box, smallest) if smallest**2 else float("inf")
    if particles > MOST_MESHED:
        low, beam = f"{size['low']:g}" if relative else _mm(size["low"]), f"{_mm(box[0])} x {_mm(box[1])}"
        most = f"more than {MOST_MESHED:.0e}"
        problems.add(path, f"{low} makes {particles:.0e} particles of a beam {beam}, {most}; give a larger 'from'")


def _mm(length: float) -> str:
    return f"{1e3 * length:g} mm"


def _sample(section):
    given = {name: getattr(section.parameters, name) for name in PARAMETERS}
    same = ("design", "size", "seed", "mesh_type", "kinematics", "failures")
    return Sample(
        **{name: getattr(section, name) for name in same},
        loads=tuple(name for name in LOADS if name in section.load),
        definitions=tuple(name for name in DEFINITIONS if name in section.definition),
        best_stiffness=section.best_stiffness and section.kinematics == "linear",
        parameters={name: one for name, one in given.items() if one is not None},
    )


def _expand(config, declared):
    if not config.samples:
        return None
    sample = _sample(config.samples)
    smallest = tuple(sample.parameters[name]["low"] for name in ("length", "height"))
    warn_of_thickness(sample.parameters["thickness"]["high"], smallest, "samples")
    return sample


def _summary(sample):
    design = {SOBOL_INDICES: "for Sobol indices", "sobol": "Sobol points"}.get(sample.design, "Latin hypercube")
    each = f"{sample.size} x {sample.rows // sample.size} points" if sample.design == SOBOL_INDICES else "points"
    times = [f"{len(names)} {what}s" for names, what in ((sample.loads, "load"), (sample.definitions, "definition"))
             if len(names) > 1]  # fmt: skip
    return [["samples", sample.scenes, f"scenes, {' x '.join([each, *times])}, {design}: {', '.join(sample.varied)}"]]


def _tables(study):
    sample = study.parts["samples"]
    return ["sobol"] if sample and sample.design == SOBOL_INDICES else []


KIND = Kind(
    "samples",
    study_fields={
        "samples": (
            SamplesConfig | None,
            Field(None, description="Sampled scenes; they make the groups `/samples`, `/effects` and `/sobol`."),
        )
    },
    check=_check,
    expand=_expand,
    axes=lambda sample: {"load": set(sample.loads), "definition": set(sample.definitions)},
    summary=_summary,
    stages=STAGES,
    outputs=OUTPUTS,
    pieces=pieces,
    take=take,
    tables=_tables,
    costs={"sampled": (0.05, 6e-4)},
)

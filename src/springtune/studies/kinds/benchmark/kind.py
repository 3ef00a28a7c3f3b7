"""Run time against error: a study's section ``benchmark``."""

from dataclasses import asdict, dataclass
from math import nan
from typing import Annotated

from pydantic import Field

from springtune.mechanics.integrators import PRECISIONS
from springtune.mesh.types import MESH_TYPES
from springtune.problem.geometry import Beam
from springtune.problem.loads import LOADS
from springtune.problem.materials import Material
from springtune.problem.quantities import nearest
from springtune.reference.calculix import program
from springtune.springs.base import DEFINITIONS

from ...config import fields
from ...config.checks import check_able, check_known, check_particles, check_product, check_scene
from ...config.fields import Named, OneOrMore, Section, default, number, one_of, optional
from ...config.kind import Kind
from ...runs.keys import beam_key, definition_key, material_key, mesh_type_key
from ...runs.stages import Task, stage
from . import OTHER_APPROACHES, THREAD_COUNTS, approach_names
from .outputs import OUTPUTS

MOST_RUNS = 100_000
"""Most combinations of scenes, approaches and mesh sizes that a benchmark measures."""

OtherApproach = Annotated[str, one_of("approach", OTHER_APPROACHES)]
Seconds = Annotated[float, number("a number of seconds above 0, such as 0.5", 0, 3600, above=True)]


class BenchmarkSceneConfig(Section):
    """A scene of the benchmark."""

    beam: fields.BeamName
    """Beam."""

    material: fields.MaterialName
    """Material, with a density."""

    load: fields.Load
    """`traction`, `compression`, `bending` or `pressure`."""

    force: fields.Force
    """Magnitude of the force."""


class BenchmarkConfig(Section):
    """Run time against error: every definition on every mesh type, and other approaches; one at a time."""

    scenes: Annotated[dict[str, BenchmarkSceneConfig], Named("scene")]
    """Scenes."""

    definition: fields.DefinitionNames
    """Definitions that derive a stiffness and need no reference."""

    mesh_type: Annotated[list[fields.MeshType], OneOrMore()]
    """Mesh types of the definitions."""

    approach: Annotated[list[OtherApproach], OneOrMore()] = Field(list(OTHER_APPROACHES))
    """Other approaches: finite elements, CalculiX where it is on the machine, and what the paper names:
    tensor-mass, pre-computed responses, boundary elements, free-form deformation. All without."""

    mesh_size: Annotated[list[fields.Length], OneOrMore()]
    """Lengths of an edge."""

    finest: fields.Length | None = None
    """The shortest of them that most approaches have; all without."""

    finest_of: dict[str, fields.Length] = Field(default_factory=dict)
    """The shortest of them that an approach has, by its name, such as `delingette/structured: 0.5 mm`."""

    most_seconds: Seconds = default("30")
    """Seconds after which an approach is not run on finer sizes, which are holes that say so."""


@dataclass(frozen=True)
class Case:
    """A scene of the benchmark; sizes are edges [m], ``finest`` has one for each approach, tension is positive [N]."""

    name: str
    beam: Beam
    material: Material
    load: str
    force: float
    approaches: tuple[str, ...]
    mesh_sizes: tuple[float, ...]
    finest: tuple[float, ...]
    most_seconds: float


def in_benchmark(load: str) -> bool:
    """Whether all approaches of the benchmark can hold and pull a beam like that."""
    kind = LOADS[load].kind
    return kind.clamped and kind.loaded.far and not LOADS[load].follower


def _check(config, problems):
    if not config.benchmark:
        return
    section = config.benchmark
    labels = ("scenes", "definition", "mesh_type", "approach", "mesh_size")
    check_product(problems, section, ("benchmark",), labels, MOST_RUNS)
    for beam in dict.fromkeys(scene.beam for scene in section.scenes.values()):
        if beam in config.beams:
            extent, largest = (config.beams[beam].length, config.beams[beam].height), max(section.mesh_size)
            check_particles(problems, ("benchmark", "mesh_size"), section.mesh_size, *extent)
            if largest > min(extent) / 2:
                message = f"{1e3 * largest:g} mm is too large for '{beam}'; give at most {500 * min(extent):g} mm"
                problems.add(("benchmark", "mesh_size"), message)
    for name, scene in section.scenes.items():
        place = ("benchmark", "scenes", name)
        check_scene(problems, place, scene, config, in_benchmark, "is no load of the benchmark")
    check_able(problems, ("benchmark", "definition"), section.definition, "needs more than mesh and material;")
    for name in section.mesh_type:
        check_known(problems, ("benchmark", "mesh_type"), "mesh type", name, MESH_TYPES, None)
    approaches = approach_names(section.definition, section.mesh_type, section.approach)
    for name in section.finest_of:
        if name not in approaches:
            message = f"'{name}' is no approach of this benchmark; {nearest(name, approaches)}"
            problems.add(("benchmark", "finest_of", name), message)
    given = {("finest",): section.finest} | {("finest_of", name): size for name, size in section.finest_of.items()}
    for place, size in given.items():
        if size is not None and size not in section.mesh_size:
            known = ", ".join(f"{1e3 * one:g} mm" for one in sorted(section.mesh_size))
            problems.add(
                ("benchmark", *place), f"{1e3 * size:g} mm is no mesh size of this benchmark; choose of {known}"
            )


def _expand(config, declared):
    section = config.benchmark
    if not section:
        return ()
    mesh_types = [name for name in MESH_TYPES if name in section.mesh_type]
    definitions = [name for name in DEFINITIONS if name in section.definition]
    others = [name for name in OTHER_APPROACHES if name in section.approach]
    approaches = approach_names(definitions, mesh_types, others)
    finest = section.finest or min(section.mesh_size)
    return tuple(
        Case(
            name,
            declared.beams[scene.beam],
            declared.materials[scene.material],
            scene.load,
            LOADS[scene.load].sign * scene.force,
            approaches,
            tuple(sorted(section.mesh_size)),
            tuple(section.finest_of.get(name, finest) for name in approaches),
            section.most_seconds,
        )
        for name, scene in section.scenes.items()
    )


def _axes(cases):
    return {
        "mesh_size": {size for one in cases for size in one.mesh_sizes},
        "scene": tuple(one.name for one in cases),
        "approach": cases[0].approaches,
        "thread_count": THREAD_COUNTS,
        "precision": PRECISIONS,
    }


def _tasks(study):
    """Scenes; explicit steps are timed on the first one."""
    for place, case in enumerate(study.parts["benchmark"]):
        values = asdict(case) | {"beam": beam_key(case.beam), "material": material_key(case.material, density=True)}
        del values["name"]
        values["explicit"] = place == 0
        yield Task(values, _code(case), {"scene": case.name}, case, name=case.name)


def _code(case):
    """Keys of what a scene is measured with."""
    pairs = [approach.split("/") for approach in case.approaches if "/" in approach]
    definitions, mesh_types = ({pair[place] for pair in pairs} for place in (0, 1))
    # What the approaches do not name is solved and timed on these.
    definitions, mesh_types = definitions | {"delingette", "lattice"}, mesh_types | {"structured"}
    springs = [definition_key(name) for name in sorted(definitions)]
    meshes = [mesh_type_key(name) for name in sorted(mesh_types)]
    return springs, meshes, program() if any(name.startswith("calculix") for name in case.approaches) else ""


CASE = ("scene", "approach", "mesh_size")
STEPS = ("mesh_size", "thread_count", "precision")

VARIABLES = {
    "displacement": (CASE, "m", "displacement of the loaded side along the force", nan),
    "error": (CASE, "1", "signed error of the displacement, over the reference's", nan),
    "assured_error": (CASE, "1", "largest absolute error of this and all finer mesh sizes that were run", nan),
    "seconds": (CASE, "s", "time from nothing to the displacement, median of warm runs", nan),
    "meshing_seconds": (CASE, "s", "time to make the mesh", nan),
    "assembling_seconds": (CASE, "s", "time to derive parameters and assemble", nan),
    "factorizing_seconds": (CASE, "s", "time to factorize, or of what is paid once", nan),
    "solving_seconds": (CASE, "s", "time to solve", nan),
    "unknowns": (CASE, "1", "number of unknowns", nan),
    "status": (CASE, "1", "what became of the case", 0),
    "message": (CASE, "1", "why there are no numbers", ""),
    "reference_displacement": (("scene",), "m", "displacement of the converged reference", nan),
    "reference_error_estimate": (("scene",), "1", "estimated relative error of the reference", nan),
    "reference_seconds": (("scene",), "s", "time of the reference", nan),
    "spring_updates": (STEPS, "s-1", "nonlinear springs a second that explicit steps advance, each counted anew", nan),
}

KIND = Kind(
    "benchmark",
    study_fields={"benchmark": optional(BenchmarkConfig, "Run time against error; it makes the group `/benchmark`.")},
    check=_check,
    expand=_expand,
    axes=_axes,
    summary=lambda part: [["benchmark", len(part), "cases, timed one by one"]],
    variables=VARIABLES,
    dimensions={
        "scene": "scene of the benchmark",
        "approach": "definition / mesh type, or another approach",
        "thread_count": "number of threads of explicit steps",
        "precision": "floating-point numbers of explicit steps",
    },
    stages=(stage("benchmark", "studies.kinds.benchmark.solve", "Timing approaches", _tasks, alone=True),),
    outputs=OUTPUTS,
)

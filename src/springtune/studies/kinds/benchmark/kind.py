"""Run time against error: a study's section ``benchmark``."""

from typing import Annotated

from pydantic import Field

from springtune.mechanics import PRECISIONS
from springtune.mesh.cells import MESH_TYPES
from springtune.problem.loads import LOADS
from springtune.problem.quantities import nearest
from springtune.reference.calculix import program
from springtune.springs.base import DEFINITIONS

from ...config import fields
from ...config.checks import check_fit, check_particles, check_product, check_scene
from ...config.fields import Named, OneOrMore, Section, default, one_of, optional
from ...config.model import Output, Stage, StudyKind, declared
from ...runs.keys import beam_key, definition_key, material_key, mesh_type_key
from ...runs.plan import Task
from . import OTHER_APPROACHES, THREAD_COUNTS, approach_names

MOST_RUNS = 100_000  # most combinations of scenes, approaches and mesh sizes

OtherApproach = Annotated[str, *one_of("approach", OTHER_APPROACHES)]
Seconds = Annotated[float, Field(gt=0, le=3600, title="a number of seconds above 0, such as 0.5")]


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
    """Run time against error of definitions and other approaches, measured one at a time."""

    scenes: Named[BenchmarkSceneConfig] = Field(title="a section for each scene, by name")
    """Scenes."""

    definition: fields.DefinitionNames
    """Definitions that derive a stiffness without a reference."""

    mesh_type: OneOrMore[fields.MadeType]
    """Mesh types."""

    approach: OneOrMore[OtherApproach] = Field(list(OTHER_APPROACHES))
    """Finite elements, CalculiX if installed, tensor-mass, pre-computed responses, boundary elements, free-form
    deformation. All by default."""

    mesh_size: OneOrMore[fields.Length]
    """Lengths of edges."""

    finest: fields.Length | None = None
    """Smallest mesh size of all approaches."""

    finest_of: dict[str, fields.Length] = Field(default_factory=dict)
    """Smallest mesh size of one approach, such as `delingette/structured: 0.5 mm`."""

    most_seconds: Seconds = default("30")
    """An approach that took longer skips finer sizes."""


def in_benchmark(load: str) -> bool:
    """Return whether every approach of the benchmark supports a load."""
    kind = LOADS[load].kind
    return kind.clamped and kind.loaded.far and not LOADS[load].follower


def _check(config, problems):
    section = config.benchmark
    check_product(
        problems, section, ("benchmark",), ("scenes", "definition", "mesh_type", "approach", "mesh_size"), MOST_RUNS
    )
    for beam in dict.fromkeys(scene.beam for scene in section.scenes.values()):
        extent, largest = (config.beams[beam].length, config.beams[beam].height), max(section.mesh_size)
        check_particles(problems, ("benchmark", "mesh_size"), section.mesh_size, *extent)
        if largest > min(extent) / 2:
            message = f"{1e3 * largest:g} mm is too large for '{beam}'; give at most {500 * min(extent):g} mm"
            problems.add(("benchmark", "mesh_size"), message)
    for name, scene in section.scenes.items():
        place = ("benchmark", "scenes", name)
        check_scene(problems, place, scene, config, in_benchmark, "is no load of the benchmark")
    check_fit(problems, ("benchmark", "definition"), section.definition)
    approaches = approach_names(section.definition, section.mesh_type, section.approach)
    for name in section.finest_of:
        if name not in approaches:
            message = f"'{name}' is no approach of this benchmark; {nearest(name, approaches)}"
            problems.add(("benchmark", "finest_of", name), message)


def _expand(config, declared):
    """Values of each scene by name; explicit steps are timed on the first scene."""
    section = config.benchmark
    mesh_types = [name for name in MESH_TYPES if name in section.mesh_type]
    definitions = [name for name in DEFINITIONS if name in section.definition]
    others = [name for name in OTHER_APPROACHES if name in section.approach]
    approaches, finest = approach_names(definitions, mesh_types, others), section.finest or min(section.mesh_size)
    shared = {"approaches": approaches, "mesh_sizes": sorted(section.mesh_size), "most_seconds": section.most_seconds}
    shared["finest"] = [section.finest_of.get(name, finest) for name in approaches]
    return {
        name: {
            **shared,
            "beam": beam_key(declared.beams[scene.beam]),
            "material": material_key(declared.materials[scene.material], density=True),
            "load": scene.load,
            "force": LOADS[scene.load].sign * scene.force,
            "explicit": name == next(iter(section.scenes)),
        }
        for name, scene in section.scenes.items()
    }


def _axes(scenes):
    first = next(iter(scenes.values()))
    axes = {"mesh_size": set(first["mesh_sizes"]), "scene": tuple(scenes), "approach": first["approaches"]}
    return axes | {"thread_count": THREAD_COUNTS, "precision": PRECISIONS}


def _tasks(study):
    for name, values in study.parts["benchmark"].items():
        approaches = values["approaches"]
        pairs = [approach.split("/") for approach in approaches if "/" in approach]
        # What the approaches do not name is solved and timed on these.
        definitions, mesh_types = zip(("delingette", "structured"), ("lattice", "structured"), *pairs)
        springs, meshes = map(definition_key, sorted({*definitions})), map(mesh_type_key, sorted({*mesh_types}))
        other = program() if any(name.startswith("calculix") for name in approaches) else ""
        yield Task(values, ([*springs], [*meshes], other), {"scene": name}, name=name)


def _figures(study):
    return {f"benchmark_{scene}": {"scene": scene} for scene in study.parts["benchmark"]}


PLOTS = "studies.kinds.benchmark.figures"

KIND = StudyKind(
    "benchmark",
    study_fields={"benchmark": optional(BenchmarkConfig, "Run time against error: group `/benchmark`.")},
    check=_check,
    expand=_expand,
    axes=_axes,
    summary=lambda part: [["benchmark", len(part), "cases, timed one by one"]],
    **declared(__file__),
    stages=(Stage("benchmark", "studies.kinds.benchmark.solve", _tasks, timed=True),),
    outputs=(Output("benchmark", "run time against error", _figures, plot=f"{PLOTS}:benchmark", shows="a benchmark"),),
    tables=lambda study: ["benchmark", "explicit_steps"] if study.parts["benchmark"] else [],
)

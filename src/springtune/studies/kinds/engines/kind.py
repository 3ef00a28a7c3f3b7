"""Scenes in engines: every combination of the values of a study's section ``engines``."""

from itertools import product
from typing import Annotated, Any, NamedTuple

from pydantic import Field

from springtune.mechanics import PRECISIONS
from springtune.mesh.cells import MESH_TYPES
from springtune.problem.loads import LOADS
from springtune.problem.quantities import nearest
from springtune.registry import import_name
from springtune.safe_io import number_text
from springtune.springs.base import DEFINITIONS

from ...config import checks, fields
from ...config.fields import OneOrMore, Section, default, one_of, optional
from ...config.model import Output, Stage, StudyKind
from ...runs.keys import beam_key, declared_key, definition_key, distribution, material_key, mesh_type_key, version_of
from ...runs.plan import Task
from . import SETTING

MOST_ENGINE_RUNS = 10_000  # most combinations of one set of runs; each takes at least a tenth of a second

RUN_KEYS = ("definition", "engine", *SETTING, "stiffness_factor")
"""Keys of a set of runs that list values, besides scenes."""

OWN_PRECISION = "own"  # precision that stands for the first one of an engine


Count = Annotated[int, Field(ge=1, le=100_000, title="a whole number from 1 to 100000, such as 10")]
Distance = Annotated[float, Field(gt=0, le=0.01, title="a number up to 0.01, such as 0.0001")]
EngineName = Annotated[str, Field(title="an engine such as 'xpbd'", examples=["xpbd"])]
FrameTime = Annotated[float, *fields.quantity("time")]
Precision = Annotated[str, *one_of("precision", (OWN_PRECISION, *PRECISIONS))]
SceneName = Annotated[str, Field(title="the name of a scene")]


class EngineSceneConfig(Section):
    """A scene that is run in engines."""

    beam: fields.BeamName
    """Beam."""

    mesh_type: fields.MadeType = default("right")
    """Generated mesh type."""

    mesh_size: fields.Length
    """Length of an edge."""

    material: fields.MaterialName
    """Material, with a density."""

    load: fields.Load
    """Load whose forces keep their direction."""

    force: fields.Force
    """Magnitude of the force."""


class EngineRunsConfig(Section):
    """Every combination of the values, as in a grid."""

    scene: OneOrMore[SceneName] | None = None
    """Scenes; all by default."""

    definition: fields.DefinitionNames
    """Definitions that need no reference. Cells of unsupported energies stay empty, with a reason."""

    engine: OneOrMore[EngineName]
    """Keys of `springtune.ENGINES`. Cells of engines that are not installed stay empty."""

    iterations: OneOrMore[Count] = default("10")
    """Solver iterations per step."""

    substeps: OneOrMore[Count] = default("1")
    """Steps per frame."""

    dt: OneOrMore[FrameTime] = default("1/60 s")
    """Time per frame."""

    precision: OneOrMore[Precision] = default(OWN_PRECISION)
    """`own` is the engine's default."""

    stiffness_factor: fields.Ratios = default("1")
    """Factors on the typed stiffness; several give a sensitivity curve."""


class EnginesConfig(Section):
    """Scenes in simulation engines, at chosen settings."""

    scenes: fields.Named[EngineSceneConfig] = Field(title="a section for each scene, by name")
    """Scenes."""

    runs: dict[str, EngineRunsConfig] = Field(min_length=1, title="a section for each set of runs, by name")
    """Sets of runs."""

    frames: Count | None = None
    """Most frames of a run; by default as many as it needs."""

    tolerance: Distance | None = None
    """A run ends at this relative distance from rest; by default 1e-7, in single precision 1e-4."""


class EngineRun(NamedTuple):
    """A run of a scene in an engine: labels and values; runs `of_curve` have stiffness factors."""

    labels: dict[str, str | float]
    of_curve: bool
    values: dict[str, Any]


def _engines():
    """Engines by name, imported late: datasets of other studies must not depend on their modules."""
    return import_name("engines.base:ENGINES")


def _check(config, problems):
    section = config.engines
    for name, scene in section.scenes.items():
        place, why = ("engines", "scenes", name), "turns with its side, and forces in engines do not"
        checks.check_scene(problems, place, scene, config, lambda load: not LOADS[load].follower, why)
        beam, size = config.beams[scene.beam], scene.mesh_size
        if refusal := MESH_TYPES[scene.mesh_type].refusal(beam.length, beam.height, size, f"beam '{scene.beam}'"):
            problems.add((*place, "mesh_size"), f"{number_text(size, 'm')} {refusal}")
    for name, runs in section.runs.items():
        place = "engines", "runs", name
        for engine in runs.engine:
            if engine not in _engines():
                problems.add((*place, "engine"), f"unknown engine '{engine}'; {nearest(engine, _engines())}")
        try:
            import_name("engines.base:Setting")(max(runs.dt))
        except ValueError as error:
            problems.add((*place, "dt"), str(error).removeprefix("dt: "))
        for one in runs.scene or section.scenes:
            if one not in section.scenes:
                known = nearest(one, section.scenes)
                problems.add((*place, "scene"), f"unknown scene '{one}'; {known}; or declare it under engines.scenes")
                continue
            scene = section.scenes[one]
            checks.check_fit(problems, (*place, "definition"), runs.definition, [scene.mesh_type], [scene.load])
        checks.check_product(problems, runs, place, RUN_KEYS, MOST_ENGINE_RUNS)
    lists = {name: {value for runs in section.runs.values() for value in getattr(runs, name)} for name in RUN_KEYS}
    lists["scene"] = {*section.scenes}
    checks.check_count(problems, ("engines", "runs"), lists, checks.MOST_CELLS, "cells of all labels together")


def _expand(config, declared):
    section, engines, found = config.engines, _engines(), {}
    orders = [list(one) for one in (section.scenes, DEFINITIONS, engines)]
    for runs in section.runs.values():
        names = product(runs.scene or section.scenes, runs.definition, runs.engine)
        settings = product(runs.precision, runs.dt, runs.substeps, runs.iterations, runs.stiffness_factor)
        for of, (precision, dt, substeps, iterations, factor) in product(names, settings):
            stated, engine, of_curve = section.scenes[of[0]], engines[of[-1]], runs.stiffness_factor != [1.0]
            precision = engine.precisions[0] if precision == OWN_PRECISION else precision
            how = precision, dt, substeps, iterations if engine.iterates else 1, factor
            labels = dict(zip(("scene", *RUN_KEYS), (*of, *how)))
            material = material_key(declared.materials[stated.material], density=True)
            values = labels | dict(stated) | {"beam": beam_key(declared.beams[stated.beam]), "material": material}
            values |= {"frames": section.frames, "tolerance": section.tolerance}
            labels |= {f"scene_{name}": value for name, value in stated} | {"program": engine.program}
            place = *(order.index(name) for order, name in zip(orders, of)), *how, of_curve
            found[place] = EngineRun(labels, of_curve, values)
    return tuple(found[place] for place in sorted(found))


def _summary(runs):
    engines = dict.fromkeys(run.labels["engine"] for run in runs)
    absent = [name for name in engines if _engines()[name].absent]
    missing = f"; not installed: {', '.join(absent)}" if absent else ""
    return [["engines", len(runs), f"runs in {', '.join(engines)}{missing}"]]


def _tasks(study):
    """Tasks of all runs; those of one engine share a job, because their seconds are measured."""
    for run in study.parts["engines"]:
        engine = _engines()[run.labels["engine"]]
        values = {name: value for name, value in run.values.items() if name != "scene"}
        code = mesh_type_key(values["mesh_type"]), definition_key(values["definition"]), declared_key(engine)
        needs = (distribution(need.partition(">=")[0]) for need in engine.needs)
        values["engine_version"] = ", ".join(f"{name} {version_of(name)}" for name in needs)  # a new one runs again
        yield Task(values, code, run.labels, name=engine.name)


STAGE = Stage("engines", "studies.kinds.engines.solve", _tasks, timed=True)


def _figures(study):
    shown = [("curves" if run.of_curve else "errors", run.labels["scene"]) for run in study.parts["engines"]]
    return {f"engines_{name}_{scene}": {"scene": scene} for name, scene in shown}


KIND = StudyKind(
    "engines",
    study_fields={"engines": optional(EnginesConfig, "Scenes in engines: groups `/engines` and `/engine_curves`.")},
    check=_check,
    expand=_expand,
    axes=lambda runs: {"definition": {run.labels["definition"] for run in runs}},
    summary=_summary,
    stages=(STAGE,),
    outputs=(
        Output(
            "engines",
            "errors over frame time and sensitivity curves in engines",
            _figures,
            plot="studies.kinds.engines.figures:engines",
            shows="scenes in engines",
        ),
    ),
    tables=lambda study: ["engines"] if study.parts["engines"] else [],
)

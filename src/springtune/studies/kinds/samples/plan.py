"""Stages of samples, and the keys of what they store."""

from dataclasses import replace
from functools import cache

from springtune.problem.loads import LOADS

from ...runs.checked_json import hash_of
from ...runs.keys import definition_key, mesh_type_key, stage_key
from ...runs.stages import Task, stage
from ..scenes.interpolated import expected_solves
from .designs import blocks

MOST_SOLVED = 1024
"""Most rows of a sample whose references are solved one by one where they cannot be interpolated."""

UNIFORM = "uniform"
"""Definition whose networks give the best uniform stiffness."""

SOLVE, INTERPOLATE = "studies.kinds.samples.solve", "studies.kinds.samples.interpolate"


def definitions(sample):
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
    if not sample:
        return
    drawn, box = None, reference_box(sample)
    if sample.rows <= MOST_SOLVED:
        drawn = {"design": sample.design, "seed": sample.seed, "parameters": sample.parameters}
        drawn |= {"first": 0, "last": sample.size}
    for kind in dict.fromkeys(LOADS[name].kind for name in sample.loads):
        key, costs = reference_key(sample, kind), [("interpolant", expected_solves(box))]
        values = {"kind": kind.name, "box": box}
        yield Task(values, costs=costs, name=kind.name, file=key, key=key, shared={"sample": drawn})


def _blocks(study):
    """Tasks of some base samples each; those of a sample of half the size are the first of them."""
    sample = study.parts["samples"]
    if not sample:
        return
    scenes = {
        result_key(sample, load, definition): _load_of(sample, load) | {"definition": definition}
        for load in sample.loads
        for definition in definitions(sample)
    }
    shared = {
        **{name: getattr(sample, name) for name in ("design", "seed", "parameters", "mesh_type", "kinematics")},
        "meshed": hash_of(stage_key(SOLVE), mesh_type_key(sample.mesh_type)),
        "results": scenes,
    }
    for first, last in _drawn(sample):
        key, costs = block_key(sample, first, last), [("sampled", (last - first) * _scenes_each(sample))]
        values = {"first": first, "last": last}
        yield Task(values, costs=costs, name=f"{first}-{last}", file=key, key=key, shared=shared)


def _drawn(sample):
    """First and last base sample of each task: of the whole sample, or of the part that a study asks for."""
    return sample.blocks or blocks(sample.design, sample.size)


def _scenes_each(sample):
    """Number of networks of a base sample."""
    return sample.rows // sample.size * len(sample.loads) * len(definitions(sample))


def pieces(study, costs, division):
    """Seconds of each piece of a sample: of a task's base samples, or of all."""
    sample = study.parts["samples"]
    seconds = {ends: costs.of("sampled", (ends[1] - ends[0]) * _scenes_each(sample)) for ends in _drawn(sample)}
    return division.of_section(seconds)


def take(study, names):
    """The study with some of its pieces alone. What is estimated from all rows is left to the whole sample."""
    sample, wanted = study.parts["samples"], set(names)
    kept = tuple(ends for ends in _drawn(sample) if ends in wanted)
    return replace(study, parts=study.parts | {"samples": replace(sample, blocks=kept) if kept else ()})


STAGES = (
    stage("interpolate", INTERPOLATE, "Interpolating the references of samples", _references, folder="samples"),
    stage("sample", SOLVE, "Solving the networks of samples", _blocks, folder="samples"),
)

"""Stages of samples: what their jobs are to do, and the keys of what they store."""

from dataclasses import replace
from functools import cache

from springtune.problem.loads import LOADS

from ...config.kind import Stage
from ...runs.hashing import hash_of
from ...runs.keys import definition_key, mesh_type_key, stage_key
from ...runs.stages import products
from ..scenes.interpolated import expected_solves
from .names import MOST_SOLVED, blocks, rows_each

UNIFORM = "uniform"
"""Definition whose networks tell the best uniform stiffness."""


def load_kinds(sample):
    """Kinds of load of a sample."""
    return list(dict.fromkeys(LOADS[name].kind for name in sample.loads))


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
    code = stage_key("studies.kinds.samples.interpolate", without=("studies.kinds.samples.designs",))
    return hash_of(kind.name, reference_box(sample), code)


def block_key(sample, first, last):
    """Key of the parameters of some base samples, and stem of the file of their results on meshes of any type."""
    return hash_of(
        sample.design, sample.seed, sample.parameters, first, last, stage_key("studies.kinds.samples.designs")
    )


@cache
def _solved_with(mesh_type, definition):
    return hash_of(stage_key("studies.kinds.samples.solve"), mesh_type_key(mesh_type), definition_key(definition))


def result_key(sample, load, definition):
    """Key of the scenes of a load and definition in the file of any base samples; linear ones are for 1 N."""
    linear = sample.kinematics == "linear"
    how = LOADS[load].kind.name if linear else [LOADS[load].kind.name, LOADS[load].sign, LOADS[load].follower]
    return hash_of(how, sample.mesh_type, sample.kinematics, _solved_with(sample.mesh_type, definition))


def _reference_members(study, costs):
    sample = study.parts["samples"]
    if not sample:
        return {}
    seconds = costs.of("interpolant", expected_solves(reference_box(sample)))
    return {kind.name: (seconds, kind) for kind in load_kinds(sample)}


def _reference(sample, kind):
    key = reference_key(sample, kind)
    return {"name": key, "key": key, "kind": kind.name, "box": reference_box(sample)}


def _references(study, folder, kinds):
    sample, drawn = study.parts["samples"], None
    if sample.rows <= MOST_SOLVED:
        drawn = {"design": sample.design, "seed": sample.seed, "parameters": sample.parameters}
        drawn |= {"first": 0, "last": sample.size}
    return {
        "folder": str(folder / "samples"),
        "files": [_reference(sample, kind) for kind in kinds],
        "sample": drawn,
    }


def _members(study, costs):
    """Tasks of some base samples each; those of a sample of half the size are the first of them."""
    sample = study.parts["samples"]
    if not sample:
        return {}
    return {
        f"{first}-{last}": (seconds_of(sample, (first, last), costs), (first, last))
        for first, last in drawn_blocks(sample)
    }


def drawn_blocks(sample):
    """First and last base sample of each task: of the whole sample, or of the part that a study asks for."""
    return sample.blocks or blocks(sample.design, sample.size)


def seconds_of(sample, ends, costs):
    """What the task of some base samples is expected to take."""
    each = rows_each(sample.design, len(sample.varied)) * len(sample.loads) * len(definitions(sample))
    return costs.of("sampled", (ends[1] - ends[0]) * each)


def _content(study, folder, members):
    sample = study.parts["samples"]
    results = {}
    for load in sample.loads:
        for definition in definitions(sample):
            scene = {"kind": LOADS[load].kind.name, "definition": definition}
            if sample.kinematics == "nonlinear":
                scene |= {"sign": LOADS[load].sign, "follower": LOADS[load].follower}
            results[result_key(sample, load, definition)] = scene
    return {
        "folder": str(folder / "samples"),
        "design": sample.design,
        "seed": sample.seed,
        "parameters": sample.parameters,
        "mesh_type": sample.mesh_type,
        "kinematics": sample.kinematics,
        "meshed": hash_of(stage_key("studies.kinds.samples.solve"), mesh_type_key(sample.mesh_type)),
        "results": results,
        "files": [_block(sample, *ends) for ends in members],
    }


def _block(sample, first, last):
    key = block_key(sample, first, last)
    return {"name": key, "key": key, "first": first, "last": last}


def pieces(study, costs, division):
    """Seconds of each piece of a sample: of a task's base samples, or of all."""
    sample = study.parts["samples"]
    return division.of_section({ends: seconds_of(sample, ends, costs) for ends in drawn_blocks(sample)})


def take(study, names):
    """The study with some of its pieces alone; what is estimated from all rows of a sample is left to the whole one."""
    sample, wanted = study.parts["samples"], set(names)
    blocks = tuple(ends for ends in drawn_blocks(sample) if ends in wanted)
    return replace(study, parts=study.parts | {"samples": replace(sample, blocks=blocks) if blocks else ()})


STAGES = (
    Stage(
        "interpolate",
        "studies.kinds.samples.interpolate",
        "Interpolating the references of samples",
        _references,
        products,
        _reference_members,
        folder="samples",
    ),
    Stage(
        "sample",
        "studies.kinds.samples.solve",
        "Solving the networks of samples",
        _content,
        products,
        _members,
        folder="samples",
    ),
)

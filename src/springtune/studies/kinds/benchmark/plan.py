"""Stage of the benchmark: what its jobs are to do, and the keys of what they store."""

from dataclasses import asdict
from pathlib import Path

from springtune.reference.program import program

from ...config.kind import Stage
from ...runs.hashing import hash_of
from ...runs.keys import beam_key, definition_key, material_key, mesh_type_key, stage_key


def case_key(case, first):
    """Key of a scene of the benchmark; curves, steps and solvers are timed on the first one."""
    pairs = [approach.split("/") for approach in case.approaches if "/" in approach]
    definitions, mesh_types = ({pair[place] for pair in pairs} for place in (0, 1))
    # What is not named in the approaches is solved and timed on these.
    definitions, mesh_types = definitions | {"delingette", "lattice"}, mesh_types | {"structured"}
    springs = [definition_key(name) for name in sorted(definitions)]
    meshes = [mesh_type_key(name) for name in sorted(mesh_types)]
    others = program() if any(approach.startswith("calculix") for approach in case.approaches) else ""
    return hash_of(_parameters(case), first, stage_key("studies.kinds.benchmark.stage"), springs, meshes, others)


def _parameters(case):
    """What a scene depends on: not on labels."""
    parameters = asdict(case) | {"beam": beam_key(case.beam), "material": material_key(case.material, density=True)}
    del parameters["name"]
    return parameters | {"second_beam": case.second_beam and beam_key(case.second_beam)}


def cases(study):
    """Scenes of a study's benchmark, with their keys."""
    return [(case, case_key(case, number == 0), number == 0) for number, case in enumerate(study.parts["benchmark"])]


def _members(study, costs):
    return {one[0].name: (0.0, one) for one in cases(study)}


def _content(study, folder, members):
    tasks = [{"key": key, "curves": first} | _parameters(case) for case, key, first in members]
    return {"folder": str(folder / "benchmark"), "cases": tasks}


def _products(content):
    return [Path(content["folder"]) / f"{case['key']}.h5" for case in content["cases"]]


STAGES = (
    Stage(
        "benchmark",
        "studies.kinds.benchmark.stage",
        "Timing approaches",
        _content,
        _products,
        _members,
        alone=True,
    ),
)

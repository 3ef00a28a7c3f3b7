"""Stage of the benchmark: what its jobs are to do, and the keys of what they store."""

from dataclasses import asdict
from pathlib import Path

from ...jobs.hashing import hash_of
from ...jobs.keys import beam_key, definition_key, material_key, mesh_type_key, stage_key
from ..base import Stage


def case_key(case):
    """Key of a scene of the benchmark."""
    parameters = asdict(case) | {"beam": beam_key(case.beam), "material": material_key(case.material, density=True)}
    parameters["second_beam"] = case.second_beam and beam_key(case.second_beam)
    pairs = [approach.split("/") for approach in case.approaches if "/" in approach]
    definitions, mesh_types = ({pair[place] for pair in pairs} for place in (0, 1))
    # What is not named in the approaches is solved and timed on these.
    definitions, mesh_types = definitions | {"delingette", "lattice"}, mesh_types | {"structured"}
    springs = [definition_key(name) for name in sorted(definitions)]
    meshes = [mesh_type_key(name) for name in sorted(mesh_types)]
    return hash_of(parameters, stage_key("kinds.benchmark.stage"), springs, meshes)


def _members(study, costs):
    return {case.name: (0.0, case) for case in study.parts["benchmark"]}


def _content(study, folder, cases):
    first = study.parts["benchmark"][0]
    tasks = [{"key": case_key(case), "curves": case is first} | asdict(case) for case in cases]
    return {"folder": str(folder / "benchmark"), "cases": tasks}


def _products(content):
    return [Path(content["folder"]) / f"{case['key']}.h5" for case in content["cases"]]


STAGES = (
    Stage(
        "benchmark",
        "kinds.benchmark.stage",
        "Timing approaches",
        _content,
        _products,
        _members,
        alone=True,
        definitions=True,
        mesh_types=True,
    ),
)

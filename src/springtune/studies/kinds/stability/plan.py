"""Stage of the experiments: what its jobs are to do, and the keys of what they store."""

from dataclasses import asdict
from pathlib import Path

from ...config.kind import Stage
from ...runs.hashing import hash_of
from ...runs.keys import beam_key, definition_key, material_key, mesh_type_key, stage_key


def experiment_key(one):
    """Key of an experiment on stability."""
    code = stage_key("studies.kinds.stability.stage"), mesh_type_key(one.mesh_type), definition_key(one.definition)
    return hash_of(_parameters(one), code)


def _parameters(one):
    """What an experiment depends on: not on labels of its beam and material."""
    return asdict(one) | {"beam": beam_key(one.beam), "material": material_key(one.material, density=True)}


def _members(study, costs):
    return {hash_of(_parameters(one)): (costs.of(one.name), one) for one in study.parts["stability"]}


def _content(study, folder, experiments):
    tasks = [{"key": experiment_key(one)} | _parameters(one) for one in experiments]
    return {"folder": str(folder / "stability"), "experiments": tasks}


def _products(content):
    return [Path(content["folder"]) / f"{one['key']}.h5" for one in content["experiments"]]


STAGES = (
    Stage(
        "stability",
        "studies.kinds.stability.stage",
        "Experiments on stability",
        _content,
        _products,
        _members,
    ),
)

"""Stage of the laid strips: what its jobs are to do, and the keys of what they store."""

from dataclasses import asdict
from pathlib import Path

from ...config.kind import Stage
from ...runs.hashing import hash_of
from ...runs.keys import definition_key, material_key, mesh_type_key, stage_key
from .cost import cost_units


def laying_key(one):
    """Key of a laid strip."""
    return hash_of(
        _parameters(one),
        stage_key("studies.kinds.laying.stage"),
        mesh_type_key("structured"),
        definition_key(one.definition),
        definition_key("delingette"),  # the trapezoid's
    )


def _parameters(one):
    """What a strip depends on: not on labels of its materials."""
    return asdict(one) | {"material": material_key(one.material), "support": material_key(one.support)}


def _members(study, costs):
    laying = study.parts["laying"]
    strips = {hash_of(_parameters(one)): one for one in (*laying.strips, *laying.references)} if laying else {}
    return {name: (costs.of("laying", cost_units(one.mesh_size)), one) for name, one in strips.items()}


def _content(study, folder, strips):
    return {"folder": str(folder / "laying"), "strips": [{"key": laying_key(one)} | _parameters(one) for one in strips]}


def _products(content):
    return [Path(content["folder"]) / f"{strip['key']}.h5" for strip in content["strips"]]


STAGES = (
    Stage(
        "laying",
        "studies.kinds.laying.stage",
        "Laying the strips",
        _content,
        _products,
        _members,
    ),
)

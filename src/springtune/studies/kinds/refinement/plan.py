"""Stage of refinements: what its jobs are to do, and the keys of what they store."""

from collections import defaultdict
from dataclasses import asdict
from pathlib import Path

from springtune.problem.loads import LOADS

from ...config.kind import Stage
from ...runs.hashing import hash_of
from ...runs.keys import beam_key, definition_key, material_key, mesh_type_key, stage_key

USUAL_PARTICLES = 1e3
"""Particles of a mesh, where they are not known: of the costs."""


def parameters(one):
    """What all values of a refinement have in common: refinements that differ in their ends alone share a file."""
    load = LOADS[one.load]
    return {
        "beam": beam_key(one.beam),
        "material": material_key(one.material),
        "kind": load.kind.name,
        "follower": load.follower and one.kinematics == "nonlinear",
        "force": one.force,
        "mesh_type": one.mesh_type,
        "mesh_size": one.mesh_size,
        "definition": one.definition,
        "kinematics": one.kinematics,
        "parameter": one.parameter,
    }


def code_keys(one):
    """What its results depend on besides."""
    return [stage_key("studies.kinds.refinement.stage"), mesh_type_key(one.mesh_type), definition_key(one.definition)]


def file_key(one):
    """Key of the file of a refinement: of all that its values depend on but these."""
    return hash_of(parameters(one), code_keys(one))


def _members(study, costs):
    families = defaultdict(list)
    for one in study.parts["refinement"]:
        families[file_key(one)].append(one)
    return {key: (sum(_seconds(one, costs) for one in family), family) for key, family in families.items()}


def _seconds(one, costs):
    """Half of the values that a refinement may have, each on the mesh that is known."""
    size = one.mesh_size or one.rule.first
    particles = one.beam.length * one.beam.height / (0.866 * size**2) if size else USUAL_PARTICLES
    return 0.5 * (one.rule.points + one.rule.most) * costs.of("refinement", particles)


def _content(study, folder, families):
    return families and {
        "folder": str(folder / "refinement"),
        "refinements": [
            parameters(family[0]) | {"key": file_key(family[0]), "rules": [asdict(one.rule) for one in family]}
            for family in families
        ],
    }


def _products(content):
    return [Path(content["folder"]) / f"{one['key']}.h5" for one in content["refinements"]]


STAGES = (
    Stage(
        "refinement",
        "studies.kinds.refinement.stage",
        "Refining where errors matter",
        _content,
        _products,
        _members,
    ),
)

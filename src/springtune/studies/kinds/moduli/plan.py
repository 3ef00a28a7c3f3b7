"""Stage of the moduli: what its jobs are to do, and the keys of what they store."""

from pathlib import Path

from springtune.mesh import MESH_TYPES

from ...config.kind import Stage
from ...config.model import MeshSpec
from ...runs.hashing import hash_of
from ...runs.keys import definition_key, mesh_type_key, stage_key
from ..scenes.plan import mesh_key, mesh_parameters, mesh_source, particles


def moduli_key(study, one):
    """Key of the effective moduli of a definition on a patch."""
    mesh = mesh_of(study, one)
    parameters = [mesh_parameters(mesh), one.definition, one.poisson_ratio]
    code = stage_key("studies.kinds.moduli.stage"), mesh_type_key(one.mesh_type), definition_key(one.definition)
    return hash_of(parameters, code)


def mesh_of(study, one):
    """Mesh of a patch test: on the box, or of the meshes from files that of the shortest beam."""
    if one.mesh_type in MESH_TYPES:
        return MeshSpec(study.parts["moduli"].patch, one.mesh_type, one.mesh_size)
    found = [mesh for label, mesh in study.mesh_files.items() if label[::2] == (one.mesh_type, one.mesh_size)]
    return min(found, key=lambda mesh: (mesh.beam.length, mesh.beam.height, mesh_key(mesh)))


def patch_name(one):
    """File stem of the moduli of a patch."""
    return f"{one.mesh_type}_{1e3 * one.mesh_size:g}mm"


def _members(study, costs):
    """What is measured on each patch, and what that costs."""
    seconds, patches = {}, {}
    for one in study.parts["moduli"].measurements if study.parts["moduli"] else ():
        name, mesh = patch_name(one), mesh_of(study, one)
        patch = patches.setdefault(name, {"name": name, "mesh": mesh_source(mesh), "measurements": []})
        measurement = {"key": moduli_key(study, one), "definition": one.definition, "poisson_ratio": one.poisson_ratio}
        patch["measurements"].append(measurement)
        each = costs.of("moduli", particles(mesh)) + costs.of(one.definition, particles(mesh))
        seconds[name] = seconds.get(name, 0.0) + each
    return {name: (seconds[name], patch) for name, patch in patches.items()}


def _content(study, folder, patches):
    return {"folder": str(folder / "moduli"), "patches": patches}


def _products(content):
    return [Path(content["folder"]) / f"{patch['name']}.h5" for patch in content["patches"]]


STAGES = (
    Stage(
        "moduli",
        "studies.kinds.moduli.stage",
        "Measuring effective moduli",
        _content,
        _products,
        _members,
    ),
)

"""Stages of shapes: what their jobs are to do, and the keys of what they store."""

import hashlib
from collections import defaultdict
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from ...config.kind import Stage
from ...runs import driver
from ...runs.checked_json import hash_of
from ...runs.keys import definition_key, material_key, mesh_type_key, stage_key
from ...runs.stages import Task, products, stage
from ..scenes.plan import mesh_products
from .names import OWN_FILE
from .outputs import DRAWING

if TYPE_CHECKING:
    from collections.abc import Collection

    from ...config.model import Study

MOST_DRAWN = 1500
"""Particles, about, of the largest mesh that is drawn where a coarser one is there."""

FILE_PARTICLES = 2000.0
"""Particles of a mesh from a file, for costs, before it is read."""


def mesh_name(one):
    """Stem of the files of a scene's mesh, and of what is solved on it."""
    return f"{one.shape}_{one.mesh_type}" + ("" if one.mesh_type == OWN_FILE else f"_{1e3 * one.mesh_size:.9g}mm")


def file_name(one):
    """The same beside files of beams, whose names begin with a number."""
    return f"shape_{mesh_name(one)}"


def particles(part, one):
    """Number of particles of a scene's mesh, about."""
    shape = part.shape[one.shape]
    return FILE_PARTICLES if shape.file else shape.area / (0.866 * one.mesh_size**2)


# -- keys --------------------------------------------------------------------------------------------------------------


def _source(shape):
    """What the geometry of a shape is made from."""
    from .task_values import geometry  # here, as below: studies of beams read the stages as well

    described = geometry(shape)
    if not shape.file:
        return described
    state = Path(shape.file).stat()
    content = _content(shape.file, state.st_size, state.st_mtime_ns)
    return described | {"file": shape.file, "unit": shape.unit, "content": content}


@lru_cache(maxsize=256)
def _content(file, size, time):
    """Hash of a file; each of its scenes asks."""
    return hashlib.sha256(Path(file).read_bytes()).hexdigest()


def _parameters(source):
    """What of it results depend on: not on where a file is, but on its ending, which says its format."""
    return source | {"file": Path(source["file"]).suffix} if "file" in source else source


def mesh_source(part, one):
    """What a scene's mesh is made from."""
    source = _source(part.shape[one.shape])
    if "file" in source:
        return source
    refined = {name: share * one.mesh_size for name, share in part.refined[one.shape].items()}
    return source | {"mesh_type": one.mesh_type, "mesh_size": one.mesh_size, "refined": refined}


def mesh_key(part, one):
    """Key of a scene's mesh."""
    return hash_of(
        _parameters(mesh_source(part, one)),
        stage_key("studies.kinds.shapes.mesh"),
        _reader(part.shape[one.shape]),
    )


def _reader(shape):
    """What reads the mesh file of a shape, the library behind it included; nothing where it has none."""
    return mesh_type_key(OWN_FILE) if shape.file else ""


def _case(part, shape, material, name):
    """What a shape of its materials under a load is, but for its geometry; no density where nothing weighs."""
    from .task_values import load

    case = part.shape[shape].loads[name]
    weighs = any(case.gravity)
    materials = {key: material_key(one, weighs) for key, one in part.materials_of(shape, material).items()}
    return {"thickness": part.shape[shape].thickness, "load": load(case), "materials": materials}


def reference_task(part, shape, material, name):
    """Task of a reference."""
    task = {"shape": _source(part.shape[shape])} | _case(part, shape, material, name)
    code = stage_key("studies.kinds.shapes.reference", driver.DRIVER), _reader(part.shape[shape])
    key = hash_of(task | {"shape": _parameters(task["shape"])}, code)
    return {"key": key} | task


def scene_task(part, one, kept=()):
    """Task of a scene."""
    task = _case(part, one.shape, one.material, one.load)
    task |= {"definition": one.definition, "kinematics": one.kinematics}
    # Scenes of shapes have no reference at finite strain.
    code = stage_key("studies.kinds.shapes.solve", without=("reference.finite_strain",)), definition_key(one.definition)
    key = hash_of(mesh_key(part, one), task, code)
    return {"key": key} | task | ({"keep_fields": True} if one in kept else {})


def draws(study):
    """Whether a study's dataset has the networks that are drawn."""
    return DRAWING in study.outputs


def shown(part):
    """Scenes whose networks are drawn: of a shape and load the finest mesh that is not too large, one material."""
    cases = defaultdict(list)
    for one in part.scenes:
        cases[one.shape, one.load].append(one)
    found = set()
    for scenes in cases.values():
        few = [one for one in scenes if particles(part, one) <= MOST_DRAWN]
        mesh = min(few, key=_size) if few else max(scenes, key=_size)
        alike = [one for one in scenes if mesh_name(one) == mesh_name(mesh)]
        found |= {one for one in alike if (one.material, one.kinematics) == (alike[0].material, alike[0].kinematics)}
    return found


def _size(one):
    return one.mesh_size


def by_mesh(part):
    """Scenes by the name of their mesh."""
    found = defaultdict(list)
    for one in part.scenes:
        found[mesh_name(one)].append(one)
    return found


# -- stages ------------------------------------------------------------------------------------------------------------


def _mesh_members(study, costs):
    """Meshes with their scenes, and what all of that costs."""
    part = study.parts["shapes"]
    members = {}
    for name, scenes in by_mesh(part).items() if part else ():
        count = particles(part, scenes[0])
        seconds = costs.of("shape_mesh", count)
        seconds += sum(costs.of("shape_scene", count) + costs.of(one.definition, count) for one in scenes)
        members[name] = seconds, scenes
    return members


def _meshes(study, folder, members):
    part = study.parts["shapes"]
    return {
        "folder": str(folder / "meshes"),
        "files": [{"name": file_name(one), "key": mesh_key(part, one)} | mesh_source(part, one) for one, *_ in members],
    }


def _reference_tasks(study):
    part = study.parts["shapes"]
    for one in part.referred if part else ():
        task = reference_task(part, *one)
        yield Task(task, costs=[("shape_reference", 0)], name="/".join(one), key=task["key"])


def _solve(study, folder, members):
    part = study.parts["shapes"]
    kept = shown(part) if draws(study) else ()
    files = [
        {
            "name": file_name(scenes[0]),
            "shape": _parameters(_source(part.shape[scenes[0].shape])),
            "tasks": list({task["key"]: task for task in (scene_task(part, one, kept) for one in scenes)}.values()),
        }
        for scenes in members
    ]
    return {"folder": str(folder / "solutions"), "meshes": str(folder / "meshes"), "files": files}


# -- parts of a study --------------------------------------------------------------------------------------------------


def pieces(study, costs, division):
    """Seconds of each piece: of a shape under a load, which says what of it is drawn, or of all grids."""
    part = study.parts["shapes"]
    found = defaultdict(float)
    for one in part.scenes:
        count = particles(part, one)
        found[one.shape, one.load] += costs.of("shape_scene", count) + costs.of(one.definition, count)
    for shape, _, load in part.referred:
        found[shape, load] += costs.of("shape_reference")
    return division.of_section(found)


def take(study, names):
    """The study with some of its pieces alone."""
    wanted = set(names)
    return of_shape_scenes(study, {one for one in study.parts["shapes"].scenes if (one.shape, one.load) in wanted})


def of_shape_scenes(study: "Study", chosen: "Collection[object]") -> "Study":
    """A study of a few scenes of shapes of another one, and of what these need."""
    part = study.parts["shapes"]
    scenes = tuple(scene for scene in part.scenes if scene in chosen) if part else ()
    if not scenes:
        return replace(study, parts=study.parts | {"shapes": ()})
    cases = {(one.shape, one.material, one.load) for one in scenes}
    names = {one.shape for one in scenes}
    found = replace(
        part,
        shapes=tuple(shape for shape in part.shapes if shape.name in names),
        scenes=scenes,
        referred=tuple(case for case in part.referred if case in cases),
    )
    return replace(study, parts=study.parts | {"shapes": found})


STAGES = (
    stage(
        "shape_reference",
        "studies.kinds.shapes.reference",
        "Solving the references of shapes",
        _reference_tasks,
        "shape_references",
    ),
    Stage(
        "shape_mesh",
        "studies.kinds.shapes.mesh",
        "Meshing shapes",
        _meshes,
        mesh_products,
        _mesh_members,
        folder="meshes",
    ),
    Stage(
        "shape_solve",
        "studies.kinds.shapes.solve",
        "Solving the networks of shapes",
        _solve,
        products,
        like="shape_mesh",
        same=("shape_mesh",),
        folder="solutions",
    ),
)

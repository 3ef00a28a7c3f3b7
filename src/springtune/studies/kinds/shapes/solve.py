"""Stage `shape_solve`: the network of every scene of a shape, all scenes of a mesh together."""

import time
from functools import partial
from pathlib import Path

import numpy as np

from springtune.problem.cases import check_case
from springtune.problem.status import Status
from springtune.scene.single import Scene
from springtune.springs import DefinitionError

from ...runs import store
from ...runs.hashing import hash_of
from ..scenes.stored_scene import FIELD_ARRAYS, fields_key, packed
from . import stored
from .task_values import ONE_LOAD, by_key, materials_of, shape_of

WITHOUT_MESH = "shape without mesh"
"""What scenes are counted as that have no mesh."""


def run(tasks, spent):
    """Solve the scenes of a bundle that are not stored yet.

    Parameters
    ----------
    tasks : dict
        ``folder``, ``meshes`` (folder of the stage `shape_mesh`) and ``families``, each with ``name`` and ``mesh``, the
        mesh's name and key, ``shape``, see `task_values.geometry`, and ``scenes``, each with
        ``key, thickness, load, materials, definition, kinematics``, and ``keep_fields`` where its network is drawn.
    """
    for family in tasks["families"]:
        path = Path(tasks["folder"]) / f"{family['name']}.h5"
        present = store.stored(path, spent.limits)
        missing = [scene for scene in family["scenes"] if not _keys(scene) <= present]
        if not missing:
            continue
        grouped = stored.read(tasks["meshes"], family["name"], family["mesh"])
        if isinstance(grouped, str):
            lost = stored.is_lost(tasks["meshes"], family["name"], family["mesh"])
            hole = _hole(grouped) | ({store.LIMITS: spent.limits} if lost else {})
            store.add(path, {key: hole for scene in missing for key in _keys(scene)})
            spent.add(WITHOUT_MESH, 0, 0.0, len(missing))
            continue
        sheets = {}
        with store.Keeper(path) as keeper:
            for task in sorted(missing, key=_turn):
                begin = time.perf_counter()
                result = spent.attempt(task["key"], partial(_solved, family, grouped, task, sheets), _hole)
                if result is None:
                    continue
                if task.get("keep_fields"):
                    keeper[fields_key(task["key"])] = packed(result)
                # What deriving springs took counts once, in the scene that asked first.
                count, deriving = len(grouped.mesh.points), result.pop("deriving", 0.0)
                keeper[task["key"]] = {name: value for name, value in result.items() if name not in FIELD_ARRAYS}
                spent.add("shape_scene", count, time.perf_counter() - begin - deriving)
                spent.add(task["definition"], count, deriving)


def _keys(scene):
    return {scene["key"], fields_key(scene["key"])} if scene.get("keep_fields") else {scene["key"]}


def lose(tasks, key, why, limits):
    """Store that a scene is beyond its limits."""
    for family in tasks["families"]:
        for scene in family["scenes"]:
            if scene["key"] == key:
                path = Path(tasks["folder"]) / f"{family['name']}.h5"
                store.add(path, {name: _hole(why) | {store.LIMITS: limits} for name in _keys(scene)})


def _hole(why):
    return {"status": Status.FAILED, "message": why, "seconds": 0.0}


def _turn(scene):
    """Order in which scenes of one network follow each other."""
    return scene["definition"], hash_of(scene["materials"])


def _solved(family, grouped, task, sheets):
    shape = shape_of(family["shape"], task["thickness"], task["load"])
    chosen = {"definition": task["definition"], "kinematics": task["kinematics"]}
    try:
        check_case(grouped, shape.loads[ONE_LOAD])
    except ValueError as error:
        return _hole(str(error))
    begin, sheet = time.perf_counter(), sheets.get(shape.thickness)
    derived = sheet.deriving if sheet else 0.0
    try:
        try:
            scene = Scene(shape, grouped, materials_of(task["materials"]), ONE_LOAD, sheet=sheet, **chosen)
        except DefinitionError:
            raise
        except ValueError as error:  # loads on what is held, quantities that the mesh has not
            return _hole(str(error))
        sheets[shape.thickness] = scene.sheet
        found = scene.solve()
    except DefinitionError as error:
        return _hole(str(error)) | {"seconds": time.perf_counter() - begin}
    result = {
        "status": found.status,
        "message": found.message,
        "seconds": found.seconds,
        "definition_seconds": found.definition_seconds,
        "deriving": scene.sheet.deriving - derived,
        "negative_pivots": found.negative_pivots,
        "values": by_key(found.values, shape.loads[ONE_LOAD]),
    }
    if task.get("keep_fields") and np.isfinite(found.displacements).all():
        result |= {
            "displacements": found.displacements,
            "spring_stiffnesses": found.stiffness,
            "spring_forces": found.spring_forces,
        }
    return result

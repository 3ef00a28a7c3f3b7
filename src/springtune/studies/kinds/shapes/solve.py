"""Stage `shape_solve`: the network of every scene of a shape, all scenes of a mesh together."""

import time

import numpy as np

from springtune.problem.boundary import check_case
from springtune.problem.status import Status
from springtune.scene.single import Scene
from springtune.springs.base import DefinitionError

from ...runs.source import hash_of
from ..scenes import stored
from .task_values import ONE_LOAD, by_key, materials_of, shape_of

parts = stored.parts


def prepare(family, content):
    """Shape, mesh, and the sheets by thickness, which scenes add."""
    return family["shape"], stored.prepared(content, family), {}


def failed(task, why):
    """Result of a scene that fails."""
    return {"status": Status.FAILED, "message": why, "seconds": 0.0}


def order(scene):
    """Order in which scenes of one network follow each other."""
    return scene["definition"], hash_of(scene["materials"])


def solve(task, family):
    """Result of a scene: its ``thickness``, ``load`` and ``materials`` are as `task_values` has them."""
    described, grouped, sheets = family
    shape = shape_of(described, task["thickness"], task["load"])
    chosen = {"definition": task["definition"], "kinematics": task["kinematics"]}
    sheet = sheets.get(shape.thickness)
    try:
        check_case(grouped, shape.loads[ONE_LOAD])
        scene = Scene(shape, grouped, materials_of(task["materials"]), ONE_LOAD, sheet=sheet, **chosen)
    except ValueError as error:  # loads on what is held, quantities that the mesh has not, definitions that refuse it
        return failed(task, str(error))
    sheets[shape.thickness] = scene.sheet
    begin = time.perf_counter()
    try:
        found = scene.solve()
    except DefinitionError as error:
        return failed(task, str(error)) | {"seconds": time.perf_counter() - begin}
    result = {
        "status": found.status,
        "message": found.message,
        "seconds": found.seconds,
        "definition_seconds": found.definition_seconds,
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

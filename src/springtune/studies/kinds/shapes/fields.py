"""Drawn networks of shapes, gathered in the group ``/shape_fields``."""

import numpy as np

from ...runs import store
from ..scenes import stored
from ..scenes.collect import fields_on, put_outline
from ..scenes.stored import PACKED, fields_key, unpacked
from . import plan
from .variables import SHAPE_FIELDS

OUTLINE_ARRAYS = ("outline_points", "outline_displacements", "outline_lengths")


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    part = study.parts["shapes"]
    if not part:
        return {}
    cases = {}
    drawn = plan.shown(part)
    for one in (one for one in part.scenes if one in drawn):
        cases.setdefault((one.shape, one.load), []).append(one)
    meshes = {case: stored.read(folder / "meshes", plan.file_name(scenes[0])) for case, scenes in cases.items()}
    outlines = {case: _outline(part, scenes[0], folder) for case, scenes in cases.items()}
    there = [({"case": ", ".join(case)}, found.mesh) for case, found in meshes.items() if found]
    axes = study.axes | {"case": tuple(map(", ".join, cases))}
    found = fields_on(SHAPE_FIELDS, axes, there, [points for points, *_ in outlines.values()])
    for case, scenes in cases.items():
        label, one = ", ".join(case), scenes[0]
        about = {"shape_name": one.shape, "load_name": one.load, "material_name": one.material}
        about |= {"kinematics_name": one.kinematics, "mesh_type_name": one.mesh_type, "case_mesh_size": one.mesh_size}
        found.put(about, case=label)
        points, moved, rounds = outlines[case]
        put_outline(found, points, moved, case=label)
        found.put_rows({"outline_round": rounds}, case=label)
        if not meshes[case]:
            continue
        path = folder / "solutions" / f"{plan.file_name(one)}.h5"
        keys = {scene: fields_key(plan.scene_task(part, scene)["key"]) for scene in scenes}
        results = store.read(path, set(keys.values()), [PACKED])
        for scene, key in keys.items():
            kept = unpacked(results[key])
            if kept:
                x, y = kept["displacements"].T
                values = {"displacement_x": x, "displacement_y": y, "spring_force": kept["spring_forces"]}
                found.put_rows(values, case=label, definition=scene.definition)
    return {SHAPE_FIELDS.name: found.data}


def _outline(part, one, folder):
    """Points of the outline, their displacements in the reference, and the number of their round."""
    case = one.shape, one.material, one.load
    if case in part.referred:
        key = plan.reference_task(part, *case)["key"]
        found = store.read_one(folder / "shape_references", key, OUTLINE_ARRAYS)
        if not found["message"]:
            points, moved, sizes = (found[name] for name in OUTLINE_ARRAYS)
            return points, moved, np.repeat(np.arange(len(sizes)), sizes)
    return np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0, dtype=int)

"""Networks of shapes that are drawn, gathered in the group ``/shape_fields``."""

import numpy as np

from ...output.dataset import Filler
from ...runs import store
from ..scenes import stored
from ..scenes.collect import cells_of
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
    meshes = {case: _mesh(part, scenes[0], folder) for case, scenes in cases.items()}
    outlines = {case: _outline(part, scenes[0], folder) for case, scenes in cases.items()}
    cells = {case: cells_of(mesh) for case, mesh in meshes.items() if mesh is not None}
    there = [mesh for mesh in meshes.values() if mesh is not None]
    lengths = {
        "particle": max((len(mesh.points) for mesh in there), default=1),
        "spring": max((len(mesh.edges) for mesh in there), default=1),
        "spring_end": 2,
        "cell": max(map(len, cells.values()), default=1),
        "cell_corner": max((one.shape[1] for one in cells.values()), default=3),
        "outline_point": max(1, *(len(points) for points, *_ in outlines.values())),
    }
    axes = {name: tuple(range(length)) for name, length in lengths.items()}
    axes["case"] = tuple(", ".join(case) for case in cases)
    found = Filler(SHAPE_FIELDS.empty(study.axes | axes))
    found.data.attrs["Conventions"] = "CF-1.11 UGRID-1.0"
    for case, scenes in cases.items():
        label, one = ", ".join(case), scenes[0]
        about = {"shape_name": one.shape, "load_name": one.load, "material_name": one.material}
        about |= {"kinematics_name": one.kinematics, "mesh_type_name": one.mesh_type, "case_mesh_size": one.mesh_size}
        found.put(about, case=label)
        points, moved, rounds = outlines[case]
        found.put_rows({"outline_x": points[:, 0], "outline_y": points[:, 1], "outline_round": rounds}, case=label)
        moved = {"reference_displacement_x": moved[:, 0], "reference_displacement_y": moved[:, 1]}
        found.put_rows(moved, case=label)
        mesh = meshes[case]
        if mesh is None:
            continue
        found.put_rows({"x": mesh.points[:, 0], "y": mesh.points[:, 1]}, case=label)
        found.put_rows({"spring_nodes": mesh.edges, "cell_nodes": cells[case]}, case=label)
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


def _mesh(part, one, folder):
    """Mesh of a scene; None where there is none."""
    name = plan.file_name(one)
    return None if stored.is_refused(folder / "meshes", name) else stored.read(folder / "meshes", name).mesh


def _outline(part, one, folder):
    """Points of the outline, their displacements by the reference, and the round that each is of."""
    case = one.shape, one.material, one.load
    if case in part.referred:
        key = plan.reference_task(part, *case)["key"]
        found = store.read_one(folder / "shape_references", key, OUTLINE_ARRAYS)
        if not found["message"]:
            points, moved, sizes = (found[name] for name in OUTLINE_ARRAYS)
            return points, moved, np.repeat(np.arange(len(sizes)), sizes)
    return np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0, dtype=int)

"""Stage `shape_mesh`: one mesh with its groups each shape, mesh type and mesh size."""

import hashlib
import time
from functools import partial
from pathlib import Path

from springtune.mesh import quality
from springtune.mesh.group_files import read_shape
from springtune.mesh.outlines import mesh_shape

from ...runs import store
from . import stored
from .task_values import shape_of


def run(tasks, spent):
    """Make the meshes of a bundle that are not there yet."""
    for task in tasks["meshes"]:
        path = Path(tasks["folder"]) / f"{task['name']}.h5"
        if task["key"] in store.stored(path, spent.limits):
            continue
        begin = time.perf_counter()
        result = spent.attempt(task["name"], partial(_made, task["source"]), _hole)
        if result is None:
            continue
        seconds = time.perf_counter() - begin
        store.add(path, {task["key"]: result | {"mesh_seconds": seconds}})
        spent.add("shape_mesh", len(result.get("points", ())), seconds)


def lose(tasks, name, why, limits):
    """Store that a mesh is beyond its limits."""
    key = next(task["key"] for task in tasks["meshes"] if task["name"] == name)
    store.add(Path(tasks["folder"]) / f"{name}.h5", {key: _hole(why) | {store.LIMITS: limits}})


def _hole(why):
    return {"message": f"mesh: {why}"}


def _made(source):
    grouped = make(source)
    mesh = grouped.mesh
    known = quality(mesh) | {"particles": len(mesh.points), "springs": len(mesh.edges), "message": ""}
    return stored.packed(grouped) | known


def make(source):
    """Mesh with its groups."""
    if "file" not in source:
        return mesh_shape(shape_of(source), source["mesh_size"], source["mesh_type"], source["refined"])
    content = hashlib.sha256(Path(source["file"]).read_bytes()).hexdigest()
    if content != source["content"]:
        raise SystemExit(f"{source['file']} was changed while the study ran; call the same command again")
    return read_shape(source["file"], source["unit"])

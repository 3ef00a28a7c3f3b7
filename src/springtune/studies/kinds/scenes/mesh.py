"""Stage `mesh`: one VTU file a mesh, with its quality figures in a note beside it."""

import hashlib
import time
from functools import partial
from pathlib import Path

from springtune.mesh import MESH_TYPES, quality, read_beam_mesh

from ...runs.driver import REFUSED
from . import stored_mesh


def run(content, costs):
    """Make the meshes of a bundle that are not there yet."""
    folder = content["folder"]
    for task in content["files"]:
        if stored_mesh.is_stored(folder, task["name"], task["key"], costs.limits):
            continue
        begin = time.perf_counter()
        mesh = costs.attempt(task["name"], partial(make, task), _failed)
        known = {"mesh_seconds": time.perf_counter() - begin}
        if mesh is None:
            continue
        if isinstance(mesh, dict):
            stored_mesh.refuse(folder, task["name"], task["key"], mesh)
            costs.add(REFUSED, 0, known["mesh_seconds"])
            continue
        known |= quality(mesh) | {"particles": len(mesh.points), "springs": len(mesh.edges)}
        stored_mesh.write(folder, task["name"], task["key"], mesh, known)
        costs.add("mesh", len(mesh.points), time.perf_counter() - begin)


def gone(content, name, why, limits):
    """Store that a mesh is beyond its limits."""
    key = next(task["key"] for task in content["files"] if task["name"] == name)
    stored_mesh.refuse(content["folder"], name, key, _failed(why) | {"limits": limits})


def _failed(why):
    return {"message": f"mesh: {why}"}


def make(source):
    """Mesh from ``length``, ``height`` and ``mesh_type`` and ``mesh_size``, or ``file`` and its ``unit``."""
    box = source["length"], source["height"]
    if "file" in source:
        content = hashlib.sha256(Path(source["file"]).read_bytes()).hexdigest()
        if content != source["content"]:
            raise SystemExit(f"{source['file']} was changed while the study ran; call the same command again")
        return read_beam_mesh(source["file"], *box, source["unit"])
    return MESH_TYPES[source["mesh_type"]](*box, source["mesh_size"])

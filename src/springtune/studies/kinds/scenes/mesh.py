"""Stage `mesh`: one VTU file a mesh, with its quality figures in a note beside it."""

import hashlib
import time
from functools import partial
from pathlib import Path

from springtune.mesh.cells import quality
from springtune.mesh.formats import read_beam_mesh
from springtune.mesh.groups import GroupedMesh
from springtune.mesh.types import MESH_TYPES

from . import stored


def make(source):
    """Mesh of a box ``length`` by ``height``: by ``mesh_type`` and ``mesh_size``, or of a ``file`` and its ``unit``."""
    box = source["length"], source["height"]
    if "file" in source:
        check_unchanged(source)
        return read_beam_mesh(source["file"], *box, source["unit"])
    return MESH_TYPES[source["mesh_type"]](*box, source["mesh_size"])


def check_unchanged(source):
    """End the job if a mesh file changed since the study was read."""
    if hashlib.sha256(Path(source["file"]).read_bytes()).hexdigest() != source["content"]:
        raise SystemExit(f"{source['file']} was changed while the study ran; call the same command again")


def run(content, attempts, make=make):
    """Make the missing meshes of a bundle."""
    folder = content["folder"]
    for name, task in ((file["name"], file["tasks"][0]) for file in content["files"]):
        if stored.is_stored(folder, name, task["key"]):
            continue
        begin = time.perf_counter()
        made = attempts.attempt(name, partial(make, task), lambda why: {"message": f"mesh: {why}"})
        known = {"mesh_seconds": time.perf_counter() - begin}
        if made is None:
            continue
        attempts.computed += 1
        if isinstance(made, dict):
            stored.refuse(folder, name, task["key"], made)
            continue
        grouped = made if isinstance(made, GroupedMesh) else GroupedMesh(made)
        mesh = grouped.mesh
        known |= quality(mesh) | {"particles": len(mesh.points), "springs": len(mesh.edges)}
        stored.write_made(folder, name, task["key"], grouped, known)

"""Stage `shape_mesh`: one mesh with its groups each shape, mesh type and mesh size."""

import hashlib
import time
from pathlib import Path

from springtune.mesh import quality
from springtune.mesh.formats import read_shape
from springtune.mesh.outlines import mesh_shape

from . import stored
from .task_values import shape_of


def failed(task, why):
    """Result of a mesh that cannot be made."""
    return {"message": f"mesh: {why}"}


def solve(task):
    """A mesh and its groups, as they are stored, and its quality."""
    begin = time.perf_counter()
    grouped = make(task["source"])
    mesh = grouped.mesh
    known = quality(mesh) | {"particles": len(mesh.points), "springs": len(mesh.edges), "message": ""}
    return stored.packed(grouped) | known | {"mesh_seconds": time.perf_counter() - begin}


def cost(task, result, seconds):
    """Seconds by the particles of the mesh."""
    yield "shape_mesh", len(result.get("points", ())), seconds


def make(source):
    """Mesh with its groups."""
    if "file" not in source:
        return mesh_shape(shape_of(source), source["mesh_size"], source["mesh_type"], source["refined"])
    content = hashlib.sha256(Path(source["file"]).read_bytes()).hexdigest()
    if content != source["content"]:
        raise SystemExit(f"{source['file']} was changed while the study ran; call the same command again")
    return read_shape(source["file"], source["unit"])

"""Stage `mesh`: one VTU file a mesh, with its quality figures in a JSON file beside it."""

import time

from ...mesh import MESH_TYPES, MeshError, quality, read_beam_mesh
from . import stored_mesh


def run(tasks, spent):
    """Make the meshes of a bundle that are not there yet.

    Parameters
    ----------
    tasks : dict
        ``folder`` and ``meshes``, each with ``name``, ``key`` and what `make` takes.
    spent : Spent
        What tasks cost is added to it.
    """
    folder = tasks["folder"]
    for task in tasks["meshes"]:
        if stored_mesh.is_stored(folder, task["name"], task["key"]):
            continue
        begin = time.perf_counter()
        try:
            mesh = make(task)
        except MeshError as error:  # the user's file: the message says it all
            raise SystemExit(str(error)) from None
        known = {"mesh_seconds": time.perf_counter() - begin}
        known |= quality(mesh) | {"particles": len(mesh.points), "springs": len(mesh.edges)}
        stored_mesh.write(folder, task["name"], task["key"], mesh, known)
        spent.add("mesh", len(mesh.points), time.perf_counter() - begin)


def make(source):
    """Mesh from ``length``, ``height`` and ``mesh_type`` and ``mesh_size``, or ``file`` and its ``unit``."""
    box = source["length"], source["height"]
    if "file" in source:
        return read_beam_mesh(source["file"], *box, source["unit"])
    return MESH_TYPES[source["mesh_type"]](*box, source["mesh_size"])

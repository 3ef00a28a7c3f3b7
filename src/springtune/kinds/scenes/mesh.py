"""Stage `mesh`: one VTU file a mesh, with its quality figures in a JSON file beside it.

A mesh that cannot be made has no VTU file, and its notes say why: it costs its own scenes and no others.
"""

import sys
import time
from pathlib import Path

from ...jobs import atomic
from ...jobs.spent import Spent
from ...mesh import MESH_TYPES, MeshError, quality, read_beam_mesh, write_mesh
from . import stored_mesh


def run(tasks, done):
    """Make the meshes of a bundle that are not there yet.

    Parameters
    ----------
    tasks : str or Path
        JSON file: ``folder`` and ``meshes``, each with ``name``, ``key`` and what `make` takes.
    done : str or Path
        JSON file to write: what was spent.
    """
    tasks, spent = atomic.read_json(tasks), Spent()
    folder = Path(tasks["folder"])
    folder.mkdir(parents=True, exist_ok=True)
    for task in tasks["meshes"]:
        path, notes = stored_mesh.mesh_path(folder, task["name"]), stored_mesh.notes_path(folder, task["name"])
        before = stored_mesh.notes(folder, task["name"])
        if before.get("key") == task["key"] and (path.exists() or "message" in before):
            continue
        begin = time.perf_counter()
        mesh, why = made(task)
        seconds = time.perf_counter() - begin
        # The notes name the mesh they belong to, so they go first and come last.
        notes.unlink(missing_ok=True)
        if mesh is None:
            path.unlink(missing_ok=True)
            atomic.write_json(notes, {"key": task["key"], "message": why})
            spent.add(stored_mesh.REFUSED, 0, seconds)
            continue
        write_mesh(path, mesh)
        figures = quality(mesh) | {"particles": len(mesh.points), "springs": len(mesh.edges)}
        atomic.write_json(notes, {"key": task["key"], "mesh_seconds": seconds} | figures)
        spent.add("mesh", len(mesh.points), time.perf_counter() - begin)
    atomic.write_json(done, spent.summary())


def made(source):
    """Mesh of what `make` takes, and nothing; or none, and why it cannot be made."""
    try:
        return make(source), ""
    except MeshError as error:  # the user's file: the message says it all
        return None, f"mesh: {error}"
    except MemoryError:
        return None, "mesh: there is not enough memory to make it; give a larger mesh size"


def make(source):
    """Mesh from ``length``, ``height`` and ``mesh_type`` and ``mesh_size``, or ``file`` and its ``unit``."""
    box = source["length"], source["height"]
    if "file" in source:
        return read_beam_mesh(source["file"], *box, source["unit"])
    return MESH_TYPES[source["mesh_type"]](*box, source["mesh_size"])


if __name__ == "__main__":
    run(*sys.argv[1:])

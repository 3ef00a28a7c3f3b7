"""Stage `mesh`: one VTU file a mesh, with its quality figures in a JSON file beside it."""

import sys
import time
from pathlib import Path

from ...jobs import atomic
from ...jobs.spent import Spent
from ...mesh import MESH_TYPES, MeshError, quality, read_beam_mesh, write_mesh


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
        path, notes = folder / f"{task['name']}.vtu", folder / f"{task['name']}.json"
        if path.exists() and notes.exists() and atomic.read_json(notes)["key"] == task["key"]:
            continue
        begin = time.perf_counter()
        try:
            mesh = make(task)
        except MeshError as error:  # the user's file: the message says it all
            raise SystemExit(str(error)) from None
        seconds = time.perf_counter() - begin
        # The notes name the mesh they belong to, so they go first and come last.
        notes.unlink(missing_ok=True)
        write_mesh(path, mesh)
        figures = quality(mesh) | {"particles": len(mesh.points), "springs": len(mesh.edges)}
        atomic.write_json(notes, {"key": task["key"], "mesh_seconds": seconds} | figures)
        spent.add("mesh", len(mesh.points), time.perf_counter() - begin)
    atomic.write_json(done, spent.summary())


def make(source):
    """Mesh from ``length``, ``height`` and ``mesh_type`` and ``mesh_size``, or ``file`` and its ``unit``."""
    box = source["length"], source["height"]
    if "file" in source:
        return read_beam_mesh(source["file"], *box, source["unit"])
    return MESH_TYPES[source["mesh_type"]](*box, source["mesh_size"])


if __name__ == "__main__":
    run(*sys.argv[1:])

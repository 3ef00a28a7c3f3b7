"""Stage `mesh`: a VTU file for each mesh of a beam or shape, with its quality and groups in a note beside it."""

import time
from functools import partial

from springtune.mesh.cells import quality
from springtune.mesh.sheets import GroupedMesh

from . import stored


def make(source):
    """Mesh of a beam or a shape."""
    if "outline" in source:
        from .task_values import make_shape  # here: most studies have no shapes

        return make_shape(source)
    return GroupedMesh(stored.make_beam(source))


def run(content, attempts):
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
            stored.write(folder, name, task["key"], None, made)
            continue
        mesh = made.mesh
        known |= quality(mesh) | {"particles": len(mesh.points), "springs": len(mesh.edges)}
        stored.write(folder, name, task["key"], made, known | {"edge_length": float(mesh.edge_lengths.mean())})

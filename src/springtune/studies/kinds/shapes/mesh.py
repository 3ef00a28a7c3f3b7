"""Stage `shape_mesh`: one mesh with its groups each shape, mesh type and mesh size."""

from functools import partial

from springtune.mesh.formats import read_shape
from springtune.mesh.outlines import mesh_shape

from ..scenes import mesh
from .task_values import shape_of


def make(source):
    """Mesh with its groups."""
    if "file" not in source:
        return mesh_shape(shape_of(source), source["mesh_size"], source["refined"])
    mesh.check_unchanged(source)
    return read_shape(source["file"], source["unit"])


run = partial(mesh.run, make=make)

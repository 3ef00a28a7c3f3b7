"""Meshes of shapes, which the stages `mesh` and `reference` make."""

from springtune.mesh.formats import read_shape
from springtune.mesh.outlines import mesh_shape

from .beam_mesh import check_unchanged
from .task_values import shape_of


def make_shape(source):
    """Mesh of a shape with its groups, generated or read from its ``file``."""
    if "file" in source:
        check_unchanged(source)
        return read_shape(source["file"], source["unit"])
    return mesh_shape(shape_of(source), source["mesh_size"], source["refined"])

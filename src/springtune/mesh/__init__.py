"""Meshes of a beam: their types, their quality and their files."""

from .files import read_mesh, write_mesh
from .free import free
from .structured import lattice, structured
from .triangles import TriangleMesh, quality, signed_areas

MESH_TYPES = {"structured": structured, "free": free}
"""Mesh type -> function (length, height, size) that makes it."""

__all__ = [
    "MESH_TYPES",
    "TriangleMesh",
    "free",
    "lattice",
    "quality",
    "read_mesh",
    "signed_areas",
    "structured",
    "write_mesh",
]

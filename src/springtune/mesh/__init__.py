"""Meshes of beams and shapes: their types, quality, checks, named groups and files."""

from .cells import Mesh, MeshError, corner_angles, quality, signed_areas
from .formats import read_beam_mesh, read_mesh, write_mesh
from .free import free
from .rows import ROW_HEIGHT, alternating, braced, isosceles, lattice, right, row_height, structured
from .types import MESH_TYPES, MeshType, mesh_type

__all__ = [
    "MESH_TYPES",
    "ROW_HEIGHT",
    "Mesh",
    "MeshError",
    "MeshType",
    "alternating",
    "braced",
    "corner_angles",
    "free",
    "isosceles",
    "lattice",
    "mesh_type",
    "quality",
    "read_beam_mesh",
    "read_mesh",
    "right",
    "row_height",
    "signed_areas",
    "structured",
    "write_mesh",
]

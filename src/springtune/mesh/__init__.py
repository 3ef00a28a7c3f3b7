"""Meshes of beams and shapes: their types, quality, checks, named groups and files.

`rows` and `free` mesh beams, `outlines` shapes, and `formats` reads and writes files.

The decorator `mesh_type` declares a function that meshes a box; `MESH_TYPES` finds all that this package's modules
and the user declare.

Examples
--------
>>> from springtune.mesh import MESH_TYPES, quality
>>> list(MESH_TYPES)
['structured', 'free', 'right', 'alternating', 'braced', 'isosceles-0.3', 'isosceles-0.5']
>>> mesh = MESH_TYPES["structured"](0.2, 0.04, 5e-3)
>>> print(len(mesh.points), "particles,", len(mesh.edges), "springs")
415 particles, 1143 springs
>>> print(f"{quality(mesh)['minimum_angle']:.1f} degrees at least")
29.4 degrees at least
"""

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

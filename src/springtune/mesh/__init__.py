"""Meshes of a beam: their types, their quality and their files."""

from functools import partial

from .cells import Mesh, corner_angles, quality, signed_areas
from .formats import MeshError, read_beam_mesh, read_mesh, write_mesh
from .free import free
from .rows import ROW_HEIGHT, isosceles, lattice, row_height, structured
from .squares import alternating, braced, right

ISOSCELES = {f"isosceles-{nu:g}": nu for nu in (0.3, 0.5)}
"""Mesh types of rows whose shape sets a Poisson's ratio, and that ratio [1]."""

MESH_TYPES = {
    "structured": structured,
    "free": free,
    "right": right,
    "alternating": alternating,
    "braced": braced,
} | {name: partial(isosceles, poisson_ratio=nu) for name, nu in ISOSCELES.items()}
"""Mesh type -> function (length, height, size) that makes it."""

QUADS = ("braced",)
"""Mesh types of quadrilaterals; the others are of triangles."""

__all__ = [
    "ISOSCELES",
    "MESH_TYPES",
    "QUADS",
    "ROW_HEIGHT",
    "Mesh",
    "MeshError",
    "alternating",
    "braced",
    "corner_angles",
    "free",
    "isosceles",
    "lattice",
    "quality",
    "read_beam_mesh",
    "read_mesh",
    "right",
    "row_height",
    "signed_areas",
    "structured",
    "write_mesh",
]

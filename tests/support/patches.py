"""Sheets that patch tests are done on, and what they find of a definition there."""

import numpy as np

import springtune as st
from springtune.mechanics.continuum import PatchTest
from springtune.mesh.rows import ROW_HEIGHT, lattice

HEIGHT, SIZE = 20e-3, 2e-3


def patch(mesh_type, length=0.1):
    """Mesh of ten cells over the height: of the exact lattice for rows of triangles, on which closed forms hold."""
    size = HEIGHT / (10 * ROW_HEIGHT) if mesh_type == "structured" else SIZE
    if mesh_type != "structured" and not mesh_type.startswith("isosceles"):
        return st.MESH_TYPES[mesh_type](length, HEIGHT, size)
    row_height = st.MESH_TYPES[mesh_type].row_height * size
    return lattice(round(length / size), round(HEIGHT / row_height), size, row_height)


def errors(name, mesh, nu):
    """Error of E and G [1], and the effective Poisson's ratio."""
    material = st.Material(1.0, nu, name="unit")
    springs = st.DEFINITIONS[name].springs(mesh, material, 1.0)
    young, ratio = PatchTest(mesh).axial(springs)
    shear = PatchTest(mesh).shear(springs)
    return young * springs.reference - 1, ratio, shear * springs.reference * 2 * (1 + nu) - 1


def disturbed(mesh, turn, size):
    """Renumbered, turned, made larger and moved away; its coordinates round otherwise."""
    order = np.random.default_rng(0).permutation(len(mesh.points))
    back, way = np.argsort(order), [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]
    return st.Mesh(size * (mesh.points[order] @ way + 3.0), back[mesh.triangles], back[mesh.quads])

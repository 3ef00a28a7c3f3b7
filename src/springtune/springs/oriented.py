"""Uniform stiffness from the affine moduli of the mesh along x: density that knows the directions of the springs.

If all springs followed the strain of the sheet (Cauchy and Born), a uniform network would have the moduli ``C_ijkl =
k / (A t) sum L^2 n_i n_j n_k n_l``. The stiffness makes Young's modulus along x, from the inverse of C, the
material's. This is an upper bound of a disordered network's modulus, so k is a lower bound; exact on a lattice.
Derived here.
"""

import numpy as np

from ..mesh.cells import Mesh
from ..problem.materials import Material
from .base import DefinitionError, Springs, definition
from .lattice import uniform


@definition("oriented", order=50, uniform=True)
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Uniform stiffness from the affine moduli of the mesh along x, directions of springs and outline included.

    Raises DefinitionError if the springs of the mesh do not carry a load along x.

    Source: Cauchy's and Born's affine moduli, textbook form (derived).
    """
    x, y = (mesh.points[mesh.edges[:, 1]] - mesh.points[mesh.edges[:, 0]]).T
    parts = np.stack([x * x, y * y, x * y])  # of the strain of each spring: xx, yy and shear
    moduli = np.einsum("is,js->ij", parts / (x * x + y * y), parts) / mesh.area
    if np.linalg.cond(moduli) > 1e12:
        raise DefinitionError("needs springs in three directions; choose a mesh with triangles")
    young_modulus = 1 / np.linalg.inv(moduli)[0, 0]
    return Springs(material.young_modulus * thickness / young_modulus, uniform(mesh))

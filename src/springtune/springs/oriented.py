"""Uniform stiffness from the affine moduli of the mesh along x: density that knows the directions of the springs.

Were all springs to follow the strain of the sheet (Cauchy and Born), the moduli of a uniform network would be
``C_ijkl = k / (A t) sum L^2 n_i n_j n_k n_l``. The stiffness is the one that makes Young's modulus along x, from the
inverse of C, that of the material. An upper bound of the modulus of a disordered network, hence a lower one of k; exact
on a lattice. Derived here.
"""

import numpy as np

from ..mesh import Mesh
from ..problem.materials import Material
from .base import DefinitionError, Springs, definition
from .lattice import uniform


@definition("oriented", order=50, uniform=True)
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Uniform stiffness from the affine moduli of the mesh along x, directions of springs and outline included.

    Parameters and returns as in `springtune.springs.lattice.springs`; raises DefinitionError where the springs of the
    mesh do not carry a load along x.
    """
    x, y = (mesh.points[mesh.edges[:, 1]] - mesh.points[mesh.edges[:, 0]]).T
    parts = np.stack([x * x, y * y, x * y])  # of the strain of each spring: xx, yy and shear
    moduli = np.einsum("is,js->ij", parts / (x * x + y * y), parts) / mesh.area
    if np.linalg.cond(moduli) > 1e12:
        raise DefinitionError("needs springs in three directions; choose a mesh with triangles")
    young_modulus = 1 / np.linalg.inv(moduli)[0, 0]
    return Springs(material.young_modulus * thickness / young_modulus, uniform(mesh))

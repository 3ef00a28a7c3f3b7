"""Springs matched to finite elements at nu = 1/3: triangle and square.

The linearised spring element matches the matrix of the finite element, which requires nu = 1/3 in the plane (Lloyd,
Szekely and Harders, IEEE TVCG 13(5):1081, 2007; first page read, formulas derived again).

- Equilateral triangle: ``sqrt(3)/4 E t`` for each of its edges, which is `springtune.springs.lattice`; exact.
- Square: ``5/16 E t`` for each side and ``7/16 E t`` for each diagonal, which fits the off-diagonal blocks of the
  bilinear element. In tension 11.8 % too soft with nu = .412; 3/8 each, as in `springtune.springs.lattice`, is exact.

Assumptions: nu = 1/3, near-equilateral triangles, squares.
"""

import numpy as np

from ..mesh.cells import Mesh
from ..problem.materials import Material
from . import lattice
from .base import DefinitionError, Springs, definition, from_rectangles, rectangle_sides

SIDE, DIAGONAL = 5 / 16, 7 / 16  # stiffness that a square gives its sides and diagonals over E t [1]


@definition("lloyd", order=70)
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Springs matched to finite elements at nu = 1/3: equilateral triangle, or square (Lloyd 2007).

    Raises DefinitionError on quadrilaterals other than squares.

    Source: Lloyd, Szekely and Harders, IEEE TVCG 13(5):1081, 2007, its first page (abstract, derived).
    """
    if not len(mesh.quads):
        return lattice.springs(mesh, material, thickness)
    along, across = rectangle_sides(mesh)
    if (np.abs(along / across - 1) > 0.02).any():
        found = f"needs squares and the mesh has rectangles of {1e3 * along[0]:.4g} x {1e3 * across[0]:.4g} mm"
        raise DefinitionError(f"{found}; choose a mesh size that divides both sides of the beam")
    side, diagonal = np.full(len(along), SIDE), np.full(len(along), DIAGONAL)
    return Springs(material.young_modulus * thickness, from_rectangles(mesh, side, side, diagonal))

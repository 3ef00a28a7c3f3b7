r"""Springs alone that are nearest to a material of any anisotropy in the energy of even strains, none negative.

A spring of stiffness k and length L along the unit vector n, in an evenly strained cell of area A, has the stiffness
``w m m^T`` with ``w = k L^2 / (A t)`` and, in Voigt's order, ``m = (n_x^2, n_y^2, n_x n_y)``. The springs of a cell
minimise

.. math:: \Big\| S^{1/2} \Big( \sum_i w_i m_i m_i^T - C \Big) S^{1/2} \Big\|_F, \quad S = C^{-1}, \quad w \ge 0,

the squared relative errors of their energy: soft and stiff directions count alike. Where no spring is zero,

.. math:: \sum_j (m_i^T S m_j)^2 w_j = m_i^T S m_i = 1 / E(n_i),

the inverse of Young's modulus along the spring. Springs always have C12 = C66 (Cauchy). Derived here. Exact

- at nu = 1/3 on equilateral triangles, where it is `springtune.springs.lattice`;
- for orthotropic materials with C12 = C66, axes along the mesh, on rows of isosceles triangles of base a and height
  ``h = a/2 sqrt(C22 / C12)``, with springs that are never negative, and on rectangles of sides a, b with ``C12 / C22
  <= (a/b)^2 <= C11 / C12``.
"""

import numpy as np

from ..mesh.cells import Mesh, signed_areas
from ..problem.materials import AnyMaterial
from .base import Springs, definition, membrane_stiffness, rectangle_sides
from .element_fit import least_squares


@definition("energy-fit", order=145, anisotropic=True)
def springs(mesh: Mesh, material: AnyMaterial, thickness: float) -> Springs:
    """Springs fitted by least squares to the strain energy of any material, none negative: C12 = C66 whatever is asked.

    Raises DefinitionError on quadrilaterals other than rectangles.

    Source: own rule (derived).
    """
    reference = membrane_stiffness(material, 1.0)
    compliance = np.linalg.inv(material.plane_stress / reference)
    parts = {}
    if len(mesh.triangles):
        corners = mesh.points[mesh.triangles]
        vectors = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)  # side i is opposite corner i
        parts[3] = _fitted(vectors, signed_areas(mesh.points, mesh.triangles), compliance)
    if len(mesh.quads):
        rectangle_sides(mesh)
        ends = ((0, 1), (1, 2), (0, 2), (1, 3))
        vectors = np.stack([mesh.points[mesh.quads[:, j]] - mesh.points[mesh.quads[:, i]] for i, j in ends], axis=1)
        first, second, diagonal, other = _fitted(vectors, signed_areas(mesh.points, mesh.quads), compliance).T
        parts[4] = np.stack([first / 2, second / 2, first / 2, second / 2, diagonal, other], axis=1)
    return Springs(reference * thickness, mesh.sum_to_edges(parts))


def _fitted(vectors: np.ndarray, areas: np.ndarray, compliance: np.ndarray) -> np.ndarray:
    """Stiffness of springs over reference and thickness [1], from their vectors, shape (n_cells, n_springs, 2)."""
    squares = (vectors**2).sum(axis=2)
    x, y = (vectors / np.sqrt(squares)[..., None]).transpose(2, 0, 1)
    strains = np.stack([x * x, y * y, x * y], axis=2)
    products = strains @ compliance @ strains.transpose(0, 2, 1)
    return least_squares(products**2, np.diagonal(products, axis1=1, axis2=2)) * areas[:, None] / squares

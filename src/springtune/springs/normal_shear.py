r"""Normal and shear springs: each side of a triangle resists its stretch and its slip, for any Poisson's ratio.

A side of length L and direction n stretches by ``L e_nn`` and slips by ``L e_ns``, with e the strain of the triangle
and s the normal of the side. Slip that is measured from displacements would resist rotations; slip that is measured
from the strain does not. Each triangle of area A and sides L_i gives its three sides

.. math:: k_n = \frac{2 A}{\sum L_i^2} \frac{E t}{1 - \nu}, \quad
          k_s = \frac{2 A}{\sum L_i^2} \frac{(1 - 3 \nu) E t}{1 - \nu^2}, \quad
          W = \tfrac{1}{2} k_n \sum (l_i - L_i)^2 + \tfrac{1}{2} k_s \sum (L_i e_{ns, i})^2 .

Normal springs alone have the bulk modulus, both together the shear modulus, as a mean over all directions. For nu >
1/3 k_s is negative. The slip of side i follows from the changes q of the squared lengths of the sides, counted round
the triangle,

.. math:: L_i e_{ns, i} = \frac{L_i}{8 A} \Big( q_{i+2} - q_{i+1} - \frac{L_{i+2}^2 - L_{i+1}^2}{L_i^2} q_i \Big),

so slip needs no energy of its own: W_s is a coupling of squared lengths (`springtune.springs.delingette`), and e is
Green's strain. E, nu and G are exact on equilateral rows; on free meshes of a/H = 0.1 E and G are within 6.1 % and nu
within 0.06. Random Delaunay meshes are mostly unstable for nu >= 0.4. On alternating diagonals G is exact and the
network isotropic.

After the distinct lattice spring model (G.-F. Zhao, Int. J. Numer. Anal. Methods Geomech. 35:859, 2011, abstract read):
shear springs take their slip from the local strain, and Cauchy and Born's rule gives both stiffnesses. The plane
formulas and the strain of triangles in place of a fit to the neighbours are derived here.
"""

import math

import numpy as np

from ..mesh.cells import Mesh, signed_areas
from ..problem.materials import Material
from .base import Springs, definition


@definition("normal-shear", order=222, cells=(3,))
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Normal springs, and shear springs of the local strain (after Zhao 2011): any nu on lattices, no tuning.

    Source: Zhao, Int. J. Numer. Anal. Methods Geomech. 35:859, 2011 (abstract, derived).
    """
    from ..mechanics.energies import BiquadraticEnergy  # here: see `springtune.springs`

    nu = material.poisson_ratio
    reference = material.young_modulus * thickness / (math.sqrt(3) * (1 - nu))  # of an edge inside a lattice
    squares = mesh.edge_lengths[mesh.cell_edges[3]] ** 2
    normal = math.sqrt(12) * signed_areas(mesh.points, mesh.triangles) / squares.sum(axis=1)
    normal = np.repeat(normal[:, None], 3, axis=1)
    form = slip_form(mesh, normal * (1 - 3 * nu) / (1 + nu))
    tensile, coupling = form[:, [0, 1, 2], [0, 1, 2]], form[:, [1, 2, 0], [2, 0, 1]]
    energies = (BiquadraticEnergy(mesh.points, mesh.triangles, tensile, coupling),)
    return Springs(reference, mesh.sum_to_edges({3: normal}), energies if abs(1 - 3 * nu) > 1e-15 else ())


def slip_form(mesh: Mesh, stiffness: np.ndarray) -> np.ndarray:
    """Twice the quadratic form of q of shear springs on the sides of each triangle, shape (n_triangles, 3, 3)."""
    squares = mesh.edge_lengths[mesh.cell_edges[3]] ** 2
    after, before = np.roll(squares, -1, axis=1), np.roll(squares, -2, axis=1)
    unit = np.eye(3)
    slips = np.roll(unit, 2, axis=1) - np.roll(unit, 1, axis=1) - ((before - after) / squares)[:, :, None] * unit
    factors = stiffness * squares / (32 * signed_areas(mesh.points, mesh.triangles)[:, None] ** 2)
    return slips.transpose(0, 2, 1) @ (factors[:, :, None] * slips)

r"""Triangular biquadratic springs (Delingette, IEEE TVCG 14(2):329, 2008): linear triangles written as springs.

With ``lambda = E nu / (1 - nu^2)``, ``mu = E (1 - nu) / (1 - nu^2)`` and c_i the cotangent of the angle at corner i of
a triangle of area A, its side opposite corner i has the tensile and two sides i, j the coupling stiffness

.. math:: k_i = t \frac{2 c_i^2 (\lambda + \mu) + \mu}{16 A}, \quad
          \gamma_{ij} = t \frac{2 c_i c_j (\lambda + \mu) - \mu}{16 A},

.. math:: W = \sum_i \tfrac{k_i}{4} (l_i^2 - L_i^2)^2
            + \sum_{i<j} \tfrac{\gamma_{ij}}{2} (l_i^2 - L_i^2) (l_j^2 - L_j^2).

Together they are the St. Venant-Kirchhoff energy of the linear triangle, exactly, on any mesh, for any nu and at any
strain. At rest side i has the spring constant ``2 L_i^2 k_i``. On an equilateral triangle the coupling vanishes at
nu = 1/3; without it E is wrong by (10 - 6 nu) / (9 (1 - nu^2)) there.
"""

import numpy as np

from ..mesh import Mesh, corner_angles, signed_areas
from ..problem.materials import Material
from .base import Springs, definition, triangles_only, zero


@definition("delingette", order=230, cells=(3,))
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Tensile and coupling springs of squared lengths (Delingette 2008): equal to linear triangles, any nu, any mesh.

    Parameters and returns as in `springtune.springs.lattice.springs`; raises DefinitionError on quadrilaterals.
    """
    return _springs(mesh, material, thickness, coupled=True)


@definition("delingette-tensile", order=180, cells=(3,))
def tensile(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """The tensile part of Delingette's springs alone: what is left without coupling.

    Parameters and returns as in `springtune.springs.lattice.springs`; raises DefinitionError on quadrilaterals.
    """
    return _springs(mesh, material, thickness, coupled=False)


def _springs(mesh: Mesh, material: Material, thickness: float, coupled: bool) -> Springs:
    from ..mechanics.energies import BiquadraticEnergy  # here: see `springtune.springs`

    triangles_only(mesh)
    nu = material.poisson_ratio
    first, second = nu / (1 - nu**2), 1 / (1 + nu)  # lambda and mu over E
    cotangents = 1 / np.tan(corner_angles(mesh.points, mesh.triangles))
    areas = signed_areas(mesh.points, mesh.triangles)[:, None]
    stiffness = (2 * (first + second) * cotangents**2 + second) / (16 * areas)
    coupling = None
    if coupled:
        products = np.roll(cotangents, -1, axis=1) * np.roll(cotangents, -2, axis=1)
        coupling = (2 * (first + second) * products - second) / (16 * areas)
    squares = mesh.edge_lengths[mesh.cell_edges[3]] ** 2
    return Springs(
        material.young_modulus * thickness,
        zero(mesh),
        (BiquadraticEnergy(mesh.points, mesh.triangles, stiffness, coupling),),
        linear_springs=mesh.sum_to_edges({3: 2 * squares * stiffness}),
    )

r"""Axial and rotational springs: the constraint of a triangle's area as springs, exact for any nu on any triangles.

With the bulk modulus ``K = E / (2 (1 - nu))``, the shear modulus G and the angles a_i at its corners, each triangle of
area A gives its side opposite corner i and its corner i

.. math:: k_i = K t \cot a_i, \quad
          \beta_i = \frac{A t}{\sin a_1 \sin a_2 \sin a_3 \sin a_i}
                    ( (G - K) \cos a_i + K \cos a_j \cos a_k ),

.. math:: W = \tfrac{1}{2} \sum k_i (l_i - L_i)^2 + \tfrac{1}{2} \sum \beta_i (\theta_i - a_i)^2 .

To first order the sum is the energy of the linear triangle, on any mesh and for any nu. Proof: with the directions n_i
of the sides at doubled angles as unit vectors c_i, a stretch is ``m + c_i . x`` of the mean strain m and the deviator
x, and a change of an angle is the difference of two slips, without m. The weights cot a_i make the coupling of m and x
vanish and give m its modulus 2 K; three changes of angles have independent squares, so one choice of beta gives x the
modulus 2 G. On equilateral triangles this is `springtune.springs.angular`.

Shear springs, see `springtune.springs.normal_shear`, can take any part: ``K_s t cot a_i`` on the sides leaves ``(G -
K) cos a_i + (K - K_s) cos a_j cos a_k`` to the angles. With ``K_s = K (1 - 3 nu) / (1 + nu)`` equilateral triangles
need no rotational spring. Here K_s = 0.

On Delaunay triangles no spring inside is negative; on the outline those opposite an obtuse angle are.

After IELSM (Li and He, arXiv 2605.15209, 2026, abstract read): axial springs and a volumetric constraint, which is
decomposed into axial, shear and rotational springs. The decomposition on triangles is derived here.
"""

import math

import numpy as np

from ..mesh.cells import Mesh, corner_angles, signed_areas
from ..problem.materials import Material
from .base import NO_STIFFNESS, Springs, definition


@definition("ielsm", order=224, cells=(3,))
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Axial and rotational springs that decompose an area constraint (after IELSM 2026): any nu, any triangles.

    Source: Li and He, arXiv 2605.15209, 2026 (abstract, derived).
    """
    from ..mechanics.energies import AngleEnergy  # here: see `springtune.springs`

    nu = material.poisson_ratio
    bulk, shear = math.sqrt(3) / 2, math.sqrt(3) / 2 * (1 - nu) / (1 + nu)  # over the stiffness inside a lattice
    reference = material.young_modulus * thickness / (math.sqrt(3) * (1 - nu))
    relative = mesh.sum_to_edges({3: bulk / np.tan(corner_angles(mesh.points, mesh.triangles))})
    relative[np.abs(relative) <= NO_STIFFNESS] = 0.0  # opposite right angles
    return Springs(reference, relative, (AngleEnergy(mesh.points, mesh.triangles, angle_moduli(mesh, bulk, shear)),))


def angle_moduli(mesh: Mesh, bulk: float, shear: float, slip: float = 0.0) -> np.ndarray:
    """Moduli beta of the corners of each triangle [m2], shape (n_triangles, 3), of K, G and K_s."""
    angles = corner_angles(mesh.points, mesh.triangles)
    sines, cosines = np.sin(angles), np.cos(angles)
    products = np.roll(cosines, -1, axis=1) * np.roll(cosines, -2, axis=1)
    scale = signed_areas(mesh.points, mesh.triangles) / sines.prod(axis=1)
    return scale[:, None] * ((shear - bulk) * cosines + (bulk - slip) * products) / sines

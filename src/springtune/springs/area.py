r"""Springs at nu = 1/3 that carry the shear modulus, and an area energy that carries the rest: any Poisson's ratio.

Central springs obey Cauchy's relation, so isotropic networks have nu = 1/3. Springs of ``E_s = 8 G / 3`` (see
`springtune.springs.lattice`) have the shear modulus G; an energy of the area of each cell,

.. math:: W_A = \tfrac{1}{2} K_A t (A - A_0)^2 / A_0, \quad K_A = \frac{E (3 \nu - 1)}{2 (1 - \nu^2)},

adds the rest of the bulk modulus. K_A is negative for nu < 1/3. The sum stays positive on equilateral rows and on
rectangles with both diagonals, where E, nu and G are exact. On disordered meshes it may not: networks on random
Delaunay meshes are mostly unstable for nu <= 0.2, and those on free meshes of a/H = 0.1 at nu = -0.3. On these E is
within 6 % for nu >= 0.3, 9.5 % at nu = 0 and 11 % at -0.1; nu is within 0.04 and G within 3 %. In plane strain K_A is
``lambda - G``, with lambda of three dimensions, and zero at nu = 1/4.

The coarse models of red cells have the same two parts (Fedosov, Caswell and Karniadakis, CMAME 199:1937, 2010, abstract
read): bonds of stiffness k at rest and areas of stiffness k_d have, on the lattice, ``G t = sqrt(3)/4 k``, ``K t =
sqrt(3)/2 k + k_d`` and ``E = 4 K G / (K + G)``, which are these springs and ``k_d = K_A t``.

After Golec and others (The Visual Computer 36, 2020, hal-02124471, abstract read): springs keep the Cauchy part, a
volume energy the rest. The plane form is derived here.
"""

import numpy as np

from ..mesh.cells import Mesh
from ..problem.materials import Material
from .base import Springs, definition
from .lattice import COEFFICIENT, half_weight


@definition("area", order=210)
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Springs for the shear modulus and an area energy for the rest (after Golec 2019): any nu, no tuning.

    Source: Golec and others, The Visual Computer 36, 2020, hal-02124471 (abstract, derived).
    """
    from ..mechanics.energies import AreaEnergy  # here: see `springtune.springs`

    nu = material.poisson_ratio
    spring_modulus = 4 / (3 * (1 + nu))  # over E
    reference = COEFFICIENT * spring_modulus * material.young_modulus * thickness
    modulus = (3 * nu - 1) / (2 * (1 - nu**2)) / (COEFFICIENT * spring_modulus)
    energies = [AreaEnergy(mesh.points, corners, np.full(len(corners), modulus)) for corners in mesh.cells.values()]
    return Springs(reference, half_weight(mesh), tuple(energies) if abs(modulus) > 1e-15 else ())

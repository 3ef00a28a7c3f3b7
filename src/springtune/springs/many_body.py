r"""Springs and a volume factor: what frees Poisson's ratio in LAMMPS, triangle by triangle.

LAMMPS (``bond_style bpm/spring`` with ``volume/factor yes``) estimates the area of a particle by the sum V of its
squared bond lengths l. A bond of length r0 at rest repels with

.. math:: k (r_0 - r) + a_v \Big( \sqrt{\frac{V_i + V_j}{V_{0,i} + V_{0,j}}} - \frac{r}{r_0} \Big).

On an equilateral lattice of edges a the second term does nothing in dilation and adds a_v / a to k in shear. So

.. math:: k = \frac{E t}{\sqrt{3} (1 - \nu)}, \quad a_v = \frac{(1 - 3 \nu) E t a}{\sqrt{3} (1 - \nu^2)}

have E and nu there: the normal stiffness and a times the shear stiffness of `springtune.springs.normal_shear`. LAMMPS
itself confirms it. At an outline V_0 differs between particles, and the forces have no energy.

Here the estimate is of each triangle, whose ``V = \sum l^2``, so that the forces have one: springs of nu = 1/3 that
carry the shear modulus, as in `springtune.springs.area`, and

.. math:: W = \tfrac{1}{2} K_A t A_0 \Big( \frac{V - V_0}{V_0} \Big)^2, \quad K_A = \frac{E (3 \nu - 1)}{2 (1 - \nu^2)},

a coupling of squared lengths (`springtune.springs.delingette`). E, nu and G are exact on equilateral rows. On free
meshes it is as good as `area`, and stable for negative nu, too.

The law is that of LAMMPS's manual (read; after Clemmer, Monti and Lechman, Soft Matter 20:1702, 2024, not read). Its
moduli in the plane and the form on triangles are derived here.
"""

import numpy as np

from ..mesh.cells import Mesh, signed_areas
from ..problem.materials import Material
from .base import Springs, definition
from .lattice import COEFFICIENT, half_weight


@definition("many-body", order=226, cells=(3,))
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Springs, and the volume factor of LAMMPS on each triangle: any nu on lattices, no tuning.

    Raises DefinitionError on quadrilaterals.

    Source: LAMMPS's manual, ``bond_style bpm/spring``; the form on triangles is ours (read, derived).
    """
    from ..mechanics.energies import BiquadraticEnergy  # here: see `springtune.springs`

    nu = material.poisson_ratio
    spring_modulus = COEFFICIENT * 4 / (3 * (1 + nu))  # over E
    modulus = (3 * nu - 1) / (2 * (1 - nu**2)) / spring_modulus
    squares = (mesh.edge_lengths[mesh.cell_edges[3]] ** 2).sum(axis=1)
    factor = 2 * modulus * signed_areas(mesh.points, mesh.triangles) / squares**2
    of_corners = np.repeat(factor[:, None], 3, axis=1)
    energies = (BiquadraticEnergy(mesh.points, mesh.triangles, of_corners, of_corners),)
    reference = spring_modulus * material.young_modulus * thickness
    return Springs(reference, half_weight(mesh), energies if abs(1 - 3 * nu) > 1e-15 else ())

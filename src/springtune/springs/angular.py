r"""Springs and angular springs: the angles of each triangle carry what the springs cannot.

On an equilateral lattice of edge a

.. math:: W = \sum_{edges} \tfrac{1}{2} k (l - L)^2 + \sum_{angles} \tfrac{1}{2} \beta (\theta - \theta_0)^2, \quad
          k = \frac{E t}{\sqrt{3} (1 - \nu)}, \quad
          \beta = \frac{a^2 E t (1 - 3 \nu)}{6 \sqrt{3} (1 - \nu^2)}

has the bulk modulus ``sqrt(3) k / 2`` and the shear modulus ``sqrt(3) k / 4 + 3 sqrt(3) beta / (2 a^2)``: exact for
every nu. beta is negative above 1/3, where the network stays stable. Outline edges have k/2; a is of the equilateral
triangle of the same area. After Keating and Kirkwood, as reviewed by Ostoja-Starzewski (Appl. Mech. Rev. 55:35,
2002, abstract read); derived and checked here. Assumptions: near-equilateral triangles.
"""

import math

import numpy as np

from ..mesh.cells import Mesh, signed_areas
from ..problem.materials import Material
from .base import Springs, definition
from .lattice import half_weight


@definition("angular", order=220, cells=(3,))
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Springs for the bulk modulus and angular springs for the rest (Keating): any nu on lattices, no tuning.

    Source: Keating and Kirkwood, reviewed by Ostoja-Starzewski, Appl. Mech. Rev. 55:35, 2002 (abstract, derived).
    """
    from ..mechanics.energies import AngleEnergy  # here: see `springtune.springs`

    nu = material.poisson_ratio
    reference = material.young_modulus * thickness / (math.sqrt(3) * (1 - nu))
    squares = 4 / math.sqrt(3) * signed_areas(mesh.points, mesh.triangles)
    modulus = squares * (1 - 3 * nu) / (6 * (1 + nu))
    energies = (AngleEnergy(mesh.points, mesh.triangles, modulus),) if np.abs(1 - 3 * nu) > 1e-15 else ()
    return Springs(reference, half_weight(mesh), energies)

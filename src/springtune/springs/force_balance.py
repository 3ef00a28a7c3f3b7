r"""Springs of a lattice, balanced on disordered points: an even tension stretches all of them alike.

A sheet under an even tension grows by one factor everywhere. A network does so only if the forces ``k L n`` of equal
strains cancel at each particle, and on the outline are the tension's. The springs of `springtune.springs.lattice` are
changed towards that by one solve: under the tension at which a sheet of nu = 1/3 has the strain 1, a spring of length L
lengthens by e, and

.. math:: k = k_0 \, e / L.

Forces ``k L = k_0 e`` are in balance, since those of a solution are. So the stiffness against even tension, E / (1 -
nu) with nu = 1/3, is exact on any mesh; shear is not, since springs of one triangle pull each other's way in it.

After Kot (ChemEngineering 5(1):3, 2021, abstract read), who balances forces on random points in space to lessen the
scatter of moduli. The plane form, by a solve in place of an iteration, is derived here. Assumptions: one part.
"""

import numpy as np

from ..mesh.cells import Mesh
from ..problem.materials import Material
from . import lattice
from .base import Springs, check_not_negative, definition
from .identification import tested_body


@definition("force-balance", order=195, cost=1)
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Springs of `lattice` balanced under even tension (after Kot 2021): its stiffness is exact, nu = 1/3.

    Raises DefinitionError where a spring becomes negative, and on meshes of several parts.

    Source: Kot, ChemEngineering 5(1):3, 2021; the solve in the plane is ours (abstract, derived).
    """
    from ..mechanics.continuum import outline_forces  # here: see `springtune.springs`
    from ..mechanics.network import Network

    found = lattice.springs(mesh, material, thickness)
    network = Network(mesh, tested_body(mesh), found.relative)
    tension = material.young_modulus * thickness / (1 - 1 / 3) / found.reference
    moved = network.expand(network.rest_factor.solve(network.reduce(tension * outline_forces(mesh, np.eye(2)))))
    growth = np.einsum("ij,ij->i", network.rest_vectors, network.end_differences(moved)) / network.rest_lengths**2
    return Springs(found.reference, check_not_negative(found.relative * growth), evaluations=1)

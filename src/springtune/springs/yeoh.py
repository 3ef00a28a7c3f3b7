r"""Sheets of rubber that was tested: linear triangles of Yeoh's law, written as springs of zero rest length and areas.

The law of a `springtune.Rubber`, which `springtune.fit_rubber` fits to a uniaxial test (O. H. Yeoh, Rubber Chem.
Technol. 63:792, 1990, not read), is

.. math:: W = \sum_{n=1}^{3} c_n (I_1 - 3)^n, \quad I_1 = tr C + J^{-2}.

``tr C A_0`` of a triangle is half the sum over its sides of the opposite angle's cotangent times the squared length,
and J its area over the one at rest. So springs of zero rest length, whose stiffness depends on I_1, and areas are
exactly linear triangles of this law, on any mesh and at any strain, see `springtune.mechanics.energies.YeohEnergy`.
One term is `neo-hooke` of an incompressible sheet. Beyond the test's I_1 the law is extrapolated, and the answer's
message says so.
"""

import numpy as np

from ..mesh.cells import Mesh
from ..problem.materials import Material, Rubber
from .base import DefinitionError, Springs, definition


@definition("yeoh", order=245, cells=(3,), finite_strain=True)
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Springs of zero rest length and areas: equal to linear triangles of rubber fitted to a uniaxial test.

    The material must be a `springtune.Rubber`. Raises DefinitionError for others and on quadrilaterals.

    Source: Yeoh, Rubber Chem. Technol. 63:792, 1990; the law as other texts have it (not read, derived).
    """
    from ..mechanics.energies import YeohEnergy  # here: see `springtune.springs`
    from .neo_hooke import of_rubber

    if not isinstance(material, Rubber):
        remedy = "give springtune.fit_rubber('uniaxial.csv'), in a study {uniaxial_test: uniaxial.csv}, or 'neo-hooke'"
        raise DefinitionError(f"needs a material that is fitted to a test and {material.name!r} is none; {remedy}")
    over = np.array(material.coefficients) / material.young_modulus
    energy = YeohEnergy(mesh.points, mesh.triangles, np.tile(over, (len(mesh.triangles), 1)), material.largest)
    return of_rubber(mesh, material, thickness, energy, 2 * over[0])

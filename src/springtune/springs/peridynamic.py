r"""Bonds of peridynamics, over all edges and bonds of a mesh (Silling, J. Mech. Phys. Solids 48:175, 2000; not read).

Particles of areas A within a horizon h have bonds of stiffness ``c A_i A_j t^2 / L`` with the micromodulus c; in plane
stress ``c = 9 E / (pi t h^3)``, which is ``6 E / (t m)`` with ``m = 2 pi h^3 / 3``, the sum of ``A_j L`` over a full
horizon. At the outline horizons are cut, and on few shells the sum is not the integral. With the particles' own sums

.. math:: k_{ij} = 3 E t \frac{A_i A_j}{L_{ij}} \Big( \frac{1}{m_i} + \frac{1}{m_j} \Big), \quad
          m_i = \sum_j A_j L_{ij},

``sum k L^2 = 3 E t A`` is exact: the correction of surfaces and of volumes at once, derived here, in the place of
that by neighbours' volumes (Bobaru and others' handbook; abstract read). nu = 1/3 in plane stress and 1/4 in plane
strain, as of all central springs.

`springtune.mesh.sheets.bonded` joins the particles within a horizon. Without bonds a horizon is one
shell, the edges. Assumptions: many directions, and a horizon far below the body's height: with bonds of two or three
edges on 5 mm in 40 mm a pressed side moves by a quarter to a half too much, see docs/catalogue.md.
"""

import numpy as np

from ..mesh.cells import Mesh
from ..problem.materials import Material
from .base import Springs, definition


@definition("peridynamic", order=45)
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Bonds of peridynamics over all shells that the mesh joins (Silling 2000), surfaces corrected: nu = 1/3.

    Source: Silling, J. Mech. Phys. Solids 48:175, 2000; the correction is ours (not read, derived).
    """
    first, second = mesh.edges.T
    areas, lengths = mesh.particle_areas, mesh.edge_lengths
    sums = np.bincount(first, areas[second] * lengths, len(areas))
    sums += np.bincount(second, areas[first] * lengths, len(areas))
    relative = 3 * areas[first] * areas[second] / lengths * (1 / sums[first] + 1 / sums[second])
    return Springs(material.young_modulus * thickness, relative)

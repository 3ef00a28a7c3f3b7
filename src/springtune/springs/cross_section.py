r"""Springs as bars whose cross-section is the thickness times the dual edge: a rule of many lattice programs.

.. math:: k = E A / L, \quad A = t \sum_T \tfrac{L}{2} \cot \alpha_T,

where the dual edge joins the circumcentres of the cells at the spring, and alpha is the angle opposite to it. Bars in
several directions share one sheet, and each is counted as if it were alone: evenly strained, such springs have

.. math:: \sum k L^2 = 2 E t A_{sheet}, \quad \text{and an isotropic sheet needs } 3 E t A_{sheet}.

So the rule is a third too soft: E of 2/3 on equilateral rows, with nu = 1/3 whatever is asked. Derived here; the rule
has no source of its own. Assumptions: Delaunay triangles, else a spring is negative.
"""

import numpy as np

from ..mesh.cells import Mesh, corner_angles
from ..problem.materials import Material
from .base import Springs, check_not_negative, definition


@definition("cross-section", order=95, cells=(3,))
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Bars of the section thickness times dual edge, E A / L: a third too soft, nu = 1/3.

    Raises DefinitionError on quadrilaterals, and where the mesh is not Delaunay.

    Source: used in lattice programs; no text at hand (derived).
    """
    halves = 0.5 / np.tan(corner_angles(mesh.points, mesh.triangles))
    return Springs(material.young_modulus * thickness, check_not_negative(mesh.sum_to_edges({3: halves})))

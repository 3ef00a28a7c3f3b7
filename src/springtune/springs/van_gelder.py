r"""Springs from the areas of the triangles around them (Van Gelder, J. Graphics Tools 3(2), 1998).

For nu = 0

.. math:: k_c = E t \sum_T \frac{A_T}{|c|^2},

in general

.. math:: k_c = \sum_T \frac{E t}{1 + \nu} \frac{A_T}{|c|^2}
          + \frac{E t \nu}{1 - \nu^2} \frac{|a|^2 + |b|^2 - |c|^2}{8 A_T}

with a, b the other sides of triangle T. The second term is half the cotangent of the opposite angle: negative for an
obtuse one.

The network's nu stays that of the mesh, 1/3 on a lattice; the general form's nu scales E wrongly, by (3 - nu) / (3 (1
- nu^2)) on a lattice, where the form for nu = 0 is exact.

Public code that cites the article has the form for nu = 0; the general one is derived from its abstract. Assumptions:
triangles.
"""

from ..mesh.cells import Mesh, signed_areas
from ..problem.materials import Material
from .base import Springs, check_not_negative, definition


@definition("van-gelder", order=80, cells=(3,))
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Springs by area over squared length, the form for nu = 0 (Van Gelder 1998): exact on lattices with no tuning.

    Raises DefinitionError on quadrilaterals.

    Source: Van Gelder, J. Graphics Tools 3(2), 1998, its abstract and public code that cites it (read).
    """
    areas = signed_areas(mesh.points, mesh.triangles)[:, None]
    squares = mesh.edge_lengths[mesh.cell_edges[3]] ** 2
    return Springs(material.young_modulus * thickness, mesh.sum_to_edges({3: areas / squares}))


@definition("van-gelder-general", order=90, cells=(3,))
def general(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Springs by area over squared length, the general form (Van Gelder 1998), whose nu only scales E.

    Raises DefinitionError on quadrilaterals, and for angles so obtuse that a stiffness is negative.

    Source: Van Gelder, J. Graphics Tools 3(2), 1998 (abstract, derived).
    """
    areas = signed_areas(mesh.points, mesh.triangles)[:, None]
    squares = mesh.edge_lengths[mesh.cell_edges[3]] ** 2
    nu = material.poisson_ratio
    half_cotangents = (squares.sum(axis=1, keepdims=True) - 2 * squares) / (8 * areas)
    parts = areas / squares / (1 + nu) + nu / (1 - nu**2) * half_cotangents
    return Springs(material.young_modulus * thickness, check_not_negative(mesh.sum_to_edges({3: parts})))

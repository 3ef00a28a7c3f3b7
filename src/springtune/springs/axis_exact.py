r"""Springs whose E and nu along x and y are exact, and whose shear modulus pays for it.

Rectangles with both diagonals, sides l along x and h along y, per element:

.. math:: k_d = \frac{E t \nu (l^2 + h^2)}{2 l h (1 - \nu^2)}, \quad
          k_l = \frac{E t (h^2 - \nu l^2)}{2 l h (1 - \nu^2)}, \quad
          k_h = \frac{E t (l^2 - \nu h^2)}{2 l h (1 - \nu^2)}.

Rows of isosceles triangles along x, base a and height h with ``nu = (a / 2h)^2``:

.. math:: k_{row} = \frac{E t h}{a}, \quad k_{diag} = \frac{E t a d^2}{2 h^3 (1 - \nu^2)}, \quad d^2 = a^2/4 + h^2,

row edges on the outline halved. In both cases the shear modulus is 2 nu / (1 - nu) times the exact one. Derived here.
"""

import numpy as np

from ..mesh.cells import Mesh, signed_areas
from ..mesh.rows import row_height
from ..problem.materials import Material
from .base import DefinitionError, Springs, check_not_negative, definition, from_rectangles, rectangle_sides

SHAPE_TOLERANCE = 0.02
"""Largest difference of a mesh's own Poisson's ratio from the material's [1]: rows are stretched to fit a box."""


@definition("axis-exact", order=130)
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Springs whose E and nu along x and y are exact, on rectangles or on isosceles rows made for nu; shear pays.

    Raises DefinitionError for nu = 0, on slender rectangles, and on rows of triangles made for another nu.

    Source: own rule (derived).
    """
    nu = material.poisson_ratio
    if nu <= 0:
        raise DefinitionError("needs a Poisson's ratio above 0: without it the diagonals have no stiffness")
    rule = _rectangles if len(mesh.quads) else _rows
    return Springs(material.young_modulus * thickness, rule(mesh, nu))


def _rectangles(mesh: Mesh, nu: float) -> np.ndarray:
    along, across = rectangle_sides(mesh)
    sides = mesh.points[mesh.quads[:, 1]] - mesh.points[mesh.quads[:, 0]]
    if np.abs(sides).min(axis=1).max() > 1e-9 * along.max():
        raise DefinitionError("needs rectangles with sides along x and y; use mesh type 'braced'")
    scale = 1 / (2 * along * across * (1 - nu**2))
    first, second = (check_not_negative(scale * (b**2 - nu * a**2)) for a, b in ((along, across), (across, along)))
    return from_rectangles(mesh, first, second, scale * nu * (along**2 + across**2))


def _rows(mesh: Mesh, nu: float) -> np.ndarray:
    vectors = np.abs(mesh.points[mesh.edges[:, 1]] - mesh.points[mesh.edges[:, 0]])[mesh.cell_edges[3]]
    x, y = vectors[..., 0], vectors[..., 1]
    small = 1e-9 * vectors.max()
    slanted = (x > small) & (y > small)
    if ((~slanted).sum(axis=1) == 0).any():
        remedy = "use a beam's mesh type 'isosceles-...', or a file of them"
        raise DefinitionError(f"needs rows of isosceles triangles along x; {remedy}")
    own = (x[slanted] / y[slanted]) ** 2
    far = own[np.argmax(np.abs(own - nu))]
    if abs(far - nu) > SHAPE_TOLERANCE:
        base = 2 * x[slanted][0]
        remedy = f"use rows of height {1e3 * row_height(base, nu):.4g} mm for bases of {1e3 * base:.4g} mm"
        raise DefinitionError(f"the rows of this mesh have nu = {far:.3g} and the material {nu:.3g}; {remedy}")
    parts = np.zeros(x.shape)
    # Half triangles at the ends have an edge across; it and the cut row carry what a strip of their area does.
    areas = np.broadcast_to(signed_areas(mesh.points, mesh.triangles)[:, None], x.shape)
    parts[~slanted] = areas[~slanted] / (x[~slanted] ** 2 + y[~slanted] ** 2)
    half, height = x[slanted], y[slanted]
    parts[slanted] = half * (half**2 + height**2) / (2 * height**3 * (1 - own**2))
    return mesh.sum_to_edges({3: parts})

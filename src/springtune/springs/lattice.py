"""Closed form of the equilateral lattice, half weight on the outline: exact E with no tuning, nu = 1/3.

An equilateral network of springs k has ``E t = 2 k / sqrt(3)`` and nu = 1/3 (Cauchy's relation of central springs).
Each triangle gives ``sqrt(3)/4 E t`` to its edges: an edge inside has ``sqrt(3)/2 E t``, an outline edge half of it.

A rectangle with both diagonals, sides l and h, gives ``3 E t (3 h^2 - l^2) / (16 l h)`` to sides of length l,
likewise to those of length h, and ``3 E t (l^2 + h^2) / (16 l h)`` to its diagonals: 3/8 E t each on a square. This
is exact at nu = 1/3 (Baudet's rectangle, `springtune.springs.baudet`).

With full stiffness on the outline a beam of height H with edges a is too stiff by ``1 + sqrt(3)/2 a/H`` in tension
and, to leading order, by ``1 + 3 sqrt(3)/2 a/H`` in bending.

Assumptions: near-equilateral triangles, or rectangles; exact on equilateral rows and on rectangles.
"""

import math

import numpy as np

from ..mesh.cells import Mesh
from ..problem.loads import LOADS
from ..problem.materials import Material
from ..problem.shapes import Beam
from .base import Springs, check_not_negative, definition, from_rectangles, rectangle_sides

COEFFICIENT = math.sqrt(3) / 2  # stiffness of an edge inside over E t [1]


@definition("lattice", order=60)
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Closed form of the equilateral lattice, half weight on the outline: exact E with no tuning, nu = 1/3.

    Source: textbook form of the equilateral lattice, with half weight on the outline (derived).
    """
    return Springs(COEFFICIENT * material.young_modulus * thickness, half_weight(mesh))


def half_weight(mesh: Mesh) -> np.ndarray:
    """Stiffness of each edge over that of an edge inside an equilateral lattice [1], shape (n_edges,)."""
    if not len(mesh.quads):
        return mesh.sum_to_edges({3: np.full((len(mesh.triangles), 3), 0.5)})
    along, across = rectangle_sides(mesh)
    scale = 3 / (16 * COEFFICIENT * along * across)
    first, second = (check_not_negative(scale * (3 * b**2 - a**2)) for a, b in ((along, across), (across, along)))
    return from_rectangles(mesh, first, second, scale * (along**2 + across**2))


def uniform(mesh: Mesh) -> np.ndarray:
    """Relative stiffnesses of uniform springs: ones, shape (n_edges,)."""
    return np.ones(len(mesh.edges))


def predicted_stiffness(material: Material, beam: Beam, mesh_size: float, load: str = "traction") -> float:
    """Return the uniform stiffness [N/m] that is exact for a beam under a load, outline included; NaN if unknown.

    ``k = sqrt(3)/2 E t / (1 + c sqrt(3)/2 a/H)``, with c = 1 in tension and compression, 3 in bending, and
    `mesh_size` a [m].
    """
    kind = LOADS[load].kind
    known = kind.clamped and kind.normal == 0
    excess = (1.0 if kind.direct else 3.0) * COEFFICIENT if known else math.nan
    return COEFFICIENT * material.in_plane.young_modulus * beam.thickness / (1.0 + excess * mesh_size / beam.height)

"""Uniform stiffness sqrt(3)/2 E t of the equilateral lattice, full weight on the outline.

What the paper tuned by hand, without tuning. Outline springs belong to one triangle only and carry too much: the
network is too stiff by ``1 + sqrt(3)/2 a/H`` in tension and by ``1 + 3 sqrt(3)/2 a/H`` in bending to leading order,
with edge length a and height H. Always nu = 1/3.
"""

from ..mesh.cells import Mesh
from ..problem.materials import Material
from .base import Springs, definition
from .lattice import COEFFICIENT, uniform


@definition("uniform", order=30, uniform=True)
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Uniform stiffness sqrt(3)/2 E t of the equilateral lattice, full weight on the outline.

    Source: textbook form of the equilateral lattice (derived).
    """
    return Springs(COEFFICIENT * material.young_modulus * thickness, uniform(mesh))

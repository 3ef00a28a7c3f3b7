"""Uniform stiffness from the density of springs: k = 3 E t A / sum L^2.

A network of uniform springs in isotropic directions has ``E t = k sum L^2 / (3 A)`` over all edges of a sheet of area
A: the plane form, derived here, of Kot, Nagahashi and Szymczak (The Visual Computer 31:1339, 2015, abstract read; in
space ``E = k sum L^2 / (6 V)``). Only the average direction of the outline enters, so a third of the excess of rows
along it is seen. Assumptions: many directions, no preferred one; nu = 1/3.
"""

from ..mesh.cells import Mesh
from ..problem.materials import Material
from .base import Springs, definition
from .lattice import uniform


@definition("density", order=40, uniform=True)
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Uniform stiffness from the density of springs, 3 E t A / sum L^2 (Kot 2015).

    Source: Kot, Nagahashi and Szymczak, The Visual Computer 31:1339, 2015 (abstract, derived).
    """
    total = float((mesh.edge_lengths**2).sum())
    return Springs(3 * material.young_modulus * thickness * mesh.area / total, uniform(mesh))

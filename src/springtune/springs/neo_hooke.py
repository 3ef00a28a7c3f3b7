r"""Neo-Hookean sheets: linear triangles of rubber, written as springs of zero rest length and areas.

An incompressible sheet in plane stress, nu = 0.5, has the energy

.. math:: W = \tfrac{\mu t}{2} A_0 (tr C + J^{-2} - 3), \quad \mu = E / 3,

on a triangle of area A_0 at rest and J A_0 now. ``tr C A_0`` is half the sum over its sides of the opposite angle's
cotangent times the squared length. So the energy is that of springs of zero rest length, ``mu t cot / 2`` from each
triangle, and of its area, ``mu t A_0 / 2 (A_0 / A)^2``: exactly linear triangles, on any mesh and at any strain.
Springs opposite obtuse angles push; no triangle can invert.

Below nu = 0.5 it is the law of CalculiX and Abaqus, ``mu/2 (J_3^(-2/3) I_1 - 3) + K/2 (J_3 - 1)^2`` per volume with
mu = E / (2 (1 + nu)) and K = E / (3 (1 - 2 nu)); the stretch across the sheet is eliminated triangle by triangle. The
references at finite strain (`springtune.reference.finite_strain`) have the same law. Derived here, checked against
linear triangles of the deformation gradient. At small strain both are linear triangles, as `delingette`.
"""

import numpy as np

from ..mesh.cells import Mesh, corner_angles
from ..problem.materials import Material
from .base import Springs, definition


@definition("neo-hooke", order=240, cells=(3,), finite_strain=True)
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Springs of zero rest length and areas: equal to linear triangles of neo-Hookean rubber, any nu, any strain.

    Source: linear triangles of the textbook law (derived).
    """
    from ..mechanics.energies import NeoHookeEnergy, YeohEnergy  # here: see `springtune.springs`

    nu = material.poisson_ratio
    ones = np.ones(len(mesh.triangles))
    shear = 1 / (2 * (1 + nu))  # over E
    energy: NeoHookeEnergy | YeohEnergy
    if nu >= 0.5:
        energy = YeohEnergy(mesh.points, mesh.triangles, 0.5 * shear * ones[:, None])
    else:
        energy = NeoHookeEnergy(mesh.points, mesh.triangles, shear * ones, ones / (3 * (1 - 2 * nu)))
    return of_rubber(mesh, material, thickness, energy, shear)


def of_rubber(mesh: Mesh, material: Material, thickness: float, energy: object, shear: float) -> Springs:
    """Springs of an energy of rubber, whose share of springs of zero rest length has this shear modulus over E."""
    cotangents = 1 / np.tan(corner_angles(mesh.points, mesh.triangles))
    linear_springs = mesh.sum_to_edges({3: 0.5 * shear * cotangents})
    reference, none = material.young_modulus * thickness, np.zeros(len(mesh.edges))
    return Springs(reference, none, (energy,), linear_springs=linear_springs)

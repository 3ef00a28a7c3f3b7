r"""Rectangles with both diagonals that keep the shear modulus (Baudet and others, 2006 to 2009), and two corrections.

A rectangle of sides l and h gives, per element,

.. math:: k_d = \frac{E t (l^2 + h^2)}{4 l h (1 + \nu)}, \quad
          k_l = \frac{E t ((3 \nu + 2) h^2 - l^2)}{4 l h (1 + \nu)}, \quad
          k_h = \frac{E t ((3 \nu + 2) l^2 - h^2)}{4 l h (1 + \nu)}.

G is exact; the bulk modulus is always 3/4 E t, so Poisson's ratio moves the wrong way, and k_l is negative for
(l/h)^2 > 3 nu + 2. Source: HAL hal-01493734 and hal-00994456, abstracts read, formulas derived again.

Baudet's own correction adds forces: here the lateral stress (1 - 3 nu)/2 of the axial one on the long faces, outwards
for nu < 1/3, which makes E and nu exact (derived). It needs the axial force, so it is for uniaxial scenes.

The incompressibility correction is ours, after Flechon (2011), whose text could not be read. An area energy of
modulus ``E (3 nu - 1) / (4 (1 - nu))`` completes the bulk modulus to E / (2 (1 - nu)) under any load. G stays exact;
E and nu are not, since the springs are not isotropic.
"""

import numpy as np

from ..mesh.cells import Mesh
from ..problem.materials import Material
from .base import Springs, check_not_negative, definition, from_rectangles, rectangle_sides


@definition("baudet", order=100, cells=(4,))
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Rectangles with both diagonals that keep the shear modulus (Baudet 2009); nu moves the wrong way.

    Raises DefinitionError on other cells, and on rectangles slender enough for a negative stiffness.

    Source: Baudet and others, HAL hal-01493734 and hal-00994456, 2006 to 2009 (abstract, derived).
    """
    along, across = rectangle_sides(mesh)
    nu = material.poisson_ratio
    scale = 1 / (4 * along * across * (1 + nu))
    first = check_not_negative(scale * ((3 * nu + 2) * across**2 - along**2))
    second = check_not_negative(scale * ((3 * nu + 2) * along**2 - across**2))
    relative = from_rectangles(mesh, first, second, scale * (along**2 + across**2))
    return Springs(material.young_modulus * thickness, relative)


@definition("baudet-corrected", order=110, cells=(4,), uniaxial=True)
def corrected(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Baudet's rectangles with his transverse correction: E and nu exact, but in uniaxial scenes alone.

    Source: Baudet and others, as `baudet`; forces as a stress are ours (abstract, derived).
    """
    plain = springs(mesh, material, thickness)
    return Springs(plain.reference, plain.relative, lateral=(1 - 3 * material.poisson_ratio) / 2)


@definition("flechon", order=120, cells=(4,))
def incompressible(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Baudet's rectangles with an area energy that keeps areas, in the manner of Flechon 2011 (ours).

    Source: after Flechon, 2011 (not read, derived).
    """
    from ..mechanics.energies import AreaEnergy  # here: see `springtune.springs`

    plain = springs(mesh, material, thickness)
    nu = material.poisson_ratio
    modulus = np.full(len(mesh.quads), (3 * nu - 1) / (4 * (1 - nu)))
    return Springs(plain.reference, plain.relative, (AreaEnergy(mesh.points, mesh.quads, modulus),))

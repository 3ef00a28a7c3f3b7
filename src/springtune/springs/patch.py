"""One scalar from one roller patch test of the very mesh: Young's modulus exact on any mesh, no reference solution.

``k_e = s k_e,0`` with ``s = E / E_eff``, where E_eff is what the network of `springtune.springs.lattice` (or of
`springtune.springs.area`) has between rollers on the ends of the mesh: one linear solve of the mesh, scaled out of all
later ones. It repairs what disorder costs, in tension along x; bending, shear and nu stay what the springs make them.
Derived here.
"""

from dataclasses import replace

from ..mesh import Mesh, MeshError
from ..problem.materials import Material
from . import area, lattice
from .base import DefinitionError, Springs, definition


@definition("patch", order=190)
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Springs of `lattice` scaled once by a roller patch test of the mesh itself: E exact on any mesh, nu is not.

    Parameters, returns and errors as in `springtune.springs.lattice.springs`.
    """
    return _scaled(lattice.springs(mesh, material, thickness), mesh, material, thickness)


@definition("patch-area", order=200)
def with_area(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Springs and area energy of `area` scaled once by a roller patch test of the mesh itself: any nu, any mesh.

    Parameters, returns and errors as in `springtune.springs.lattice.springs`.
    """
    return _scaled(area.springs(mesh, material, thickness), mesh, material, thickness)


def _scaled(found: Springs, mesh: Mesh, material: Material, thickness: float) -> Springs:
    from ..mechanics.moduli import axial_moduli  # here: see `springtune.springs`

    # The modulus in units of the reference stiffness: the scalar is a ratio of the two.
    try:
        stiffness, _ = axial_moduli(mesh, found)
    except MeshError as error:
        raise DefinitionError(f"{error}; or take 'lattice' or 'area', which need none") from None
    scalar = material.young_modulus * thickness / (stiffness * found.reference)
    return replace(found, reference=scalar * found.reference, evaluations=1)

"""One scalar from one patch test of the same mesh: its mean Young's modulus is exact, no reference solution.

``k_e = s k_e,0`` with ``s = E / E_eff``, where E_eff is that of the network of `springtune.springs.lattice` (or of
`springtune.springs.area`): this costs one factorization of the mesh.

A strip between straight faces, such as a beam, is tested between rollers on its ends: E along x. Any other mesh is
tested by three affine displacements of its whole outline, rims of holes included, under which a continuum of any
shape has an even strain. Their forces are a stiffness C, and with ``S = C^-1`` 1/E_eff is the mean over all
directions of the strain along a unit pull, ``(3 S11 + 3 S22 + 2 S12 + S66) / 8``.

It corrects the tensile error of irregular meshes. Errors in bending, shear and nu remain. Derived here.
"""

from dataclasses import replace

from ..mesh.cells import Mesh
from ..problem.materials import Material
from . import area, lattice
from .base import Springs, definition


@definition("patch", order=190, cost=1)
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Springs of `lattice` scaled once by a patch test of the mesh itself: its mean E is exact, nu is not.

    Source: own rule (derived).
    """
    return _scaled(lattice.springs(mesh, material, thickness), mesh, material, thickness)


@definition("patch-area", order=200, cost=1)
def with_area(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Springs and area energy of `area` scaled once by a patch test of the mesh itself: its mean E is exact, nu is not.

    Source: own rule (derived).
    """
    return _scaled(area.springs(mesh, material, thickness), mesh, material, thickness)


def _scaled(found: Springs, mesh: Mesh, material: Material, thickness: float) -> Springs:
    from ..mechanics.continuum import PatchTest  # here: see `springtune.springs`

    # `stiffness` is the modulus times thickness over the reference stiffness.
    stiffness, _ = PatchTest(mesh).axial(found)
    scalar = material.young_modulus * thickness / (stiffness * found.reference)
    return replace(found, reference=scalar * found.reference, evaluations=1)

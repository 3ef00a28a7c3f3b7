r"""Rectangles with both diagonals and an energy of their area: orthotropic sheets, exactly.

With the material's axes along the sides a and b of a rectangle, its stiffness in plane stress C and ``K = C12 -
C66``, the rectangle gives its diagonals, each of its sides a and each of its sides b

.. math:: k_d = C_{66} t \frac{a^2 + b^2}{2 a b}, \quad
          k_a = \frac{t b}{2 a} \Big( C_{11} - K - C_{66} \frac{a^2}{b^2} \Big), \quad
          k_b = \frac{t a}{2 b} \Big( C_{22} - K - C_{66} \frac{b^2}{a^2} \Big),

and its area the energy :math:`\tfrac{1}{2} K t (A - A_0)^2 / A_0`. The diagonals, which alone resist shear, add C66
to C12 as well (Cauchy's relation); the area adds K to C11, C22 and C12. On squares ``k_d = C66 t``, ``k_a = (C11 -
C12) t / 2`` and ``k_b = (C22 - C12) t / 2``. All four constants are exact for every even strain. For C12 = C66, K =
0: springs alone suffice.

Suryawanshi and Gupta (Journal of Mechanics of Materials and Structures 18:143, 2023, abstract read) match the
displacements of one square of an orthotropic sheet by further springs; their formulas were not found. Four springs'
constants cannot, since springs have C12 = C66, so the area takes the part of these here.

No spring is negative on squares while C12 <= C11 and C12 <= C22; else on rectangles whose ratio a / b is from
``sqrt(C66 / (C22 - K))`` to ``sqrt((C11 - K) / C66)``. Derived here.
"""

import math

import numpy as np

from ..mesh.cells import Mesh
from ..problem.materials import AnyMaterial, rotated
from .base import DefinitionError, Springs, definition, from_rectangles, membrane_stiffness, rectangle_sides

COUPLING = 1e-9  # largest C16 and C26 along the sides of a rectangle, over the largest constant, that are rounding [1]


@definition("orthotropic", order=215, cells=(4,), anisotropic=True)
def springs(mesh: Mesh, material: AnyMaterial, thickness: float) -> Springs:
    """Rectangles with both diagonals and an area energy: all four constants of an orthotropic sheet, no tuning.

    Raises DefinitionError on other cells, if the material's axes are not along their sides, and for a negative side
    spring.

    Source: Suryawanshi and Gupta, Journal of Mechanics of Materials and Structures 18:143, 2023; the area energy is
    ours (abstract, derived).
    """
    from ..mechanics.energies import AreaEnergy  # here: see `springtune.springs`

    along, across = rectangle_sides(mesh)
    first = mesh.points[mesh.quads[:, 1]] - mesh.points[mesh.quads[:, 0]]
    reference = membrane_stiffness(material, 1.0)
    sides, others, diagonals, moduli = (np.empty(len(along)) for _ in range(4))
    angles = np.arctan2(first[:, 1], first[:, 0])
    _, groups = np.unique(angles.round(9), return_inverse=True)
    for group in range(groups.max() + 1):  # one on most meshes, along x
        here = groups == group
        constants = rotated(material.plane_stress, -float(angles[here].mean())) / reference
        if np.abs(constants[2, :2]).max() > COUPLING:
            why = f"needs the axes of the material along the sides of the rectangles, and {material.name!r} has C16 = "
            why += f"{reference * constants[0, 2]:.4g} Pa, C26 = {reference * constants[1, 2]:.4g} Pa there"
            raise DefinitionError(f"{why}; turn mesh or material, or choose 'delingette' on triangles")
        (c11, c12, _), (_, c22, _), (_, _, c66) = constants.tolist()
        ratio = (along[here] / across[here]) ** 2
        modulus = c12 - c66
        sides[here] = (c11 - modulus - c66 * ratio) / (2 * np.sqrt(ratio))
        others[here] = (c22 - modulus - c66 / ratio) * np.sqrt(ratio) / 2
        diagonals[here] = c66 * (ratio + 1) / (2 * np.sqrt(ratio))
        moduli[here] = modulus
        if min(sides[here].min(), others[here].min()) < -COUPLING:
            raise DefinitionError(_negative(reference * constants, math.sqrt(ratio.max())))
    # What is nothing but rounding is no spring.
    sides, others = (np.maximum(part, 0.0) for part in (sides, others))
    energies = (AreaEnergy(mesh.points, mesh.quads, moduli),) if np.abs(moduli).max() > 1e-15 else ()
    return Springs(reference * thickness, from_rectangles(mesh, sides, others, diagonals), energies)


def _negative(constants: np.ndarray, ratio: float) -> str:
    """Why the springs of some side are negative, and what to do."""
    (c11, c12, _), (_, c22, _), (_, _, c66) = constants.tolist()
    modulus = c12 - c66
    shown = f"C11 = {c11:.4g} Pa, C22 = {c22:.4g} Pa, C12 = {c12:.4g} Pa, C66 = {c66:.4g} Pa"
    why = f"gives sides of the rectangles a negative stiffness: on squares it needs C12 <= C11 and C12 <= C22; {shown}"
    if min(c11, c22) > modulus and (c11 - modulus) * (c22 - modulus) >= c66 * c66:
        low, high = math.sqrt(c66 / (c22 - modulus)), math.sqrt((c11 - modulus) / c66)
        return f"{why}; use rectangles {low:.4g} to {high:.4g} times as long as high, these have {ratio:.4g}"
    return f"{why}, for which no rectangle serves; choose 'delingette' on triangles"

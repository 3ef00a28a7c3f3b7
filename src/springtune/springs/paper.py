"""Uniform stiffness as printed: the value that the study states for a mesh type and material.

The paper chose one stiffness by hand from the sensitivity curve of its 200x30 beam: 170e6 N/m on structured and
185e6 N/m on free meshes for steel, 800 N/m for rubber. Springs on the outline have the same stiffness as those inside.
"""

from ..mesh.cells import Mesh
from ..problem.materials import AnyMaterial
from .base import Springs, definition
from .lattice import uniform


@definition("paper", order=10, uniform=True, needs="stiffness", anisotropic=True)
def springs(mesh: Mesh, material: AnyMaterial, thickness: float, stiffness: float) -> Springs:
    """Uniform stiffness as printed: the value that the study states for a mesh type and material.

    Source: the paper that is reproduced, its tables 1 to 5 (read).
    """
    return Springs(stiffness, uniform(mesh))

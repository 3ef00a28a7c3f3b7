"""Uniform stiffness calibrated as the paper did: the mean best stiffness of one beam's sensitivity curves.

On each curve of the calibration beam, one a mesh size, the best stiffness is where the deformation error of a stable
equilibrium is zero. The mean over mesh sizes serves every beam, size and load of that mesh type and material.
"""

import math
from collections.abc import Iterable

from ..mesh.cells import Mesh
from ..problem.materials import Material
from . import paper
from .base import Springs, definition


def calibrate(curves: Iterable[tuple[str, float, str]]) -> float:
    """Return the mean of the best stiffnesses [N/m] of curves, each with a name and, for NaN, a reason."""
    curves = list(curves)
    if not curves:
        raise ValueError("there is no sensitivity curve of the calibration beam")
    for name, value, message in curves:
        if math.isnan(value):
            raise ValueError(f"the sensitivity curve of {name} has no best stiffness: {message}")
    return sum(value for _, value, _ in curves) / len(curves)


@definition("calibrated", order=20, uniform=True, needs="stiffness")
def springs(mesh: Mesh, material: Material, thickness: float, stiffness: float) -> Springs:
    """Uniform stiffness calibrated as the paper did: the mean best stiffness of one beam's sensitivity curves.

    Source: the paper that is reproduced; the mean over meshes is ours (read, derived).
    """
    return paper.springs(mesh, material, thickness, stiffness)

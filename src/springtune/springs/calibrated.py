"""Uniform stiffness calibrated as the paper did: the mean best stiffness of one beam's sensitivity curves.

On each curve of the calibration beam, one a mesh size, the best stiffness is where the deformation error of a stable
equilibrium is zero; the mean over the mesh sizes serves every beam, size and load of that mesh type and material.
"""

import math
from collections.abc import Iterable

from ..mesh import Mesh
from ..problem.materials import Material
from . import paper
from .base import Springs, definition


def calibrate(curves: Iterable[tuple[str, float, str]]) -> float:
    """Calibrated stiffness from the best stiffness of each mesh size.

    Parameters
    ----------
    curves : iterable of (str, float, str)
        Name of each curve, its best stiffness [N/m], NaN where there is none, and why there is none.

    Returns
    -------
    float
        Their mean [N/m].
    """
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

    Parameters and returns as in `springtune.springs.paper`.
    """
    return paper.springs(mesh, material, thickness, stiffness)

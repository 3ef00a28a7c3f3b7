"""Uniform stiffness calibrated as the paper did: the mean best stiffness of one beam's sensitivity curves.

On each curve of the calibration beam, one a mesh size, the best stiffness is where the deformation error is zero; the
mean over the mesh sizes serves every beam, size and load of that mesh type and material.
"""

import math

from . import paper


def calibrate(best_stiffnesses):
    """Calibrated stiffness from the best stiffness of each mesh size.

    Parameters
    ----------
    best_stiffnesses : iterable of float
        Best stiffness of each curve [N/m]; NaN where a curve does not cross zero error.

    Returns
    -------
    float
        Their mean [N/m].

    Raises
    ------
    ValueError
        If a curve has no best stiffness: a mean over some sizes would not say so.
    """
    values = list(best_stiffnesses)
    if not values or any(math.isnan(value) for value in values):
        raise ValueError("a sensitivity curve of the calibration beam has no best stiffness; widen `sensitivity`")
    return sum(values) / len(values)


def springs(mesh, material, thickness, stiffness):
    """Uniform stiffness calibrated as the paper did: the mean best stiffness of one beam's sensitivity curves.

    Parameters and returns as in `springtune.springs.paper`.
    """
    return paper.springs(mesh, material, thickness, stiffness)

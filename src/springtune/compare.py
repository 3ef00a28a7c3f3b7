"""Comparing networks with references: errors, and the stiffness at which a sensitivity curve has none."""

import numpy as np
from scipy.interpolate import CubicSpline


def deformation_error(displacement, reference):
    """Signed deformation error ``(network - reference) / |reference|`` [1].

    Positive where the end has moved further along +x than the reference's: in tension a network that is too soft, in
    compression one that is too stiff.

    Parameters
    ----------
    displacement, reference : array_like of float
        Displacement of network and reference [m].

    Returns
    -------
    ndarray of float
    """
    displacement, reference = np.asarray(displacement), np.asarray(reference)
    return (displacement - reference) / np.abs(reference)


def best_stiffness(stiffness, displacement, reference):
    """Stiffness at which a sensitivity curve meets the reference.

    Along a curve the displacement is close to a multiple of ``1/k``; a cubic spline of it over ``1/k`` is accurate to
    some 1e-9 between the 61 points of a curve.

    Parameters
    ----------
    stiffness : ndarray of float, shape (n,)
        Ascending [N/m].
    displacement : ndarray of float, shape (n,)
        Displacement of the network [m]; NaN where there is none.
    reference : float
        Displacement of the reference [m].

    Returns
    -------
    float
        Stiffness [N/m]; the stiffest where the curve meets the reference more than once, NaN where it never does.
    """
    known = np.isfinite(displacement)
    if known.sum() < 2 or not np.isfinite(reference):
        return np.nan
    softness, error = 1.0 / stiffness[known][::-1], displacement[known][::-1] - reference
    roots = CubicSpline(softness, error).roots(extrapolate=False)
    roots = roots[np.isfinite(roots)]
    return float(1.0 / roots.min()) if len(roots) else np.nan

"""Comparing networks with references: errors, and the stiffness at which a sensitivity curve has none."""

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq


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
    # Bracketed by the samples: the roots of the pieces lose one that rounding puts on the seam of two pieces.
    met = np.flatnonzero(np.sign(error[:-1]) * np.sign(error[1:]) <= 0)
    if not len(met):
        return np.nan
    ends = softness[met[0] : met[0] + 2]
    curve = CubicSpline(softness, error)
    values = curve(ends)
    if values[0] * values[1] >= 0:  # an end is a root but for rounding
        return float(1.0 / ends[np.argmin(np.abs(values))])
    return float(1.0 / brentq(curve, *ends, xtol=1e-15 * ends[0], rtol=1e-14))

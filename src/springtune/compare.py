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


def left_out(x, y):
    """What values differ by from the polynomials through three neighbours on either side.

    Parameters
    ----------
    x, y : ndarray of float, shape (n,)
        Places, ascending or descending, and values.

    Returns
    -------
    ndarray of float, shape (n,)
        0 where there are fewer neighbours.
    """
    result = np.zeros(len(x))
    if len(x) < 7:
        return result
    offsets = np.array([-3, -2, -1, 1, 2, 3])
    places = np.arange(3, len(x) - 3)
    nodes, values = x[places[:, None] + offsets], y[places[:, None] + offsets]
    apart, among = x[places][:, None] - nodes, nodes[:, :, None] - nodes[:, None, :]
    diagonal = np.arange(6)
    ratios = np.broadcast_to(apart[:, None, :], among.shape).copy()
    ratios[:, diagonal, diagonal] = among[:, diagonal, diagonal] = 1.0
    result[places] = y[places] - ((ratios / among).prod(axis=2) * values).sum(axis=1)
    return result


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


def assured(errors, second):
    """Largest error of each mesh size and all finer ones that were run, on both beams [1].

    An error that happens to cross zero at one mesh size, or on one beam, promises nothing: what is finer, or another
    beam, shows it. Nothing does for the finest one.

    Parameters
    ----------
    errors, second : ndarray of float, shape (n_methods, n_sizes)
        Errors on the beam and on the second one, from the finest mesh size to the coarsest [1].

    Returns
    -------
    ndarray of float, shape (n_methods, n_sizes)
        NaN for the finest size that was run, and from where a finer one failed or has no second beam.
    """
    errors, second = np.abs(errors), np.abs(second)
    found = np.full(errors.shape, np.nan)
    for i, run_on in enumerate(np.isfinite(errors)):
        for j in np.flatnonzero(run_on)[1:]:
            finest = int(np.argmax(run_on))
            found[i, j] = np.maximum(errors[i, finest : j + 1], second[i, finest : j + 1]).max()
    return found


def unbeaten(errors, seconds):
    """Whether no other case has a smaller error in no more time; not where an error is NaN."""
    best = np.zeros(errors.shape, dtype=bool)
    for place in map(tuple, np.argwhere(np.isfinite(errors))):
        best[place] = not ((errors < errors[place]) & (seconds <= seconds[place])).any()
    return best

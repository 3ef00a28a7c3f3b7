"""Stored references: solutions of unit problems, read at the size of a beam and for a force of 1 N."""

from ...jobs import store
from . import stored_interpolant

SCALED = ("displacement", "mean_displacement", "displacements")


def read(folder, reference, fields=()):
    """Reference of a beam, material and kind of load.

    Parameters
    ----------
    folder : str or Path
        Where references are stored.
    reference : dict
        ``key`` of the unit problem, ``length`` [m] and ``displacement`` [m/N], see
        `springtune.reference.similarity.unit_scales`; where it is interpolated, ``interpolant``, the key of that, and
        ``problem``, the aspect ratio and Poisson's ratio.
    fields : sequence of str, optional
        Arrays to read besides scalars, of ``x``, ``y`` and ``displacements``.

    Returns
    -------
    dict
        What the stage `reference` stored [m, rad, 1], for 1 N; of a reference that did not converge ``message`` and
        ``seconds`` alone. One that is interpolated has no arrays, and ``solves``, the number of solutions behind it.
    """
    found = _interpolated(folder, reference) if "interpolant" in reference else _solved(folder, reference, fields)
    scales = dict.fromkeys(SCALED, reference["displacement"]) | dict.fromkeys("xy", reference["length"])
    scales |= dict.fromkeys(("rotation", "strain"), reference["displacement"] / reference["length"])
    return {name: value * scales[name] if name in scales else value for name, value in found.items()}


def _solved(folder, reference, fields):
    return store.read_one(folder, reference["key"], fields)


def _interpolated(folder, reference):
    """Reference by an interpolant, or solved by itself where there is none."""
    interpolant, results, seconds, why = stored_interpolant.read(folder, reference["interpolant"])
    if interpolant is None:
        return results.get(reference["key"], {"message": why, "seconds": 0.0})
    found = interpolant.evaluate(*reference["problem"])
    values = {name: float(getattr(found, name)) for name in stored_interpolant.ANSWERS}
    return values | {"message": "", "seconds": seconds, "solves": interpolant.solves}

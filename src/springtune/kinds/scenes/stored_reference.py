"""Stored references: solutions of unit problems, read at the size of a beam and for a force of 1 N."""

from functools import lru_cache
from pathlib import Path

from ...jobs import store
from ...problem.loads import LOAD_KINDS

SCALED = ("displacement", "mean_displacement", "displacements")


INTERPOLANT = "interpolant"
"""What a reference names that is interpolated."""


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
    found = _interpolated(folder, reference) if INTERPOLANT in reference else _solved(folder, reference, fields)
    scales = dict.fromkeys(SCALED, reference["displacement"]) | dict.fromkeys("xy", reference["length"])
    scales |= dict.fromkeys(("rotation", "strain"), reference["displacement"] / reference["length"])
    return {name: value * scales[name] if name in scales else value for name, value in found.items()}


def _solved(folder, reference, fields):
    return store.read_one(folder, reference["key"], fields)


def _interpolated(folder, reference):
    """Reference by an interpolant, or solved by itself where there is none."""
    path = Path(folder) / f"{reference[INTERPOLANT]}.h5"
    state = path.stat() if path.exists() else None
    when = (state.st_size, state.st_mtime_ns) if state else None
    interpolant, results, seconds, why = _opened(path, reference[INTERPOLANT], when)
    if interpolant is None:
        return results.get(reference["key"], {"message": why, "seconds": 0.0})
    found = interpolant.evaluate(*reference["problem"])
    names = ("displacement", "mean_displacement", "rotation", "strain", "error_estimate")
    values = {name: float(getattr(found, name)) for name in names}
    return values | {"message": "", "seconds": seconds, "solves": interpolant.solves}


@lru_cache(maxsize=8)
def _opened(path, key, state):
    """Interpolant of a file in its state, results of unit problems that were solved by themselves, and notes."""
    arrays = ("aspect_range", "nu_range", "values")
    results = store.read(path, {key} | (store.stored(path) if state else set()), arrays)
    known = results.pop(key)
    if "solves" not in known:
        return None, results, 0.0, known["message"]
    from ...reference.interpolant import Interpolant  # here: few studies need it

    return Interpolant.from_arrays(LOAD_KINDS[known["kind"]], known), results, known["seconds"] / known["asked"], ""

"""References for curves and the dataset, solved one by one or interpolated; `solve` needs whole fields instead."""

from functools import lru_cache
from pathlib import Path

from springtune.problem.loads import LOAD_KINDS

from ...runs import store
from . import stored

ANSWERS = ("displacement", "mean_displacement", "rotation", "strain", "error_estimate")
"""Values of a unit problem that an interpolant returns."""


def read(folder, reference, fields=()):
    """Reference of a beam, material and kind of load."""
    if "interpolant" not in reference:
        return stored.read_reference(folder, reference, fields)
    interpolant, results, seconds, why = read_interpolant(folder, reference["interpolant"])
    if interpolant is None:
        found = results.get(reference["key"], {"message": why, "seconds": 0.0})
    else:
        answers = interpolant.evaluate(*reference["problem"])._asdict()
        found = {name: float(value) for name, value in answers.items()}
        found |= {"message": "", "seconds": seconds, "solves": interpolant.solves}
    return stored.scaled(found, reference)


def read_interpolant(folder, key):
    """Interpolant, or None with the reason last; unit problems solved instead, by key; seconds of one answer."""
    path = Path(folder) / f"{key}.h5"
    state = path.stat() if path.exists() else None
    return _read_interpolant(path, key, (state.st_size, state.st_mtime_ns) if state else None)


@lru_cache(maxsize=8)
def _read_interpolant(path, key, state):
    """Read an interpolant; cached by the state of its file."""
    arrays = ("aspect_range", "nu_range", "values")
    results = store.read(path, {key} | (store.stored_keys(path) if state else set()), arrays)
    known = results.pop(key)
    if "solves" not in known:
        return None, results, 0.0, known["message"]
    from springtune.reference.interpolant import Interpolant  # here: few studies need it

    each = known["seconds"] / max(known["asked"], 1)
    return Interpolant.from_arrays(LOAD_KINDS[known["kind"]], known), results, each, ""

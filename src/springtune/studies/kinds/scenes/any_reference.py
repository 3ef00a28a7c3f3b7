"""References for curves and the dataset, solved by themselves or interpolated.

The stage `solve` reads those solved by themselves alone: it needs whole fields, and does not depend on finite elements.
"""

from . import stored, stored_interpolant


def read(folder, reference, fields=()):
    """Reference of a beam, material and kind of load."""
    if "interpolant" not in reference:
        return stored.read_reference(folder, reference, fields)
    interpolant, results, seconds, why = stored_interpolant.read(folder, reference["interpolant"])
    if interpolant is None:
        found = results.get(reference["key"], {"message": why, "seconds": 0.0})
    else:
        answers = interpolant.evaluate(*reference["problem"])
        found = {name: float(getattr(answers, name)) for name in stored_interpolant.ANSWERS}
        found |= {"message": "", "seconds": seconds, "solves": interpolant.solves}
    return stored.scaled(found, reference)

"""References that are solved by themselves: of unit problems, read at the size of a beam and for a force of 1 N."""

from ...runs import store

SCALED = ("displacement", "mean_displacement", "displacements")


def read(folder, reference, fields=()):
    """Reference for 1 N [m, rad, 1]; one that did not converge has ``message`` and ``seconds`` alone.

    ``reference`` has the ``key`` of its unit problem and the scales ``length`` [m] and ``displacement`` [m/N].
    """
    return scaled(store.read_one(folder, reference["key"], fields), reference)


def scaled(found, reference):
    """Answer of a unit problem at the size of a beam and for 1 N."""
    scales = dict.fromkeys(SCALED, reference["displacement"]) | dict.fromkeys("xy", reference["length"])
    scales |= dict.fromkeys(("rotation", "strain"), reference["displacement"] / reference["length"])
    return {name: value * scales[name] if name in scales else value for name, value in found.items()}

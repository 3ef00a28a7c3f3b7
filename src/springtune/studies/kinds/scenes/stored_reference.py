"""References that are solved by themselves: of unit problems, read at the size of a beam and for a force of 1 N."""

from ...runs import store

SCALED = ("displacement", "mean_displacement", "displacements")


def read(folder, reference, fields=()):
    """Reference of a beam, material and kind of load.

    Parameters
    ----------
    reference : dict
        ``key`` of the unit problem, ``length`` [m] and ``displacement`` [m/N], see
        `springtune.reference.similarity.unit_scales`.

    Returns
    -------
    dict
        What the stage `reference` stored [m, rad, 1], for 1 N; of a reference that did not converge ``message`` and
        ``seconds`` alone.
    """
    return scaled(store.read_one(folder, reference["key"], fields), reference)


def scaled(found, reference):
    """Answer of a unit problem at the size of a beam and for 1 N."""
    scales = dict.fromkeys(SCALED, reference["displacement"]) | dict.fromkeys("xy", reference["length"])
    scales |= dict.fromkeys(("rotation", "strain"), reference["displacement"] / reference["length"])
    return {name: value * scales[name] if name in scales else value for name, value in found.items()}

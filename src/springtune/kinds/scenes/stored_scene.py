"""Stored scenes: numbers under one key, whole fields under another, so that either is there without the other."""

from ...jobs.hashing import hash_of

FIELD_ARRAYS = ("displacements", "spring_stiffnesses", "spring_forces")
"""Arrays of all particles and springs."""


def calibrated_key(key: str, stiffness: float | None) -> str:
    """Key of a calibrated scene.

    Parameters
    ----------
    key : str
        Of all that it depends on besides.
    stiffness : float or None
        What was calibrated [N/m]; None where there is nothing.

    Returns
    -------
    str
    """
    return hash_of(key, stiffness)


def fields_key(key: str) -> str:
    """Key of the fields of a scene.

    Parameters
    ----------
    key : str
        Of its numbers.

    Returns
    -------
    str
    """
    return hash_of(key, "fields")

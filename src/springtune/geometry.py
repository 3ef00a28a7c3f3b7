"""Geometry of the bodies that a study asks for."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Beam:
    """A rectangular sheet, its lower left corner at the origin.

    Attributes
    ----------
    name : str
        Label of the beam, e.g. ``"200x40"``.
    length, height, thickness : float
        Extent along x, along y and out of the plane [m].
    """

    name: str
    length: float
    height: float
    thickness: float

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


@dataclass(frozen=True)
class Strip:
    """A strip that is laid.

    Attributes
    ----------
    length, height, thickness : float
        Extent along x, along y and out of the plane [m].
    """

    length: float
    height: float
    thickness: float


@dataclass(frozen=True)
class Trapezoid:
    """A symmetric trapezoid, upright on its lower base.

    Attributes
    ----------
    lower_base, upper_base, height : float
        Lengths of its bases and their distance [m].
    """

    lower_base: float
    upper_base: float
    height: float

    @property
    def area(self) -> float:
        """Area [m2]."""
        return 0.5 * (self.lower_base + self.upper_base) * self.height

    @property
    def corners(self) -> list[tuple[float, float]]:
        """Corners, counter-clockwise, the axis at x = 0: pairs of x and y [m]."""
        low, high = 0.5 * self.lower_base, 0.5 * self.upper_base
        return [(-low, 0.0), (low, 0.0), (high, self.height), (-high, self.height)]

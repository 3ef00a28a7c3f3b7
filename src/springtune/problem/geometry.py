"""Beams, strips and trapezoids, and warnings about the thickness and the size of any body."""

import warnings
from collections.abc import Iterable
from dataclasses import dataclass

from .quantities import Number, positive, put


class AssumptionWarning(UserWarning):
    """An input violates an assumption of the model, such as a thin sheet."""


def _warn(said: str) -> None:
    """Warn whoever makes the body."""
    warnings.warn(said, AssumptionWarning, stacklevel=5)


def warn_of_thickness(thickness: float, sides: tuple[float, float], what: str) -> None:
    """Warn if a body is thicker than its smaller side [m]: plane stress is for thin sheets."""
    smaller = min(sides)
    if thickness > smaller:
        _warn(
            f"{what}, thickness: {1e3 * thickness:g} mm exceeds its smaller side, {1e3 * smaller:.6g} mm, and plane "
            "stress is an assumption about thin sheets; give a smaller thickness, or a material in plane strain"
        )


LEAST_SIDE, MOST_SIDE = 1e-5, 100.0
"""Longer sides of bodies [m] beyond which a unit is likely to be missing."""


def warn_of_size(sides: Iterable[float], what: str) -> None:
    """Warn if the longer side of a body [m] is so short or long that a unit is likely to be missing."""
    longer = max(sides)
    if not LEAST_SIDE <= longer <= MOST_SIDE:
        usual = f"more than {MOST_SIDE:g} m" if longer > MOST_SIDE else f"less than {1e6 * LEAST_SIDE:g} um"
        units = "numbers in Python are in m, a text such as '200 mm' has its own"
        _warn(f"{what}: its longer side is {longer:.6g} m, {usual}; check the unit: {units}")


@dataclass(frozen=True)
class Beam:
    """A rectangular sheet with its lower left corner at the origin.

    Parameters
    ----------
    length, height, thickness : float or str
        Extent along x, along y and out of the plane [m], or texts with their unit.
    name : str, optional
        Label; by default length and height in mm, e.g. ``"200x40"``.

    Raises
    ------
    ValueError
        If a length is not above zero, or a text not a length.

    Warns
    -----
    AssumptionWarning
        If it is thicker than its smaller side (plane stress is for thin sheets), or its longer side is more than 100 m
        or less than 10 um (numbers are in m).

    Examples
    --------
    >>> import springtune as st
    >>> st.Beam("200 mm", "40 mm"), st.Beam("80 mm", "30 mm", name="pad").label
    (Beam(length=0.2, height=0.04, thickness=0.001, name='200x40'), 'pad (80 x 30 mm)')
    """

    length: Number
    height: Number
    thickness: Number = 1e-3
    name: str = ""

    def __post_init__(self) -> None:
        for side in ("length", "height", "thickness"):
            put(self, **{side: positive(getattr(self, side), "length", side)})
        if not self.name:
            put(self, name=f"{1e3 * self.length:g}x{1e3 * self.height:g}")
        warn_of_size((self.length, self.height), f"beam {self.name!r}")
        warn_of_thickness(self.thickness, (self.length, self.height), f"beam {self.name!r}")

    @property
    def label(self) -> str:
        """Name and size of the sheet, for titles, see `beam_label`."""
        return beam_label(self.name, self.length, self.height)


def beam_label(name: str, length: float, height: float) -> str:
    """Return ``"200x40 mm"``, or ``"pad (80 x 30 mm)"`` for a name without the size [m]; only the name for NaN."""
    long, high = (round(1e3 * side, 9) for side in (length, height))
    if long != long or high != high:
        return name
    return f"{name} mm" if name == f"{long:g}x{high:g}" else f"{name} ({long:.4g} x {high:.4g} mm)"


def size_text(length: float, height: float) -> str:
    """Return extents [m] in words.

    >>> size_text(0.08, 0.06), size_text(80, 60), size_text(8e-5, 1e-6)
    ('80 x 60 mm', '80 x 60 m', '80 x 1 um')
    """
    longer = max(length, height)
    unit, name = (1.0, "m") if longer >= 10 else (1e-3, "mm") if longer >= 1e-4 else (1e-6, "um")
    return f"{length / unit:.4g} x {height / unit:.4g} {name}"


@dataclass(frozen=True)
class Strip:
    """Strip to be laid; lengths in m."""

    length: float
    height: float
    thickness: float


@dataclass(frozen=True)
class Trapezoid:
    """Symmetric trapezoid on its lower base; lengths in m."""

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

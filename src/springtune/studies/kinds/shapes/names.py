"""Words of studies of shapes: quantities and what they are measured in, components, and mesh types."""

from dataclasses import dataclass

OUTLINED = {"free": "Delaunay triangles inside of the outline"}
"""Mesh types of outlines, and what they are."""

OWN_FILE = "file"
"""Mesh type of a shape whose mesh is that of its file."""

OWN_SIZE = 0.0
"""Label of its mesh size [m]."""

ALONG_AXES = ("x", "y")
STRESSES = ("xx", "yy", "xy")
"""Components."""


@dataclass(frozen=True)
class QuantityKind:
    """A kind of quantity of interest: ``places`` are ``at`` a point or ``of`` a group, ``shown`` units and SI sizes."""

    unit_kind: str
    places: tuple[str, ...] = ()
    example: str = ""
    shown: tuple[tuple[str, float], ...] = ()


KINDS_OF_QUANTITY = {
    "displacement": QuantityKind("length", ("at", "of"), "at: a point, or of: a group", (("mm", 1e-3), ("µm", 1e-6))),
    "stress": QuantityKind("stress", ("at",), "at: a point", (("GPa", 1e9), ("MPa", 1e6), ("kPa", 1e3), ("Pa", 1.0))),
    "reaction": QuantityKind("force", ("of",), "of: a group that is held", (("kN", 1e3), ("N", 1.0))),
    "area": QuantityKind("area", (), "", (("mm²", 1e-6),)),
    "energy": QuantityKind("energy", (), "", (("kJ", 1e3), ("J", 1.0), ("mJ", 1e-3))),
}
"""Kinds of quantity by name, as `springtune.problem.shapes.QUANTITY_KINDS` has them."""

QUANTITY_UNITS = {"displacement": "m", "stress": "Pa", "reaction": "N", "area": "m2", "energy": "J"}
"""Units of the values in the dataset."""

"""A network as plain arrays, and the energies besides its springs."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..mesh.cells import no_cells

FORMULAS = {
    "area": "W = 1/2 modulus (A - rest_area)^2 / rest_area of each cell, A its area",
    "angle": "W = 1/2 modulus sum_i (angle_i - rest_angle_i)^2 of each triangle, angle_i that at its corner i",
    "corner": "W = 1/2 sum_i rotational_i (angle_i - rest_angle_i)^2 of each triangle, angle_i that at its corner i",
    "biquadratic": (
        "W = sum_i tensile_i / 4 q_i^2 + sum_i coupling_i / 2 q_j q_k of each triangle, with q_i = l_i^2 - "
        "rest_length_i^2 of the side opposite corner i, and j, k the other two: coupling_i joins the sides that meet "
        "in corner i"
    ),
    "incompressible": (
        "W = rest_area (c1 e + c2 e^2 + c3 e^3) of each triangle, with e = T + (rest_area / A)^2 - 3, A its area, "
        "T = sum_i rest_weight_i l_i^2 / rest_area of the side opposite corner i: its first term is that of springs of "
        "zero rest length with stiffnesses 2 c1 rest_weight_i, and of areas; no triangle turns inside out"
    ),
    "compressible": (
        "W = rest_area (shear/2 (V^(-2/3) (T + z^2) - 3) + bulk/2 (V - 1)^2) of each triangle, with V = z A / "
        "rest_area, A its area, z > 0 where W has its minimum, T = sum_i rest_weight_i l_i^2 / rest_area of the side "
        "opposite corner i"
    ),
}
"""Energy of a cell by kind of terms."""

VALUES = {
    "area": {"rest_area": "m2", "modulus": "N/m"},
    "angle": {"rest_angle": "rad", "modulus": "J"},
    "corner": {"rest_angle": "rad", "rotational": "J"},
    "biquadratic": {"rest_length": "m", "tensile": "N/m3", "coupling": "N/m3"},
    "incompressible": {"rest_area": "m2", "rest_weight": "1", "c1": "N/m", "c2": "N/m", "c3": "N/m"},
    "compressible": {"rest_area": "m2", "rest_weight": "1", "shear": "N/m", "bulk": "N/m"},
}
"""Names of the values of each kind of terms, and their units."""

OF_CORNERS = ("rest_angle", "rotational", "rest_length", "tensile", "coupling", "rest_weight")
"""Values that each corner of a cell has its own of."""


@dataclass(frozen=True, eq=False)
class Terms:
    """Energies of one kind besides the springs: a row for each cell.

    `cells` (n_cells, n_corners) are particles, counter-clockwise: all triangles of a net, or all of its quadrilaterals.
    `values`, by the names of `VALUES`, have shape (n_cells,) or (n_cells, n_corners). Values of sides are of the side
    opposite to each corner, and `coupling` of the two sides that meet in it.
    """

    kind: str
    cells: np.ndarray
    values: dict[str, np.ndarray]

    @property
    def formula(self) -> str:
        """Energy of a cell."""
        return FORMULAS[self.kind]

    @property
    def units(self) -> dict[str, str]:
        """Unit of each of the values."""
        return VALUES[self.kind]


@dataclass(frozen=True, eq=False)
class Net:
    """A network as plain arrays; `springtune.SpringNet` has what they are."""

    points: np.ndarray
    springs: np.ndarray
    rest_lengths: np.ndarray
    stiffness: np.ndarray
    energies: tuple[Terms, ...]
    masses: np.ndarray | None
    thickness: float
    held: np.ndarray
    forces: np.ndarray
    header: dict[str, Any]
    triangles: np.ndarray = field(default_factory=lambda: no_cells(3))
    quads: np.ndarray = field(default_factory=lambda: no_cells(4))

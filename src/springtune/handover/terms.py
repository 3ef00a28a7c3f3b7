"""Energies besides springs, as plain arrays."""

from dataclasses import dataclass

import numpy as np

FORMULAS = {
    "area": "W = 1/2 modulus (A - rest_area)^2 / rest_area of each cell, A its area",
    "angle": "W = 1/2 modulus sum_i (angle_i - rest_angle_i)^2 of each triangle, angle_i that at its corner i",
    "biquadratic": (
        "W = sum_i tensile_i / 4 q_i^2 + sum_i coupling_i / 2 q_j q_k of each triangle, with q_i = l_i^2 - "
        "rest_length_i^2 of the side opposite corner i, and j, k the other two: coupling_i joins the sides that meet "
        "in corner i"
    ),
}
"""Energy of a cell by kind of terms."""

VALUES = {
    "area": {"rest_area": "m2", "modulus": "N/m"},
    "angle": {"rest_angle": "rad", "modulus": "J"},
    "biquadratic": {"rest_length": "m", "tensile": "N/m3", "coupling": "N/m3"},
}
"""Names of the values of each kind of terms, and their units."""

OF_CORNERS = ("rest_angle", "rest_length", "tensile", "coupling")
"""Values that each corner of a cell has its own of."""


@dataclass(frozen=True, eq=False)
class Terms:
    """Energies of one kind, besides the springs': a row for each cell.

    Attributes
    ----------
    kind : str
        Key of `FORMULAS`: ``"area"``, ``"angle"`` or ``"biquadratic"``.
    cells : ndarray of int, shape (n_cells, n_corners)
        Particles of each cell, counter-clockwise: all triangles of a net, or all of its quadrilaterals.
    values : dict of str to ndarray of float, shape (n_cells,) or (n_cells, n_corners)
        By the names of `VALUES`; those of a biquadratic energy are of the side opposite each corner, and `coupling` of
        the two sides that meet in it.
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

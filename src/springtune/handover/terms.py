"""A network as plain arrays, and the energies besides its springs."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..mechanics.energies import AngleEnergy, AreaEnergy, BiquadraticEnergy, Energy, NeoHookeEnergy, YeohEnergy
from ..mesh.cells import Mesh, corner_angles, no_cells, rows_of, signed_areas
from ..springs.base import DefinitionError

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

CORNER_VALUES = ("rest_angle", "rotational", "rest_length", "tensile", "coupling", "rest_weight")
"""Values that each corner of a cell has its own of."""

ENERGY_CLASSES: dict[str, type[Energy]] = {
    "area": AreaEnergy,
    "angle": AngleEnergy,
    "corner": AngleEnergy,
    "biquadratic": BiquadraticEnergy,
    "compressible": NeoHookeEnergy,
    "incompressible": YeohEnergy,
}
"""Energies of a network by kind of terms."""


def _rest_lengths(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    sides = np.roll(points[cells], 1, axis=1) - np.roll(points[cells], -1, axis=1)
    return np.asarray(np.linalg.norm(sides, axis=2))


REST_VALUES: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "rest_area": signed_areas,
    "rest_angle": corner_angles,
    "rest_length": _rest_lengths,
    "rest_weight": lambda points, cells: 0.5 / np.tan(corner_angles(points, cells)),
}
"""Values that follow from the points and cells at rest; the others are moduli, which the energy is proportional to."""


@dataclass(frozen=True, eq=False)
class Terms:
    """Energies of one kind besides the springs: a row for each of `cells` (n_cells, n_corners), counter-clockwise.

    Values of sides are of the side opposite to each corner, and `coupling` of the two sides that meet in it.
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

    @property
    def moduli(self) -> dict[str, np.ndarray]:
        """Values that the energy is proportional to."""
        return {name: self.values[name] for name in VALUES[self.kind] if name not in REST_VALUES}

    @property
    def present(self) -> np.ndarray:
        """Whether a cell has the energy; cells of other parts have zeros as moduli."""
        return np.any([one.reshape(len(one), -1).any(axis=1) for one in self.moduli.values()], axis=0)


@dataclass(frozen=True, eq=False)
class Net:
    """A network as plain arrays, which `springtune.SpringNet` describes."""

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


def terms_of(energy: Energy, mesh: Mesh, reference: float) -> Terms:
    """Energy of a network as plain arrays, for all cells with as many corners; moduli are over `reference` [N/m]."""
    kind = next((kind for kind, made in ENERGY_CLASSES.items() if isinstance(energy, made)), "")
    if not kind:
        raise DefinitionError(
            f"energy {type(energy).__name__} cannot be written out; use those of springtune.mechanics.energies"
        )
    given = energy.moduli
    if isinstance(energy, AngleEnergy) and energy.modulus.ndim > 1:
        kind, given = "corner", {"rotational": energy.modulus}
    elif isinstance(energy, YeohEnergy):
        given = dict(zip(("c1", "c2", "c3"), energy.coefficients.T))
    cells, values = mesh.cells[energy.corners.shape[1]], {}
    rows = rows_of(cells, energy.corners)
    for name in VALUES[kind]:
        if name in REST_VALUES:
            values[name] = REST_VALUES[name](mesh.points, cells)
        else:
            values[name] = np.zeros(cells.shape if name in CORNER_VALUES else len(cells))
            if given.get(name) is not None:
                values[name][rows] = reference * given[name]
    return Terms(kind, cells, values)


def energies_of(net: Net, reference: float) -> list[Energy]:
    """Energies that the terms of a net were written from."""
    found = []
    for terms in net.energies:
        moduli = [one[terms.present] / reference for one in terms.moduli.values()]
        if terms.kind == "incompressible":
            moduli = [np.column_stack(moduli)]
        found.append(ENERGY_CLASSES[terms.kind](net.points, terms.cells[terms.present], *moduli))
    return found

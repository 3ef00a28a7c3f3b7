r"""Finite elements whose stiffness is linear in constants: displacements, and their exact derivatives.

With :math:`K = \sum_i c_i K_i` and :math:`K u = f` the derivative along a direction s of the constants solves
:math:`K u' = -\sum_i s_i K_i u`.
"""

from collections.abc import Mapping
from copy import copy

import numpy as np
from scipy.sparse import csc_array, csr_array, eye_array, kron

from ..linalg.factors import entry_places, factorize
from ..mesh.sheets import GroupedMesh
from ..problem.materials import AnyMaterial
from ..problem.shapes import LoadCase, Shape
from .shapes import VOIGT, solve_shape
from .triangles import shape_functions

ENERGY_TOLERANCE = 1e-4  # largest relative error estimate of the energy at which a level of finite elements is taken

ENTRIES = ((0, 0), (1, 1), (0, 1), (2, 2), (0, 2), (1, 2))
"""Places of the constants C11, C22, C12, C66, C16 and C26 in the stiffness of a part."""


class Family:
    """A shape under a load case for any constants, on a level that is fine enough for some `materials`."""

    def __init__(
        self, shape: Shape, load: LoadCase, grouped: GroupedMesh | None, materials: Mapping[str, AnyMaterial]
    ) -> None:
        self.reference = solve_shape(shape, load, materials, grouped, tolerance=ENERGY_TOLERANCE)
        self._level = level = copy(self.reference._level)
        space, mesh = level.space, level.space.mesh
        self._free, self.forces, self._given = ~level.held.ravel(), level.forces().ravel(), level.supports()[1].ravel()
        sides = [group for side in mesh.sides.values() for group in side.groups]
        self.groups = (*dict.fromkeys(sides), *level.problem.points)
        places = entry_places(2 * space.numbers[:, :, None] + np.arange(2))
        self._all = []
        for part in map(mesh.names.index, materials):
            for row, column in ENTRIES:
                units = np.zeros((len(mesh.names), 3, 3))
                units[part, row, column] = units[part, column, row] = shape.thickness
                level._tensor = units[:, VOIGT[:, :, None, None], VOIGT[None, None]]
                self._all.append(csr_array((level._matrices().ravel(), places), shape=2 * self.forces.shape))

    def solve(self, constants: np.ndarray) -> np.ndarray:
        """Return displacements (unknowns, n): of the first column of `constants`, then derivatives along the others."""
        free, whole = self._free, self._all[0].copy()
        whole.data = constants[:, 0] @ np.stack([one.data for one in self._all])
        factor = factorize(csc_array(whole[free][:, free]))
        moved = np.zeros((len(free), constants.shape[1]))
        moved[:, 0] = self._given
        moved[free, 0] = factor.solve((self.forces - whole @ self._given)[free])
        pulls = np.stack([one @ moved[:, 0] for one in self._all], axis=1) @ constants
        moved[free, 1:] = -factor.solve(np.ascontiguousarray(pulls[free, 1:]))
        return moved

    def mean(self, group: str, axis: int) -> np.ndarray:
        """Row (unknowns,) that reads the displacement of a point, or the mean one of sides, along an axis."""
        points = self._level.problem.points
        if group in points:
            return self.at(np.array([points[group]]))[0][[axis]].toarray()[0]
        return np.kron(self._level._shares(group), np.eye(2)[axis])

    def at(self, points: np.ndarray) -> tuple[csr_array, np.ndarray]:
        """Rows that read u and v at points (n, 2) in turn, and distances from the body over its extent [1]."""
        space = self._level.space
        found, local = self._level._locate(points)
        shares = np.column_stack([1 - local.sum(axis=1), local]).clip(0)
        values, _ = shape_functions(space.degree, (shares / shares.sum(axis=1, keepdims=True))[:, 1:])
        ends = values.shape[1] * np.arange(len(points) + 1)
        entries = values.ravel(), space.numbers[found].ravel(), ends
        reading = csr_array(entries, shape=(len(points), len(space.places)))
        apart = np.linalg.norm(reading @ space.places - points, axis=1) / np.ptp(space.mesh.points)
        return kron(reading, eye_array(2), format="csr"), apart

r"""Finite elements whose stiffness is linear in constants: displacements, and their exact derivatives.

With :math:`K = \sum_i c_i K_i` and :math:`K u = f` the derivative along a direction s of the constants solves
:math:`K u' = -\sum_i s_i K_i u`: one more solve with the same factor. Elements are those of
`springtune.reference.shapes`.
"""

from collections.abc import Mapping
from copy import copy

import numpy as np
from scipy.sparse import csc_array, csr_array

from ..linalg.factors import factorize
from ..mesh.groups import GroupedMesh
from ..problem.materials import AnyMaterial
from ..problem.shapes import LoadCase, Shape
from .shapes import VOIGT, solve_shape
from .triangles import shape_functions

ACCURACY = 1e-3
"""Largest relative error estimate of the energy at which a level of finite elements is taken."""

ENTRIES = ((0, 0), (1, 1), (0, 1), (2, 2), (0, 2), (1, 2))
"""Places of the constants C11, C22, C12, C66, C16 and C26 in the stiffness of a part."""


class Family:
    """A shape under a load case for any constants, on a level that is fine enough for some `materials`.

    `forces` are those on the unknowns [N], `groups` the names of sides and points. `reference` is the solution for
    these materials.
    """

    def __init__(
        self, shape: Shape, load: LoadCase, materials: Mapping[str, AnyMaterial], grouped: GroupedMesh | None
    ) -> None:
        self.reference = solve_shape(shape, load, materials, grouped, tolerance=ACCURACY)
        self._level = level = copy(self.reference._level)
        space, held = level.space, level.held.ravel()
        self._free, self.forces, self._given = ~held, level.forces().ravel(), level.supports()[1].ravel()
        sides = [group for side in space.mesh.sides.values() for group in side.groups]
        self.groups = (*dict.fromkeys(sides), *level.problem.points)
        numbers = (2 * space.numbers[:, :, None] + np.arange(2)).reshape(len(space.corners), -1)
        width = numbers.shape[1]
        places = np.repeat(numbers, width, axis=1).ravel(), np.tile(numbers, width).ravel()
        self._all = []
        for part in (space.mesh.names.index(name) for name in materials):
            for row, column in ENTRIES:
                units = np.zeros((len(space.mesh.names), 3, 3))
                units[part, row, column] = units[part, column, row] = shape.thickness
                level._tensor = units[:, VOIGT[:, :, None, None], VOIGT[None, None]]
                self._all.append(csr_array((level._matrices().ravel(), places), shape=(len(held), len(held))))
        self._inner = [one[self._free][:, self._free] for one in self._all]

    def solve(self, constants: np.ndarray, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return displacements (unknowns,), derivatives along `slopes` (unknowns, n), and all K_i u.

        `constants` has `ENTRIES` of each part; `slopes` (n_constants, n) are directions of them.
        """
        first, free = self._inner[0], self._free
        data = constants @ np.stack([one.data for one in self._inner])
        factor = factorize(csc_array((data, first.indices, first.indptr), shape=first.shape))
        found = self._given.copy()
        pulls = np.stack([one @ found for one in self._all], axis=1)
        found[free] = factor.solve((self.forces - pulls @ constants)[free])
        pulls = np.stack([one @ found for one in self._all], axis=1)
        derivatives = np.zeros((len(found), slopes.shape[1]))
        derivatives[free] = -factor.solve(np.ascontiguousarray((pulls @ slopes)[free]))
        return found, derivatives, pulls

    def mean(self, group: str, axis: int) -> np.ndarray:
        """Row (unknowns,) that reads the displacement of a point, or the mean one of sides, along an axis."""
        level = self._level
        if group in level.problem.points:
            return self.at(np.array([level.problem.points[group]]))[0][[axis]].toarray()[0]
        row = np.zeros((level.space.n_functions, 2))
        row[:, axis] = level._shares(group)
        return row.ravel()

    def at(self, points: np.ndarray) -> tuple[csr_array, np.ndarray]:
        """Rows that read u and v at points (n, 2) in turn, and distances from the body over its extent [1]."""
        space = self._level.space
        found, local = self._level._located(points)
        shares = np.column_stack([1 - local.sum(axis=1), local]).clip(0)
        values, _ = shape_functions(space.degree, (shares / shares.sum(axis=1, keepdims=True))[:, 1:])
        apart = np.linalg.norm(np.einsum("pi,pic->pc", values, space.places[space.numbers[found]]) - points, axis=1)
        columns = (2 * space.numbers[found][:, None] + np.arange(2)[:, None]).reshape(2 * len(points), -1)
        rows = np.repeat(np.arange(len(columns)), columns.shape[1])
        shape = len(columns), 2 * space.n_functions
        entries = np.repeat(values, 2, axis=0).ravel()
        return csr_array((entries, (rows, columns.ravel())), shape=shape), apart / np.ptp(space.mesh.points)

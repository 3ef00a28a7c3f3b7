r"""The best that springs alone can do: each stiffness searched for, over a space of loads and the field inside.

The loads are the 15 tests of `springtune.springs.patch_fit`, here for the wanted nu: F are their forces, U0 their
exact displacements, and 1 their energies. A network has displacements ``U = K(k)^-1 F`` and energies ``M = F^T U``, a
matrix-convex function of k. A thousand springs can meet the 120 numbers of M exactly, with a field that is wrong by
half; so the field counts, too. The springs minimise

.. math:: \| M - 1 \|^2 + \frac{w_s}{n} \sum_e \frac{|e_e - e_{e,0}|^2}{|e_{e,0}|^2} + w_u \| u - u_0 \|^2
          + \frac{\lambda}{n} \sum_e \ln^2 \frac{k_e}{k_{e,start}}

with ``e_e`` (15) the stretches of a spring, one under each load, and u the displacements, weighted by area, without
rigid motions, relative to the load's own. A spring changes by a factor of ten at most. Gradients are exact: one
factorization and 30 solves. The best of several searches is not the best there is.

**A bound that is proven.** Take any virtual displacements y, one field for each load, with work ``y . F >= 0``. Then
``sum_e k_e y_e . e_e = y . F >= 0`` in equilibrium, where ``y_e`` (15) are a spring's stretches by y. With k >= 0 some
spring has ``k_e > 0`` and ``y_e . e_e >= 0``, and so ``|e_e - e_e0| >= -y_e . e_e0 / |y_e|``. No stiffnesses k >= 0
have all stretches right to better than

.. math:: \delta = \min_e \frac{- y_e \cdot e_{e,0}}{|y_e| |e_{e,0}|}

of what a spring has at most under a load of energy 1. Here y moves one particle alone, so that its own springs count,
and delta is the largest over all particles. Each y is a proof, whether or not the search for it converged.
The weights are chosen by the errors of six free meshes of 5 mm under loads that were not fitted. Derived here.
"""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

from ..mesh.cells import Mesh
from ..problem.materials import Material
from . import van_gelder
from .base import DefinitionError, Springs, check_triangles, definition
from .identification import MOST_RATIO, tested_body
from .patch_fit import NU, polynomial_tests

STRETCH_WEIGHT, DISPLACEMENT_WEIGHT, START_WEIGHT = 0.1, 0.1, 1e-3
"""Weights w_s, w_u and lambda against the squared misfit of the energies [1]."""

EVALUATIONS = 400  # networks that a search tries, each with a gradient

LEAST_START = 0.01  # least stiffness from which a search starts, over the mean [1]: logarithms need one above zero

LEAST_DISPLACEMENT = 0.01
"""Displacement over the largest load's below which it counts no less, as in slender sheets [1]."""

LEAST_MOVE = 1e-4  # virtual stretch below which a spring's proves little [1]

ROUNDING = 1e-9  # by which a bound is lowered, and below which numbers are zero [1]


@definition("best-springs", order=197, cells=(3,), cost=2)
def springs(mesh: Mesh, material: Material, thickness: float) -> Springs:
    """Springs found by a search over 15 loads and the field inside, none negative: a limit to compare with, slow.

    Raises DefinitionError on quadrilaterals and on meshes of several parts.

    Source: own rule (derived).
    """
    start = van_gelder.springs(mesh, material, thickness).relative
    stiffness, _, evaluations = LoadSpace(mesh, material.poisson_ratio).search(start)
    return Springs(material.young_modulus * thickness, stiffness, evaluations=evaluations)


class LoadSpace:
    """Tests with polynomial stresses on a mesh, and how far a network is off, for E t = 1.

    `forces` (unknowns, n_tests), exact `stretches` (n_springs, n_tests) and their `sizes` (n_springs,).
    """

    def __init__(self, mesh: Mesh, nu: float = NU) -> None:
        from ..mechanics.network import Network  # here: see `springtune.springs`

        check_triangles(mesh)
        self.mesh, self.nu = mesh, nu
        self.network = Network(mesh, tested_body(mesh), np.ones(len(mesh.edges)))
        self.normals = self.network.rest_vectors / self.network.rest_lengths[:, None]
        self._outside, fields = polynomial_tests(mesh, nu)
        self.forces = self._reduced(self._outside)
        if len(self.forces) < len(fields):
            raise DefinitionError(f"has {len(fields)} loads to fit, too many for so coarse a mesh; use a finer one")
        self.stretches = self._stretched(fields)
        self.sizes = np.linalg.norm(self.stretches, axis=1)
        # Displacements times the root of the area: rigid motions are taken off by a projection.
        self._roots = np.sqrt(np.repeat(mesh.particle_areas, 2))[:, None]
        turned = (mesh.points - mesh.points.mean(axis=0))[:, ::-1] * [-1.0, 1.0]
        rigid = np.column_stack([np.tile(np.eye(2), (len(turned), 1)), turned.ravel()])
        self._rigid = np.linalg.qr(self._roots * rigid)[0]
        self._wanted = self._deformed(fields)
        squares, mixtures = np.linalg.eigh(self._wanted.T @ self._wanted)
        self._scale = mixtures / np.sqrt(squares + LEAST_DISPLACEMENT**2 * squares[-1])

    def _reduced(self, fields: Iterable[np.ndarray]) -> np.ndarray:
        return np.stack([self.network.reduce(field) for field in fields], axis=1)

    def _stretched(self, fields: Iterable[np.ndarray]) -> np.ndarray:
        return np.stack([(self.normals * self.network.end_differences(field)).sum(axis=1) for field in fields], axis=1)

    def _deformed(self, fields: Iterable[np.ndarray]) -> np.ndarray:
        moved = self._roots * np.stack([field.ravel() for field in fields], axis=1)
        return np.asarray(moved - self._rigid @ (self._rigid.T @ moved))

    def _factorized(self, stiffness: np.ndarray) -> tuple[Any, Any]:
        from ..linalg.factors import SingularError
        from ..mechanics.network import Network

        network = Network(self.mesh, self.network.held, stiffness, like=self.network)
        factor = network.factorize_tangent()
        if factor.negative_pivots:
            raise SingularError("the network is unstable at rest")
        return network, factor

    def misses(self, stiffness: np.ndarray, slope: bool = False) -> tuple[np.ndarray, ...]:
        """Return misfits of energies, stretches and displacements; with `slope` the gradient of their squares."""
        network, factor = self._factorized(stiffness)
        moved = factor.solve(self.forces)
        fields = [network.expand(field) for field in moved.T]
        stretches = self._stretched(fields)
        energies = self.forces.T @ moved - np.eye(moved.shape[1])
        off = (stretches - self.stretches) / self.sizes[:, None]
        apart = (self._deformed(fields) - self._wanted) @ self._scale
        if not slope:
            return energies, off, apart
        # Adjoint: the forces that stretches and displacements ask for.
        pulls = 2 * STRETCH_WEIGHT / len(off) * off / self.sizes[:, None]
        pushes = 2 * DISPLACEMENT_WEIGHT * self._roots * (apart @ self._scale.T)
        right = self._reduced(pushes.T.reshape(len(moved.T), -1, 2))
        right -= np.stack([network.gather(pull[:, None] * self.normals) for pull in pulls.T], axis=1)
        adjoint = self._stretched(network.expand(field) for field in factor.solve(right).T)
        return energies, off, apart, -((2 * stretches @ energies + adjoint) * stretches).sum(axis=1)

    def errors(self, stiffness: np.ndarray) -> tuple[float, float, float, float]:
        """Worst errors [1] over all loads of the space: of energy, displacements, a stretch, and unfitted energy."""
        energies, off, apart = self.misses(stiffness)
        others = self._reduced(polynomial_tests(self.mesh, self.nu, range(5, 7))[0])
        further = others.T @ self._factorized(stiffness)[1].solve(others) - np.eye(others.shape[1])
        energy, field, other = (float(np.linalg.norm(one, 2)) for one in (energies, apart, further))
        return energy, field, float(np.linalg.norm(off, axis=1).max()), other

    def search(
        self, start: np.ndarray, any_sign: bool = False, evaluations: int = EVALUATIONS
    ) -> tuple[np.ndarray, float, int]:
        """Stiffnesses that L-BFGS-B finds from a start, their objective and the networks tried."""
        from scipy.optimize import minimize  # here: see `springtune.springs`

        from ..linalg.factors import SingularError

        start = start if any_sign else np.maximum(start, LEAST_START * np.abs(start).mean())

        def objective(change: np.ndarray) -> tuple[float, np.ndarray]:
            stiffness = start * (1 + change) if any_sign else start * np.exp(change)
            try:
                energies, off, apart, slope = self.misses(stiffness, slope=True)
            except SingularError:
                return math.inf, np.zeros(len(change))
            fields = STRETCH_WEIGHT * (off**2).sum() / len(off) + DISPLACEMENT_WEIGHT * (apart**2).sum()
            value = (energies**2).sum() + fields + START_WEIGHT * (change**2).mean()
            step = start if any_sign else stiffness
            return float(value), slope * step + 2 * START_WEIGHT / len(change) * change

        bounds = [(-MOST_RATIO, MOST_RATIO) if any_sign else (-math.log(MOST_RATIO), math.log(MOST_RATIO))] * len(start)
        options = {"maxfun": evaluations, "maxiter": evaluations, "maxcor": 20, "ftol": 1e-9, "gtol": 1e-9}
        found = minimize(objective, np.zeros(len(start)), jac=True, method="L-BFGS-B", bounds=bounds, options=options)
        stiffness = start * (1 + found.x) if any_sign else start * np.exp(found.x)
        return stiffness, float(found.fun), int(found.nfev)

    def stretch_bound(self) -> float:
        """Largest delta over all particles: no stiffnesses k >= 0 have a smaller worst error of a stretch [1]."""
        edges, target, proven = self.mesh.edges, self.stretches / self.sizes[:, None], [0.0]
        for particle, force in enumerate(self._outside.transpose(1, 2, 0)):
            rows = np.flatnonzero((edges == particle).any(axis=1))
            towards = np.where(edges[rows, 1] == particle, 1.0, -1.0)[:, None] * self.normals[rows]
            proven.append(delta_of(towards, target[rows], force))
        return max(proven)


def delta_of(normals: np.ndarray, target: np.ndarray, force: np.ndarray) -> float:
    """Delta that one particle proves, or 0, by `normals` of its springs, `target` stretches and `force`."""
    from scipy.optimize import minimize, nnls  # here: see `springtune.springs`

    rows = np.linalg.svd(np.concatenate([target, force]), full_matrices=False)
    basis = rows[2][rows[1] > ROUNDING * rows[1][0]].T
    target, force = target @ basis, (force @ basis).ravel() / max(np.linalg.norm(force), ROUNDING)

    def opposed(unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Virtual stretches, their sizes, and how far they are against the target ones; the last unknown is delta."""
        stretches = normals @ unknowns[:-1].reshape(2, -1)
        sizes = np.sqrt((stretches**2).sum(axis=1) + LEAST_MOVE**2)
        return stretches, sizes, -(stretches * target).sum(axis=1)

    def margins(unknowns: np.ndarray) -> np.ndarray:
        _, sizes, against = opposed(unknowns)
        move = unknowns[:-1]
        return np.concatenate([against - unknowns[-1] * sizes, [move @ force, 1 - move @ move]])

    def slopes(unknowns: np.ndarray) -> np.ndarray:
        stretches, sizes, _ = opposed(unknowns)
        towards = -target - unknowns[-1] * stretches / sizes[:, None]
        of_springs = np.column_stack([(normals[:, :, None] * towards[:, None]).reshape(len(normals), -1), -sizes])
        return np.concatenate([of_springs, [np.append(force, 0.0), np.append(-2 * unknowns[:-1], 0.0)]])

    # What the springs, none pushing, leave of the force, or of a sum of 1, is against all of them.
    pulls = (normals.T[:, None] * target.T).reshape(len(force), -1)
    total = np.full((1, len(normals)), 0.0 if force.any() else 1.0)
    start = force - pulls @ nnls(np.concatenate([pulls, total]), np.append(force, 1.0))[0]
    begin = np.append(start / max(np.linalg.norm(start), ROUNDING), 0.0)
    found = minimize(
        lambda unknowns: -unknowns[-1], begin, jac=lambda _: np.append(np.zeros(len(start)), -1.0),
        constraints={"type": "ineq", "fun": margins, "jac": slopes}, method="SLSQP", options={"maxiter": 200},
    ).x  # fmt: skip
    found[:-1] += max(0.0, ROUNDING - found[:-1] @ force) * force
    stretches, _, against = opposed(found)
    sizes = np.linalg.norm(stretches, axis=1)
    return max(0.0, float((against / sizes).min()) - ROUNDING) if sizes.min() > 1e-2 * LEAST_MOVE else 0.0

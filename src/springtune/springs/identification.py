"""Stiffness of each spring from target displacements: the misfit that searches minimise.

A case is a load and its target displacements. The misfit of a network over all particles is ::

    J = 1/2 sum over cases |u - u*|^2 / |u*|^2

Unknowns are logarithms of the stiffnesses, from a tenth to ten times those of `springtune.springs.lattice`; for an
anisotropic material those of `springtune.springs.energy_fit`, with a tenth of their mean in place of zeros.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..mesh.cells import Mesh, MeshError
from ..problem.materials import AnyMaterial, Material
from . import energy_fit, lattice
from .base import DefinitionError, Springs, membrane_stiffness

MOST_RATIO = 10.0  # largest factor between a spring and where its search starts [1]


@dataclass(frozen=True, eq=False)
class Case:
    """A load [N] and its target displacements [m], with `held` directions; all arrays are (n_points, 2)."""

    held: np.ndarray
    forces: np.ndarray
    displacements: np.ndarray


def tested_body(mesh: Mesh) -> np.ndarray:
    """Directions to hold of the free body of a patch test, shape (n_points, 2); refuse a mesh of several parts."""
    from ..mechanics.continuum import free_body  # here: see `springtune.springs`

    try:
        return free_body(mesh)
    except MeshError as error:
        raise DefinitionError(f"{error}; or take 'van-gelder', which needs no test") from None


def patch_cases(mesh: Mesh, material: AnyMaterial, thickness: float) -> list[Case]:
    """Return tension along x and y and shear of the free mesh under even tractions; exact displacements are known."""
    from ..mechanics.continuum import outline_forces  # here: see `springtune.springs`

    tested_body(mesh)
    x, y = mesh.points.T
    corner = _first_least(x + y)
    held = np.zeros(mesh.points.shape, dtype=bool)
    held[corner] = True
    other = _first_least(y - x)  # the other end of the lower side
    # Of a body that has none, or stands on its corner.
    if x[other] - x[corner] <= abs(y[other] - y[corner]) * (1 + 1e-9):
        other = _first_least(-np.abs(x - x[corner]))
    held[other, 1] = True
    points = mesh.points - mesh.points[corner]
    modulus, gradients = _gradients(material.in_plane)
    cases = []
    for stress, given in zip(([[1, 0], [0, 0]], [[0, 0], [0, 1]], [[0, 1], [1, 0]]), gradients):
        forces = modulus * thickness * outline_forces(mesh, np.array(stress, dtype=float))
        gradient = np.array(given, dtype=float)
        turn = gradient[1] @ points[other] / points[other, 0]  # turned back, since it is held there
        gradient -= turn * np.array([[0.0, -1.0], [1.0, 0.0]])
        cases.append(Case(held, forces, points @ gradient.T))
    return cases


def _first_least(values: np.ndarray) -> int:
    """Number of the least value; the first one of those that are equal up to rounding."""
    return int(np.argmax(values <= values.min() + 1e-9 * np.ptp(values)))


def _gradients(material: AnyMaterial) -> tuple[float, list[list[list[float]]]]:
    """A stress, and the displacement gradients of it along x, along y and in shear, the lower side staying level."""
    if isinstance(material, Material):
        nu = material.poisson_ratio
        return material.young_modulus, [[[1, 0], [0, -nu]], [[-nu, 0], [0, 1]], [[0, 2 * (1 + nu)], [0, 0]]]
    modulus = membrane_stiffness(material, 1.0)
    strains = np.linalg.inv(material.plane_stress / modulus).T.tolist()
    return modulus, [[[along, sheared], [0, across]] for along, across, sheared in strains]


def _start(mesh: Mesh, material: AnyMaterial, thickness: float) -> tuple[float, np.ndarray]:
    """Reference stiffness and relative ones from which searches start."""
    if isinstance(material, Material):
        found = lattice.springs(mesh, material, thickness)
        return found.reference, found.relative
    found = energy_fit.springs(mesh, material, thickness)
    return found.reference, np.maximum(found.relative, 0.1 * found.relative.mean())


class Misfit:
    """Misfit of networks that differ in stiffness, its gradient, and the number of evaluations."""

    def __init__(self, mesh: Mesh, material: AnyMaterial, thickness: float, cases: Sequence[Case]):
        from ..mechanics.network import Network  # here: see `springtune.springs`

        self.reference, self.start = _start(mesh, material, thickness)
        self.mesh, self.evaluations = mesh, 0
        self.groups: dict[bytes, list[Case]] = {}
        for case in cases:
            self.groups.setdefault(case.held.tobytes(), []).append(case)
        self.patterns = {name: Network(mesh, group[0].held, self.start) for name, group in self.groups.items()}

    @property
    def bounds(self) -> list[tuple[float, float]]:
        """Least and largest logarithm of each spring."""
        return [(-math.log(MOST_RATIO), math.log(MOST_RATIO))] * len(self.start)

    def springs(self, logarithms: np.ndarray) -> Springs:
        """Springs of logarithms that a search found."""
        return Springs(self.reference, self.start * np.exp(logarithms), evaluations=self.evaluations)

    def __call__(self, logarithms: np.ndarray) -> float:
        """Misfit at natural logarithms of the stiffnesses over their start, shape (n_edges,)."""
        return self.evaluate(logarithms, gradient=False)[0]

    def evaluate(self, logarithms: np.ndarray, gradient: bool = True) -> tuple[float, np.ndarray]:
        """Misfit and its gradient, shape (n_edges,), by one solve more for each case (adjoint method)."""
        from ..mechanics.network import Network
        from ..mechanics.statics import SingularError

        self.evaluations += 1
        relative = self.start * np.exp(logarithms)
        total, slope = 0.0, np.zeros(len(relative))
        for name, cases in self.groups.items():
            network = Network(self.mesh, cases[0].held, relative, like=self.patterns[name])
            try:
                factor = network.factorize_tangent()
            except SingularError:
                return np.inf, slope
            loads = np.stack([network.reduce(case.forces) for case in cases], axis=1) / self.reference
            target = np.stack([network.reduce(case.displacements) for case in cases], axis=1)
            weights = 1 / np.array([np.sum(case.displacements**2) for case in cases])
            found = factor.solve(loads)
            miss = found - target
            total += 0.5 * float((weights * (miss**2).sum(axis=0)).sum())
            if gradient:
                adjoint = factor.solve(miss * weights)
                normals = network.rest_vectors / network.rest_lengths[:, None]
                for number in range(len(cases)):
                    apart = (network.end_differences(network.expand(one[:, number])) for one in (found, adjoint))
                    stretches, forces = (np.einsum("ij,ij->i", normals, one) for one in apart)
                    slope -= relative * stretches * forces
        return total, slope

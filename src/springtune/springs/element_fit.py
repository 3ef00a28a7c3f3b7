r"""Springs fitted to the stiffness matrix of each finite element, none negative.

.. math:: \min_{k \ge 0} \; \Big\| \sum_i k_i B_i - K_{FEM} \Big\|_F

for each cell, with B_i the matrix of a unit spring on its edge i and K_FEM that of the linear triangle or of the
bilinear rectangle (four Gauss points). After Natsupakpong and Cavusoglu (Graph. Models 72:61, 2010; abstract read).
It matches the constrained modulus rather than E: on an equilateral triangle E is wrong by 8 / (9 (1 - nu^2)).
"""

from itertools import combinations

import numpy as np

from ..mesh.cells import DIAGONALS, SIDES, Mesh, signed_areas
from ..problem.materials import AnyMaterial
from .base import Springs, definition, membrane_stiffness


@definition("element-fit", order=140, anisotropic=True)
def springs(mesh: Mesh, material: AnyMaterial, thickness: float) -> Springs:
    """Springs fitted by least squares to the stiffness matrix of each finite element, none negative.

    Source: Natsupakpong and Cavusoglu, Graph. Models 72:61, 2010 (abstract, derived).
    """
    elasticity = material.plane_stress / membrane_stiffness(material, 1.0)
    parts = {}
    for count, corners in mesh.cells.items():
        here = mesh.points[corners] - mesh.points[corners[:, :1]]
        # Cells of one shape have one answer, and meshes in rows few shapes.
        shapes = np.round(here / np.sqrt(mesh.area / len(corners)), 9).reshape(len(corners), -1)
        _, first, which = np.unique(shapes, axis=0, return_index=True, return_inverse=True)
        matrices = _element_matrices(here[first], elasticity)
        parts[count] = _fit(here[first], SIDES[count] + DIAGONALS[count], matrices)[which.ravel()]
    return Springs(membrane_stiffness(material, thickness), mesh.sum_to_edges(parts))


def _element_matrices(here: np.ndarray, elasticity: np.ndarray) -> np.ndarray:
    """Stiffness matrix of each cell for E t = 1, shape (n_cells, 2 m, 2 m), from its corners, shape (n_cells, m, 2)."""
    if here.shape[1] == 3:
        areas = signed_areas(here.reshape(-1, 2), np.arange(here.size // 2).reshape(-1, 3))
        turned = np.roll(here, -1, axis=1) - np.roll(here, -2, axis=1)
        strain = _strain(np.stack([turned[..., 1], -turned[..., 0]], axis=2) / (2 * areas[:, None, None]))
        return np.einsum("n,nki,kl,nlj->nij", areas, strain, elasticity, strain, optimize=True)
    total = np.zeros((len(here), 8, 8))
    signs = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for xi, eta in signs / np.sqrt(3):
        local = 0.25 * np.stack([signs[:, 0] * (1 + eta * signs[:, 1]), signs[:, 1] * (1 + xi * signs[:, 0])], axis=1)
        jacobian = np.einsum("ia,nib->nab", local, here)
        strain = _strain(np.einsum("nba,ia->nib", np.linalg.inv(jacobian), local))
        total = total + np.einsum("n,nki,kl,nlj->nij", np.linalg.det(jacobian), strain, elasticity, strain)
    return total


def _strain(slopes: np.ndarray) -> np.ndarray:
    """Matrix from the corners' displacements to xx, yy and xy strain, shape (n_cells, 3, 2 m)."""
    count, corners, _ = slopes.shape
    strain = np.zeros((count, 3, corners, 2))
    strain[:, 0, :, 0] = strain[:, 2, :, 1] = slopes[..., 0]
    strain[:, 1, :, 1] = strain[:, 2, :, 0] = slopes[..., 1]
    return strain.reshape(count, 3, 2 * corners)


def _fit(here: np.ndarray, pairs: tuple[tuple[int, int], ...], matrices: np.ndarray) -> np.ndarray:
    """Non-negative stiffness of each edge of each cell, shape (n_cells, n_pairs)."""
    count, corners, _ = here.shape
    parts = np.zeros((count, len(pairs), corners, 2))
    for number, (i, j) in enumerate(pairs):
        normal = here[:, j] - here[:, i]
        normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        parts[:, number, i], parts[:, number, j] = -normal, normal
    springs = parts.reshape(count, len(pairs), -1)
    products = np.einsum("npi,nqi->npq", springs, springs) ** 2
    target = np.einsum("npi,nij,npj->np", springs, matrices, springs)
    return least_squares(products, target)


def least_squares(products: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return the springs k >= 0 of each cell that minimise ``k . products . k - 2 target . k``.

    `products` (n_cells, n_springs, n_springs) are of unit springs' effects, `target` (n_cells, n_springs) with the aim.
    """
    pairs = target.shape[1]
    # All sets of springs that may be other than zero are few: the best one with no negative stiffness is the answer.
    best, cost = np.zeros(target.shape), np.zeros(len(target))
    open_cells = np.arange(len(target))
    for size in range(pairs, 0, -1):
        for chosen in combinations(range(pairs), size):
            places = np.array(chosen)
            matrices, aims = products[open_cells][:, places[:, None], places], target[open_cells][:, places]
            found = np.linalg.solve(matrices, aims[..., None])[..., 0]
            trial = -(found * aims).sum(axis=1)
            better = (found >= 0).all(axis=1) & (trial < cost[open_cells])
            where = open_cells[better]
            cost[where] = trial[better]
            best[where] = 0.0
            best[where[:, None], places] = found[better]
            if size == pairs:  # without a constraint at work no other set is better
                open_cells = open_cells[~better]
                if not len(open_cells):
                    return best
    return best

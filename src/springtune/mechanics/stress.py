r"""Stress in a network, recovered from the forces in its cells.

A cell of area A in which forces f act on corners at x has the mean stress (virial)

.. math:: \sigma = \frac{1}{A t} \sum_{corners} x \otimes f

Energies give each cell's forces exactly. A spring of force f, length l and direction n gives half,
:math:`f l\, n \otimes n / 2`, to the cell on each side; an outline edge or a diagonal gives all to its one cell. In
cells next to a joint of materials it is a mean of both sides.

Stress at particles is a linear field fitted to the surrounding cells (superconvergent patch recovery: O. C. Zienkiewicz
and J. Z. Zhu, Int. J. Numer. Methods Eng. 33:1331, 1992); outline particles take their inner neighbours' mean.
"""

from collections.abc import Mapping

import numpy as np

from ..mesh.cells import Mesh, rows_of, signed_areas
from .network import Network


def cell_stresses(network: Network, displacements: np.ndarray, linear: bool) -> dict[int, np.ndarray]:
    """Return stresses xx, yy, xy (n_cells, 3) by corner count, times thickness over reference stiffness [1]."""
    mesh = network.mesh
    place = mesh.points if linear else mesh.points + displacements
    vectors = place[network.second] - place[network.first]
    lengths = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    pull = network.spring_forces_over_k(displacements, linear) / lengths
    pull /= np.maximum(mesh.cells_per_edge, 1)  # bonds are of no cell
    # Components xx, yy and xy of each edge's share.
    virial = np.stack([vectors[:, 0] ** 2, vectors[:, 1] ** 2, vectors[:, 0] * vectors[:, 1]], axis=1) * pull[:, None]
    total = {count: virial[edges].sum(axis=1) for count, edges in mesh.cell_edges.items()}
    for energy in network.energies:
        count, corners = energy.corners.shape[1], energy.corners
        moved = displacements[corners]
        if linear:
            forces = (energy.tangent() @ moved.reshape(len(corners), -1, 1)).reshape(moved.shape)
        else:
            forces = energy.forces(displacements)
        # About a corner of its own: coordinates far from the origin would cost digits.
        x, y = (place[corners] - place[corners[:, :1]]).transpose(2, 0, 1)
        fx, fy = forces.transpose(2, 0, 1)
        # Parts of a body may have energies of their own.
        parts = [(x * fx).sum(1), (y * fy).sum(1), 0.5 * (x * fy + y * fx).sum(1)]
        total[count][rows_of(mesh.cells[count], corners)] += np.stack(parts, axis=1)
    return {count: total[count] / signed_areas(place, corners)[:, None] for count, corners in mesh.cells.items()}


def particle_stresses(
    mesh: Mesh, stresses: Mapping[int, np.ndarray], chosen: Mapping[int, np.ndarray] | None = None
) -> np.ndarray:
    """Return the stress at the particles (n_points, 3) from `chosen` cells, of one part; NaN without one."""
    # Corner by corner of the cells: the side to the next corner, and stress and middle of the cell.
    sides_of, values, middles, number = [], [], [], 0
    for count, cells in mesh.cells.items():
        kept = slice(None) if chosen is None else chosen[count]
        corners = cells[kept]
        sides_of.append(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2))
        values.append(np.repeat(stresses[count][kept], count, axis=0))
        middles.append(np.repeat(mesh.points[corners].mean(axis=1), count, axis=0))
        number += len(corners)
    pairs, value, middle = np.concatenate(sides_of), np.concatenate(values), np.concatenate(middles)
    count, size, particle = len(mesh.points), np.sqrt(mesh.area / number), pairs[:, 0]
    fits, good = _fits(mesh.points, particle, middle, value, count, size)
    # Of the sides of these cells, those that have one of them are the outline.
    code = np.sort(pairs, axis=1) @ np.array([count, 1])
    sides, times = np.unique(code, return_counts=True)
    rim = np.zeros(count, dtype=bool)
    rim[np.concatenate(np.divmod(sides[times == 1], count))] = True
    found = np.full((count, 3), np.nan)
    inside = good & ~rim
    found[inside] = fits[inside, 0]
    # Of neighbours inside, and where there are none of theirs, the fits are continued.
    joined = np.concatenate([pairs, pairs[:, ::-1]])
    around = np.bincount(particle, minlength=count)
    sources = inside
    while True:
        wanted = (around > 0) & np.isnan(found[:, 0])
        if not wanted.any():
            return found
        to, of = joined[wanted[joined[:, 0]] & sources[joined[:, 1]]].T
        if not len(to):
            # No particle inside: the fits to the cells around, or their mean.
            total = np.stack([np.bincount(particle, part, count) for part in value.T], axis=1)
            mean = total[wanted] / around[wanted, None]
            found[wanted] = np.where(good[wanted, None], fits[wanted, 0], mean)
            return found
        apart = (mesh.points[to] - mesh.points[of]) / size
        reached = fits[of, 0] + apart[:, :1] * fits[of, 1] + apart[:, 1:] * fits[of, 2]
        met = np.bincount(to, minlength=count)
        sums = np.stack([np.bincount(to, part, count) for part in reached.T], axis=1)
        filled = np.flatnonzero(met)
        found[filled] = sums[filled] / met[filled, None]
        # What was filled passes on the mean of the fits that filled it.
        slopes = fits[of, 1:].reshape(len(of), -1)
        means = np.stack([np.bincount(to, part, count) for part in slopes.T], axis=1)[filled] / met[filled, None]
        fits[filled, 0], fits[filled, 1:] = found[filled], means.reshape(-1, 2, 3)
        sources = met > 0


def _fits(
    points: np.ndarray, particle: np.ndarray, middle: np.ndarray, value: np.ndarray, count: int, size: float
) -> tuple[np.ndarray, np.ndarray]:
    """Linear field about each particle, value and slopes over `size`, shape (n_points, 3, 3), and where it is one."""
    basis = np.concatenate([np.ones((len(particle), 1)), (middle - points[particle]) / size], axis=1)
    matrix, right = np.zeros((count, 3, 3)), np.zeros((count, 3, 3))
    for i in range(3):
        for j in range(3):
            matrix[:, i, j] = np.bincount(particle, basis[:, i] * basis[:, j], count)
            right[:, i, j] = np.bincount(particle, basis[:, i] * value[:, j], count)
    # Three middles that are on no line.
    scale = np.trace(matrix, axis1=1, axis2=2)
    good = np.linalg.det(matrix) > 1e-6 * np.where(scale > 0, scale, 1.0) ** 3
    fits = np.zeros((count, 3, 3))
    fits[good] = np.linalg.solve(matrix[good], right[good])
    return fits, good

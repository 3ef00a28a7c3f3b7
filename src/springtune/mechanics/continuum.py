r"""Networks as a continuum: effective moduli by patch tests with an even strain, and stress.

::

          o------o------o------o          u_x given on both ends, u_y free but for one particle: E and nu of a strip
        ->|    sheet           |->
          o------o------o------o          both given on the whole outline, as for even shear: G

          <- o---o---o                    an affine displacement of the whole outline and the rims of holes: three
         <-  |  ___  | ->                 of them give the stiffness of any mesh; three even tractions on the free
             o-/   \-o  ->                body give its compliance
          <- o-\___/-o

Moduli are times the thickness and over the reference stiffness [1], and of the given mesh: rows of triangles stretched
to fit a box differ from the exact lattice (`springtune.mesh.lattice`) by a few percent.

A cell of area A in which forces f act on corners at x has the mean stress (virial)

.. math:: \sigma = \frac{1}{A t} \sum_{corners} x \otimes f

Energies give each cell's forces exactly. A spring of force f, length l and direction n gives half,
:math:`f l\, n \otimes n / 2`, to the cell on each side; an outline edge or a diagonal gives all to its one cell. In
cells next to a joint of materials it is a mean of both sides.

Stress at particles is a linear field fitted to the surrounding cells (superconvergent patch recovery: O. C. Zienkiewicz
and J. Z. Zhu, Int. J. Numer. Methods Eng. 33:1331, 1992); outline particles take their inner neighbours' mean.
"""

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from ..linalg.factors import SingularError
from ..mesh.cells import Mesh, MeshError, rows_of, side_shares, signed_areas
from ..mesh.sheets import connected
from .network import Network

STRIP_TOLERANCE = 1e-6  # tolerance of a strip's length over its extent [1]: coordinates from files have few digits


Elastic = Any
"""A `springtune.springs.Springs`, which is of a room above: `relative`, `energies` and `lateral` of it are read."""


def ends(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Particles of the left and of the right end, straight or staggered: of outline edges that lie on neither face."""
    y = mesh.points[:, 1]
    tolerance = 1e-9 * np.ptp(y)
    edges = mesh.edges[mesh.on_outline]
    faces = [(np.abs(y[edges] - value) <= tolerance).all(axis=1) for value in (y.min(), y.max())]
    edges = edges[~faces[0] & ~faces[1]]
    middles = mesh.points[edges, 0].mean(axis=1)
    left = middles < 0.5 * (middles.min() + middles.max())
    return np.unique(edges[left]), np.unique(edges[~left])


UNIT_STRAINS = (((1.0, 0.0), (0.0, 0.0)), ((0.0, 0.0), (0.0, 1.0)), ((0.0, 0.5), (0.5, 0.0)))
"""Unit strains xx, yy and shear angle xy [1]."""


def unit_fields(mesh: Mesh) -> list[np.ndarray]:
    """Displacements of all particles by each of the unit strains [m], shape (n_points, 2)."""
    return [(mesh.points - mesh.points[0]) @ np.array(strain) for strain in UNIT_STRAINS]


def work_of(fields: list[np.ndarray], forces: list[np.ndarray], mesh: Mesh) -> np.ndarray:
    """Stiffness as the work that forces under each unit strain [m] do on its fields [m], over the area [1], (3, 3)."""
    work = np.array([[(force * field).sum() for field in fields] for force in forces]) / mesh.area
    return 0.5 * (work + work.T)


def strip_fault(mesh: Mesh) -> str:
    """Return why a mesh is no strip of one length without holes, with the remedy, or an empty string."""
    outline = mesh.edges[mesh.on_outline]
    x, y = mesh.points.T
    remedy = "give a full rectangle, or rows of one length"
    rounds = connected(outline, len(x))[outline[:, 0]]
    if (np.bincount(outline.ravel(), minlength=len(x))[outline] != 2).any() or (rounds != rounds[0]).any():
        return f"its outline is no single line around it: there are holes or parts; {remedy}"
    left, right = (end[np.argsort(y[end], kind="stable")] for end in ends(mesh))
    size = max(np.ptp(x), np.ptp(y))
    sides = [(side, y[side]) for side in (left, right)]
    rising = all(len(side) > 1 and (np.diff(heights) > 0).all() for side, heights in sides)
    faces = [y.min(), y.max()]
    if not rising or any(abs(heights[[0, -1]] - faces).max() > STRIP_TOLERANCE * size for _, heights in sides):
        return f"its ends do not run from a straight lower face to a straight upper one; {remedy}"
    heights = np.union1d(y[left], y[right])
    lengths = np.interp(heights, y[right], x[right]) - np.interp(heights, y[left], x[left])
    covered = float(lengths.mean() * np.ptp(y))
    if np.ptp(lengths) > STRIP_TOLERANCE * size or abs(mesh.area / covered - 1) > STRIP_TOLERANCE:
        return f"it is not of one length at every height; {remedy}"
    return ""


def free_body(mesh: Mesh) -> np.ndarray:
    """Return three directions to hold, shape (n_points, 2), so that a body is free but cannot move as a whole."""
    parts = connected(mesh.edges, len(mesh.points)).max() + 1
    if parts > 1:
        raise MeshError(f"the mesh has {parts} parts that no edge joins, and a free body is one; join them")
    corner = np.argmin(mesh.points.sum(axis=1))
    away = np.abs(mesh.points - mesh.points[corner])
    far = np.argmax((away**2).sum(axis=1))
    held = np.zeros(mesh.points.shape, dtype=bool)
    held[corner] = True
    held[far, np.argmin(away[far])] = True
    return held


def mean_gradient(mesh: Mesh, displacements: np.ndarray) -> np.ndarray:
    """Return the mean displacement gradient over the area [1], by the divergence theorem; row by column."""
    total = np.zeros((2, 2))
    for corners, normals in _cell_normals(mesh):
        moved = displacements[corners]
        total += np.einsum("nia,nib->ab", 0.5 * (np.roll(moved, -1, axis=1) + moved), normals)
    return total / mesh.area


def _cell_normals(mesh: Mesh) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Corners of cells (n, m), and outward normals of their sides times lengths (n, m, 2), by number of corners."""
    for corners in mesh.cells.values():
        here = mesh.points[corners]
        x, y = (np.roll(here, -1, axis=1) - here).transpose(2, 0, 1)
        yield corners, np.stack([y, -x], axis=2)


class PatchTest:
    """Patch tests of many networks on one mesh, which share its sparsity."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self._first: dict[str, Network] = {}

    def _network(self, name: str, held: np.ndarray, springs: Elastic) -> Network:
        network = Network(self.mesh, held, springs.relative, springs.energies, self._first.get(name))
        self._first.setdefault(name, network)
        if network.unknowns and network.rest_factor.negative_pivots:
            raise SingularError("the network is unstable at rest")
        return network

    def _relaxed(self, network: Network, given: np.ndarray) -> np.ndarray:
        """Displacements [m] whose free directions are in equilibrium with the given held ones."""
        if not network.unknowns:
            return given
        return given - network.expand(network.rest_factor.solve(network.free_forces_over_k(given, linear=True)))

    @cached_property
    def strip_fault(self) -> str:
        """Reason of the function `strip_fault`, computed once."""
        return strip_fault(self.mesh)

    @cached_property
    def _rollers(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Particles at both ends, directions held and displacements given between rollers."""
        left, right = ends(self.mesh)
        held = np.zeros(self.mesh.points.shape, dtype=bool)
        held[left, 0] = held[right, 0] = True
        held[left[0], 1] = True
        return left, right, held, np.where(held, self.mesh.points * [1.0, 0.0], 0.0)

    @cached_property
    def _frame(self) -> tuple[np.ndarray, np.ndarray]:
        """Directions held and displacements given under even shear of the whole outline."""
        held = np.zeros(self.mesh.points.shape, dtype=bool)
        held[self.mesh.edges[self.mesh.on_outline]] = True
        return held, self.mesh.points[:, ::-1] * [1.0, 0.0]

    def stiffness(self, springs: Elastic) -> np.ndarray:
        """Return the plane-stress stiffness (3, 3) under affine displacements of the outline and of holes' rims.

        Times the thickness over the reference stiffness [1]. Exact on any mesh, the stiffest test (Hill's bounds).
        """
        network, fields = self._network("frame", self._frame[0], springs), unit_fields(self.mesh)
        forces = [network.linear_forces_over_k(self._relaxed(network, field)) for field in fields]
        return work_of(fields, forces, self.mesh)

    def axial(self, springs: Elastic) -> tuple[float, float]:
        """Return E t over the reference stiffness and nu [1]: along x for a strip, else means over all directions."""
        if self.strip_fault:
            if springs.lateral:
                raise MeshError(f"no patch test of springs that go with a lateral stress: {self.strip_fault}")
            return isotropic_moduli(np.linalg.inv(self.stiffness(springs)))
        mesh, (left, right, held, given) = self.mesh, self._rollers
        network = self._network("rollers", held, springs)
        moved = self._relaxed(network, given)
        force = network.linear_forces_over_k(moved)[right, 0].sum()
        height = mesh.area / (mesh.points[right, 0].mean() - mesh.points[left, 0].mean())
        stress = force / height
        if springs.lateral:
            pushed = network.expand(network.rest_factor.solve(network.reduce(lateral_forces(mesh))))
            own = network.linear_forces_over_k(pushed)[right, 0].sum() * springs.lateral
            stress = force / (height - own)
            moved += stress * springs.lateral * pushed
        strain = mean_gradient(mesh, moved)
        return stress / strain[0, 0], -strain[1, 1] / strain[0, 0]

    def shear(self, springs: Elastic) -> float:
        """Return G t over the reference stiffness [1] under even shear of the whole outline."""
        held, given = self._frame
        network = self._network("frame", held, springs)
        return float((network.linear_forces_over_k(self._relaxed(network, given)) * given).sum()) / self.mesh.area


def lateral_forces(mesh: Mesh) -> np.ndarray:
    """Forces of a unit stress [N/m] that pulls outwards on the lower and the upper face, shape (n_points, 2)."""
    forces = np.zeros(mesh.points.shape)
    y = mesh.points[:, 1]
    for value, sign in ((y.min(), -1.0), (y.max(), 1.0)):
        forces[:, 1] += sign * side_shares(mesh, mesh.outline_edges(1, value), 0)
    return forces


def outline_forces(mesh: Mesh, stress: np.ndarray) -> np.ndarray:
    """Return the forces over the thickness [N/m], (n_points, 2), of an even stress (2, 2) [Pa] on all outlines."""
    total = np.zeros(mesh.points.shape)
    for corners, normals in _cell_normals(mesh):  # inside they cancel
        pull = 0.5 * normals @ stress.T
        np.add.at(total, corners, pull + np.roll(pull, 1, axis=1))
    return total


def isotropic_moduli(compliance: np.ndarray) -> tuple[float, float]:
    """Return E and nu [1] of a compliance (3, 3): means over all directions of strains along and across a unit pull."""
    (xx, xy, _), (_, yy, _), (_, _, shear) = compliance
    along, across = (3 * (xx + yy) + 2 * xy + shear) / 8, (xx + yy + 6 * xy - shear) / 8
    return 1 / along, -across / along


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
    around_cells, number = [], 0
    for count, cells in mesh.cells.items():
        kept = slice(None) if chosen is None else chosen[count]
        corners = cells[kept]
        sides = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2)
        of_cells = stresses[count][kept], mesh.points[corners].mean(axis=1)
        around_cells.append((sides, *(np.repeat(one, count, axis=0) for one in of_cells)))
        number += len(corners)
    pairs, value, middle = map(np.concatenate, zip(*around_cells))
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
        missing = (around > 0) & np.isnan(found[:, 0])
        if not missing.any():
            return found
        to, of = joined[missing[joined[:, 0]] & sources[joined[:, 1]]].T
        if not len(to):
            # No particle inside: the fits to the cells around, or their mean.
            total = np.stack([np.bincount(particle, part, count) for part in value.T], axis=1)
            mean = total[missing] / around[missing, None]
            found[missing] = np.where(good[missing, None], fits[missing, 0], mean)
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
    """Fit a linear field about each particle: value and slopes over `size`, (n_points, 3, 3), and where it exists."""
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

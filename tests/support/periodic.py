"""Sheets without an outline: triangulations of points that repeat along x and y, and their exact stiffness."""

import numpy as np
from scipy.sparse import csc_array
from scipy.spatial import Delaunay

import springtune as st
from springtune.linalg.factors import SingularError, SuperLUFactor
from springtune.mechanics.continuum import unit_fields, work_of
from springtune.mechanics.network import Network
from springtune.mesh.cells import signed_areas


def periodic_delaunay(points, length, height):
    """Triangulate points (n, 2) [m] that repeat with the periods `length` along x and `height` along y [m].

    Returns one period as a mesh, and for each of its particles the point that it is a copy of, itself among the first
    n: particles beyond its ragged outline are copies of those at the other side.
    """
    count, period = len(points), np.array([length, height])
    tiles = np.array([(0, 0), *((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j)])
    spread = (points + period * tiles[:, None]).reshape(-1, 2)
    triangles = Delaunay(spread).simplices
    areas = signed_areas(spread, triangles)
    triangles = np.where((areas < 0)[:, None], triangles[:, ::-1], triangles)[areas != 0]
    # Of all copies of a triangle that whose first corner, by point and tile, is in the middle.
    order = (triangles % count) * 9 + (tiles[triangles // count] + 1) @ [3, 1]
    first = np.take_along_axis(triangles, order.argmin(axis=1)[:, None], axis=1)[:, 0]
    triangles = triangles[first < count]
    used, places = np.unique(np.concatenate([np.arange(count), triangles.ravel()]), return_inverse=True)
    mesh = st.Mesh(spread[used], places[count:].reshape(-1, 3))
    assert len(triangles) == 2 * count and abs(mesh.area / (length * height) - 1) < 1e-9, "they do not cover one period"
    return mesh, used % count


def periodic_stiffness(mesh, copied, springs):
    """Return the plane-stress stiffness of a sheet without an outline, shape (3, 3) and unit of `PatchTest.stiffness`.

    All particles relax under an even mean strain, so this is the continuum that equals the network. It is at most
    `PatchTest.stiffness`, which holds the outline, and that at most `affine_stiffness`.

    `mesh` is one period and `copied` (n_points,) the particle that each one is a copy of. Springs on the outline add to
    their copies at the other side: each cell gives its share, as in most definitions. For one stiffness k give k/2
    times `Mesh.cells_per_edge`.
    """
    network = Network(mesh, np.zeros(mesh.points.shape, dtype=bool), springs.relative, springs.energies)
    matrix, fields = network.tangent(), np.stack([field.ravel() for field in unit_fields(mesh)], axis=1)
    _, numbers = np.unique(copied, return_inverse=True)
    free = np.flatnonzero(numbers)  # one particle is held
    places = ((2 * part[:, None] + [0, 1]).ravel() for part in (free, numbers[free] - 1))
    moves = csc_array((np.ones(2 * len(free)), tuple(places)), shape=(matrix.shape[0], 2 * numbers.max()))
    factor = SuperLUFactor((moves.T @ matrix @ moves).tocsc())
    if factor.negative_pivots:
        raise SingularError("the network is unstable at rest")
    moved = fields - moves @ factor.solve(moves.T @ (matrix @ fields))
    return moved.T @ (matrix @ moved) / mesh.area


def affine_stiffness(mesh, springs):
    """Return the plane-stress stiffness if all particles followed an even strain (Cauchy and Born).

    For springs ``C_ijkl t = 1/A sum k L^2 n_i n_j n_k n_l``, with C12 = C66; an upper bound of `PatchTest.stiffness` in
    its shape and unit, which a lattice attains.
    """
    network = Network(mesh, np.ones(mesh.points.shape, dtype=bool), springs.relative, springs.energies)
    fields = unit_fields(mesh)
    return work_of(fields, [network.linear_forces_over_k(field) for field in fields], mesh)

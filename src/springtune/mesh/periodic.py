"""Sheets without an outline: Delaunay triangulations of points that repeat along x and y."""

import numpy as np

from .cells import Mesh, MeshError, signed_areas


def periodic_delaunay(points: np.ndarray, length: float, height: float) -> tuple[Mesh, np.ndarray]:
    """Triangulate points (n, 2) [m] that repeat with the periods `length` along x and `height` along y [m].

    Returns one period as a mesh, and for each of its particles the point that it is a copy of, itself among the first
    n: particles beyond its ragged outline are copies of those at the other side.

    Examples
    --------
    >>> mesh, copied = periodic_delaunay(np.random.default_rng(1).uniform(size=(50, 2)), 1.0, 1.0)
    >>> len(mesh.triangles), len(np.unique(copied)), round(mesh.area, 12)
    (100, 50, 1.0)
    """
    from scipy.spatial import Delaunay, QhullError  # here: see `springtune.springs`

    count, period = len(points), np.array([length, height])
    tiles = np.array([(0, 0), *((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j)])
    spread = (points + period * tiles[:, None]).reshape(-1, 2)
    remedy = "give a dozen points or more inside of one period, no four of them on one circle, as on a grid of squares"
    try:
        triangles = Delaunay(spread).simplices
    except (QhullError, ValueError) as error:
        raise MeshError(f"points: cannot be triangulated ({str(error).splitlines()[0]}); {remedy}") from None
    areas = signed_areas(spread, triangles)
    triangles = np.where((areas < 0)[:, None], triangles[:, ::-1], triangles)[areas != 0]
    # Of all copies of a triangle that whose first corner, by point and tile, is in the middle.
    order = (triangles % count) * 9 + (tiles[triangles // count] + 1) @ [3, 1]
    first = np.take_along_axis(triangles, order.argmin(axis=1)[:, None], axis=1)[:, 0]
    triangles = triangles[first < count]
    used, places = np.unique(np.concatenate([np.arange(count), triangles.ravel()]), return_inverse=True)
    mesh = Mesh(spread[used], places[count:].reshape(-1, 3))
    if len(triangles) != 2 * count or abs(mesh.area / (length * height) - 1) > 1e-9:
        raise MeshError(f"points: their triangles do not cover one period of {length:g} x {height:g} m once; {remedy}")
    return mesh, used % count

"""Bonds between particles that no cell joins, as of peridynamics."""

from dataclasses import replace

import numpy as np

from .cells import Mesh, MeshError


def bonded(mesh: Mesh, reach: float) -> Mesh:
    """Return a mesh with a bond between all points up to `reach` apart [m], but for those across its outline.

    Second neighbours on rows of triangles:

    >>> import springtune as st
    >>> mesh = st.make_mesh(st.Beam("100 mm", "20 mm"), "structured", "5 mm")
    >>> joined = bonded(mesh, 2 * mesh.edge_lengths.max())
    >>> len(mesh.edges), len(joined.edges), bool(joined.on_outline.sum() == mesh.on_outline.sum())
    (333, 900, True)
    """
    from scipy.spatial import cKDTree  # here, since studies are read without scipy

    if not reach > 0:
        raise MeshError(f"reach: {reach!r} is not above zero; give a length in m")
    pairs = cKDTree(mesh.points).query_pairs(reach * (1 + 1e-9), output_type="ndarray")
    known = mesh.edges @ [len(mesh.points), 1]
    pairs = np.sort(pairs, axis=1)
    pairs = pairs[~np.isin(pairs @ [len(mesh.points), 1], known)]
    outline = mesh.points[mesh.edges[mesh.on_outline]]
    parts = np.array_split(pairs, 1 + len(pairs) // 1000)
    return replace(mesh, bonds=np.concatenate([part[_inside(mesh.points[part], outline)] for part in parts]))


def _inside(bonds: np.ndarray, outline: np.ndarray) -> np.ndarray:
    """Which bonds (n, 2, 2) stay in a body or on its outline (m, 2, 2)."""
    a, b = bonds[:, None, 0], bonds[:, None, 1]
    c, d = outline[:, 0], outline[:, 1]

    def turn(start: np.ndarray, end: np.ndarray, at: np.ndarray) -> np.ndarray:
        """Twice the area of the triangle of three points."""
        way, there = end - start, at - start
        return np.asarray(way[..., 0] * there[..., 1] - way[..., 1] * there[..., 0])

    size = np.linalg.norm(d - c, axis=1)
    rounding = 1e-9 * size * np.linalg.norm(b - a, axis=2)
    # Sides that only touch do not cross: each end is clearly on its side of the other line.
    crossed = (
        (np.minimum(turn(c, d, a), turn(c, d, b)) < -rounding)
        & (np.maximum(turn(c, d, a), turn(c, d, b)) > rounding)
        & (np.minimum(turn(a, b, c), turn(a, b, d)) < -rounding)
        & (np.maximum(turn(a, b, c), turn(a, b, d)) > rounding)
    )
    found: np.ndarray = ~crossed.any(axis=1)
    for share in (0.125, 0.375, 0.625, 0.875):  # a bond may also leave the body through a corner
        at = a + share * (b - a)
        within = np.linalg.norm(at - 0.5 * (c + d), axis=2) <= 0.5 * size * (1 + 1e-9)
        on_side = (np.abs(turn(c, d, at)) <= rounding) & within
        # A ray from the point leaves the body through an odd number of sides.
        rising = (c[:, 1] > at[..., 1]) != (d[:, 1] > at[..., 1])
        right = (turn(c, d, at) > 0) == (d[:, 1] > c[:, 1])
        found &= ((rising & right).sum(axis=1) % 2 == 1) | on_side.any(axis=1)
    return found

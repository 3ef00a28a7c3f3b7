"""Whether a mesh fills a box exactly once, and if not, where and what to do about it."""

from collections.abc import Sequence

import numpy as np

from .cells import Mesh, MeshError, signed_areas

DIGITS = 1e-6
"""What coordinates in a file may be off, over the extent of the mesh: formats in text have few digits."""


MOST_SEARCHED = 2000
"""So many ends of edges are looked at for one that hangs on another edge."""


def on_sides(mesh: Mesh, box: np.ndarray) -> Mesh:
    """Mesh of a box with the lower left corner at the origin, its sides made straight.

    Parameters
    ----------
    mesh : Mesh
        Its sides are off by less than `DIGITS`.
    box : ndarray of float, shape (2,)
        Length and height [m].

    Returns
    -------
    Mesh

    Raises
    ------
    MeshError
        If cells lie within rounding of a side.
    """
    near = np.abs(mesh.points - box) <= DIGITS * box
    points = np.where(near, box, np.where(mesh.points <= DIGITS * box, 0.0, mesh.points))
    for corners in mesh.cells.values():
        flat = corners[signed_areas(points, corners) <= 0]
        if len(flat):
            first = f"{len(flat)}, the first one at {in_words(points[flat[0]])}"
            raise MeshError(f"cells within rounding of a side of the box: {first}; make them larger or remove them")
    return Mesh(points, mesh.triangles, mesh.quads)


def box_fault(mesh: Mesh) -> str:
    """Why a mesh does not fill the box around it exactly once, with the remedy; empty where it does.

    Parameters
    ----------
    mesh : Mesh
        Looked at once: it keeps what is found.

    Returns
    -------
    str

    Examples
    --------
    A box without one of its cells:

    >>> from springtune.mesh import Mesh, right
    >>> whole = right(0.1, 0.02, 5e-3)
    >>> box_fault(whole)
    ''
    >>> box_fault(Mesh(whole.points, whole.triangles[1:]))[:43]
    'its cells cover 99.375 % of the box or over'
    """
    known: str | None = vars(mesh).get("_box_fault")
    if known is None:
        low = mesh.points.min(axis=0)
        box = mesh.points.max(axis=0) - low
        moved = Mesh(mesh.points - low, mesh.triangles, mesh.quads) if low.any() else mesh
        try:
            known = _fault(on_sides(moved, box), box)
        except MeshError as error:
            known = str(error)
        vars(mesh)["_box_fault"] = known
    return known


def _fault(mesh: Mesh, box: np.ndarray) -> str:
    """Why a mesh does not fill a box exactly once, and what to do about it; empty where it does.

    All cells are convex and counter-clockwise, no two lie on the same side of an edge, and the edges that have one cell
    only make one round of the box. As many cells lie over a point as that round winds about it: one. So there is no
    slit, hole or overlap, however thin, and there are no parts that meet in a point alone.
    """
    points = mesh.points
    for count, corners in mesh.cells.items():
        turns = [signed_areas(points, corners[:, [i - 1, i, (i + 1) % count]]) for i in range(count)]
        bad = corners[np.min(turns, axis=0) <= 0]
        if len(bad):
            first = f"{len(bad)}, the first one at {in_words(points[bad[0]])}"
            return f"cells with a corner of 180 degrees or more: {first}; split them into triangles"
    share = mesh.area / box.prod()
    lead = f"its cells cover {100 * share:.6g} % of the box or overlap: " if abs(share - 1) > DIGITS else ""
    edges = np.concatenate(
        [np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2) for corners in mesh.cells.values()]
    )
    codes = np.sort(edges @ [len(points), 1])  # one integer per edge and direction
    again = codes[1:][codes[1:] == codes[:-1]]
    if len(again):
        first = _edge(points, np.divmod(again[0], len(points)))
        return f"{lead}edges with two cells on the same side: {len(again)}, the first one {first}; remove one of them"
    back = np.setdiff1d(edges @ [1, len(points)], codes, assume_unique=True)
    outline = np.stack(np.divmod(back, len(points))[::-1], axis=1)
    ends = points[outline]
    on_side = [(ends[..., axis] == value).all(axis=1) for axis in range(2) for value in (0.0, box[axis])]
    inside = ~np.any(on_side, axis=0)
    if inside.any():
        return lead + _opening(points, outline[inside])
    again = np.flatnonzero(np.bincount(outline[:, 0]) > 1)
    if len(again) or lead:
        where = in_words(points[again[0] if len(again) else outline[0, 0]])
        return f"{lead}the outline runs through {where} more than once; give a mesh that fills the box once"
    return ""


def _opening(points: np.ndarray, edges: np.ndarray) -> str:
    """What is wrong where edges inside a box have one cell only, and what to do about it."""
    from scipy.spatial import cKDTree  # here, since a good mesh needs none

    count = f"edges inside the box with one cell only: {len(edges)}"
    small = DIGITS * np.ptp(points, axis=0).max()
    ends = np.unique(edges)
    distances, nearest = cKDTree(points[ends]).query(points[ends], k=2)
    twins = np.flatnonzero(distances[:, 1] <= small)
    if len(twins):
        # Of points at one place the nearest may be the point itself.
        partner = np.where(nearest[:, 1] == np.arange(len(ends)), nearest[:, 0], nearest[:, 1])
        one, other = points[ends[[twins[0], partner[twins[0]]]]]
        distance = np.linalg.norm(other - one)
        apart = f", {1e3 * distance:.3g} mm apart" if distance else ""
        return f"two points at {in_words(one)}{apart}, do not join their cells ({count}); merge duplicate points"
    start, along = points[edges[:, 0]], points[edges[:, 1]] - points[edges[:, 0]]
    squares = (along**2).sum(axis=1)
    for end in ends[:MOST_SEARCHED]:
        to = points[end] - start
        share = (to * along).sum(axis=1) / squares
        aside = np.linalg.norm(to - share[:, None] * along, axis=1)
        hangs = np.flatnonzero((aside <= small) & (share > 0) & (share < 1) & (edges != end).all(axis=1))
        if len(hangs):
            edge = _edge(points, edges[hangs[0]])
            hanging = f"the point at {in_words(points[end])} hangs on the edge {edge}"
            return f"{hanging} ({count}); split the cell of that edge there"
    return f"{count}, the first one {_edge(points, edges[0])}; close the hole there"


def in_words(points: np.ndarray) -> str:
    """Middle of one or more points, in words."""
    return "({:.6g}, {:.6g}) mm".format(*(1e3 * points.reshape(-1, 2).mean(axis=0)))


def _edge(points: np.ndarray, ends: Sequence[int] | np.ndarray) -> str:
    """Both ends of an edge, in words."""
    return f"from {in_words(points[ends[0]])} to {in_words(points[ends[1]])}"

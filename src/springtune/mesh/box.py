"""Check that a mesh fills a box exactly once."""

import numpy as np

from .cells import Mesh, MeshError, signed_areas
from .sheets import DIGITS, edge_in_words, in_words, not_convex, opening, outline_of


def on_sides(mesh: Mesh, box: np.ndarray) -> Mesh:
    """Return a mesh of a box (2,) [m] at the origin with its sides made straight."""
    near = np.abs(mesh.points - box) <= DIGITS * box
    points = np.where(near, box, np.where(mesh.points <= DIGITS * box, 0.0, mesh.points))
    for corners in mesh.cells.values():
        flat = corners[signed_areas(points, corners) <= 0]
        if len(flat):
            first = f"{len(flat)}, the first one at {in_words(points[flat[0]])}"
            raise MeshError(f"cells within rounding of a side of the box: {first}; make them larger or remove them")
    return Mesh(points, mesh.triangles, mesh.quads)


def box_fault(mesh: Mesh) -> str:
    """Return why a mesh does not fill its bounding box exactly once, with the remedy, or an empty string.

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
    """Return why a mesh does not fill a box exactly once, with the remedy, or an empty string.

    All cells are convex and counter-clockwise, no two lie on one side of an edge, and the edges with one cell make
    one round of the box. So as many cells cover a point as that round winds about it: one. This excludes slits, holes
    and overlaps of any width, and parts that meet in a point.
    """
    points = mesh.points
    fault = not_convex(mesh)
    if fault:
        return fault
    share = mesh.area / box.prod()
    lead = f"its cells cover {100 * share:.6g} % of the box or overlap: " if abs(share - 1) > DIGITS else ""
    outline, fault = outline_of(mesh)
    if fault:
        return lead + fault
    ends = points[outline]
    on_side = [(ends[..., axis] == value).all(axis=1) for axis in range(2) for value in (0.0, box[axis])]
    inside = ~np.any(on_side, axis=0)
    if inside.any():
        count = f"edges inside the box with one cell only: {inside.sum()}"
        first = f"{count}, the first one {edge_in_words(points, outline[inside][0])}; close the hole there"
        return lead + (opening(points, outline[inside], count) or first)
    again = np.flatnonzero(np.bincount(outline[:, 0]) > 1)
    if len(again) or lead:
        where = in_words(points[again[0] if len(again) else outline[0, 0]])
        return f"{lead}the outline runs through {where} more than once; give a mesh that fills the box once"
    return ""

"""Meshes with named groups; checks that they are plane sheets, and fill a box; what mesh files have."""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from .cells import Mesh, MeshError, signed_areas
from .sides import edge_in_words, in_words, near_edges, turn, winding

COORDINATE_TOLERANCE = 1e-6
"""Tolerance of coordinates in a file over the extent of the mesh: text formats have few digits."""

MOST_SEARCHED_ENDS = 2000  # most ends of edges checked for one that hangs on another edge


def sheet_fault(mesh: Mesh) -> str:
    """Return why the cells of a mesh are not a conforming plane sheet, with the remedy, or an empty string.

    Rounds of the outline must not touch themselves or each other: no slits, or cells that meet only in a point.
    """
    outline, fault = outline_of(mesh)
    if fault := convexity_fault(mesh) or fault:
        return fault
    points = mesh.points
    ways = np.diff(points[outline], axis=1)[:, 0]
    lengths = np.linalg.norm(ways, axis=1)
    small = min(COORDINATE_TOLERANCE * np.ptp(points, axis=0).max(), 0.01 * lengths.min())
    near = near_edges(points, outline, np.full(len(outline), 0.5 * small)).ravel()
    # Edges that share a point touch where the outline turns back on itself there.
    order, (x, y) = np.argsort(outline[:, 0]), (ways / lengths[:, None]).T
    low, high = (np.searchsorted(outline[order, 0], outline[:, 1], side) for side in ("left", "right"))
    after = order[np.minimum(low + np.arange((high - low).max())[:, None], high - 1)]
    which, back = np.nonzero(
        (x * x[after] + y * y[after] < 0) & (np.abs(x * y[after] - y * x[after]) < COORDINATE_TOLERANCE)
    )
    touching = np.unique(np.concatenate([near, back, after[which, back]]))
    if len(touching):
        count = f"outline edges that meet others without being joined: {len(touching)}"
        first = f"{count}, the first one {edge_in_words(points, outline[touching[0]])}"
        return opening_fault(points, outline[touching], count) or f"cells overlap ({first}); remove some"
    if len(again := np.flatnonzero(np.bincount(outline[:, 0]) > 1)):
        where = in_words(points[again[0]])
        return f"cells hang together in a point alone, at {where}; join them by an edge, or part them"
    for line in rounds(outline):
        start, end = points[outline[~np.isin(outline[:, 0], line)].T]
        outer = turn(points[line[0]], points[line], np.roll(points[line], -1, axis=0)).sum() > 0
        if winding(start, end, points[line[0]]) != (0 if outer else 1):
            return f"cells lie over each other at {in_words(points[line[0]])}; remove some"
    return ""


def convexity_fault(mesh: Mesh) -> str:
    """Return why cells have a corner of 180 degrees or more, with the remedy, or an empty string."""
    points = mesh.points
    for count, corners in mesh.cells.items():
        turns = [signed_areas(points, corners[:, [i - 1, i, (i + 1) % count]]) for i in range(count)]
        if len(bad := corners[np.min(turns, axis=0) <= 0]):
            first = f"{len(bad)}, the first one at {in_words(points[bad[0]])}"
            return f"cells with a corner of 180 degrees or more: {first}; split them into triangles"
    return ""


def outline_of(mesh: Mesh) -> tuple[np.ndarray, str]:
    """Return the sides (n, 2) without a neighbour, the cell on the left, and why edges have too many cells."""
    edges = np.concatenate(
        [np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2) for corners in mesh.cells.values()]
    )
    codes = np.sort(edges @ [len(mesh.points), 1])  # one integer per edge and direction
    again = codes[1:][codes[1:] == codes[:-1]]
    fault = ""
    if len(again):
        first = edge_in_words(mesh.points, np.divmod(again[0], len(mesh.points)))
        fault = f"edges with two cells on the same side: {len(again)}, the first one {first}; remove one of them"
    back = np.setdiff1d(edges @ [1, len(mesh.points)], codes, assume_unique=not fault)
    return np.stack(np.divmod(back, len(mesh.points))[::-1], axis=1), fault


def opening_fault(points: np.ndarray, edges: np.ndarray, count: str) -> str:
    """Return why edges (n, 2) have one cell although others are near, with the remedy, or an empty string."""
    from scipy.spatial import cKDTree  # here, since a good mesh needs none

    small = COORDINATE_TOLERANCE * np.ptp(points, axis=0).max()
    ends = np.unique(edges)
    if twins := sorted(cKDTree(points[ends]).query_pairs(small)):
        one, other = points[ends[[*twins[0]]]]
        distance = np.linalg.norm(other - one)
        apart = f", {1e3 * distance:.3g} mm apart" if distance else ""
        return f"two points at {in_words(one)}{apart}, do not join their cells ({count}); merge duplicate points"
    start, along = points[edges[:, 0]], points[edges[:, 1]] - points[edges[:, 0]]
    squares = (along**2).sum(axis=1)
    for end in ends[:MOST_SEARCHED_ENDS]:
        to = points[end] - start
        share = (to * along).sum(axis=1) / squares
        aside = np.linalg.norm(to - share[:, None] * along, axis=1)
        hangs = np.flatnonzero((aside <= small) & (share > 0) & (share < 1) & (edges != end).all(axis=1))
        if len(hangs):
            edge = edge_in_words(points, edges[hangs[0]])
            hanging = f"the point at {in_words(points[end])} hangs on the edge {edge}"
            return f"{hanging} ({count}); split the cell of that edge there"
    return ""


def rounds(edges: np.ndarray) -> list[np.ndarray]:
    """Return closed rounds of edges as ordered points; one edge must leave each point."""
    following = dict(edges.tolist())
    closed = []
    while following:
        point, after = following.popitem()
        found = [point]
        while after != point:
            found.append(after)
            after = following.pop(after)
        closed.append(np.array(found))
    return closed


def on_sides(mesh: Mesh, box: np.ndarray) -> Mesh:
    """Return a mesh of a box (2,) [m] at the origin with its sides made straight."""
    near = np.abs(mesh.points - box) <= COORDINATE_TOLERANCE * box
    points = np.where(near, box, np.where(mesh.points <= COORDINATE_TOLERANCE * box, 0.0, mesh.points))
    for corners in mesh.cells.values():
        if len(flat := corners[signed_areas(points, corners) <= 0]):
            first = f"{len(flat)}, the first one at {in_words(points[flat[0]])}"
            raise MeshError(f"cells within rounding of a side of the box: {first}; make them larger or remove them")
    return replace(mesh, points=points)


def box_fault(mesh: Mesh) -> str:
    """Return why a mesh does not fill its bounding box exactly once, with the remedy, or an empty string.

    >>> from springtune.mesh.cells import Mesh
    >>> from springtune.mesh.rows import right
    >>> whole = right(0.1, 0.02, 5e-3)
    >>> box_fault(Mesh(whole.points, whole.triangles[1:]))[:43]
    'its cells cover 99.375 % of the box or over'
    """
    known = vars(mesh)
    if "_box_fault" not in known:
        low = mesh.points.min(axis=0)
        box = mesh.points.max(axis=0) - low
        moved = replace(mesh, points=mesh.points - low) if low.any() else mesh
        try:
            known["_box_fault"] = _box_filling_fault(on_sides(moved, box), box)
        except MeshError as error:
            known["_box_fault"] = str(error)
    return str(known["_box_fault"])


def _box_filling_fault(mesh: Mesh, box: np.ndarray) -> str:
    """Return why a mesh does not fill a box exactly once, without slits or holes, or an empty string."""
    share = mesh.area / box.prod()
    wrong = abs(share - 1) > COORDINATE_TOLERANCE
    fault = sheet_fault(mesh)
    outline, _ = outline_of(mesh)
    ends = mesh.points[outline]
    on_side = [(ends[..., axis] == value).all(axis=1) for axis in range(2) for value in (0.0, box[axis])]
    if len(inside := outline[~np.any(on_side, axis=0)]) and not fault:
        first = edge_in_words(mesh.points, inside[0])
        fault = f"edges inside the box with one cell only: {len(inside)}, the first one {first}; close the hole there"
    return f"its cells cover {100 * share:.6g} % of the box or overlap: {fault}" if fault and wrong else fault


def connected(edges: np.ndarray, count: int) -> np.ndarray:
    """Return the number of each of `count` points' connected part; `edges` has shape (n_edges, 2).

    >>> connected(np.array([[0, 2], [3, 1]]), 5).tolist()
    [0, 1, 0, 1, 2]
    """
    from scipy.sparse import coo_array  # here, since studies are read without scipy
    from scipy.sparse.csgraph import connected_components

    below = np.zeros(count, dtype=bool)
    below[np.maximum(*edges.T)] = True
    if below.sum() == count - 1:  # each point but the first is joined to one before it, as in rows
        return np.zeros(count, dtype=np.int32)
    joined = coo_array((np.ones(len(edges)), edges.T), shape=(count, count))
    return np.asarray(connected_components(joined, directed=False)[1])


def bonded(mesh: Mesh, reach: float) -> Mesh:
    """Return a mesh with a bond between all points up to `reach` apart [m], but for those across its outline."""
    from scipy.spatial import cKDTree  # here, since studies are read without scipy

    pairs = np.sort(cKDTree(mesh.points).query_pairs(reach * (1 + 1e-9), output_type="ndarray"), axis=1)
    pairs = pairs[~np.isin(pairs @ [len(mesh.points), 1], mesh.edges @ [len(mesh.points), 1])]
    outline = mesh.points[outline_of(mesh)[0]]
    parts = np.array_split(pairs, 1 + len(pairs) // 1000)
    return replace(mesh, bonds=np.concatenate([part[_inside(mesh.points[part], outline)] for part in parts]))


def _inside(bonds: np.ndarray, outline: np.ndarray) -> np.ndarray:
    """Mask of the bonds (n, 2, 2) that stay in a body or on its outline (m, 2, 2), which has the body on its left."""
    a, b = bonds[:, None, 0], bonds[:, None, 1]
    c, d = outline[:, 0], outline[:, 1]
    size = np.linalg.norm(d - c, axis=1)
    rounding = 1e-9 * size * np.linalg.norm(b - a, axis=2)
    # Sides that only touch do not cross: each end is clearly on its side of the other line.
    sides = np.sort([[turn(c, d, a), turn(c, d, b)], [turn(a, b, c), turn(a, b, d)]], axis=1)
    crossed = ((sides[:, 0] < -rounding) & (sides[:, 1] > rounding)).all(axis=0)
    found: np.ndarray = ~crossed.any(axis=1)
    for share in (0.125, 0.375, 0.625, 0.875):  # a bond may also leave the body through a corner
        at = a + share * (b - a)
        within = np.linalg.norm(at - 0.5 * (c + d), axis=2) <= 0.5 * size * (1 + 1e-9)
        on_side = (np.abs(turn(c, d, at)) <= rounding) & within
        found &= (winding(c, d, at) != 0) | on_side.any(axis=1)
    return found


@dataclass(frozen=True, eq=False)
class GroupedMesh:
    """A mesh and named groups of its edges, points and cells.

    Parameters
    ----------
    mesh : Mesh
    sides : mapping of str to ndarray of int, shape (n, 2), optional
        Edges of the outline, holes included, by group, the body to the left.
    points : mapping of str to ndarray of float, shape (2,), optional
        Coordinates of named points [m], in the body.
    parts : mapping of str to dict of int to ndarray of bool, shape (n_cells,), optional
        Cells by part and number of corners, as in `Mesh.cells`; each is in at most one part. The rest are the main
        part, ``""``.
    unusable : mapping of str to str, optional
        Groups of a file that are not usable, and why, as in ``"is not on the outline: ..."``.

    Examples
    --------
    >>> import springtune as st
    >>> grouped = st.mesh_shape(st.Shape.rectangle("100 mm", "40 mm"), "10 mm")
    >>> {name: len(edges) for name, edges in grouped.sides.items()}
    {'lower': 10, 'right': 4, 'upper': 10, 'left': 4}
    >>> grouped.mesh.points[grouped.sides["right"][0]].round(6).tolist()
    [[0.1, 0.0], [0.1, 0.01]]
    >>> grouped.mesh.points[grouped.particles("right"), 1].round(6).tolist()
    [0.0, 0.01, 0.02, 0.03, 0.04]
    >>> corner = st.GroupedMesh(grouped.mesh, points={"corner": grouped.mesh.points[-1]})
    >>> corner.particle("corner") == len(grouped.mesh.points) - 1
    True
    """

    mesh: Mesh
    sides: Mapping[str, np.ndarray] = field(default_factory=dict)
    points: Mapping[str, np.ndarray] = field(default_factory=dict)
    parts: Mapping[str, Mapping[int, np.ndarray]] = field(default_factory=dict)
    unusable: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        groups = {"sides": self.sides, "points": self.points, "parts": self.parts}
        named = (f"{what} {', '.join(names)}" for what, names in groups.items() if names)
        return f"GroupedMesh({'; '.join([repr(self.mesh), *named])})"

    def particle(self, name: str) -> int | None:
        """Return the particle at a named point.

        Parameters
        ----------
        name : str
            Key of `points`.

        Returns
        -------
        int or None
            None if no particle is within rounding.
        """
        distances = np.linalg.norm(self.mesh.points - self.points[name], axis=1)
        nearest = int(np.argmin(distances))
        return nearest if distances[nearest] <= 1e-9 * np.ptp(self.mesh.points, axis=0).max() else None

    def particles(self, name: str) -> np.ndarray:
        """Return the particles of a group.

        Parameters
        ----------
        name : str
            Key of `sides` or `points`.

        Returns
        -------
        ndarray of int
            Sorted, each once; empty for a point without particle.
        """
        if name in self.sides:
            return np.unique(self.sides[name])
        number = self.particle(name)
        return np.array([] if number is None else [number], dtype=np.int64)

    @cached_property
    def _outline_codes(self) -> np.ndarray:
        """One number for each edge of the outline, the body on its left."""
        return outline_of(self.mesh)[0] @ [len(self.mesh.points), 1]


def side_fault(grouped: GroupedMesh, name: str, directed: bool) -> str:
    """Return why a group of sides is not usable, with the remedy, or ""; `directed` edges have the body on the left."""
    count, edges = len(grouped.mesh.points), np.reshape(grouped.sides[name], (-1, 2))
    wrong = edges[~np.isin(edges @ [count, 1], grouped._outline_codes)]
    if len(inside := wrong[~np.isin(wrong @ [1, count], grouped._outline_codes)]):
        first = edge_in_words(grouped.mesh.points, inside[0])
        return f"has edges that are not on the outline, the first one {first}; take these out"
    if directed and len(wrong):
        first = edge_in_words(grouped.mesh.points, wrong[0])
        return f"has edges with the body on their right, the first one {first}; turn them"
    return ""


def parts_of(grouped: GroupedMesh) -> list[str]:
    """Return the parts that have cells, sorted: ``""`` for the main part."""
    if not grouped.parts:  # no look at each cell
        return [""]
    return sorted({str(name) for labels in part_names(grouped).values() for name in labels})


def part_names(grouped: GroupedMesh) -> dict[int, np.ndarray]:
    """Return the part of each cell, by number of corners: ``""`` for the main part."""
    found = {count: np.full(len(corners), "", dtype=object) for count, corners in grouped.mesh.cells.items()}
    for name, cells in grouped.parts.items():
        for count in found.keys() & cells:
            found[count][cells[count]] = name
    return found


@dataclass
class Content:
    """Content of a mesh file: cells in blocks of one type, by meshio's name, with their points.

    Groups are numbers of cells, over all blocks, and of points; `unusable` ones have a reason.
    """

    points: np.ndarray
    cells: list[tuple[str, np.ndarray]]
    cell_groups: dict[str, list[np.ndarray]] = field(default_factory=lambda: defaultdict(list))
    point_groups: dict[str, list[np.ndarray]] = field(default_factory=lambda: defaultdict(list))
    unusable: dict[str, str] = field(default_factory=dict)

    def starts(self) -> list[int]:
        """Number of the first cell of each block, and of all cells."""
        return [0, *np.cumsum([len(corners) for _, corners in self.cells]).tolist()]


def find_tags(tags: np.ndarray, requested: list[np.ndarray]) -> list[np.ndarray]:
    """Return the place of each requested tag among `tags`; refuse missing and repeated tags."""
    order = np.argsort(tags, kind="stable")
    ordered, flat = tags[order], np.concatenate([np.zeros(0, dtype=np.int64), *(one.ravel() for one in requested)])
    twice = ordered[1:][ordered[1:] == ordered[:-1]]
    if len(twice):
        raise MeshError(f"points have one number twice: {twice[0]}; renumber them")
    missing = ~np.isin(flat, ordered)
    if missing.any():
        raise MeshError(f"a cell has point {flat[missing][0]}, which the file does not have; write all points")
    parts = np.split(order[np.searchsorted(ordered, flat)], np.cumsum([one.size for one in requested[:-1]]))
    return [part.reshape(one.shape) for part, one in zip(parts, requested)]

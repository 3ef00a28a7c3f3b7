"""Check that a mesh is a conforming plane sheet."""

from collections.abc import Sequence

import numpy as np

from .cells import Mesh, signed_areas

DIGITS = 1e-6
"""Tolerance of coordinates in a file over the extent of the mesh: text formats have few digits."""

MOST_SEARCHED = 2000
"""Most ends of edges checked for one that hangs on another edge."""

MOST_PAIRS = 4_000_000
"""Pairs of edges that are compared at a time."""


def sheet_fault(mesh: Mesh) -> str:
    """Return why the cells of a mesh are not a conforming plane sheet, with the remedy, or an empty string.

    Cells must be convex and meet in entire edges, at most two in each, without overlaps. Rounds of the outline must
    not touch themselves or each other: no slits, hanging points, or cells that meet only in a point.

    Examples
    --------
    Two triangles that meet in a point:

    >>> import numpy as np
    >>> points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [-1.0, 0.0], [-1.0, -1.0]])
    >>> sheet_fault(Mesh(points, np.array([[0, 1, 2]])))
    ''
    >>> sheet_fault(Mesh(points, np.array([[0, 1, 2], [0, 3, 4]])))
    'cells hang together in a point alone, at (0, 0) mm; join them by an edge, or part them'
    """
    fault = not_convex(mesh)
    if fault:
        return fault
    outline, fault = outline_of(mesh)
    if fault:
        return fault
    points = mesh.points
    touching = _touching(points, outline)
    if len(touching):
        count = f"outline edges that meet others without being joined: {len(touching)}"
        first = edge_in_words(points, outline[touching[0]])
        return (
            opening(points, outline[touching], count) or f"cells overlap ({count}, the first one {first}); remove some"
        )
    again = np.flatnonzero(np.bincount(outline[:, 0]) > 1)
    if len(again):
        where = in_words(points[again[0]])
        return f"cells hang together in a point alone, at {where}; join them by an edge, or part them"
    rounds = _rounds(outline)
    for one in rounds:
        others = outline[~np.isin(outline[:, 0], one)]
        x, y = (points[one] - points[one[0]]).T
        outer = (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() > 0
        if _winding(points, others, points[one[0]]) != (0 if outer else 1):
            return f"cells lie over each other at {in_words(points[one[0]])}; remove some"
    return ""


def not_convex(mesh: Mesh) -> str:
    """Which cells have a corner of 180 degrees or more, with the remedy; empty where none has."""
    points = mesh.points
    for count, corners in mesh.cells.items():
        turns = [signed_areas(points, corners[:, [i - 1, i, (i + 1) % count]]) for i in range(count)]
        bad = corners[np.min(turns, axis=0) <= 0]
        if len(bad):
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


def opening(points: np.ndarray, edges: np.ndarray, count: str) -> str:
    """Return why edges (n, 2) have one cell although others are near, with the remedy, or an empty string."""
    from scipy.spatial import cKDTree  # here, since a good mesh needs none

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
            edge = edge_in_words(points, edges[hangs[0]])
            hanging = f"the point at {in_words(points[end])} hangs on the edge {edge}"
            return f"{hanging} ({count}); split the cell of that edge there"
    return ""


def _touching(points: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Numbers of edges that come near another one with which they share no end."""
    shortest = np.linalg.norm(np.diff(points[edges], axis=1), axis=2).min()
    small = min(DIGITS * np.ptp(points, axis=0).max(), 0.01 * shortest)
    one, other, _ = nearer(points, edges, np.full(len(edges), 0.5 * small))
    return np.union1d(one, other)


def nearer(points: np.ndarray, edges: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return pairs of disjoint edges nearer than their reaches together, and their distances [m].

    `points` (n_points, 2) [m], `edges` (n, 2), `reach` (n,) [m].
    """
    start, end = points[edges[:, 0]], points[edges[:, 1]]
    # Along a direction in which few sides of shapes run, an edge overlaps few others.
    along = np.stack([start, end]) @ np.array([[np.cos(1.0), -np.sin(1.0)], [np.sin(1.0), np.cos(1.0)]])
    low, high = along.min(axis=0) - reach[:, None], along.max(axis=0) + reach[:, None]
    order = np.argsort(low[:, 0], kind="stable")
    counts = np.searchsorted(low[order, 0], high[order, 0], side="right") - np.arange(len(order)) - 1
    before = np.concatenate([[0], np.cumsum(counts)])
    found = []
    begin = 0
    while begin < len(order):
        stop = max(begin + 1, int(np.searchsorted(before, before[begin] + MOST_PAIRS, side="right")) - 1)
        here = counts[begin:stop]
        first = np.repeat(np.arange(begin, stop), here)
        second = first + 1 + np.arange(len(first)) - np.repeat(before[begin:stop] - before[begin], here)
        one, other = order[first], order[second]
        near = (low[one, 1] <= high[other, 1]) & (low[other, 1] <= high[one, 1])
        near &= (edges[one][:, :, None] != edges[other][:, None, :]).all(axis=(1, 2))
        one, other = one[near], other[near]
        distances = _apart(start[one], end[one], start[other], end[other])
        close = distances <= reach[one] + reach[other]
        found.append((one[close], other[close], distances[close]))
        begin = stop
    ones, others, apart = (np.concatenate(parts) for parts in zip(*found))
    return ones, others, apart


def _apart(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Distance of each edge from a to b from the one from c to d [m]."""

    def left(one: np.ndarray, two: np.ndarray, three: np.ndarray) -> np.ndarray:
        (x, y), (u, v) = (two - one).T, (three - one).T
        return np.asarray(x * v - y * u)

    def away(point: np.ndarray, one: np.ndarray, two: np.ndarray) -> np.ndarray:
        along = two - one
        share = np.clip(((point - one) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
        return np.asarray(np.linalg.norm(point - one - share[:, None] * along, axis=1))

    crossing = (left(a, b, c) * left(a, b, d) < 0) & (left(c, d, a) * left(c, d, b) < 0)
    distance = np.min([away(a, c, d), away(b, c, d), away(c, a, b), away(d, a, b)], axis=0)
    return np.where(crossing, 0.0, distance)


def _rounds(edges: np.ndarray) -> list[np.ndarray]:
    """Closed rounds of edges, by the points on each in order; each point has one edge that leaves it."""
    following = dict(edges.tolist())
    rounds = []
    while following:
        point, after = following.popitem()
        found = [point]
        while after != point:
            found.append(after)
            after = following.pop(after)
        rounds.append(np.array(found))
    return rounds


def _winding(points: np.ndarray, edges: np.ndarray, point: np.ndarray) -> int:
    """How often edges wind about a point that is on none, counter-clockwise."""
    start, end = points[edges[:, 0]] - point, points[edges[:, 1]] - point
    left = start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]
    up = (start[:, 1] <= 0) & (end[:, 1] > 0) & (left > 0)
    down = (start[:, 1] > 0) & (end[:, 1] <= 0) & (left < 0)
    return int(up.sum()) - int(down.sum())


def in_words(points: np.ndarray) -> str:
    """Middle of one or more points, in words."""
    return "({:.6g}, {:.6g}) mm".format(*(1e3 * points.reshape(-1, 2).mean(axis=0)))


def edge_in_words(points: np.ndarray, ends: Sequence[int] | np.ndarray) -> str:
    """Both ends of an edge, in words."""
    return f"from {in_words(points[ends[0]])} to {in_words(points[ends[1]])}"

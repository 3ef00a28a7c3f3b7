r"""Coarse triangles of a shape whose sides lie on its arcs, graded towards its corners.

Triangles at a corner are cut at a fifth of their sides, again and again: the layers of `grade`::

        c
       / \            Each triangle (v, a, b) becomes a similar one (v, a', b') and two beside it. Neighbours share
      /   \           their cuts, so that the mesh stays conforming.
     a'----b'
    /   .    \
   a ---------- b
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ..mesh.cells import MeshError, signed_areas
from ..mesh.groups import GroupedMesh
from ..problem.shapes import Segment, Shape
from .small_strain import ELEMENT_GROWTH, SHRINKAGE

Ends = tuple[int, int]
"""Points at the ends of a side, the lower number first."""

LARGEST_TURN = np.pi / 6
"""Of a side of a triangle along an arc [rad]."""

LARGEST_SAGITTA = 0.15
"""Of a side of a triangle along an arc, over the distance to what else there is."""

FEWEST_ALONG = 4
"""Sides of triangles along the extent of a shape, at least."""


@dataclass(frozen=True)
class Arc:
    """A circle, or an ellipse with its axes along x and y.

    Attributes
    ----------
    centre : tuple of float
        [m]
    axes : tuple of float
        Half axes along x and y [m].
    """

    centre: tuple[float, float]
    axes: tuple[float, float]

    def at(self, angles: np.ndarray | float) -> np.ndarray:
        """Points of eccentric angles [rad], shape (..., 2) [m]."""
        return np.array(self.centre) + np.array(self.axes) * np.stack([np.cos(angles), np.sin(angles)], axis=-1)

    def slope(self, angle: float) -> np.ndarray:
        """Derivative of `at`, shape (2,)."""
        return np.array(self.axes) * [-np.sin(angle), np.cos(angle)]

    def angle(self, point: Iterable[float]) -> float:
        """Eccentric angle of a point [rad]."""
        x, y = (np.array(point) - self.centre) / self.axes
        return float(np.arctan2(y, x))


@dataclass(frozen=True)
class Side:
    """A side of a triangle on the outline, or between two parts.

    Attributes
    ----------
    groups : tuple of str
        That it belongs to.
    arc : Arc or None
        That it lies on; straight without.
    angles : tuple of float
        On the arc, at the corner of the lower number and at the other one [rad].
    """

    groups: tuple[str, ...] = ()
    arc: Arc | None = None
    angles: tuple[float, float] = (0.0, 0.0)


class CoarseMesh:
    """Triangles, and what is known of their sides on the outline and between parts.

    Parameters
    ----------
    points : ndarray of float, shape (n_points, 2)
        [m]
    triangles : ndarray of int, shape (n, 3)
        Counter-clockwise.
    parts : ndarray of int, shape (n,)
        Number of the part that each is in.
    names : tuple of str
        Of the parts.
    sides : dict of tuple of int to Side
        By the points at their ends, the lower number first.
    named : dict of str to int
        Points of names that are corners of triangles.
    """

    def __init__(
        self,
        points: np.ndarray,
        triangles: np.ndarray,
        parts: np.ndarray,
        names: tuple[str, ...],
        sides: dict[Ends, Side],
        named: dict[str, int],
    ) -> None:
        self.points, self.triangles, self.parts, self.names = points, triangles, parts, names
        self.sides, self.named = sides, named

    def copy(self) -> "CoarseMesh":
        """A mesh that may be cut for itself."""
        return CoarseMesh(self.points, self.triangles, self.parts, self.names, dict(self.sides), self.named)

    def curve(self, ends: Ends, along: np.ndarray) -> np.ndarray:
        """Points of a side, shape (n, 2) [m], from -1 at the corner of the lower number to 1."""
        side = self.sides.get(ends)
        share = (along + 1) / 2
        if side is None or side.arc is None:
            return self.points[ends[0]] + share[:, None] * (self.points[ends[1]] - self.points[ends[0]])
        return side.arc.at(side.angles[0] + share * (side.angles[1] - side.angles[0]))

    def _cut_side(self, first: int, second: int, share: float, new: int) -> np.ndarray:
        """The point a share of the way from one corner to another, and its number in the places of `sides`."""
        ends = (min(first, second), max(first, second))
        side = self.sides.pop(ends, None)
        if side is None:
            return self.points[first] + share * (self.points[second] - self.points[first])
        if first != ends[0]:
            share = 1 - share
        where = self.curve(ends, np.array([2 * share - 1]))[0]
        middle = side.angles[0] + share * (side.angles[1] - side.angles[0])
        self.sides[ends[0], new] = replace(side, angles=(side.angles[0], middle))
        self.sides[ends[1], new] = replace(side, angles=(side.angles[1], middle))
        return where

    def _replace(self, rows: np.ndarray, triangles: list[tuple[int, int, int]], parts: list[int]) -> None:
        self.triangles = np.concatenate([np.delete(self.triangles, rows, axis=0), np.array(triangles)])
        self.parts = np.concatenate([np.delete(self.parts, rows), np.array(parts)])

    def bisect(self, first: int, second: int) -> None:
        """Split a side, and the triangles at it, in the middle.

        Parameters
        ----------
        first, second : int
            Points at its ends.
        """
        new = len(self.points)
        where = self._cut_side(first, second, 0.5, new)
        self.points = np.concatenate([self.points, where[None]])
        rows = np.flatnonzero((self.triangles == first).any(axis=1) & (self.triangles == second).any(axis=1))
        triangles, parts = [], []
        for row in rows:
            a, b, c = (int(corner) for corner in self.triangles[row])
            while {a, b} != {first, second}:
                a, b, c = b, c, a
            triangles += [(a, new, c), (new, b, c)]
            parts += [int(self.parts[row])] * 2
        self._replace(rows, triangles, parts)

    def insert(self, name: str, where: np.ndarray) -> None:
        """Make a point inside the corner of triangles, and name it.

        Parameters
        ----------
        name : str
        where : ndarray of float, shape (2,)
            [m]
        """
        near = np.argsort(np.linalg.norm(self.points - where, axis=1))
        fixed = {end for ends in self.sides for end in ends} | set(self.named.values())
        for point in near[:3]:
            moved = self.points.copy()
            moved[point] = where
            around = self.triangles[(self.triangles == point).any(axis=1)]
            if int(point) not in fixed and len(around) and _shapely(moved, around):
                self.points, self.named = moved, self.named | {name: int(point)}
                return
        corners = self.points[self.triangles]
        shares = np.stack([_area(where, corners[:, (i + 1) % 3], corners[:, (i + 2) % 3]) for i in range(3)], axis=1)
        row = int(np.argmax(shares.min(axis=1) / signed_areas(self.points, self.triangles)))
        a, b, c = (int(corner) for corner in self.triangles[row])
        new = len(self.points)
        self.points, self.named = np.concatenate([self.points, where[None]]), self.named | {name: new}
        self._replace(np.array([row]), [(a, b, new), (b, c, new), (c, a, new)], [int(self.parts[row])] * 3)

    def part_sides(self) -> dict[Ends, list[tuple[int, bool]]]:
        """Triangles at each side of `sides`: number, and whether they go along it from the lower number."""
        return _triangles_at(self.triangles, self.sides)

    def isolate(self, corners: Iterable[int]) -> None:
        """Bisect sides until no triangle has two of some corners.

        Parameters
        ----------
        corners : iterable of int
        """
        chosen = np.array(sorted(corners), dtype=int)
        while True:
            among = np.isin(self.triangles, chosen)
            rows = np.flatnonzero(among.sum(axis=1) > 1)
            if not len(rows):
                return
            found = {
                tuple(sorted(pair))
                for row in rows
                for pair in combinations((int(corner) for corner in self.triangles[row][among[row]]), 2)
            }
            first, second = min(found)
            self.bisect(first, second)

    def grade(self, corners: Iterable[int]) -> None:
        """Cut the triangles at corners, of which no triangle has two, once.

        Parameters
        ----------
        corners : iterable of int
        """
        for corner in sorted(corners):
            rows = np.flatnonzero((self.triangles == corner).any(axis=1))
            cuts: dict[int, int] = {}
            wheres: list[np.ndarray] = []
            triangles, parts = [], []
            for row in rows:
                v, a, b = (int(point) for point in self.triangles[row])
                while v != corner:
                    v, a, b = a, b, v
                for end in (a, b):
                    if end not in cuts:
                        cuts[end] = len(self.points) + len(wheres)
                        wheres.append(self._cut_side(corner, end, SHRINKAGE, cuts[end]))
                near, far = cuts[a], cuts[b]
                triangles += [(v, near, far)]
                if np.linalg.norm(wheres[near - len(self.points)] - self.points[b]) < np.linalg.norm(
                    wheres[far - len(self.points)] - self.points[a]
                ):
                    triangles += [(near, a, b), (near, b, far)]
                else:
                    triangles += [(near, a, far), (a, b, far)]
                parts += [int(self.parts[row])] * 3
            self.points = np.concatenate([self.points, np.array(wheres)])
            self._replace(rows, triangles, parts)


def _area(first: np.ndarray, second: np.ndarray, third: np.ndarray) -> np.ndarray:
    one, other = second - first, third - first
    return 0.5 * (one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0])


def _shapely(points: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether triangles are counter-clockwise and not flat."""
    sides = points[triangles] - points[np.roll(triangles, 1, axis=1)]
    return bool((signed_areas(points, triangles) > 0.1 * (sides**2).sum(axis=(1, 2)) / 3).all())


def _triangles_at(triangles: np.ndarray, sides: Iterable[Ends]) -> dict[Ends, list[tuple[int, bool]]]:
    """Triangles at some sides, see `CoarseMesh.part_sides`."""
    wanted: dict[Ends, list[tuple[int, bool]]] = {ends: [] for ends in sides}
    corners = np.zeros(triangles.max() + 1, dtype=bool)
    corners[[end for ends in wanted for end in ends]] = True
    for i in range(3):
        starts, ends = triangles[:, i], triangles[:, (i + 1) % 3]
        for row in np.flatnonzero(corners[starts] & corners[ends]):
            start, end = int(starts[row]), int(ends[row])
            if (found := wanted.get((min(start, end), max(start, end)))) is not None:
                found.append((int(row), start < end))
    return wanted


@dataclass(frozen=True)
class _Piece:
    """A piece of a segment that becomes a side of triangles, or some."""

    start: np.ndarray
    end: np.ndarray
    group: str
    arc: Arc | None
    angles: tuple[float, float]
    left: int
    right: int

    def at(self, shares: np.ndarray) -> np.ndarray:
        if self.arc is None:
            return self.start + shares[:, None] * (self.end - self.start)
        return self.arc.at(self.angles[0] + shares * (self.angles[1] - self.angles[0]))

    def cut(self, share: float) -> "tuple[_Piece, _Piece]":
        middle = self.at(np.array([share]))[0]
        angle = self.angles[0] + share * (self.angles[1] - self.angles[0])
        return (
            replace(self, end=middle, angles=(self.angles[0], angle)),
            replace(self, start=middle, angles=(angle, self.angles[1])),
        )


def arc_of(segment: Segment, end: tuple[float, float]) -> tuple[Arc, tuple[float, float]]:
    """Arc of a segment, and the eccentric angles at its ends.

    Parameters
    ----------
    segment : Segment
        With a centre.
    end : tuple of float
        Where it ends [m].

    Returns
    -------
    arc : Arc
    angles : tuple of float
        [rad], less than half a turn from each other.

    Raises
    ------
    MeshError
        If no ellipse about the centre with its axes along x and y passes both ends.
    """
    assert segment.centre is not None
    first, second = (np.array(point) - segment.centre for point in (segment.start, end))
    lengths = np.hypot(*first), np.hypot(*second)
    if abs(lengths[0] - lengths[1]) <= 1e-9 * max(lengths):
        axes = np.array([lengths[0], lengths[0]])
    else:
        squares = np.stack([first, second]) ** 2
        try:
            inverse = np.linalg.solve(squares, np.ones(2))
        except np.linalg.LinAlgError:
            inverse = np.zeros(2)
        if not (inverse > 0).all():
            raise MeshError(f"no ellipse about {segment.centre} passes {segment.start} and {end}; correct the centre")
        axes = inverse**-0.5
    arc = Arc(segment.centre, (float(axes[0]), float(axes[1])))
    start, stop = arc.angle(segment.start), arc.angle(end)
    return arc, (start, start + (stop - start + np.pi) % (2 * np.pi) - np.pi)


def _round(outline: tuple[Segment, ...], inner: int, outer: int, turned: bool) -> list[_Piece]:
    """Pieces of a closed round, one a segment; `inner` is to the left where it is counter-clockwise."""
    pieces = []
    for segment, following in zip(outline, outline[1:] + outline[:1]):
        start, end = np.array(segment.start), np.array(following.start)
        arc, angles = arc_of(segment, following.start) if segment.centre is not None else (None, (0.0, 0.0))
        left, right = (outer, inner) if turned else (inner, outer)
        pieces.append(_Piece(start, end, segment.group, arc, angles, left, right))
    return pieces


def _polygon(outline: tuple[Segment, ...]) -> np.ndarray:
    """Corners of a polygon that follows an outline closely."""
    return np.concatenate([piece.at(np.linspace(0, 1, 24, endpoint=False)) for piece in _round(outline, 1, 0, False)])


def _inside(polygon: np.ndarray, point: np.ndarray) -> bool:
    start, end = polygon, np.roll(polygon, -1, axis=0)
    crossed = (start[:, 1] > point[1]) != (end[:, 1] > point[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        x = start[:, 0] + (point[1] - start[:, 1]) * (end[:, 0] - start[:, 0]) / (end[:, 1] - start[:, 1])
    return bool((crossed & (point[0] < x)).sum() % 2)


def _turns(polygon: np.ndarray) -> bool:
    """Whether a polygon is clockwise."""
    x, y = (polygon - polygon[0]).T
    return bool((x * np.roll(y, -1) - y * np.roll(x, -1)).sum() < 0)


def _refined(pieces: list[_Piece], largest_turn: float) -> list[_Piece]:
    """Pieces that are short where others are near, and turn little."""
    extent = max(np.ptp([piece.start for piece in pieces], axis=0))
    done = False
    while not done:
        done = True
        samples = np.array([piece.at(np.linspace(0, 1, 7)) for piece in pieces])
        chords = samples[:, -1] - samples[:, 0]
        lengths = np.linalg.norm(np.diff(samples, axis=1), axis=2).sum(axis=1)
        normal = chords[:, ::-1] * [1, -1] / np.linalg.norm(chords, axis=1)[:, None]
        sagittas = np.abs(((samples - samples[:, :1]) * normal[:, None]).sum(axis=2)).max(axis=1)
        refined: list[_Piece] = []
        for i, piece in enumerate(pieces):
            apart = np.linalg.norm(samples[:, None] - samples[i][None, :, None], axis=3).min(axis=(1, 2))
            apart[i] = np.inf
            clear = apart > 1e-9 * extent
            nearest = apart[clear].min(initial=np.inf)
            limit = min(
                extent / FEWEST_ALONG,
                ELEMENT_GROWTH * nearest,
                (2 * lengths[clear] + apart[clear]).min(initial=np.inf),
            )
            turn = abs(piece.angles[1] - piece.angles[0])
            if lengths[i] > 1.01 * limit or turn > 1.01 * largest_turn or sagittas[i] > LARGEST_SAGITTA * nearest:
                refined += piece.cut(0.5)
                done = False
            else:
                refined.append(piece)
        pieces = refined
    return pieces


def outline_mesh(shape: Shape, corners: Iterable[str] = (), largest_turn: float = LARGEST_TURN) -> CoarseMesh:
    """Coarse triangles of a shape that has an outline, by netgen's advancing front.

    Parameters
    ----------
    shape : Shape
    corners : iterable of str
        Named points that are to be corners of triangles; those on the outline are anyway.
    largest_turn : float
        Of a side along an arc [rad].

    Returns
    -------
    CoarseMesh

    Raises
    ------
    MeshError
        If netgen fails.
    """
    from netgen.geom2d import SplineGeometry  # here, since only a shape should pay for it
    from netgen.meshing import NgException

    names = tuple(dict.fromkeys(["", *(hole.part for hole in shape.holes if hole.part)]))
    polygons = [_polygon(hole.outline) for hole in shape.holes]
    domains = [names.index(hole.part) + 1 if hole.part else 0 for hole in shape.holes]
    pieces = _round(shape.outline, 1, 0, _turns(_polygon(shape.outline)))
    for i, (hole, polygon) in enumerate(zip(shape.holes, polygons)):
        around = [j for j, other in enumerate(polygons) if j != i and _inside(other, polygon[0])]
        # The innermost of those around it is inside all others.
        outer = max(around, key=lambda j: sum(_inside(polygons[k], polygons[j][0]) for k in around), default=None)
        pieces += _round(hole.outline, domains[i], 1 if outer is None else domains[outer], _turns(polygon))

    extent = max(np.ptp([piece.start for piece in pieces], axis=0))
    placed, inner = {}, {}
    for name, point in shape.points.items():
        where = np.array(point, dtype=float)
        for i, piece in enumerate(pieces):
            share = _share(piece, where, 1e-9 * extent)
            if share is not None:
                placed[name] = where
                if 1e-9 < share < 1 - 1e-9:
                    pieces[i : i + 1] = piece.cut(share)
                break
        else:
            if name in corners:
                inner[name] = where
    pieces = _refined(pieces, largest_turn)

    # Lengths about 1: netgen's own tolerances are absolute.
    scale = FEWEST_ALONG / extent
    origin = pieces[0].start
    geometry = SplineGeometry()
    numbers: dict[tuple[int, int], int] = {}

    def number(point: np.ndarray) -> int:
        x, y = (point - origin) * scale
        key = round(x * 1e8), round(y * 1e8)
        if key not in numbers:
            numbers[key] = geometry.AppendPoint(x, y)
        return numbers[key]

    for i, piece in enumerate(pieces):
        ends = [number(piece.start), number(piece.end)]
        geometry.Append(["line", *ends], leftdomain=piece.left, rightdomain=piece.right, bc=i + 1)
    try:
        made = geometry.GenerateMesh(maxh=1.0, grading=0.5)
    except NgException as error:
        raise MeshError(f"netgen cannot mesh {shape.name!r}: {error}; look for sides that meet or touch") from None
    points = np.array([point.p for point in made.Points()])[:, :2] / scale + origin
    triangles = np.array([[vertex.nr - 1 for vertex in element.vertices] for element in made.Elements2D()])
    parts = np.array([element.index - 1 for element in made.Elements2D()])
    inverted = signed_areas(points, triangles) < 0
    triangles[inverted] = triangles[inverted][:, ::-1]

    sides = {}
    exact = points.copy()
    for element in made.Elements1D():
        piece = pieces[element.index - 1]
        chord = piece.end - piece.start
        first, second = (vertex.nr - 1 for vertex in element.vertices)
        shares = np.array([(points[end] - piece.start) @ chord / (chord @ chord) for end in (first, second)])
        shares[np.abs(shares) < 1e-7] = 0.0
        shares[np.abs(shares - 1) < 1e-7] = 1.0
        exact[[first, second]] = piece.at(shares)
        angles = piece.angles[0] + shares * (piece.angles[1] - piece.angles[0])
        if first > second:
            first, second, angles = second, first, angles[::-1]
        groups = (piece.group,) if piece.group else ()
        sides[first, second] = Side(groups, piece.arc, (float(angles[0]), float(angles[1])))
    for piece in pieces:  # the outline's own corners to the last bit
        exact[np.argmin(np.linalg.norm(exact - piece.start, axis=1))] = piece.start
    named = {}
    for name, where in placed.items():
        named[name] = int(np.argmin(np.linalg.norm(exact - where, axis=1)))
        exact[named[name]] = where
    mesh = CoarseMesh(exact, triangles, parts, names, sides, named)
    for name, where in inner.items():
        mesh.insert(name, where)
    return mesh


def _share(piece: _Piece, where: np.ndarray, tolerance: float) -> float | None:
    """How far along a piece a point is, from 0 to 1; None where it is not on it."""
    if piece.arc is None:
        chord = piece.end - piece.start
        share = float((where - piece.start) @ chord / (chord @ chord))
    else:
        turn = piece.angles[1] - piece.angles[0]
        beyond = (piece.arc.angle(where) - piece.angles[0]) * np.sign(turn)
        share = float((beyond + 1e-9) % (2 * np.pi) - 1e-9) / abs(turn)
    if not -1e-9 <= share <= 1 + 1e-9:
        return None
    share = min(max(share, 0.0), 1.0)
    return share if np.linalg.norm(piece.at(np.array([share]))[0] - where) <= tolerance else None


def grouped_mesh(grouped: GroupedMesh, corners: Mapping[str, tuple[float, float]]) -> CoarseMesh:
    """Triangles of a mesh as read; quadrilaterals are halved by their shorter diagonal.

    Parameters
    ----------
    grouped : GroupedMesh
    corners : mapping of str to tuple of float
        Named points that are to be corners of triangles [m].

    Returns
    -------
    CoarseMesh
    """
    mesh = grouped.mesh
    names = tuple(dict.fromkeys(["", *grouped.parts]))
    of_cells = {count: np.zeros(len(cells), dtype=int) for count, cells in mesh.cells.items()}
    for name, inside in grouped.parts.items():
        for count, which in inside.items():
            of_cells[count][which] = names.index(name)
    triangles, parts = [mesh.triangles], [of_cells.get(3, np.zeros(0, dtype=int))]
    if len(quads := mesh.quads):
        at = mesh.points[quads]
        across = np.linalg.norm(at[:, 2] - at[:, 0], axis=1) <= np.linalg.norm(at[:, 3] - at[:, 1], axis=1)
        turned = np.where(across[:, None], quads, np.roll(quads, -1, axis=1))
        triangles += [turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]]
        parts += [of_cells[4], of_cells[4]]
    all_triangles, all_parts = np.concatenate(triangles), np.concatenate(parts)

    groups: dict[tuple[int, int], tuple[str, ...]] = {}
    for start, end in mesh.edges[mesh.on_outline].tolist():
        groups[start, end] = ()
    for name, edges in grouped.sides.items():
        for start, end in np.sort(edges, axis=1).tolist():
            groups[start, end] = (*groups.get((start, end), ()), name)
    if len(names) > 1:
        codes: dict[Ends, int] = {}
        for i in range(3):
            pairs = np.sort(all_triangles[:, [i, (i + 1) % 3]], axis=1)
            for start, end, part in zip(*pairs.T.tolist(), all_parts.tolist()):
                if codes.setdefault((start, end), part) != part:
                    groups.setdefault((start, end), ())
    # Points that no triangle has would be unknowns without a stiffness.
    used, inverse = np.unique(all_triangles, return_inverse=True)
    number = np.full(len(mesh.points), -1)
    number[used] = np.arange(len(used))
    sides = {}
    for (start, end), of in groups.items():
        first, second = int(number[start]), int(number[end])
        sides[min(first, second), max(first, second)] = Side(of)
    points = mesh.points[used]
    coarse = CoarseMesh(points, inverse.reshape(-1, 3), all_parts, names, sides, {})
    extent = np.ptp(points, axis=0).max()
    for name, point in corners.items():
        where = np.array(point, dtype=float)
        apart = np.linalg.norm(coarse.points - where, axis=1)
        if apart.min() <= 1e-9 * extent:
            coarse.named[name] = int(np.argmin(apart))
            continue
        for first, second in list(coarse.sides):
            start, end = coarse.points[first], coarse.points[second]
            share = (where - start) @ (end - start) / ((end - start) @ (end - start))
            if 0 < share < 1 and np.linalg.norm(start + share * (end - start) - where) <= 1e-9 * extent:
                coarse.bisect(first, second)
                coarse.points[-1] = where
                coarse.named[name] = len(coarse.points) - 1
                break
        else:
            coarse.insert(name, where)
    return coarse


def singular_corners(
    mesh: CoarseMesh,
    condition: Callable[[Side], object],
    free: Callable[[Side], bool],
    mirror: Callable[[Side, np.ndarray], bool],
    smooth: float,
) -> dict[int, str]:
    """Corners at which a solution may not be smooth, and what they are.

    Parameters
    ----------
    mesh : CoarseMesh
    condition : callable
        What holds on a side: supports and loads.
    free : callable
        Whether nothing holds on it.
    mirror : callable
        Whether the solution goes on beyond a side, of a direction, as its mirror image.
    smooth : float
        Turn of the outline that is taken for none [rad].

    Returns
    -------
    dict of int to str
    """
    at_sides = mesh.part_sides()
    at_corner: dict[int, list[tuple[int, int]]] = {}
    for ends in at_sides:
        for end in ends:
            at_corner.setdefault(end, []).append(ends)
    angles: dict[int, float] = {}
    inside: dict[int, set[int]] = {}
    of_interest = np.isin(mesh.triangles, list(at_corner))
    for row, i in zip(*np.nonzero(of_interest)):
        inside.setdefault(int(mesh.triangles[row, i]), set()).add(int(mesh.parts[row]))

    def leaving(corner: int, ends: Ends) -> np.ndarray:
        """Direction of a side at a corner."""
        side = mesh.sides[ends]
        if side.arc is None:
            other = ends[1] if ends[0] == corner else ends[0]
            way = mesh.points[other] - mesh.points[corner]
        else:
            place = ends.index(corner)
            way = side.arc.slope(side.angles[place]) * (side.angles[1 - place] - side.angles[place])
        return way / np.linalg.norm(way)

    found: dict[int, str] = {}
    for corner, around in at_corner.items():
        outer = [ends for ends in around if len(at_sides[ends]) == 1]
        between = [ends for ends in around if len(at_sides[ends]) > 1]
        if len(inside[corner]) > 1:
            if outer:
                found[corner] = "parts of different materials meet on the outline"
            elif len(between) != 2:
                found[corner] = "parts meet"
            else:
                one, other = (leaving(corner, ends) for ends in between)
                if np.arccos(np.clip(-(one @ other), -1, 1)) > smooth:
                    found[corner] = "the border between two parts has a corner"
            continue
        if len(outer) != 2:
            if outer:
                found[corner] = "pieces of the body touch"
            continue

        # The side from which the body lies counter-clockwise about the corner, then the other one.
        leads = at_sides[outer[0]][0][1] == (outer[0][0] == corner)
        first, last = outer if leads else outer[::-1]
        one, other = leaving(corner, first), leaving(corner, last)
        angle = float(np.arctan2(one[0] * other[1] - one[1] * other[0], one @ other) % (2 * np.pi))
        angles[corner] = angle
        side, next_side = mesh.sides[first], mesh.sides[last]
        same = condition(side) == condition(next_side)
        if same and abs(angle - np.pi) <= smooth:
            continue
        bare = free(side), free(next_side)
        mirrored = mirror(side, one), mirror(next_side, other)
        if all(bare) and angle < np.pi:
            continue
        if all(mirrored) and angle <= np.pi / 2 + 1e-9:
            continue
        if (bare[0] and mirrored[1] or bare[1] and mirrored[0]) and 2 * angle <= np.pi + smooth:
            continue
        degrees = f"{np.degrees(angle):.0f} degrees"
        if same:
            found[corner] = f"the outline has a corner of {degrees}"
        else:
            found[corner] = f"supports or loads change at an angle of {degrees}"
    return found

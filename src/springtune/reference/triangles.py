"""Coarse triangles of a shape, graded towards its corners, and polynomials of any degree on them.

Sides of triangles lie on the shape's arcs. Triangles at a corner are cut at a fifth of their sides, again and again,
conforming with their neighbours.

Shape functions are hierarchical (Szabo and Babuska, Finite Element Analysis, 1991, chapter 6): one a corner, degree - 1
a side and the rest inside. Corners are numbered upwards, so that neighbours agree on a side's direction.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import Legendre, legder, leggauss, legval
from scipy import spatial

from ..mesh.cells import MeshError, signed_areas
from ..mesh.free import triangulate
from ..mesh.sheets import GroupedMesh, part_names
from ..mesh.sides import OutlineSide, Point, Stretch, turn
from ..problem.shapes import Shape
from .small_strain import ELEMENT_GROWTH, SHRINKAGE

_Ends = tuple[int, int]  # points at the ends of a side, the lower number first

LARGEST_TURN = np.pi / 6  # largest change of direction along a triangle's side on an arc [rad]

LARGEST_SAGITTA = 0.15  # largest sagitta of a triangle's side on an arc, over the distance to the rest of the outline

PIECE_SAMPLES = 7  # points on a piece of an outline at which distances are taken

LENGTH_TOLERANCE = 1e-9  # distance that counts as zero, over the extent of a shape

STRAIGHT_TURN = 1e-6  # turn of a polygon that counts as zero [rad]

SMOOTH_TURN = np.radians(12)
"""Turn of an outline that needs no smaller triangles [rad]: a polygon that stands for a circle."""

SMALL_TURN = 1e-3  # turn of an outline that counts as zero for stresses [rad]

UNGRADED_ANGLE = np.radians(91)  # largest angle of a corner without supports and loads that needs no grading [rad]

LEAST_SHARE = 0.05  # smallest triangle that a point inside another one may cut off, over that one

LEAST_SIDES_ALONG = 4  # sides of triangles along the extent of a shape, at least


SIDE_CORNERS = ((0, 1), (1, 2), (0, 2))
"""Corners of the sides of a triangle whose corners are numbered upwards, from the lower number to the higher one."""

CORNER_GRADIENTS = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
"""Gradients of the corners' shape functions in the reference triangle."""


@dataclass(frozen=True)
class Side:
    """Side of a triangle on the outline or between parts; `span` runs from the lower corner's parameter on the arc."""

    groups: tuple[str, ...] = ()
    arc: OutlineSide | None = None
    span: tuple[float, float] = (0.0, 1.0)


@dataclass(eq=False)
class CoarseMesh:
    """Triangles (n, 3), counter-clockwise, their parts' numbers (n,), and sides on the outline and between parts."""

    points: np.ndarray
    triangles: np.ndarray
    parts: np.ndarray
    names: tuple[str, ...]
    sides: dict[_Ends, Side]
    named: dict[str, int]

    def copy(self) -> "CoarseMesh":
        """Return a copy, which can be cut without changing this mesh."""
        return replace(self, sides=dict(self.sides))

    def curve(self, ends: _Ends, along: np.ndarray) -> np.ndarray:
        """Points of a side, shape (n, 2) [m], from -1 at the corner of the lower number to 1."""
        side = self.sides.get(ends)
        share = (along + 1) / 2
        if side is None or side.arc is None:
            return self.points[ends[0]] + share[:, None] * (self.points[ends[1]] - self.points[ends[0]])
        return _points(side.arc, side.span, share)

    def _cut_side(self, first: int, second: int, share: float, new: int) -> np.ndarray:
        """The point a share of the way from one corner to another, and its number in the places of `sides`."""
        ends = (min(first, second), max(first, second))
        side = self.sides.get(ends)
        if side is None:
            return self.points[first] + share * (self.points[second] - self.points[first])
        if first != ends[0]:
            share = 1 - share
        where = self.curve(ends, np.array([2 * share - 1]))[0]
        middle = side.span[0] + share * (side.span[1] - side.span[0])
        del self.sides[ends]
        self.sides[ends[0], new] = replace(side, span=(side.span[0], middle))
        self.sides[ends[1], new] = replace(side, span=(side.span[1], middle))
        return where

    def _replace(self, rows: np.ndarray, triangles: list[tuple[int, int, int]]) -> None:
        """Replace triangles, each by the same number of new ones."""
        parts = np.repeat(self.parts[rows], len(triangles) // len(rows))
        self.triangles = np.concatenate([np.delete(self.triangles, rows, axis=0), np.array(triangles)])
        self.parts = np.concatenate([np.delete(self.parts, rows), parts])

    def bisect(self, first: int, second: int) -> None:
        """Split a side, and the triangles at it, in the middle."""
        new = len(self.points)
        where = self._cut_side(first, second, 0.5, new)
        self.points = np.concatenate([self.points, where[None]])
        rows = np.flatnonzero((self.triangles == first).any(axis=1) & (self.triangles == second).any(axis=1))
        triangles = []
        for row in rows:
            a, b, c = (int(corner) for corner in self.triangles[row])
            while {a, b} != {first, second}:
                a, b, c = b, c, a
            triangles += [(a, new, c), (new, b, c)]
        self._replace(rows, triangles)

    def insert(self, name: str, where: np.ndarray) -> None:
        """Make a point inside, shape (2,) [m], a named corner of triangles."""
        near = np.argsort(np.linalg.norm(self.points - where, axis=1))
        fixed = {end for ends in self.sides for end in ends} | set(self.named.values())
        for point in near[:3]:
            moved = self.points.copy()
            moved[point] = where
            around = self.triangles[(self.triangles == point).any(axis=1)]
            if int(point) not in fixed and len(around) and _are_well_shaped(moved, around):
                self.points, self.named = moved, self.named | {name: int(point)}
                return
        corners = self.points[self.triangles]
        shares = 0.5 * np.stack(
            [turn(where, corners[:, (i + 1) % 3], corners[:, (i + 2) % 3]) for i in range(3)], axis=1
        )
        shares /= signed_areas(self.points, self.triangles)[:, None]
        row = int(np.argmax(shares.min(axis=1)))
        a, b, c = (int(corner) for corner in np.roll(self.triangles[row], -1 - np.argmin(shares[row])))
        new = len(self.points)
        if shares[row].min() < LEAST_SHARE and (min(a, b), max(a, b)) not in self.sides:
            self.bisect(a, b)  # the side that the point is next to
            self.points[new] = where
        else:
            self.points = np.concatenate([self.points, where[None]])
            self._replace(np.array([row]), [(a, b, new), (b, c, new), (c, a, new)])
        self.named = self.named | {name: new}

    def part_sides(self) -> dict[_Ends, list[tuple[int, bool]]]:
        """Triangles at each side of `sides`: number, and whether they go along it from the lower number."""
        triangles_at: dict[_Ends, list[tuple[int, bool]]] = {ends: [] for ends in self.sides}
        corners = np.zeros(self.triangles.max() + 1, dtype=bool)
        corners[[end for ends in triangles_at for end in ends]] = True
        for i in range(3):
            starts, ends = self.triangles[:, i], self.triangles[:, (i + 1) % 3]
            for row in np.flatnonzero(corners[starts] & corners[ends]):
                start, end = int(starts[row]), int(ends[row])
                if (found := triangles_at.get((min(start, end), max(start, end)))) is not None:
                    found.append((int(row), start < end))
        return triangles_at

    def isolate(self, corners: Iterable[int]) -> None:
        """Bisect sides until no triangle has two of some corners."""
        chosen = np.array(sorted(corners), dtype=int)
        while True:
            among = np.isin(self.triangles, chosen)
            rows = np.flatnonzero(among.sum(axis=1) > 1)
            if not len(rows):
                return
            several = [sorted(self.triangles[row][among[row]].tolist()) for row in rows]
            self.bisect(*min(pair for corners in several for pair in combinations(corners, 2)))

    def grade(self, corners: Iterable[int]) -> None:
        """Cut the triangles at corners, of which no triangle has two, once."""
        for corner in sorted(corners):
            rows = np.flatnonzero((self.triangles == corner).any(axis=1))
            cuts, wheres = dict[int, int](), list[np.ndarray]()
            triangles = []
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
                here, there = (wheres[cut - len(self.points)] for cut in (near, far))
                if np.linalg.norm(here - self.points[b]) < np.linalg.norm(there - self.points[a]):
                    triangles += [(near, a, b), (near, b, far)]
                else:
                    triangles += [(near, a, far), (a, b, far)]
            self.points = np.concatenate([self.points, np.array(wheres)])
            self._replace(rows, triangles)


def _are_well_shaped(points: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether triangles are counter-clockwise and not flat."""
    sides = points[triangles] - points[np.roll(triangles, 1, axis=1)]
    return bool((signed_areas(points, triangles) > 0.1 * (sides**2).sum(axis=(1, 2)) / 3).all())


def _points(side: OutlineSide, span: tuple[float, float], shares: np.ndarray) -> np.ndarray:
    """Points of a side at shares of the way between two parameters [m], shape (n, 2)."""
    return np.array([side.at(float(span[0] + share * (span[1] - span[0]))) for share in shares])


@dataclass(frozen=True)
class _Piece(Stretch):
    """A stretch of the outline that becomes a side of triangles, or some."""

    groups: tuple[str, ...]

    def at(self, shares: np.ndarray) -> np.ndarray:
        return _points(self.side, (self.low, self.high), shares)

    @property
    def turn(self) -> float:
        """Turn of its direction from end to end [rad]."""
        one, other = self.side.slope(self.low), self.side.slope(self.high)
        return float(np.arctan2(abs(one[0] * other[1] - one[1] * other[0]), one[0] * other[0] + one[1] * other[1]))


def _refine_pieces(pieces: list[_Piece], extent: float, largest_turn: float) -> list[_Piece]:
    """Pieces that are short where others are near, and turn little."""
    while True:
        samples = np.array([piece.at(np.linspace(0, 1, PIECE_SAMPLES)) for piece in pieces])
        chords = samples[:, -1] - samples[:, 0]
        lengths = np.linalg.norm(np.diff(samples, axis=1), axis=2).sum(axis=1)
        normal = chords[:, ::-1] * [1, -1] / np.linalg.norm(chords, axis=1)[:, None]
        sagittas = np.abs(((samples - samples[:, :1]) * normal[:, None]).sum(axis=2)).max(axis=1)
        tree = spatial.cKDTree(samples.reshape(-1, 2))
        refined: list[_Piece] = []
        for piece, at, length, sagitta in zip(pieces, samples, lengths, sagittas):
            # What is farther than its length does not matter.
            near = np.unique(np.concatenate(tree.query_ball_point(at, length)).astype(int) // PIECE_SAMPLES)
            apart = np.linalg.norm(samples[near][:, :, None] - at[None, None], axis=3).min(axis=(1, 2))
            clear = apart > LENGTH_TOLERANCE * extent
            nearest = apart[clear].min(initial=np.inf)
            others = (2 * lengths[near][clear] + apart[clear]).min(initial=np.inf)
            limit = min(extent / LEAST_SIDES_ALONG, ELEMENT_GROWTH * nearest, others)
            kept = length <= 1.01 * limit and piece.turn <= 1.01 * largest_turn and sagitta <= LARGEST_SAGITTA * nearest
            refined += [piece] if kept else piece.cut([piece.low, (piece.low + piece.high) / 2, piece.high])
        if len(refined) == len(pieces):
            return pieces
        pieces = refined


def outline_mesh(
    shape: Shape, grouped: GroupedMesh | None, points: Mapping[str, Point], largest_turn: float = LARGEST_TURN
) -> CoarseMesh:
    """Make coarse triangles of a shape by netgen, with corners at `points` and arcs cut every `largest_turn` [rad]."""
    if grouped is None:
        names = ("", *shape.parts)
        numbers = {None: 0} | {name: number + 1 for number, name in enumerate(names)}
        whole = [
            _Piece(side, 0.0, 1.0, numbers[one.inner], numbers[one.outer], (side.group,) if side.group else ())
            for one in shape.rounds
            for side in one.sides
        ]
    else:
        names, whole = _polygons(grouped)
    corners = np.array([end for piece in whole for end in (piece.side.start, piece.side.end)])
    extent = float(np.ptp(corners, axis=0).max())
    pieces, placed = list[_Piece](), set[str]()
    for piece in whole:
        on_it = piece.side.find_points(points, LENGTH_TOLERANCE * extent)
        placed.update(on_it)
        pieces += piece.cut(sorted({0.0, 1.0, *on_it.values()}))
    mesh = _triangulated(shape.name, _refine_pieces(pieces, extent, largest_turn), names, extent)
    for name in sorted(points, key=lambda name: name not in placed):  # those on sides first
        where = np.array(points[name], dtype=float)
        if name in placed:
            mesh.named[name] = int(np.argmin(np.linalg.norm(mesh.points - where, axis=1)))
            mesh.points[mesh.named[name]] = where
        else:
            mesh.insert(name, where)
    return mesh


def _triangulated(name: str, pieces: list[_Piece], names: tuple[str, ...], extent: float) -> CoarseMesh:
    """Triangles between pieces of outlines."""
    ends = np.array([piece.at(np.array([0.0, 1.0])) for piece in pieces])
    # Lengths about 1: netgen's own tolerances are absolute.
    scale, origin = LEAST_SIDES_ALONG / extent, ends.min(axis=(0, 1))
    keys, places = np.unique(np.round((ends.reshape(-1, 2) - origin) * scale * 1e8), axis=0, return_inverse=True)
    given = np.empty((len(keys), 2))
    given[places.ravel()] = ends.reshape(-1, 2)
    lines = [(int(i), int(j), one.left, one.right) for one, (i, j) in zip(pieces, places.reshape(-1, 2))]
    remedy = "look for sides that meet or touch"
    made = triangulate((given - origin) * scale, lines, repr(name), remedy=remedy, maxh=1.0, grading=0.5)
    points = made.points / scale + origin
    triangles, parts = made.triangles, made.regions - 1

    sides = {}
    exact = points.copy()
    for line, *corners in made.pieces:
        piece, (start, end), (first, second) = pieces[line], ends[line], sorted(corners)
        shares = (points[[first, second]] - start) @ (end - start) / ((end - start) @ (end - start))
        shares[np.abs(shares) < 1e-7] = 0.0
        shares[np.abs(shares - 1) < 1e-7] = 1.0
        exact[[first, second]] = piece.at(shares)
        span = piece.low + shares * (piece.high - piece.low)
        arc = piece.side if piece.side.arc else None
        sides[first, second] = Side(piece.groups, arc, (float(span[0]), float(span[1])))
    return CoarseMesh(exact, triangles, parts, names, sides, {})


def _polygons(grouped: GroupedMesh) -> tuple[tuple[str, ...], list[_Piece]]:
    """Names of parts, and straight pieces around and between the parts of a mesh."""
    mesh, labels = grouped.mesh, part_names(grouped)
    names = tuple(dict.fromkeys(["", *grouped.parts]))
    part_of: dict[_Ends, int] = {}  # to the left of each way around a cell
    for count, cells in mesh.cells.items():
        parts = [names.index(name) for name in labels[count]]
        for i in range(count):
            part_of.update(zip(zip(cells[:, i].tolist(), cells[:, (i + 1) % count].tolist()), parts))
    groups: dict[_Ends, tuple[str, ...]] = {}
    for name, edges in grouped.sides.items():
        for first, second in np.sort(edges, axis=1).tolist():
            groups[first, second] = (*groups.get((first, second), ()), name)
    leaving, arriving = dict[int, list[_Ends]](), dict[int, list[_Ends]]()
    keys: dict[_Ends, tuple[int, int, tuple[str, ...]]] = {}  # what is beside a way
    for (first, second), part in part_of.items():
        other = part_of.get((second, first), -1)
        if other < 0 or part < other:
            keys[first, second] = part + 1, other + 1, groups.get((min(first, second), max(first, second)), ())
            leaving.setdefault(first, []).append((first, second))
            arriving.setdefault(second, []).append((first, second))
    following: dict[_Ends, _Ends] = {}  # where a way goes on straight
    for here, ways in leaving.items():
        if len(ways) == len(arriving.get(here, ())) == 1 and keys[ways[0]] == keys[arriving[here][0]]:
            before, there = arriving[here][0][0], ways[0][1]
            one, two = mesh.points[here] - mesh.points[before], mesh.points[there] - mesh.points[here]
            if abs(one[0] * two[1] - one[1] * two[0]) <= STRAIGHT_TURN * (one @ two):
                following[before, here] = here, there
    pieces, inner = [], set(following.values())
    for way in (way for ways in leaving.values() for way in ways if way not in inner):
        last = way
        while last in following:
            last = following[last]
        start, end = (tuple(mesh.points[point].tolist()) for point in (way[0], last[1]))
        pieces.append(_Piece(OutlineSide(start, end), 0.0, 1.0, *keys[way]))
    return names, pieces


class Corner(NamedTuple):
    """Corner of the outline or of parts; `rough` where a solution is not smooth enough for even triangles."""

    what: str
    rough: bool = True
    infinite: bool = False


def corners_of(
    mesh: CoarseMesh,
    condition: Callable[[Side], object],
    held: Callable[[Side], bool],
    mirror: Callable[[Side, np.ndarray], bool],
) -> dict[int, Corner]:
    """Return the corners where a solution may not be smooth, as re-entrant ones between free sides (Williams 1952)."""
    at_sides = mesh.part_sides()
    at_corner: dict[int, list[_Ends]] = {}
    for ends in at_sides:
        for end in ends:
            at_corner.setdefault(end, []).append(ends)

    def leaving(corner: int, ends: _Ends) -> np.ndarray:
        """Direction of a side at a corner."""
        side = mesh.sides[ends]
        if side.arc is None:
            other = ends[1] if ends[0] == corner else ends[0]
            way = mesh.points[other] - mesh.points[corner]
        else:
            place = ends.index(corner)
            way = np.array(side.arc.slope(side.span[place])) * (side.span[1 - place] - side.span[place])
        return way / np.linalg.norm(way)

    found: dict[int, Corner] = {}
    for corner, around in at_corner.items():
        outer = [ends for ends in around if len(at_sides[ends]) == 1]
        between = [ends for ends in around if len(at_sides[ends]) > 1]
        if np.ptp(mesh.parts[(mesh.triangles == corner).any(axis=1)]):
            if outer:
                found[corner] = Corner("parts of different materials meet on the outline")
            elif len(between) != 2:
                found[corner] = Corner("parts meet")
            else:
                one, other = (leaving(corner, ends) for ends in between)
                rough = np.arccos(np.clip(-(one @ other), -1, 1)) > SMOOTH_TURN
                found[corner] = Corner("parts of different materials meet", bool(rough))
            continue
        if len(outer) != 2:
            if outer:
                found[corner] = Corner("pieces of the body touch")
            continue
        # The side from which the body lies counter-clockwise about the corner, then the other one.
        leads = at_sides[outer[0]][0][1] == (outer[0][0] == corner)
        first, last = outer if leads else outer[::-1]
        one, other = leaving(corner, first), leaving(corner, last)
        angle = float(np.arctan2(one[0] * other[1] - one[1] * other[0], one @ other) % (2 * np.pi))
        sides = mesh.sides[first], mesh.sides[last]
        same = condition(sides[0]) == condition(sides[1])
        mirrored = mirror(sides[0], one), mirror(sides[1], other)
        free = not held(sides[0]), not held(sides[1])
        bare = not condition(sides[0]), not condition(sides[1])
        straight = same and abs(angle - np.pi) <= SMALL_TURN
        if all(mirrored):
            rough, infinite = abs(angle - np.pi / 2) > SMALL_TURN, angle > np.pi / 2 + SMALL_TURN and not straight
        elif any(mirrored):
            smooth = any(bare) and (2 * angle < UNGRADED_ANGLE or abs(2 * angle - np.pi) <= SMOOTH_TURN)
            rough, infinite = not smooth, any(free) and 2 * angle > np.pi + SMALL_TURN
        else:
            rough = not (all(bare) and angle < UNGRADED_ANGLE)
            infinite = all(free) and angle > np.pi + SMALL_TURN
        what = "the outline has a corner" if same else "supports or loads change at an angle"
        rough = rough and not (same and abs(angle - np.pi) <= SMOOTH_TURN)
        found[corner] = Corner(f"{what} of {np.degrees(angle):.4g} degrees", rough, infinite)
    return found


def function_counts(degree: int) -> tuple[int, int]:
    """Number of shape functions of a side and of the inside of a triangle."""
    return degree - 1, (degree - 1) * (degree - 2) // 2


def local_functions(lower: int, degree: int) -> np.ndarray:
    """Places of the shape functions of a lower degree among those of a degree, as in `shape_functions`."""
    (few, few_inside), (per_side, _) = function_counts(lower), function_counts(degree)
    sides = 3 + np.add.outer(per_side * np.arange(3), np.arange(few)).ravel()
    return np.concatenate([np.arange(3), sides, 3 + 3 * per_side + np.arange(few_inside)])


def _side_kernels(degree: int, along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Integrated Legendre polynomials over (1 - t^2) / 4, and their derivatives; shape (n, degree - 1)."""
    values, slopes = [], []
    for k in range(2, degree + 1):
        coefficients = 4 * np.sqrt((2 * k - 1) / 2) / (k * (k - 1)) * legder([0] * (k - 1) + [1])
        values.append(legval(along, coefficients))
        slopes.append(legval(along, legder(coefficients)))
    return np.stack(values, axis=-1), np.stack(slopes, axis=-1)


def side_functions(degree: int, along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return shape functions at `along` in [-1, 1] on a side, and slopes, (n, degree + 1): corners' first."""
    kernel, slope = _side_kernels(degree, along)
    bulge = (1 - along[:, None] ** 2) / 4
    ends = np.stack([(1 - along) / 2, (1 + along) / 2], axis=1)
    values = np.concatenate([ends, bulge * kernel], axis=1)
    constant = np.broadcast_to([-0.5, 0.5], ends.shape)
    return values, np.concatenate([constant, bulge * slope - along[:, None] / 2 * kernel], axis=1)


def shape_functions(degree: int, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return functions (n, n_functions) and gradients (n, n_functions, 2) in a triangle: corners, sides, inside."""
    corners = np.column_stack([1 - points.sum(axis=1), points])
    values, gradients = [corners], [np.broadcast_to(CORNER_GRADIENTS, (len(points), 3, 2))]

    def product_gradient(i: int, j: int) -> np.ndarray:
        return corners[:, i, None] * CORNER_GRADIENTS[j] + corners[:, j, None] * CORNER_GRADIENTS[i]

    for i, j in SIDE_CORNERS:
        kernel, slope = _side_kernels(degree, corners[:, j] - corners[:, i])
        product = corners[:, i] * corners[:, j]
        values.append(product[:, None] * kernel)
        turned = (product[:, None] * slope)[..., None] * (CORNER_GRADIENTS[j] - CORNER_GRADIENTS[i])
        gradients.append(kernel[..., None] * product_gradient(i, j)[:, None] + turned)
    bubble = corners.prod(axis=1)
    bubble_gradient = corners[:, 2, None] * product_gradient(0, 1)
    bubble_gradient += (corners[:, 0] * corners[:, 1])[:, None] * CORNER_GRADIENTS[2]
    first, second = corners[:, 1] - corners[:, 0], 2 * corners[:, 2] - 1
    for total in range(degree - 2):
        for i in range(total + 1):
            one, other = Legendre.basis(i), Legendre.basis(total - i)
            a, b = one(first), other(second)
            values.append((bubble * a * b)[:, None])
            inner = (one.deriv()(first) * b)[:, None] * (CORNER_GRADIENTS[1] - CORNER_GRADIENTS[0])
            inner = inner + (2 * a * other.deriv()(second))[:, None] * CORNER_GRADIENTS[2]
            gradients.append(((a * b)[:, None] * bubble_gradient + bubble[:, None] * inner)[:, None])
    return np.concatenate(values, axis=1), np.concatenate(gradients, axis=1)


@lru_cache(maxsize=64)
def tabulated(degree: int, exact: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return quadrature weights, sum 1/2, exact to degree `exact`, and shape functions and gradients at its points.

    Gauss's rules in a square are folded onto the reference triangle.
    """
    nodes, weights = leggauss(exact // 2 + 1)
    across, weights_across = leggauss((exact + 1) // 2 + 1)  # one degree more by the fold
    x, y = (nodes + 1) / 2, (across + 1) / 2
    points = np.stack([np.multiply.outer(1 - y, x).ravel(), np.repeat(y, len(x))], axis=1)
    return np.multiply.outer(weights_across / 2 * (1 - y), weights / 2).ravel(), *shape_functions(degree, points)


@lru_cache(maxsize=64)
def side_fit(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return inner points of Lobatto's rule on a side, and the matrix from values there to side functions."""
    along = np.real(Legendre.basis(degree).deriv().roots())
    return along, np.linalg.inv(side_functions(degree, along)[0][:, 2:])


class Space:
    """Polynomials of one degree on the triangles of a mesh."""

    def __init__(self, mesh: CoarseMesh, degree: int) -> None:
        self.mesh, self.degree = mesh, degree
        self.corners = corners = np.sort(mesh.triangles, axis=1)
        self.sense = np.sign(turn(*(mesh.points[corners[:, i]] for i in range(3))))
        n_points = len(mesh.points)
        pairs = np.concatenate([corners[:, pair] for pair in SIDE_CORNERS])
        codes, places = np.unique(pairs[:, 0] * n_points + pairs[:, 1], return_inverse=True)
        self.edges = np.stack(np.divmod(codes, n_points), axis=1)
        of_triangles = places.reshape(3, -1).T
        per_side, inside = function_counts(degree)
        self.n_outer = n_points + len(codes) * per_side
        self.n_functions = self.n_outer + len(corners) * inside
        on_sides = n_points + of_triangles[:, :, None] * per_side + np.arange(per_side)
        within = self.n_outer + np.arange(len(corners))[:, None] * inside + np.arange(inside)
        self.n_local_outer = 3 + 3 * per_side
        self.numbers = np.concatenate([corners, on_sides.reshape(len(corners), -1), within], axis=1)
        # Where the triangles are: coefficients of the same functions (isoparametric).
        self.places = np.zeros((self.n_functions, 2))
        self.places[:n_points] = mesh.points
        self.codes = codes
        along, inverse = side_fit(degree)
        curved = [ends for ends, side in mesh.sides.items() if side.arc is not None]
        for ends in curved:
            start, end = mesh.points[ends[0]], mesh.points[ends[1]]
            straight = (start + end) / 2 + along[:, None] * (end - start) / 2
            self.places[self.on_side(ends)[2:]] = inverse @ (mesh.curve(ends, along) - straight)
        bent = np.zeros(len(codes), dtype=bool)
        bent[[self._edge(ends) for ends in curved]] = True
        self.curved = np.asarray(bent[of_triangles].any(axis=1))

    def _edge(self, ends: tuple[int, int]) -> int:
        return int(np.searchsorted(self.codes, ends[0] * len(self.mesh.points) + ends[1]))

    def on_side(self, ends: tuple[int, int]) -> np.ndarray:
        """Functions on a side, as in `side_functions`."""
        per_side = self.degree - 1
        first = len(self.mesh.points) + self._edge(ends) * per_side
        return np.concatenate([np.array(ends), np.arange(first, first + per_side)])

    def jacobians(self, gradients: np.ndarray, rows: np.ndarray | slice = slice(None)) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of places (n, points, 2, 2), last by reference coordinate, and determinants; refuse folds."""
        at = self.places[self.numbers[rows]]
        derivatives = np.einsum("eic,qia->eqca", at, gradients, optimize=True)
        determinants = derivatives[..., 0, 0] * derivatives[..., 1, 1] - derivatives[..., 0, 1] * derivatives[..., 1, 0]
        folded = (determinants * self.sense[rows, None] <= 0).any(axis=1)
        if folded.any():
            x, y = 1e3 * self.mesh.points[self.corners[rows][folded][0]].mean(axis=0)
            raise MeshError(f"a triangle folds along an arc near ({x:.4g}, {y:.4g}) mm; give the arc as shorter arcs")
        return derivatives, determinants


def inverse_of(matrices: np.ndarray, determinants: np.ndarray) -> np.ndarray:
    """Inverses of 2 x 2 matrices, shape (..., 2, 2)."""
    turned = np.swapaxes(matrices[..., ::-1, ::-1], -1, -2)
    return turned * [[1, -1], [-1, 1]] / determinants[..., None, None]


def is_unfolded(mesh: CoarseMesh) -> bool:
    """Whether all triangles are the right way round everywhere."""
    if not (signed_areas(mesh.points, mesh.triangles) > 0).all():
        return False
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]])
    try:
        for degree in (2, 4):
            gradients = tabulated(degree, 10)[2], shape_functions(degree, corners)[1]
            Space(mesh, degree).jacobians(np.concatenate(gradients))
    except MeshError:
        return False
    return True

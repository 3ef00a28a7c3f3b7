"""Delaunay triangulations by netgen: of boxes (mesh type ``free``), and of shapes with arcs, holes and inclusions."""

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from .cells import Mesh, MeshError, check_box, mesh_type, signed_areas, too_many, upright
from .rows import ROW_HEIGHT
from .sheets import GroupedMesh
from .sides import OutlineSide, Point, nearer, winds_about

EDGE_FACTOR = 1.0 + 1e-9
"""Edge imposed on netgen, over the wanted one: a side of n edges exactly shall not be split into n + 1 by rounding."""


class Triangulation(NamedTuple):
    """Result of netgen: `regions` are domains, from 1 on; `pieces` the line, start and end of each edge on one."""

    points: np.ndarray
    triangles: np.ndarray
    regions: np.ndarray
    pieces: list[tuple[int, int, int]]


def triangulate(
    points: np.ndarray,
    lines: Sequence[tuple[int, int, int, int]],
    what: str,
    remedy: str,
    sizes: Sequence[float] | None = None,
    region_sizes: Mapping[int, float] | None = None,
    **options: float,
) -> Triangulation:
    """Triangulate inside lines, by netgen's advancing front.

    `lines` are start, end, left and right domain. Lengths must be about 1: netgen's own tolerances are absolute.
    """
    from netgen.geom2d import SplineGeometry  # here, since only a mesh of this type should pay for it
    from netgen.meshing import NgException

    outline = SplineGeometry()
    for (x, y), size in zip(points, [1e99] * len(points) if sizes is None else sizes):
        outline.AppendPoint(x, y, maxh=size)
    for number, (start, end, left, right) in enumerate(lines):
        outline.Append(["line", start, end], leftdomain=left, rightdomain=right, bc=number + 1)
    for region, size in (region_sizes or {}).items():
        outline.SetDomainMaxH(region, size)
    try:
        made = outline.GenerateMesh(**options)
    except NgException as error:
        raise MeshError(f"netgen cannot mesh {what}: {error}; {remedy}") from None
    elements, placed = made.Elements2D(), np.array([point.p for point in made.Points()])[:, :2]
    triangles = np.array([[vertex.nr - 1 for vertex in element.vertices] for element in elements], dtype=np.int64)
    return Triangulation(
        placed,
        upright(placed, triangles.reshape(-1, 3)),
        np.array([element.index for element in elements], dtype=np.int64),
        [(one.index - 1, *(vertex.nr - 1 for vertex in one.points)) for one in made.Elements1D()],
    )


@mesh_type("free", order=20, row_height=ROW_HEIGHT)
def free(length: float, height: float, size: float) -> Mesh:
    """Delaunay triangulation inside an outline of imposed edge size, by netgen's advancing front."""
    check_box(length, height, size)
    # Lengths in units of the edge: netgen's own tolerances are absolute.
    size = min(size, max(length, height))  # a side of less than an edge is one edge, and netgen bears no tiny boxes
    box = np.array([length, height]) / size
    corners = box * [(0, 0), (1, 0), (1, 1), (0, 1)]
    lines, what = [(i, (i + 1) % 4, 1, 0) for i in range(4)], f"{length:g} x {height:g} m at {size:g} m"
    made = triangulate(corners, lines, what, "give another size", maxh=EDGE_FACTOR)
    points = made.points
    for axis in range(2):
        points[np.abs(points[:, axis]) < 1e-9, axis] = 0.0
        points[np.abs(points[:, axis] - box[axis]) < 1e-9 * box[axis], axis] = box[axis]
    return Mesh(points * (np.array([length, height]) / box), made.triangles)


LEAST_EDGES_A_TURN = 6
"""Fewest edges of a full turn of an arc, so that a small hole remains."""

LEAST_SIZE_SHARE = 4e-6
"""Smallest mesh size over the extent of a shape: netgen merges points a millionth apart."""

GRADING = 0.3
"""How much longer edges get over the distance from shorter ones, at most: netgen's."""

LINE_SIZE_SHARE = 0.6
"""Length of a line over the mesh size that netgen takes it for, at least: 1 would divide edges next to shorter ones."""

MOST_ROUNDS = 20
"""Most times that a mesh is made anew because netgen divided edges of arcs."""


Outlined = Any
"""A `springtune.Shape`, which is of a room above."""


@dataclass(frozen=True)
class _Stretch:
    """An edge-to-be of the outline: a stretch of a side."""

    side: OutlineSide
    low: float
    high: float
    inner: int
    outer: int

    def cut(self, parameters: Sequence[float]) -> list["_Stretch"]:
        """Stretches between parameters, of which the first and the last are its ends."""
        return [replace(self, low=low, high=high) for low, high in zip(parameters, parameters[1:])]


def mesh_shape(shape: Outlined, size: float, refined: Mapping[str, float] | None = None) -> GroupedMesh:
    """Mesh a shape by netgen; lengths in m. Same input, same mesh; see `springtune.mesh_shape`."""
    what = f"shape '{shape.name}'"
    if not shape.rounds:
        raise MeshError(f"{what}: its mesh is that of the file {shape.file}; read it with springtune.read_shape")
    sizes = _sizes(shape, size, dict(refined or {}), what)
    stretches, lines, fine = _divide_sides(shape, sizes)
    (left, low), _ = shape.extent
    origin = np.array([left, low])
    regions = [one.inner for one in shape.rounds]
    for _ in range(MOST_ROUNDS):
        made, chains, divided = _netgen(stretches, lines, fine, sizes, regions, origin, what)
        if not any(stretches[number].side.arc for number in divided):
            break
        again: list[_Stretch] = []
        for number, stretch in enumerate(stretches):
            shares = divided.get(number, []) if stretch.side.arc else []
            cuts = [stretch.low + share * (stretch.high - stretch.low) for share in (0.0, *shares)] + [stretch.high]
            again += stretch.cut(cuts)
        stretches = again
    else:
        raise MeshError(f"{what}: netgen divides its arcs on and on at {size:g} m; give another size")
    return _group_mesh(shape, made, chains, stretches, regions)


def _sizes(shape: Outlined, size: float, refined: dict[str, float], what: str) -> dict[str, float]:
    """Mesh size by the name of what is refined, ``""`` for all else [m]."""
    (left, low), (right, high) = shape.extent
    lengths: dict[str, float] = defaultdict(float)
    for one in shape.rounds:
        for side in one.sides:
            lengths[side.group] += side.length_to(1.0)
    known = {*lengths, *shape.points, *(one.inner for one in shape.rounds)} - {"", None}
    for name, value in {"": size, **refined}.items():
        told = f"refined {name!r}" if name else "mesh size"
        if not value > 0:
            raise MeshError(f"{told}: {value!r} is not a number above zero; give one in m")
        if name and name not in known:
            there = ", ".join(sorted(map(str, known))) or "none"
            raise MeshError(f"{told}: {what} has no side, point or part of that name; known: {there}")
        if name and value < LEAST_SIZE_SHARE * max(right - left, high - low):
            raise MeshError(f"{told}: {value!r} is less than some millionths of {what}; give more")
        if value > size:
            raise MeshError(f"{told}: {value!r} is larger than the mesh size, {size!r}; give at most that")
    smaller = min(right - left, high - low)
    if size > smaller:
        raise MeshError(f"mesh size: {size!r} is larger than {what}; give at most its smaller extent, {smaller:g}")
    count = shape.area / (ROW_HEIGHT * size**2) + 0.5 * sum(lengths.values()) / size
    for name, value in refined.items():
        part = sum(one.area for one in shape.rounds if one.inner == name)
        count += part / (ROW_HEIGHT * value**2) + 4 * lengths.get(name, value) / value
    refusal = too_many(count, min([size, *refined.values()]), smaller, what)
    if refusal:
        raise MeshError(f"mesh size: {size!r}{f' with {refined}' if refined else ''} {refusal}")
    return {"": size, **refined}


def _divide_sides(
    shape: Outlined, sizes: Mapping[str, float]
) -> tuple[list[_Stretch], list[tuple[Point, Point, int]], dict[Point, float]]:
    """Stretches of the outlines, one for each edge; lines from points on none; and sizes at all named points."""
    (left, low), (right, high) = shape.extent
    small = 1e-9 * max(right - left, high - low)
    inside = dict(shape.points)
    stretches = []
    fine: dict[Point, float] = {}
    for number, one in enumerate(shape.rounds):
        outer = 0 if one.around is None else 1 + one.around
        inner = 0 if one.inner is None else 1 + number
        for side in one.sides:
            cuts = {0.0, 1.0}
            size = min(sizes.get(name, sizes[""]) for name in (side.group, one.inner or "", one.outer or ""))
            for name, point in shape.points.items():
                parameter = side.parameter_near(point, small)
                if parameter is not None:
                    inside.pop(name, None)
                    parameter = next((end for end in (0.0, 1.0) if math.dist(point, side.at(end)) <= small), parameter)
                    cuts.add(parameter)
                    place = side.at(parameter)
                    fine[place] = min(sizes.get(name, size), fine.get(place, size))
            places = sorted(cuts)
            for begin, end in zip(places, places[1:]):
                # A hair less: a side of exactly n edges shall not be split into n + 1 by rounding.
                count = math.ceil((side.length_to(end) - side.length_to(begin)) / size * (1 - 1e-9))
                if side.arc:
                    turn = abs(side.arc[3]) * (end - begin)
                    count = max(count, math.ceil(LEAST_EDGES_A_TURN * turn / (2 * math.pi) * (1 - 1e-9)))
                ends = side.divided(max(count, 1), begin, end)
                stretches += _Stretch(side, begin, end, inner, outer).cut(ends)
    fine |= {point: sizes.get(name, sizes[""]) for name, point in inside.items()}
    return (
        _separate_chords(stretches, shape.name),
        _lines(shape, {point: fine[point] for point in inside.values()}),
        fine,
    )


def _separate_chords(stretches: list[_Stretch], name: str) -> list[_Stretch]:
    """Stretches of arcs halved until their chords are well apart from other ones: walls may be thin."""
    for _ in range(MOST_ROUNDS):
        numbers: dict[Point, int] = {}
        edges = np.array([[numbers.setdefault(one.side.at(end), len(numbers)) for end in (one.low, one.high)]
                          for one in stretches])  # fmt: skip
        aside = np.array([one.side.aside(one.low, one.high) for one in stretches])
        one, other, _ = nearer(np.array(list(numbers)), edges, 3 * aside)
        halved = {*one[aside[one] > 0].tolist(), *other[aside[other] > 0].tolist()}
        if not halved:
            return stretches
        found = []
        for number, stretch in enumerate(stretches):
            ends = stretch.side.divided(2 if number in halved else 1, stretch.low, stretch.high)
            found += stretch.cut(ends)
        stretches = found
    raise MeshError(f"shape '{name}': arcs are too near to others to be meshed; keep them apart")


def _lines(shape: Outlined, points: Mapping[Point, float]) -> list[tuple[Point, Point, int]]:
    """Lines of one edge from points inside the body, and their regions: netgen places particles on lines only."""
    sides = [side for one in shape.rounds for side in one.sides]
    found = []
    for point, size in points.items():
        others = [other for other in points if other != point]

        def room(place: Point, others: list[Point] = others) -> float:
            """Distance to the next side, or half of that to the next other point, whose line is shorter [m]."""
            return min([side.nearest(place)[1] for side in sides] + [0.5 * math.dist(place, one) for one in others])

        # Halved until an end has room around it; a circle of this radius has nothing in it.
        length, end = 2 * min(size, room(point)), point
        while room(end) < 0.5 * length or end == point:
            length *= 0.5
            ways = [(length * math.cos(turn), length * math.sin(turn)) for turn in (i * math.pi / 6 for i in range(12))]
            ends = [(point[0] + x, point[1] + y) for x, y in ways]
            end = max(ends, key=room)
        around = [i for i, one in enumerate(shape.rounds) if winds_about(one.sides, point)]
        found.append((point, end, 1 + min(around, key=lambda i: shape.rounds[i].area)))
    return found


def _netgen(
    stretches: Sequence[_Stretch],
    lines: Sequence[tuple[Point, Point, int]],
    fine: Mapping[Point, float],
    sizes: Mapping[str, float],
    regions: Sequence[str | None],
    origin: np.ndarray,
    what: str,
) -> tuple[Triangulation, list[list[int]], dict[int, list[float]]]:
    """Triangulation inside stretches [m], the points in order along each, and shares where stretches are divided."""
    from scipy.spatial import cKDTree  # here, since studies are read without scipy

    # Lengths in units of the edge: netgen's own tolerances are absolute.
    unit = sizes[""]
    pairs = [(stretch.side.at(stretch.low), stretch.side.at(stretch.high)) for stretch in stretches]
    pairs += [(start, end) for start, end, _ in lines]
    numbers = {point: number for number, point in enumerate(dict.fromkeys(point for pair in pairs for point in pair))}
    joined = [(numbers[start], numbers[end]) for start, end in pairs]
    domains = [(stretch.inner, stretch.outer) for stretch in stretches] + [(region, region) for _, _, region in lines]
    made = triangulate(
        (np.array(list(numbers)) - origin) / unit,
        [(*ends, *sides) for ends, sides in zip(joined, domains)],
        f"{what} at {unit:g} m",
        "give another size",
        sizes=[fine.get(point, unit) / unit for point in numbers],
        region_sizes={
            number: sizes[region] / unit for number, region in enumerate(regions, 1) if region and region in sizes
        },
        maxh=EDGE_FACTOR,
        grading=GRADING,
        segmentsperedge=LINE_SIZE_SHARE,
    )
    points = made.points
    given = (np.array(list(numbers)) - origin) / unit
    # Where two are near each other, netgen numbers them otherwise.
    away, order = cKDTree(points).query(given)
    if not len(made.triangles) or away.max() > 1e-9 * np.abs(given).max() or len(np.unique(order)) < len(order):
        raise MeshError(f"netgen cannot mesh {what} at {unit:g} m: points are too near each other; give another size")
    pieces: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for line, first, second in made.pieces:
        pieces[line].append((first, second))
    chains, divided = [], {}
    corner = dict(zip(numbers.values(), order.tolist()))
    for number in range(len(stretches)):
        following = dict(pieces[number])
        chain = [corner[joined[number][0]]]
        while chain[-1] in following and len(chain) <= len(following):
            chain.append(following[chain[-1]])
        if chain[-1] != corner[joined[number][1]] or len(chain) != len(following) + 1:
            raise MeshError(f"netgen cannot mesh {what} at {unit:g} m: a side is not closed; give another size")
        chains.append(chain)
        if len(chain) > 2:
            start, along = points[chain[0]], points[chain[-1]] - points[chain[0]]
            divided[number] = [float((points[i] - start) @ along / (along @ along)) for i in chain[1:-1]]
    placed = points * unit + origin
    placed[order] = list(numbers)
    for number, shares in divided.items():
        stretch = stretches[number]
        for i, share in zip(chains[number][1:], shares):
            placed[i] = stretch.side.at(stretch.low + share * (stretch.high - stretch.low))
    return made._replace(points=placed), chains, divided


def _group_mesh(
    shape: Outlined,
    made: Triangulation,
    chains: list[list[int]],
    stretches: Sequence[_Stretch],
    regions: Sequence[str | None],
) -> GroupedMesh:
    """A mesh with the groups of its shape, refused where triangles do not fill the outline."""
    areas = signed_areas(made.points, made.triangles)
    # About a corner: coordinates far from the origin would cost digits.
    ends = made.points[[pair for chain in chains for pair in zip(chain, chain[1:])]] - made.points[0]
    senses = [bool(one.inner) - bool(one.outer) for one, chain in zip(stretches, chains) for _ in chain[1:]]
    within = 0.5 * float((ends[:, 0, 0] * ends[:, 1, 1] - ends[:, 1, 0] * ends[:, 0, 1]) @ senses)
    if abs(np.abs(areas).sum() - within) > 1e-9 * within:
        raise MeshError(f"netgen does not fill shape '{shape.name}'; give another size")
    sides: dict[str, list[Any]] = defaultdict(list)
    for stretch, chain in zip(stretches, chains):
        if stretch.side.group:
            pairs = list(zip(chain, chain[1:]))
            sides[stretch.side.group] += pairs if stretch.inner else [pair[::-1] for pair in pairs]
    parts: dict[str, np.ndarray] = {}
    for number, region in enumerate(regions):
        if region:
            parts[region] = parts.get(region, False) | (made.regions == number + 1)
    return GroupedMesh(
        Mesh(made.points, made.triangles),
        {name: np.array(edges, dtype=np.int64) for name, edges in sides.items()},
        {name: np.array(point) for name, point in shape.points.items()},
        {name: {3: cells} for name, cells in parts.items()},
    )

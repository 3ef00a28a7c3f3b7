"""Delaunay triangulations by netgen: of boxes (mesh type ``free``), and of shapes with arcs, holes and inclusions."""

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from .cells import Mesh, MeshError, check_box, counter_clockwise, mesh_type, signed_areas, too_many
from .rows import ROW_HEIGHT
from .sheets import GroupedMesh
from .sides import Point, Stretch, near_edges, winds_about

EDGE_FACTOR = 1.0 + 1e-9
"""Edge imposed on netgen, over the requested one: rounding must not split a side of exactly n edges into n + 1."""


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
    sizes: Sequence[float] | None = None,
    region_sizes: Mapping[int, float] | None = None,
    remedy: str = "give another size",
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
        counter_clockwise(placed, triangles.reshape(-1, 3)),
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
    made = triangulate(corners, lines, what, maxh=EDGE_FACTOR)
    points = made.points
    for axis in range(2):
        points[np.abs(points[:, axis]) < 1e-9, axis] = 0.0
        points[np.abs(points[:, axis] - box[axis]) < 1e-9 * box[axis], axis] = box[axis]
    return Mesh(points * (np.array([length, height]) / box), made.triangles)


LEAST_EDGES_A_TURN = 6  # fewest edges of a full turn of an arc, so that a small hole remains

LEAST_SIZE_SHARE = 4e-6  # smallest mesh size over the extent of a shape: netgen merges points a millionth apart

GRADING = 0.3  # how much longer edges get over the distance from shorter ones, at most: netgen's

LINE_SIZE_SHARE = 0.6
"""Length of a line over the mesh size that netgen takes it for, at least: 1 would divide edges next to shorter ones."""

MOST_ROUNDS = 20  # most times that a mesh is made anew because netgen divided edges of arcs


Outlined = Any  # A `springtune.Shape`, which is of a room above


def mesh_shape(shape: Outlined, size: float, refined: Mapping[str, float] | None = None) -> GroupedMesh:
    """Mesh a shape by netgen; lengths in m. Same input, same mesh; see `springtune.mesh_shape`."""
    what = f"shape '{shape.name}'"
    if not shape.rounds:
        raise MeshError(f"{what}: its mesh is that of the file {shape.file}; read it with springtune.read_shape")
    sizes = _sizes(shape, size, dict(refined or {}), what)
    stretches, lines, fine = _divide_sides(shape, sizes)
    for _ in range(MOST_ROUNDS):
        made, chains, divided = _netgen(shape, stretches, lines, fine, sizes)
        if not any(stretches[number].side.arc for number in divided):
            return _group_mesh(shape, made, chains, stretches)
        inner = [divided.get(number, ()) if one.side.arc else () for number, one in enumerate(stretches)]
        stretches = [piece for one, cuts in zip(stretches, inner) for piece in one.cut([one.low, *cuts, one.high])]
    raise MeshError(f"{what}: netgen divides its arcs on and on at {size:g} m; give another size")


def _sizes(shape: Outlined, size: float, refined: dict[str, float], what: str) -> dict[str, float]:
    """Mesh size [m] by the name of a refined group, point or part; ``""`` for all else."""
    smaller, larger = sorted(np.ptp(shape.extent, axis=0).tolist())
    lengths: dict[str, float] = defaultdict(float)
    for one in shape.rounds:
        for side in one.sides:
            lengths[side.group] += side.length_to(1.0)
    known = {*lengths, *shape.points, *(one.inner for one in shape.rounds)} - {"", None}
    for name, value in {"": size, **refined}.items():
        where = f"refined {name!r}" if name else "mesh size"
        if name and name not in known:
            there = ", ".join(sorted(map(str, known))) or "none"
            raise MeshError(f"{where}: {what} has no side, point or part of that name; known: {there}")
        if name and value < LEAST_SIZE_SHARE * larger:
            raise MeshError(f"{where}: {value!r} is less than some millionths of {what}; give more")
        if value > size:
            raise MeshError(f"{where}: {value!r} is larger than the mesh size, {size!r}; give at most that")
    if size > smaller:
        raise MeshError(f"mesh size: {size!r} is larger than {what}; give at most its smaller extent, {smaller:g}")
    count = shape.area / (ROW_HEIGHT * size**2) + 0.5 * sum(lengths.values()) / size
    for name, value in refined.items():
        part = sum(one.area for one in shape.rounds if one.inner == name)
        count += part / (ROW_HEIGHT * value**2) + 4 * lengths.get(name, value) / value
    if refusal := too_many(count, min([size, *refined.values()]), smaller, what):
        raise MeshError(f"mesh size: {size!r}{f' with {refined}' if refined else ''} {refusal}")
    return {"": size, **refined}


Line = tuple[Point, Point, int]  # start and end of a line of one edge [m], and its region


def _divide_sides(shape: Outlined, sizes: Mapping[str, float]) -> tuple[list[Stretch], list[Line], dict[Point, float]]:
    """Stretches of the outlines, one for each edge; lines from points on none; and sizes at all named points."""
    small = 1e-9 * np.ptp(shape.extent, axis=0).max()
    inside = dict(shape.points)
    stretches = []
    fine: dict[Point, float] = {}
    for number, one in enumerate(shape.rounds):
        outer = 0 if one.around is None else 1 + one.around
        inner = 0 if one.inner is None else 1 + number
        for side in one.sides:
            size = min(sizes.get(name, sizes[""]) for name in (side.group, one.inner or "", one.outer or ""))
            on_it = side.find_points(shape.points, small)
            for name, parameter in on_it.items():
                inside.pop(name, None)
                place = side.at(parameter)
                fine[place] = min(sizes.get(name, size), fine.get(place, size))
            for begin, end in pairwise(sorted({0.0, 1.0, *on_it.values()})):
                # A hair less: a side of exactly n edges shall not be split into n + 1 by rounding.
                count = math.ceil((side.length_to(end) - side.length_to(begin)) / size * (1 - 1e-9))
                if side.arc:
                    turn = abs(side.arc[3]) * (end - begin)
                    count = max(count, math.ceil(LEAST_EDGES_A_TURN * turn / (2 * math.pi) * (1 - 1e-9)))
                stretches += Stretch(side, begin, end, inner, outer).divided(max(count, 1))
    fine |= {point: sizes.get(name, sizes[""]) for name, point in inside.items()}
    lines = _lines(shape, {point: fine[point] for point in inside.values()})
    return _separate_chords(stretches, shape.name), lines, fine


def _separate_chords(stretches: list[Stretch], name: str) -> list[Stretch]:
    """Stretches of arcs halved until their chords are well apart from other ones: walls may be thin."""
    for _ in range(MOST_ROUNDS):
        numbers: dict[Point, int] = {}
        edges = np.array([[numbers.setdefault(one.side.at(end), len(numbers)) for end in (one.low, one.high)]
                          for one in stretches])  # fmt: skip
        aside = np.array([one.side.chord_distance(one.low, one.high) for one in stretches])
        near = near_edges(np.array(list(numbers)), edges, 3 * aside)
        halved = {*near[aside[near] > 0].tolist()}
        if not halved:
            return stretches
        stretches = [piece for i, one in enumerate(stretches) for piece in (one.divided(2) if i in halved else [one])]
    raise MeshError(f"shape '{name}': arcs are too near to others to be meshed; keep them apart")


def _lines(shape: Outlined, points: Mapping[Point, float]) -> list[Line]:
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
            ways = [(math.cos(turn), math.sin(turn)) for turn in (i * math.pi / 6 for i in range(12))]
            end = max([(point[0] + length * x, point[1] + length * y) for x, y in ways], key=room)
        around = [i for i, one in enumerate(shape.rounds) if winds_about(one.sides, point)]
        found.append((point, end, 1 + min(around, key=lambda i: shape.rounds[i].area)))
    return found


def _netgen(
    shape: Outlined,
    stretches: Sequence[Stretch],
    lines: Sequence[Line],
    fine: Mapping[Point, float],
    sizes: Mapping[str, float],
) -> tuple[Triangulation, list[list[int]], dict[int, list[float]]]:
    """Triangulation inside stretches [m], the points in order along each, and shares where stretches are divided."""
    from scipy.spatial import cKDTree  # here, since studies are read without scipy

    # Lengths in units of the edge: netgen's own tolerances are absolute.
    unit, origin = sizes[""], np.array(shape.extent[0])
    what = f"shape '{shape.name}' at {unit:g} m"
    pairs = [(stretch.side.at(stretch.low), stretch.side.at(stretch.high)) for stretch in stretches]
    pairs += [(start, end) for start, end, _ in lines]
    numbers = {point: number for number, point in enumerate(dict.fromkeys(point for pair in pairs for point in pair))}
    joined = [(numbers[start], numbers[end]) for start, end in pairs]
    domains = [(stretch.left, stretch.right) for stretch in stretches] + [(region, region) for _, _, region in lines]
    given, parts = (np.array(list(numbers)) - origin) / unit, enumerate((one.inner for one in shape.rounds), 1)
    made = triangulate(
        given,
        [(*ends, *sides) for ends, sides in zip(joined, domains)],
        what,
        sizes=[fine.get(point, unit) / unit for point in numbers],
        region_sizes={number: sizes[part] / unit for number, part in parts if part and part in sizes},
        maxh=EDGE_FACTOR,
        grading=GRADING,
        segmentsperedge=LINE_SIZE_SHARE,
    )
    points = made.points
    # Where two are near each other, netgen numbers them otherwise.
    away, order = cKDTree(points).query(given)
    if not len(made.triangles) or away.max() > 1e-9 * np.abs(given).max() or len(np.unique(order)) < len(order):
        raise MeshError(f"netgen cannot mesh {what}: points are too near each other; give another size")
    pieces: dict[int, dict[int, int]] = defaultdict(dict)
    for line, first, second in made.pieces:
        pieces[line][first] = second
    chains, divided, corner = [], {}, order.tolist()
    for number, one in enumerate(stretches):
        following = pieces[number]
        chain = [corner[joined[number][0]]]
        while chain[-1] in following and len(chain) <= len(following):
            chain.append(following[chain[-1]])
        if chain[-1] != corner[joined[number][1]] or len(chain) != len(following) + 1:
            raise MeshError(f"netgen cannot mesh {what}: a side is not closed; give another size")
        chains.append(chain)
        if len(chain) > 2:
            start, along = points[chain[0]], points[chain[-1]] - points[chain[0]]
            shares = [float((points[i] - start) @ along / (along @ along)) for i in chain[1:-1]]
            divided[number] = [one.low + share * (one.high - one.low) for share in shares]
    placed = points * unit + origin
    placed[order] = list(numbers)
    for number, parameters in divided.items():
        for i, parameter in zip(chains[number][1:], parameters):
            placed[i] = stretches[number].side.at(parameter)
    return made._replace(points=placed), chains, divided


def _group_mesh(
    shape: Outlined, made: Triangulation, chains: list[list[int]], stretches: Sequence[Stretch]
) -> GroupedMesh:
    """A mesh with the groups of its shape, refused where triangles do not fill the outline."""
    # About a corner: coordinates far from the origin would cost digits.
    ends = made.points[[pair for one in chains for pair in pairwise(one)]] - made.points[0]
    senses = [bool(one.left) - bool(one.right) for one, chain in zip(stretches, chains) for _ in chain[1:]]
    within = 0.5 * float((ends[:, 0, 0] * ends[:, 1, 1] - ends[:, 1, 0] * ends[:, 0, 1]) @ senses)
    if abs(np.abs(signed_areas(made.points, made.triangles)).sum() - within) > 1e-9 * within:
        raise MeshError(f"netgen does not fill shape '{shape.name}'; give another size")
    sides: dict[str, list[Any]] = defaultdict(list)
    for stretch, points in zip(stretches, chains):
        if stretch.side.group:
            sides[stretch.side.group] += [pair if stretch.left else pair[::-1] for pair in pairwise(points)]
    parts: dict[str, np.ndarray] = {}
    for number, one in enumerate(shape.rounds, 1):
        if one.inner:
            parts[one.inner] = parts.get(one.inner, False) | (made.regions == number)
    return GroupedMesh(
        Mesh(made.points, made.triangles),
        {name: np.array(edges, dtype=np.int64) for name, edges in sides.items()},
        {name: np.array(point) for name, point in shape.points.items()},
        {name: {3: cells} for name, cells in parts.items()},
    )

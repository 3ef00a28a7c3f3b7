"""Meshes of shapes: Delaunay triangulations inside outlines with arcs, holes and inclusions."""

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any, Protocol

import numpy as np

from .cells import Mesh, MeshError, signed_areas
from .groups import GroupedMesh
from .rows import ROW_HEIGHT
from .types import too_many

Point = tuple[float, float]
"""Coordinates [m]."""

LEAST_AROUND = 6
"""Fewest edges of a full turn of an arc: a small hole stays one."""

GRADING = 0.3
"""How much longer edges get over the distance from shorter ones, at most: netgen's."""

MOST_ROUNDS = 20
"""Most times that a mesh is made anew because netgen divided edges of arcs."""


class OutlineSide(Protocol):
    """A side, see `springtune.problem.outlines.OutlineSide`."""

    @property
    def group(self) -> str: ...  # noqa: D102
    @property
    def arc(self) -> tuple[float, float, float, float] | None: ...  # noqa: D102
    def at(self, parameter: float) -> Point: ...  # noqa: D102
    def length_to(self, parameter: float) -> float: ...  # noqa: D102
    def divided(self, count: int, low: float, high: float) -> list[float]: ...  # noqa: D102
    def nearest(self, point: Point) -> tuple[float, float]: ...  # noqa: D102


class Round(Protocol):
    """A closed round of sides, see `springtune.problem.outlines.Round`."""

    @property
    def sides(self) -> Sequence[OutlineSide]: ...  # noqa: D102
    @property
    def inner(self) -> str | None: ...  # noqa: D102
    @property
    def outer(self) -> str | None: ...  # noqa: D102
    @property
    def area(self) -> float: ...  # noqa: D102
    def winds_about(self, point: Point) -> bool: ...  # noqa: D102


class Outlined(Protocol):
    """What can be meshed: a `springtune.Shape`."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def file(self) -> str: ...  # noqa: D102
    @property
    def rounds(self) -> Sequence[Round]: ...  # noqa: D102
    @property
    def points(self) -> Mapping[str, Point]: ...  # noqa: D102
    @property
    def area(self) -> float: ...  # noqa: D102
    @property
    def extent(self) -> tuple[Point, Point]: ...  # noqa: D102


@dataclass(frozen=True)
class _Stretch:
    """An edge-to-be of the outline: a stretch of a side."""

    side: OutlineSide
    low: float
    high: float
    inner: int
    outer: int


def mesh_shape(
    shape: Outlined, size: float, mesh_type: str = "free", refined: Mapping[str, float] | None = None
) -> GroupedMesh:
    """Mesh a shape.

    Each side is divided into equal edges no longer than `size`, an arc into at least six edges a full turn, with its
    particles on the arc; where much shorter ones are near, edges are divided further. Named points are particles.
    Inside, netgen places points so that triangles come out near-equilateral. Same input, same mesh.

    Parameters
    ----------
    shape : Shape
    size : float
        Length of edges [m].
    mesh_type : str, optional
        ``"free"``: no other one meshes an outline.
    refined : mapping of str to float, optional
        Shorter edges at groups of sides, at points and in parts, by their name [m]; from there on they grow.

    Returns
    -------
    GroupedMesh

    Raises
    ------
    MeshError
        If the shape is that of a file, the mesh type another one, a size absurd or no number, or netgen fails.
    """
    what = f"shape '{shape.name}'"
    if not shape.rounds:
        raise MeshError(f"{what}: its mesh is that of the file {shape.file}; read it with springtune.read_shape")
    if mesh_type != "free":
        raise MeshError(f"mesh type: {mesh_type!r} fills rectangles, and {what} has an outline of its own; give 'free'")
    sizes = _sizes(shape, size, dict(refined or {}), what)
    stretches, inner_points = _divided(shape, sizes)
    (left, low), _ = shape.extent
    origin = np.array([left, low])
    regions = [one.inner for one in shape.rounds]
    for _ in range(MOST_ROUNDS):
        made = _netgen(stretches, inner_points, sizes, regions, origin, what)
        arcs_divided = [n for n, found in made.divided.items() if stretches[n].side.arc]
        if not arcs_divided:
            break
        again: list[_Stretch] = []
        for number, stretch in enumerate(stretches):
            shares = made.divided.get(number, []) if stretch.side.arc else []
            cuts = [stretch.low + share * (stretch.high - stretch.low) for share in (0.0, *shares)] + [stretch.high]
            again += [_Stretch(stretch.side, *pair, stretch.inner, stretch.outer) for pair in zip(cuts, cuts[1:])]
        stretches = again
    else:
        raise MeshError(f"{what}: netgen divides its arcs on and on at {size:g} m; give another size")
    return _grouped(shape, made, stretches, regions)


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
        if not (isinstance(value, Real) and not isinstance(value, bool) and 1e-40 <= value <= 1e40):
            raise MeshError(f"{told}: {value!r} is not a number above zero; give one in m")
        if name and name not in known:
            there = ", ".join(sorted(map(str, known))) or "none"
            raise MeshError(f"{told}: {what} has no side, point or part of that name; known: {there}")
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
        raise MeshError(f"mesh size: {size!r} {refusal}")
    return {"": size, **refined}


def _divided(
    shape: Outlined, sizes: Mapping[str, float]
) -> tuple[list[_Stretch], list[tuple[Point, Point, float, int]]]:
    """Stretches of the outlines, one for each edge, and lines through points that are on none."""
    (left, low), (right, high) = shape.extent
    small = 1e-9 * max(right - left, high - low)
    inside = dict(shape.points)
    stretches = []
    areas = [one.area for one in shape.rounds]
    for number, one in enumerate(shape.rounds):
        # What is around a round is the smallest one that winds about it.
        outer = 0
        if one.outer is not None:
            around = [
                i for i, other in enumerate(shape.rounds) if i != number and other.winds_about(one.sides[0].at(0.0))
            ]
            outer = 1 + min(around, key=areas.__getitem__)
        inner = 0 if one.inner is None else 1 + number
        for side in one.sides:
            cuts = {0.0, 1.0}
            size = min(sizes.get(name, sizes[""]) for name in (side.group, one.inner or "", one.outer or ""))
            for name, point in shape.points.items():
                parameter, distance = side.nearest(point)
                if distance <= small:
                    inside.pop(name, None)
                    if min(math.dist(point, side.at(end)) for end in (0.0, 1.0)) > small:
                        cuts.add(parameter)
            places = sorted(cuts)
            for begin, end in zip(places, places[1:]):
                # A hair less: a side of exactly n edges shall not be split into n + 1 by rounding.
                count = math.ceil((side.length_to(end) - side.length_to(begin)) / size * (1 - 1e-9))
                if side.arc:
                    turn = abs(side.arc[3]) * (end - begin)
                    count = max(count, math.ceil(LEAST_AROUND * turn / (2 * math.pi) * (1 - 1e-9)))
                ends = side.divided(max(count, 1), begin, end)
                stretches += [_Stretch(side, *pair, inner, outer) for pair in zip(ends, ends[1:])]
    return stretches, _lines(shape, inside, sizes, areas)


def _lines(
    shape: Outlined, points: Mapping[str, Point], sizes: Mapping[str, float], areas: Sequence[float]
) -> list[tuple[Point, Point, float, int]]:
    """A line of one edge from each point inside the body, in its region: only lines make netgen place a particle."""
    sides = [side for one in shape.rounds for side in one.sides]
    found = []
    for name, point in points.items():
        others = [0.5 * math.dist(point, other) for key, other in points.items() if key != name]
        clear = min([side.nearest(point)[1] for side in sides] + others)
        size = sizes.get(name, sizes[""])
        length = min(size, clear)
        # The way on which there is most room.
        ends = [(point[0] + length * math.cos(angle), point[1] + length * math.sin(angle))
                for angle in (math.pi / 6 * i for i in range(12))]  # fmt: skip
        room = [
            min(
                [side.nearest(end)[1] for side in sides]
                + [0.5 * math.dist(end, other) for key, other in points.items() if key != name]
            )
            for end in ends
        ]
        best = max(range(12), key=lambda i: (room[i] > 0.5 * length, -i) if max(room) > 0.5 * length else (room[i], -i))
        end = ends[best]
        if room[best] < 0.25 * length:
            end = point[0] + 0.5 * (end[0] - point[0]), point[1] + 0.5 * (end[1] - point[1])
        around = [i for i, one in enumerate(shape.rounds) if one.winds_about(point)]
        found.append((point, end, size, 1 + min(around, key=areas.__getitem__)))
    return found


@dataclass(frozen=True, eq=False)
class _Made:
    """What netgen made: points in m, triangles, their regions, and the points in order along each stretch."""

    points: np.ndarray
    triangles: np.ndarray
    regions: np.ndarray
    chains: list[list[int]]
    divided: dict[int, list[float]]


def _netgen(
    stretches: Sequence[_Stretch],
    lines: Sequence[tuple[Point, Point, float, int]],
    sizes: Mapping[str, float],
    regions: Sequence[str | None],
    origin: np.ndarray,
    what: str,
) -> _Made:
    """Triangulation inside stretches, by netgen's advancing front."""
    from netgen.geom2d import SplineGeometry  # here, since only a mesh of this type should pay for it
    from netgen.meshing import NgException

    # Lengths in units of the edge: netgen's own tolerances are absolute.
    unit = sizes[""]
    outline = SplineGeometry()
    corners = [stretch.side.at(stretch.low) for stretch in stretches]
    numbers: dict[Point, int] = {}
    ends = [stretch.side.at(stretch.high) for stretch in stretches]
    lines_ends = [(start, end) for start, end, _, _ in lines]
    pairs = [*zip(corners, ends), *lines_ends]
    fine = {start: size for start, _, size, _ in lines}
    for point in (point for pair in pairs for point in pair):
        if point not in numbers:
            x, y = (np.array(point) - origin) / unit
            numbers[point] = outline.AppendPoint(x, y, maxh=fine.get(point, unit) / unit)
    joined = [(numbers[start], numbers[end]) for start, end in pairs]
    domains = [(stretch.inner, stretch.outer) for stretch in stretches] + [(region, region) for *_, region in lines]
    for number, ((start, end), (inner, outer)) in enumerate(zip(joined, domains)):
        outline.Append(["line", start, end], leftdomain=inner, rightdomain=outer, bc=number + 1)
    for number, region in enumerate(regions):
        if region and region in sizes:
            outline.SetDomainMaxH(number + 1, sizes[region] / unit)
    try:
        made = outline.GenerateMesh(maxh=1.0 + 1e-9, grading=GRADING)
    except NgException as error:
        raise MeshError(f"netgen cannot mesh {what} at {unit:g} m: {error}; give another size") from None
    points = np.array([point.p for point in made.Points()])[:, :2]
    elements = made.Elements2D()
    triangles = np.array([[vertex.nr - 1 for vertex in element.vertices] for element in elements], dtype=np.int64)
    found = np.array([element.index for element in elements], dtype=np.int64)
    given = (np.array(list(numbers)) - origin) / unit
    if (
        len(points) < len(given)
        or np.abs(points[: len(given)] - given).max() > 1e-9 * np.abs(given).max()
        or not len(triangles)
    ):
        raise MeshError(f"netgen cannot mesh {what} at {unit:g} m: it moves corners; give another size")
    pieces: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for element in made.Elements1D():
        first, second = (vertex.nr - 1 for vertex in element.points)
        pieces[element.index - 1].append((first, second))
    chains, divided = [], {}
    order = {number: i for i, number in enumerate(numbers.values())}
    for number in range(len(stretches)):
        following = dict(pieces[number])
        chain = [order[joined[number][0]]]
        while chain[-1] in following and len(chain) <= len(following):
            chain.append(following[chain[-1]])
        if chain[-1] != order[joined[number][1]] or len(chain) != len(following) + 1:
            raise MeshError(f"netgen cannot mesh {what} at {unit:g} m: a side is not closed; give another size")
        chains.append(chain)
        if len(chain) > 2:
            start, along = points[chain[0]], points[chain[-1]] - points[chain[0]]
            divided[number] = [float((points[i] - start) @ along / (along @ along)) for i in chain[1:-1]]
    placed = points * unit + origin
    placed[: len(given)] = list(numbers)
    for number, shares in divided.items():
        stretch = stretches[number]
        for i, share in zip(chains[number][1:], shares):
            placed[i] = stretch.side.at(stretch.low + share * (stretch.high - stretch.low))
    inverted = signed_areas(placed, triangles) < 0
    triangles[inverted] = triangles[inverted][:, ::-1]
    return _Made(placed, triangles, found, chains, divided)


def _grouped(shape: Outlined, made: _Made, stretches: Sequence[_Stretch], regions: Sequence[str | None]) -> GroupedMesh:
    """A mesh with the groups of its shape."""
    sides: dict[str, list[Any]] = defaultdict(list)
    for stretch, chain in zip(stretches, made.chains):
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

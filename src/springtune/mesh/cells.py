"""Meshes of triangles and quadrilaterals, and the declaration of mesh types: functions that mesh a box."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from numbers import Real
from typing import TypeVar

import numpy as np

from ..registry import Declaration, Registry

SIDES = {3: ((1, 2), (2, 0), (0, 1)), 4: ((0, 1), (1, 2), (2, 3), (3, 0))}
"""Corners of each side of a cell; side i of a triangle is opposite its corner i."""

DIAGONALS = {3: (), 4: ((0, 2), (1, 3))}  # corners that are joined across a cell


def no_cells(corners: int) -> np.ndarray:
    """Corner indices of no cells, shape (0, corners)."""
    return np.zeros((0, corners), dtype=np.int64)


class MeshError(ValueError):
    """A mesh cannot be used; the message gives the reason and the remedy.

    Examples
    --------
    >>> import springtune as st
    >>> from springtune.mesh.formats import write_mesh
    >>> write_mesh("own.vtu", st.make_mesh(st.Beam("100 mm", "20 mm"), "right", "5 mm"))
    >>> try:
    ...     st.read_mesh("own.vtu", st.Beam("200 mm", "40 mm"))
    ... except st.MeshError as error:
    ...     print(error)
    own.vtu: extends over 100 x 20 mm, its beam over 200 x 40 mm; correct the unit or the beam
    """


@dataclass(frozen=True, eq=False)
class Mesh:
    r"""A conforming mesh of counter-clockwise cells; each edge carries one spring.

    ::

        3 ------- 4 ------- 6
         \  B   / \ \     / |     edges    each pair of joined particles once, smaller index first: the sides of all
          \   /  A \   X    |              cells, and both diagonals of each quadrilateral
           0 ------- 1 ---- 5     cells_per_edge    2 inside (between A and B), 1 on the outline and on diagonals

    Parameters
    ----------
    points : ndarray of float, shape (n_points, 2)
        Coordinates [m].
    triangles, quads : ndarray of int, shape (n, 3) or (n, 4)
        Corner indices, counter-clockwise; quadrilaterals are optional.
    bonds : ndarray of int, shape (n_bonds, 2), optional
        Further pairs of points with a spring, which no cell joins; see `springtune.mesh.sheets.bonded`.

    Raises
    ------
    MeshError
        If an array has the wrong shape, a coordinate is not finite, or a cell is clockwise, flat or lacks a point.

    Examples
    --------
    A square of two triangles; its diagonal is the second edge:

    >>> import numpy as np
    >>> import springtune as st
    >>> points = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> mesh = st.Mesh(points, triangles=np.array([[0, 1, 2], [0, 2, 3]]))
    >>> mesh.edges.tolist()
    [[0, 1], [0, 2], [0, 3], [1, 2], [2, 3]]
    >>> mesh.cells_per_edge.tolist(), mesh.on_outline.tolist()
    ([1, 2, 1, 1, 1], [True, False, True, True, True])
    >>> {corners: mesh.cell_edges[corners].tolist() for corners in mesh.cells}
    {3: [[3, 1, 0], [4, 2, 1]]}
    >>> mesh.edge_lengths.round(3).tolist()
    [1.0, 1.414, 1.0, 1.0, 1.0]
    >>> mesh.area, mesh.particle_areas.round(3).tolist()
    (1.0, [0.333, 0.167, 0.333, 0.167])

    >>> mesh.sum_to_edges({3: np.ones((2, 3))}).tolist()  # edges of the cells, counted
    [1.0, 2.0, 1.0, 1.0, 1.0]
    >>> mesh.outline_edges(0, 1.0).tolist()
    [[1, 2]]
    >>> mesh.inverted(mesh.points * [-1, -1]), mesh.inverted(mesh.points * [-1, 1])  # rotated, mirrored
    (False, True)

    As one quadrilateral it has both diagonals:

    >>> square = st.Mesh(points, triangles=np.zeros((0, 3), dtype=int), quads=np.array([[0, 1, 2, 3]]))
    >>> len(square.edges), square.on_outline.sum().item()
    (6, 4)
    """

    points: np.ndarray
    triangles: np.ndarray
    quads: np.ndarray = field(default_factory=lambda: no_cells(4))
    bonds: np.ndarray = field(default_factory=lambda: no_cells(2))

    def __post_init__(self) -> None:
        for name, count in (("points", 2), ("triangles", 3), ("quads", 4), ("bonds", 2)):
            kind = float if name == "points" else np.int64
            object.__setattr__(self, name, _array(getattr(self, name), name, count, kind))
        points = self.points
        if len(lost := np.flatnonzero(~np.isfinite(points).all(axis=1))):
            raise MeshError(f"points: {len(lost)} have no coordinates, the first one {lost[0]}; give finite ones in m")
        if not self.cells:
            raise MeshError("there are no cells; give triangles, quads or both")
        for count, corners in self.cells.items():
            if corners.min() < 0 or corners.max() >= len(points):
                cell = np.argmax(((corners < 0) | (corners >= len(points))).any(axis=1))
                shown = f"cell {cell} has corners {corners[cell].tolist()}"
                raise MeshError(f"{shown}, and points are 0 to {len(points) - 1}; renumber them")
            areas = signed_areas(points, corners)
            if not (areas > 0).all():
                cell = np.argmin(areas > 0)
                where = "({:.6g}, {:.6g}) mm".format(*1e3 * points[corners[cell]].mean(axis=0))
                first = f"{(~(areas > 0)).sum()}, the first one {cell} at {where}; turn them, or remove them"
                raise MeshError(f"cells of {count} corners that are clockwise or have no area: {first}")

    def __repr__(self) -> str:
        named = ("triangles", self.triangles), ("quads", self.quads)
        cells = ", ".join(f"{len(corners)} {name}" for name, corners in named if len(corners))
        return f"Mesh({len(self.points)} points, {len(self.edges)} edges, {cells})"

    @property
    def cells(self) -> dict[int, np.ndarray]:
        """Corner indices of the cells by number of corners, those kinds that the mesh has."""
        return {corners.shape[1]: corners for corners in (self.triangles, self.quads) if len(corners)}

    @cached_property
    def _edges(self) -> tuple[np.ndarray, np.ndarray, dict[int, np.ndarray]]:
        joins = {count: corners[:, SIDES[count] + DIAGONALS[count]] for count, corners in self.cells.items()}
        pairs = np.concatenate([*(one.reshape(-1, 2) for one in joins.values()), self.bonds])
        # One integer per edge sorts ten times faster than rows do.
        codes, places = np.unique(np.sort(pairs, axis=1) @ [len(self.points), 1], return_inverse=True)
        places = places[: len(pairs) - len(self.bonds)]
        counts = np.bincount(places, minlength=len(codes))
        edges = np.stack(np.divmod(codes, len(self.points)), axis=1)
        forward = np.bincount(places, pairs[: len(places), 0] < pairs[: len(places), 1], len(codes)).astype(int)
        if (most := np.maximum(forward, counts - forward)).max() > 1:  # cells turn to the left
            first = f"the edge of points {edges[np.argmax(most)].tolist()} has {most.max()} cells on one side"
            raise MeshError(f"{first}, which overlap; remove some")
        parts = np.split(places, [next(iter(joins.values())).size // 2])
        return edges, counts, {count: part.reshape(one.shape[:2]) for (count, one), part in zip(joins.items(), parts)}

    @property
    def edges(self) -> np.ndarray:
        """Edges, shape (n_edges, 2), sorted, each once."""
        return self._edges[0]

    @property
    def cells_per_edge(self) -> np.ndarray:
        """Number of cells at each edge, (n_edges,): 2 inside, 1 on the outline and on diagonals, 0 of bonds."""
        return self._edges[1]

    @property
    def cell_edges(self) -> dict[int, np.ndarray]:
        """Edges of each cell by number of corners: sides as in `SIDES`, then diagonals, shape (n_cells, 3 or 6)."""
        return self._edges[2]

    @cached_property
    def on_outline(self) -> np.ndarray:
        """Whether each edge is a side of the outline, shape (n_edges,)."""
        outline = self.cells_per_edge == 1
        if len(self.quads):
            outline[self.cell_edges[4][:, 4:]] = False
        return outline

    @cached_property
    def edge_lengths(self) -> np.ndarray:
        """Length of each edge [m], shape (n_edges,)."""
        ends = self.points[self.edges]
        return np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)

    @cached_property
    def area(self) -> float:
        """Area of all cells [m2]."""
        return float(sum(signed_areas(self.points, corners).sum() for corners in self.cells.values()))

    def sum_to_edges(self, values: dict[int, np.ndarray]) -> np.ndarray:
        """Sum values given on the edges of each cell.

        Parameters
        ----------
        values : dict of int to ndarray, shape (n_cells, 3 or 6)
            As `cell_edges`, by number of corners.

        Returns
        -------
        ndarray of float, shape (n_edges,)
        """
        total = np.zeros(len(self.edges))
        for count, part in values.items():
            total += np.bincount(self.cell_edges[count].ravel(), np.ravel(part), len(total))
        return total

    @cached_property
    def particle_areas(self) -> np.ndarray:
        """Share of each particle in the area of its cells [m2], shape (n_points,)."""
        shares = np.zeros(len(self.points))
        for count, corners in self.cells.items():
            np.add.at(shares, corners, signed_areas(self.points, corners)[:, None] / count)
        return shares

    def outline_edges(self, coordinate: int, value: float) -> np.ndarray:
        """Return the outline edges on a line ``x = value`` or ``y = value``.

        Parameters
        ----------
        coordinate : int
            0 for x, 1 for y.
        value : float
            Position of the line [m].

        Returns
        -------
        ndarray of int, shape (n, 2)
        """
        outline = self.edges[self.on_outline]
        tolerance = 1e-9 * np.ptp(self.points[:, coordinate])
        return outline[(np.abs(self.points[outline, coordinate] - value) <= tolerance).all(axis=1)]

    def inverted(self, points: np.ndarray) -> bool:
        """Return whether any corner of any cell is inverted at other positions of the particles.

        Parameters
        ----------
        points : ndarray of float, shape (n_points, 2)
            The positions [m].

        Returns
        -------
        bool
        """
        return any(
            (signed_areas(points, corners[:, [i - 1, i, (i + 1) % count]]) <= 0).any()
            for count, corners in self.cells.items()
            for i in range(1 if count == 3 else count)
        )


def _array(values: object, name: str, columns: int, kind: type) -> np.ndarray:
    """Return an array of `columns` columns of a kind of number; refuse other shapes."""
    try:
        given = np.asarray(values)
        fits = given.ndim == 2 and given.shape[1] == columns and given.dtype.kind in ("iuf" if kind is float else "iu")
    except (TypeError, ValueError):
        fits = False
    if not fits:
        shape = f"{given.dtype} of shape {given.shape}" if isinstance(values, np.ndarray) else type(values).__name__
        numbers = "numbers" if kind is float else "whole numbers"
        raise MeshError(f"{name}: {shape}; give an array of {numbers} of shape (n, {columns})")
    return given.astype(kind, copy=False)


def share_edges(mesh: Mesh, other: Mesh) -> bool:
    """Return whether two meshes have the same cells; the first one then takes the other's edges."""
    cells, others = ((one.triangles, one.quads, one.bonds) for one in (mesh, other))
    same = len(mesh.points) == len(other.points) and all(map(np.array_equal, cells, others))
    if same:
        vars(mesh).update(_edges=other._edges, on_outline=other.on_outline)
    return same


def side_shares(mesh: Mesh, edges: np.ndarray, axis: int) -> np.ndarray:
    """Return each particle's share [m] (n_points,) in the extent of edges (n, 2) along an axis: half of each edge's."""
    shares = np.zeros(len(mesh.points))
    extent = np.abs(mesh.points[edges[:, 1], axis] - mesh.points[edges[:, 0], axis])
    np.add.at(shares, edges, 0.5 * extent[:, None])
    return shares


def rows_of(cells: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Return the rows of `chosen` cells among all `cells` (n_cells, m), with corners in the same order.

    >>> rows_of(np.array([[0, 1, 2], [2, 1, 3], [3, 4, 2]]), np.array([[3, 4, 2], [0, 1, 2]])).tolist()
    [2, 0]
    """
    if len(chosen) == len(cells) and np.array_equal(chosen, cells):
        return np.arange(len(cells))
    _, numbers = np.unique(np.concatenate([cells, chosen]), axis=0, return_inverse=True)
    places = np.empty(len(cells), dtype=np.int64)
    numbers = numbers.ravel()
    places[numbers[: len(cells)]] = np.arange(len(cells))
    return places[numbers[len(cells) :]]


def signed_areas(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Signed area of each cell [m2], shape (n_cells,); negative where it is inverted."""
    # About the first corner: coordinates far from the origin would cost digits.
    x, y = (np.ascontiguousarray(along)[corners.T] for along in points.T)
    x, y = x[1:] - x[0], y[1:] - y[0]
    return 0.5 * sum(x[i] * y[i + 1] - x[i + 1] * y[i] for i in range(len(x) - 1))


def counter_clockwise(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return cells counter-clockwise: clockwise ones in reverse order."""
    return np.where((signed_areas(points, corners) < 0)[:, None], corners[:, ::-1], corners)


def corner_angles(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Angle at each corner of each cell [rad], shape (n_cells, n_corners)."""
    x, y = (np.ascontiguousarray(along)[corners.T] for along in points.T)
    angles = np.empty(corners.shape)
    # Corner by corner: of millions of cells, memory for arrays of all takes longer to get than to fill.
    for i, j, k in zip(range(-1, len(x) - 1), range(len(x)), range(-2, len(x) - 2)):
        a, b, c, d = x[j] - x[i], y[j] - y[i], x[k] - x[i], y[k] - y[i]
        angles[:, i] = np.arctan2(np.abs(a * d - b * c), a * c + b * d)
    return angles


def quality(mesh: Mesh) -> dict[str, float]:
    """Return the smallest angle [degree], and the standard deviation of the edge lengths over their mean [1]."""
    smallest = min(corner_angles(mesh.points, corners).min() for corners in mesh.cells.values())
    lengths = mesh.edge_lengths
    return {"minimum_angle": float(np.degrees(smallest)), "edge_length_spread": float(lengths.std() / lengths.mean())}


MOST_MESH_PARTICLES = 5_000_000  # particles beyond which no mesh is made: its edges alone take gigabytes


def check_box(length: float, height: float, size: float) -> None:
    """Refuse a box that cannot be meshed."""
    for name, value in (("length", length), ("height", height), ("size", size)):
        number = isinstance(value, Real) and not isinstance(value, bool)
        if not (number and 1e-40 <= value <= 1e40):
            raise MeshError(f"{name}: {value!r} is not a number above zero; give one in m")
    if not max(length / size, 1.0) * max(height / size, 1.0) <= 2 * MOST_MESH_PARTICLES:
        least = f"{1e3 * math.sqrt(length * height / MOST_MESH_PARTICLES):.2g} mm"
        raise MeshError(f"size: {size!r} makes too many particles of {length:g} x {height:g} m; give at least {least}")


def too_many(count: float, size: float, side: float, body: str) -> str:
    """Return why so many particles are refused, with the remedy, or an empty string; `size`, `side` in m."""
    if count <= MOST_MESH_PARTICLES:
        return ""
    least = 1.1 * size * math.sqrt(count / MOST_MESH_PARTICLES)
    remedy = f"at least {1e3 * least:.2g} mm" if least < side else f"a shorter {body.partition(' ')[0]}"
    made = f"makes some {count:.2g} particles of {body}"
    return f"{made}, more than can be meshed ({MOST_MESH_PARTICLES:,}); give {remedy}"


def nearest_whole(ratio: float) -> int:
    """Return the nearest whole number, at least 1, halves to even; 2.5000000000000004 counts as a half."""
    return max(1, round(round(ratio, 9)))


def nearest_counts(length: float, height: float, size: float, row_height: float = 1.0) -> tuple[int, int]:
    """Return the numbers of cells along a box and of rows nearest to a size; `row_height` is over an edge's length [1].

    >>> nearest_counts(0.2, 0.04, 0.011)
    (18, 4)
    """
    check_box(length, height, size)
    return nearest_whole(length / size), nearest_whole(height / (row_height * size))


Function = TypeVar("Function", bound=Callable[..., Mesh])


@dataclass(frozen=True, eq=False)
class MeshType(Declaration):
    """A mesh type of studies, made by the decorator `mesh_type`; call it to make a mesh."""

    corners: int = 3
    row_height: float = 1.0

    def __call__(self, length: float, height: float, size: float) -> Mesh:
        """Mesh a box; lengths in m."""
        found = self.function(length, height, size)
        if not isinstance(found, Mesh):
            what = type(found).__name__
            raise MeshError(f"mesh type {self.name!r} returns {what}; return springtune.Mesh(points, triangles)")
        return found

    def particles(self, length: float, height: float, size: float) -> float:
        """Approximate number of particles of a mesh of this size; lengths in m."""
        return (length / size + 1.5) * (height / (self.row_height * size) + 1.0)

    def refusal(self, length: float, height: float, size: float, box: str) -> str:
        """Why no mesh of a size is made, with the remedy; empty where one is."""
        side = min(length, height)
        if size > side:
            return f"is larger than {box}; give at most its smaller side"
        return too_many(self.particles(length, height, size), size, side, box)


MESH_TYPES: Registry[MeshType] = Registry(__package__, "mesh type", "mesh_types")
"""Mesh types by name, in the order of their labels."""


def mesh_type(
    name: str, *, order: float = math.inf, corners: int = 3, row_height: float = 1.0
) -> Callable[[Function], Function]:
    """Declare a function as a mesh type, by a decorator that returns it unchanged.

    Parameters
    ----------
    name : str
        Label in a study and in the dataset.
    order : float, optional
        Place in the order of labels, between its neighbours' numbers; by default last.
    corners, row_height
        As of `MeshType`.

    Returns
    -------
    callable

    Raises
    ------
    ValueError
        If another function has that name; the same function, declared again, replaces the former.

    Examples
    --------
    >>> import numpy as np
    >>> import springtune as st
    >>> @st.mesh_type("two")
    ... def two(length, height, size):
    ...     "Two triangles, whatever the size."
    ...     points = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * [length, height]
    ...     return st.Mesh(points, np.array([[0, 1, 2], [0, 2, 3]]))
    >>> mesh = st.make_mesh(st.Beam("200 mm", "40 mm"), "two", "5 mm")
    >>> len(mesh.edges), mesh.points.max(axis=0).tolist()
    (5, [0.2, 0.04])
    >>> st.MESH_TYPES.discard("two")
    """
    if corners not in SIDES:
        raise ValueError(f"mesh type {name!r}: corners {corners!r}; cells have 3 or 4")
    if not (isinstance(row_height, Real) and 0 < row_height < math.inf):
        raise ValueError(f"mesh type {name!r}: row_height {row_height!r} is not a number above zero; give one")
    return lambda function: MESH_TYPES.declare(MeshType(name, function, order, corners, row_height))

"""Declaration of mesh types: functions that mesh a box."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from numbers import Integral, Real
from typing import TypeVar

import numpy as np

from ..registry import Declared, Registry
from .cells import SIDES, Mesh, MeshError, no_cells, signed_areas

MOST_MESHED = 5_000_000
"""Particles beyond which no mesh is made: its edges alone take gigabytes."""


LARGEST_SIZE = 1000.0
"""Mesh size over the smaller side of a box from which it is taken for an error: cells become slivers [1]."""


def check_box(length: float, height: float, size: float) -> None:
    """Refuse a box that cannot be meshed."""
    for name, value in (("length", length), ("height", height), ("size", size)):
        number = isinstance(value, Real) and not isinstance(value, bool)
        if not (number and 1e-40 <= value <= 1e40):
            raise MeshError(f"{name}: {value!r} is not a number above zero; give one in m")
    if size > LARGEST_SIZE * min(length, height):
        raise MeshError(f"size: {size!r} is no size of {length:g} x {height:g} m; give at most {min(length, height):g}")
    if not max(length / size, 1.0) * max(height / size, 1.0) <= 2 * MOST_MESHED:
        least = f"{1e3 * math.sqrt(length * height / MOST_MESHED):.2g} mm"
        raise MeshError(f"size: {size!r} makes too many particles of {length:g} x {height:g} m; give at least {least}")


def too_many(count: float, size: float, side: float, body: str) -> str:
    """Return why so many particles are refused, with the remedy, or an empty string; `size`, `side` in m."""
    if count <= MOST_MESHED:
        return ""
    least = 1.1 * size * math.sqrt(count / MOST_MESHED)
    remedy = f"at least {1e3 * least:.2g} mm" if least < side else f"a shorter {body.partition(' ')[0]}"
    return f"makes some {count:.2g} particles of {body}, more than can be meshed ({MOST_MESHED:,}); give {remedy}"


def nearest_whole(ratio: float) -> int:
    """Return the nearest whole number, at least 1, halves to even; 2.5000000000000004 counts as a half."""
    return max(1, round(round(ratio, 9)))


def nearest_counts(length: float, height: float, size: float, row_height: float = 1.0) -> tuple[int, int]:
    """Return the numbers of cells along a box and of rows over its height nearest to a size; lengths in m.

    `row_height` is over the length of an edge [1].

    Examples
    --------
    >>> nearest_counts(0.2, 0.04, 0.011)
    (18, 4)
    """
    check_box(length, height, size)
    return nearest_whole(length / size), nearest_whole(height / (row_height * size))


Function = TypeVar("Function", bound=Callable[..., Mesh])


@dataclass(frozen=True, eq=False)
class MeshType(Declared):
    """A mesh type of studies, made by the decorator `mesh_type`; call it to make a mesh.

    `function` takes (length, height, size) [m]. `row_height` is over the mesh size [1]. `own_stretch`, with the same
    arguments, replaces `stretch` if the counts are not the nearest.
    """

    corners: int = 3
    row_height: float = 1.0
    own_stretch: Callable[[float, float, float], float] | None = None

    def __call__(self, length: float, height: float, size: float) -> Mesh:
        """Mesh a box; lengths in m."""
        found = self.function(length, height, size)
        if not isinstance(found, Mesh):
            what = type(found).__name__
            raise MeshError(f"mesh type {self.name!r} returns {what}; return springtune.Mesh(points, triangles)")
        return found

    def stretch(self, length: float, height: float, size: float) -> float:
        """Return the cells' ratio of width to height over the nominal one, in a box [1]; lengths in m.

        Known without making the mesh.
        """
        if self.own_stretch:
            return self.own_stretch(length, height, size)
        cells, rows = nearest_counts(length, height, size, self.row_height)
        return length / cells / (height / (self.row_height * rows))

    def particles(self, length: float, height: float, size: float) -> float:
        """How many particles a mesh would have, about; parameters as of a call."""
        return (length / size + 1.5) * (height / (self.row_height * size) + 1.0)

    def refusal(self, length: float, height: float, size: float, box: str) -> str:
        """Why no mesh of a size is made, with the remedy; empty where one is."""
        side = min(length, height)
        if size > side:
            return f"is larger than {box}; give at most its smaller side"
        return too_many(self.particles(length, height, size), size, side, box)


MESH_TYPES: Registry[MeshType] = Registry(__package__, "mesh type")
"""Mesh types by name, in the order of their labels."""


def mesh_type(
    name: str,
    *,
    order: float = math.inf,
    corners: int = 3,
    row_height: float = 1.0,
    own_stretch: Callable[[float, float, float], float] | None = None,
) -> Callable[[Function], Function]:
    """Declare a function as a mesh type, by a decorator that returns it unchanged.

    Parameters
    ----------
    name : str
        Label in a study and in the dataset.
    order : float, optional
        Place in the order of labels, between its neighbours' numbers; by default last.
    corners, row_height, own_stretch
        As of `MeshType`.

    Returns
    -------
    callable
        Decorator.

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

    def declare(function: Function) -> Function:
        if corners not in SIDES:
            raise ValueError(f"mesh type {name!r}: corners {corners!r}; cells have 3 or 4")
        if not (isinstance(row_height, Real) and 0 < row_height < math.inf):
            raise ValueError(f"mesh type {name!r}: row_height {row_height!r} is not a number above zero; give one")
        MESH_TYPES.declare(MeshType(name, function, order, corners, row_height, own_stretch))
        return function

    return declare


ROW_HEIGHT = math.sqrt(3) / 2
"""Height of a row of equilateral triangles of unit edge."""


@mesh_type("structured", order=10, row_height=ROW_HEIGHT)
def structured(length: float, height: float, size: float) -> Mesh:
    r"""Rows of near-equilateral triangles along x, fitted to the box.

    The numbers of cells and rows are nearest to the exact lattice, then stretched to fit; lengths in m. Every other
    line of points is shifted by half a cell and closed with a point on either end::

        +---+---+---+      4 points, as the lowest line
        |\ / \ / \ /|
        +-+---+---+-+      shifted by half an edge, closed at both ends: 5 points
        |/ \ / \ / \|
        +---+---+---+
    """
    return _fitted(length, height, *nearest_counts(length, height, size, ROW_HEIGHT))


def isosceles(length: float, height: float, size: float, poisson_ratio: float) -> Mesh:
    """Rows of isosceles triangles whose shape sets Poisson's ratio under load along x.

    Only the row springs carry a uniaxial load along the rows, so ``nu = (a / 2h)^2`` whatever their stiffness: rows
    of height ``h = a / (2 sqrt(nu))``. An anisotropic mesh, as in figure 4b of the paper. `size` is a [m]; the number
    of rows is the nearest, that of cells along x keeps the shape best.
    """
    return _fitted(length, height, *_isosceles_counts(length, height, size, poisson_ratio))


def _isosceles_counts(length: float, height: float, size: float, poisson_ratio: float) -> tuple[int, int]:
    check_box(length, height, size)
    if not (isinstance(poisson_ratio, Real) and 1e-6 <= poisson_ratio <= 1):
        raise MeshError(f"poisson_ratio: {poisson_ratio!r} has no such rows; give a number above 0 and at most 1")
    rows = nearest_whole(height / row_height(size, poisson_ratio))
    size = 2 * math.sqrt(poisson_ratio) * height / rows
    return nearest_whole(length / size), rows


def row_height(size: float, poisson_ratio: float) -> float:
    """Return the height [m] of a row of isosceles triangles of base `size` [m] that sets Poisson's ratio.

    Examples
    --------
    >>> row_height(2e-3, 0.25)
    0.002
    """
    return size / (2 * math.sqrt(poisson_ratio))


def _declare_isosceles(order: float, poisson_ratio: float) -> None:
    def made(length: float, height: float, size: float) -> Mesh:
        return isosceles(length, height, size, poisson_ratio)

    def stretch(length: float, height: float, size: float) -> float:
        cells, rows = _isosceles_counts(length, height, size, poisson_ratio)
        return length / cells / (height / (shape * rows))

    shape = row_height(1.0, poisson_ratio)
    made.__doc__ = f"Rows of triangles along x whose shape sets a Poisson's ratio of {poisson_ratio:g}."
    mesh_type(f"isosceles-{poisson_ratio:g}", order=order, row_height=shape, own_stretch=stretch)(made)


_declare_isosceles(order=60, poisson_ratio=0.3)
_declare_isosceles(order=70, poisson_ratio=0.5)


def _fitted(length: float, height: float, cells: int, rows: int) -> Mesh:
    straight = np.linspace(0.0, length, cells + 1)
    shifted = np.concatenate([[0.0], 0.5 * (straight[:-1] + straight[1:]), [length]])
    lines = [straight if row % 2 == 0 else shifted for row in range(rows + 1)]
    mesh = _join(lines, np.linspace(0.0, height, rows + 1))
    vars(mesh)["_box_fault"] = ""  # rows fill it once: `springtune.mesh.sheets.box_fault` need not look
    return mesh


def lattice(cells: int, rows: int, size: float = 1.0, row_height: float | None = None) -> Mesh:
    """Exact lattice with staggered ends: every particle inside has the same neighbours.

    Closed forms of a lattice are exact on it: lines of points have one length, every other one is shifted by half an
    edge, and no triangle is cut. `size` is the edge along the rows [m]; `row_height` [m] is by default that of
    equilateral triangles.
    """
    row_height = ROW_HEIGHT * size if row_height is None else row_height
    for name, value in (("cells", cells), ("rows", rows)):
        if not (isinstance(value, Integral) and 1 <= value <= MOST_MESHED):
            raise MeshError(f"{name}: {value!r} is not a whole number above zero; give one, such as 10")
    check_box(cells * size, rows * row_height, size)
    line = size * np.arange(cells + 1.0)
    return _join([line + 0.5 * size * (row % 2) for row in range(rows + 1)], row_height * np.arange(rows + 1.0))


def _join(lines: list[np.ndarray], heights: np.ndarray) -> Mesh:
    """Join lines of points, each sorted along x, by triangles: always the next point that is further left."""
    starts = np.concatenate([[0], np.cumsum([len(line) for line in lines])])
    points = np.concatenate([np.stack([line, np.full(len(line), y)], axis=1) for line, y in zip(lines, heights)])
    triangles = []
    known: dict[tuple[int, int], tuple[np.ndarray, np.ndarray]] = {}  # lines of few kinds alternate
    for row, (low, high) in enumerate(zip(lines[:-1], lines[1:])):
        pair = id(low), id(high)
        if pair not in known:
            known[pair] = _joined(low, high)
        corners, above = known[pair]
        triangles.append(corners + np.where(above, starts[row + 1], starts[row]))
    return Mesh(points, np.concatenate(triangles))


def _joined(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles between two lines: places of their corners in these, and whether a corner is of the upper one."""
    # Merging the mid points of both lines' cells from left to right gives the order of the triangles.
    mids = np.concatenate([low[:-1] + low[1:], high[:-1] + high[1:]])
    upper = np.repeat([False, True], [len(low) - 1, len(high) - 1])
    upper = upper[np.argsort(mids, kind="stable")]
    i = np.concatenate([[0], np.cumsum(~upper)])[:-1]
    j = np.concatenate([[0], np.cumsum(upper)])[:-1]
    above = np.stack([np.zeros_like(upper), upper, np.ones_like(upper)], axis=1)
    return np.stack([i, np.where(upper, j + 1, i + 1), j], axis=1), above


@mesh_type("right", order=30)
def right(length: float, height: float, size: float) -> Mesh:
    r"""Squares cut by parallel diagonals.

    Their edges have about `size` [m]; they are stretched to fit the box.

    ::

        +---+---+
        | / | / |
        +---+---+
        | / | / |
        +---+---+
    """
    points, a, b, c, d = _grid(length, height, size)
    return Mesh(points, np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]))


@mesh_type("alternating", order=40)
def alternating(length: float, height: float, size: float) -> Mesh:
    r"""Squares whose diagonals alternate like a chequerboard.

    ::

        +---+---+
        | \ | / |
        +---+---+
        | / | \ |
        +---+---+
    """
    points, a, b, c, d = _grid(length, height, size)
    columns, rows = nearest_counts(length, height, size)
    falling = np.add.outer(np.arange(columns), np.arange(rows)).ravel() % 2 == 1
    first = np.where(falling[:, None], np.stack([a, b, d], axis=1), np.stack([a, b, c], axis=1))
    second = np.where(falling[:, None], np.stack([b, c, d], axis=1), np.stack([a, c, d], axis=1))
    return Mesh(points, np.concatenate([first, second]))


@mesh_type("braced", order=50, corners=4)
def braced(length: float, height: float, size: float) -> Mesh:
    r"""Squares with both diagonals.

    ::

        +---+---+
        | X | X |     the diagonals of a square do not meet: there is no particle between them
        +---+---+
    """
    points, *corners = _grid(length, height, size)
    return Mesh(points, no_cells(3), np.stack(corners, axis=1))


def _grid(length: float, height: float, size: float) -> tuple[np.ndarray, ...]:
    """Points column by column, and the four corners of each square, counter-clockwise from the lower left."""
    columns, rows = nearest_counts(length, height, size)
    x, y = np.meshgrid(np.linspace(0, length, columns + 1), np.linspace(0, height, rows + 1), indexing="ij")
    a = np.add.outer(np.arange(columns) * (rows + 1), np.arange(rows)).ravel()
    b = a + rows + 1
    return np.stack([x.ravel(), y.ravel()], axis=1), a, b, b + 1, a + 1


def _stretch(length: float, height: float, size: float) -> float:
    """As of `MeshType.stretch`: the sides are divided, each by itself."""
    # A hair less: a side of exactly n edges is not split into n + 1 by rounding.
    along, across = (max(1, math.ceil(side / size * (1 - 1e-9))) for side in (length, height))
    return length / along / (height / across)


@mesh_type("free", order=20, row_height=ROW_HEIGHT, own_stretch=_stretch)
def free(length: float, height: float, size: float) -> Mesh:
    """Delaunay triangulation inside an outline of imposed edge size, by netgen's advancing front.

    The sides are divided into equal edges no longer than `size`; inside, netgen makes near-equilateral triangles.
    Deterministic.
    """
    from netgen.geom2d import SplineGeometry  # here, since only a mesh of this type should pay for it
    from netgen.meshing import NgException

    check_box(length, height, size)
    # Lengths in units of the edge: netgen's own tolerances are absolute.
    size = min(size, max(length, height))  # a side of less than an edge is one edge, and netgen bears no tiny boxes
    box = np.array([length, height]) / size
    outline = SplineGeometry()
    corners = [outline.AppendPoint(*(box * corner)) for corner in ((0, 0), (1, 0), (1, 1), (0, 1))]
    for start, end in zip(corners, corners[1:] + corners[:1]):
        outline.Append(["line", start, end], leftdomain=1, rightdomain=0)
    # A hair above 1: a side of exactly n edges shall not be split into n + 1 by rounding.
    try:
        made = outline.GenerateMesh(maxh=1.0 + 1e-9)
    except NgException as error:
        raise MeshError(
            f"netgen cannot mesh {length:g} x {height:g} m at {size:g} m: {error}; give another size"
        ) from None
    points = np.array([point.p for point in made.Points()])[:, :2]
    triangles = np.array([[vertex.nr - 1 for vertex in element.vertices] for element in made.Elements2D()])
    for axis in range(2):
        points[np.abs(points[:, axis]) < 1e-9, axis] = 0.0
        points[np.abs(points[:, axis] - box[axis]) < 1e-9 * box[axis], axis] = box[axis]
    points *= np.array([length, height]) / box
    inverted = signed_areas(points, triangles) < 0
    triangles[inverted] = triangles[inverted][:, ::-1]
    return Mesh(points, triangles)

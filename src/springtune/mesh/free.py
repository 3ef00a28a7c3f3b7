"""Delaunay triangulation inside an outline of imposed edge size: the mesh type ``free``."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .cells import Mesh, MeshError, signed_areas
from .rows import ROW_HEIGHT
from .types import check_box, mesh_type

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
    """Triangulate inside lines, by netgen's advancing front; triangles may be clockwise.

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
    elements = made.Elements2D()
    return Triangulation(
        np.array([point.p for point in made.Points()])[:, :2],
        np.array([[vertex.nr - 1 for vertex in element.vertices] for element in elements], dtype=np.int64),
        np.array([element.index for element in elements], dtype=np.int64),
        [(one.index - 1, *(vertex.nr - 1 for vertex in one.points)) for one in made.Elements1D()],
    )


def upright(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Triangles with clockwise ones turned."""
    return np.where((signed_areas(points, triangles) < 0)[:, None], triangles[:, ::-1], triangles)


@mesh_type("free", order=20, row_height=ROW_HEIGHT)
def free(length: float, height: float, size: float) -> Mesh:
    """Delaunay triangulation inside an outline of imposed edge size, by netgen's advancing front."""
    check_box(length, height, size)
    # Lengths in units of the edge: netgen's own tolerances are absolute.
    size = min(size, max(length, height))  # a side of less than an edge is one edge, and netgen bears no tiny boxes
    box = np.array([length, height]) / size
    corners = box * [(0, 0), (1, 0), (1, 1), (0, 1)]
    lines = [(i, (i + 1) % 4, 1, 0) for i in range(4)]
    made = triangulate(
        corners, lines, f"{length:g} x {height:g} m at {size:g} m", "give another size", maxh=EDGE_FACTOR
    )
    points = made.points
    for axis in range(2):
        points[np.abs(points[:, axis]) < 1e-9, axis] = 0.0
        points[np.abs(points[:, axis] - box[axis]) < 1e-9 * box[axis], axis] = box[axis]
    points *= np.array([length, height]) / box
    return Mesh(points, upright(points, made.triangles))

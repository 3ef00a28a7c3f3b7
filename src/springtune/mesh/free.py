"""Delaunay triangulation inside an outline of imposed edge size: the mesh type ``free``."""

import math

import numpy as np

from .cells import Mesh, MeshError, signed_areas
from .rows import ROW_HEIGHT
from .types import check_box, mesh_type


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

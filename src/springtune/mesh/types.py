"""Declaration of mesh types: functions that mesh a box."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real
from typing import TypeVar

from ..registry import Declaration, Registry
from .cells import SIDES, Mesh, MeshError

MOST_MESH_PARTICLES = 5_000_000
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
    if not max(length / size, 1.0) * max(height / size, 1.0) <= 2 * MOST_MESH_PARTICLES:
        least = f"{1e3 * math.sqrt(length * height / MOST_MESH_PARTICLES):.2g} mm"
        raise MeshError(f"size: {size!r} makes too many particles of {length:g} x {height:g} m; give at least {least}")


def too_many(count: float, size: float, side: float, body: str) -> str:
    """Return why so many particles are refused, with the remedy, or an empty string; `size`, `side` in m."""
    if count <= MOST_MESH_PARTICLES:
        return ""
    least = 1.1 * size * math.sqrt(count / MOST_MESH_PARTICLES)
    remedy = f"at least {1e3 * least:.2g} mm" if least < side else f"a shorter {body.partition(' ')[0]}"
    return (
        f"makes some {count:.2g} particles of {body}, more than can be meshed ({MOST_MESH_PARTICLES:,}); give {remedy}"
    )


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
    name: str,
    *,
    order: float = math.inf,
    corners: int = 3,
    row_height: float = 1.0,
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

    def declare(function: Function) -> Function:
        if corners not in SIDES:
            raise ValueError(f"mesh type {name!r}: corners {corners!r}; cells have 3 or 4")
        if not (isinstance(row_height, Real) and 0 < row_height < math.inf):
            raise ValueError(f"mesh type {name!r}: row_height {row_height!r} is not a number above zero; give one")
        MESH_TYPES.declare(MeshType(name, function, order, corners, row_height))
        return function

    return declare

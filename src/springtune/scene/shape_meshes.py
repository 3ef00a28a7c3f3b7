"""Meshes of shapes: made, or from a file. Results of beams do not depend on this module."""

from collections.abc import Mapping
from pathlib import Path

from ..mesh.formats import read_shape as read_grouped
from ..mesh.groups import GroupedMesh
from ..mesh.outlines import mesh_shape as mesh_outlined
from ..problem.quantities import positive
from ..problem.shapes import Shape
from .meshes import A_SHAPE, is_a


def mesh_shape(shape: Shape, size: float | str, refined: Mapping[str, float | str] | None = None) -> GroupedMesh:
    """Mesh a shape, with the groups of its sides, its points and parts.

    An arc has at least six edges a full turn; near much shorter ones, edges are divided further.

    Parameters
    ----------
    shape : Shape
    size : float or str
        Length of an edge [m], or a text with its unit.
    refined : mapping of str to float or str, optional
        Shorter edges at groups of sides, at points and in parts, by their name [m]; from there on they grow.

    Returns
    -------
    GroupedMesh

    Examples
    --------
    >>> import springtune as st
    >>> plate = st.Shape.rectangle("100 mm", "40 mm", holes=[st.Hole.circle(("50 mm", "20 mm"), "8 mm")])
    >>> grouped = st.mesh_shape(plate, "4 mm", refined={"hole": "1 mm"})
    >>> len(grouped.sides["hole"]), len(grouped.sides["right"])
    (52, 10)
    """
    is_a(shape, Shape, "shape", A_SHAPE)
    sizes = {name: positive(value, "length", f"refined {name!r}") for name, value in (refined or {}).items()}
    return mesh_outlined(shape, positive(size, "length", "mesh size"), sizes)


def read_shape(path: str | Path, unit: float | str = "1 m") -> GroupedMesh:
    """Read the mesh of a shape with its groups, of any format that meshio knows.

    Parameters
    ----------
    path : str or Path
        The guide on mesh files says how a group of the file becomes sides, a point or a part.
    unit : float or str, optional
        Unit of the coordinates in the file [m], or a text such as ``"1 mm"``.

    Returns
    -------
    GroupedMesh

    Examples
    --------
    >>> import springtune as st
    >>> from springtune.mesh import write_mesh
    >>> plate = st.Shape.rectangle("100 mm", "40 mm", holes=[st.Hole.circle(("50 mm", "20 mm"), "8 mm")])
    >>> write_mesh("plate.vtu", st.mesh_shape(plate, "4 mm"))
    >>> sorted(st.read_shape("plate.vtu").sides)
    ['hole', 'left', 'lower', 'right', 'upper']
    """
    return read_grouped(path, positive(unit, "length", "unit"))

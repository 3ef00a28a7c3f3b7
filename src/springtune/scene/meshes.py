"""Meshes of beams and shapes: made, or from a file."""

from collections.abc import Mapping
from pathlib import Path

from ..mesh.cells import MESH_TYPES, Mesh
from ..mesh.formats import read_beam_mesh
from ..mesh.formats import read_shape as read_grouped
from ..mesh.free import mesh_shape as mesh_outlined
from ..mesh.sheets import GroupedMesh
from ..problem.quantities import positive
from ..problem.shapes import Beam, Shape
from .mesh_cache import A_BEAM, A_SHAPE, choose, is_a


def make_mesh(beam: Beam, mesh_type: str, size: float | str) -> Mesh:
    """Mesh a beam.

    Parameters
    ----------
    beam : Beam
    mesh_type : str
        Key of `springtune.MESH_TYPES`.
    size : float or str
        Length of an edge [m], or a text with its unit.

    Returns
    -------
    Mesh

    Raises
    ------
    ValueError
        If the size is larger than the beam's smaller side, or makes more cells than can be meshed.

    Examples
    --------
    >>> import springtune as st
    >>> mesh = st.make_mesh(st.Beam("200 mm", "40 mm"), "structured", "5 mm")
    >>> len(mesh.points), len(mesh.edges)
    (415, 1143)
    """
    is_a(beam, Beam, "beam", A_BEAM)
    make, edge = choose(MESH_TYPES, mesh_type, "mesh type"), positive(size, "length", "mesh size")
    refusal = make.refusal(beam.length, beam.height, edge, f"beam {beam.name!r}")
    if refusal:
        raise ValueError(f"mesh size: {size!r} {refusal}")
    return make(beam.length, beam.height, edge)


def read_mesh(path: str | Path, beam: Beam, unit: float | str = "1 m") -> Mesh:
    """Read a mesh of a beam, of any format that meshio knows; its lower left corner is put at the origin.

    Parameters
    ----------
    path : str or Path
    beam : Beam
        That it fills.
    unit : float or str, optional
        Unit of the coordinates in the file [m], or a text such as ``"1 mm"``.

    Returns
    -------
    Mesh

    Examples
    --------
    >>> import springtune as st
    >>> from springtune.mesh.formats import write_mesh
    >>> beam = st.Beam("100 mm", "20 mm")
    >>> write_mesh("own.vtu", st.make_mesh(beam, "free", "5 mm"))
    >>> print(f"{1e6 * st.read_mesh('own.vtu', beam).area:.0f} mm2")
    2000 mm2
    """
    is_a(beam, Beam, "beam", A_BEAM)
    return read_beam_mesh(path, beam.length, beam.height, positive(unit, "length", "unit"))


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
    >>> from springtune.mesh.formats import write_mesh
    >>> plate = st.Shape.rectangle("100 mm", "40 mm", holes=[st.Hole.circle(("50 mm", "20 mm"), "8 mm")])
    >>> write_mesh("plate.vtu", st.mesh_shape(plate, "4 mm"))
    >>> sorted(st.read_shape("plate.vtu").sides)
    ['hole', 'left', 'lower', 'right', 'upper']
    """
    return read_grouped(path, positive(unit, "length", "unit"))

"""Meshes of a beam: of a type, or from a file."""

from pathlib import Path

from ..mesh import MESH_TYPES, Mesh, read_beam_mesh
from ..problem.geometry import Beam
from ..problem.quantities import positive
from .sheet import chosen


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
        If the mesh type is unknown, or the size not above zero, larger than the beam's smaller side, or absurdly small.

    Examples
    --------
    >>> import springtune as st
    >>> mesh = st.make_mesh(st.Beam("200 mm", "40 mm"), "structured", "5 mm")
    >>> len(mesh.points), len(mesh.edges)
    (415, 1143)
    """
    make, edge = chosen(MESH_TYPES, mesh_type, "mesh type"), positive(size, "length", "mesh size")
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

    Raises
    ------
    MeshError
        If the file cannot be read, or does not mesh the beam once.

    Examples
    --------
    >>> import springtune as st
    >>> from springtune.mesh import write_mesh
    >>> beam = st.Beam("100 mm", "20 mm")
    >>> write_mesh("own.vtu", st.make_mesh(beam, "free", "5 mm"))
    >>> mesh = st.read_mesh("own.vtu", beam)
    >>> print(f"{1e6 * mesh.area:.0f} mm2")
    2000 mm2
    """
    return read_beam_mesh(path, beam.length, beam.height, positive(unit, "length", "unit"))

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
        If the mesh type is unknown, or the size not above zero or larger than the beam's smaller side.

    Examples
    --------
    >>> mesh = make_mesh(Beam("200 mm", "40 mm"), "structured", "5 mm")
    >>> len(mesh.points), len(mesh.edges)
    (415, 1143)
    """
    make, edge = chosen(MESH_TYPES, mesh_type, "mesh type"), positive(size, "length", "mesh size")
    if edge > min(beam.length, beam.height):
        raise ValueError(f"mesh size: {size!r} is larger than beam {beam.name!r}; give at most its smaller side")
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
    >>> import tempfile
    >>> from springtune.mesh import write_mesh
    >>> beam = Beam("100 mm", "20 mm")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_mesh(f"{folder}/own.vtu", make_mesh(beam, "free", "5 mm"))
    ...     mesh = read_mesh(f"{folder}/own.vtu", beam)
    >>> mesh.area
    0.002
    """
    return read_beam_mesh(path, beam.length, beam.height, positive(unit, "length", "unit"))

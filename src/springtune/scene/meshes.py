"""Meshes of beams: made, or from a file."""

from pathlib import Path
from typing import Any, get_args

import numpy as np

from ..mesh.cells import Mesh
from ..mesh.formats import read_beam_mesh
from ..mesh.sheets import box_fault
from ..mesh.types import MESH_TYPES
from ..problem.geometry import Beam
from ..problem.materials import AnisotropicMaterial, Material, only_isotropic
from ..problem.quantities import positive
from .mesh_cache import choose

MOST_GAP = 1e-6
"""Largest gap between a mesh and its beam, over the beam's extent."""


def is_a(value: object, wanted: Any, name: str, example: str) -> None:
    """Refuse an argument of another type."""
    if wanted is Material and isinstance(value, AnisotropicMaterial):
        only_isotropic(value, "give a springtune.Shape, whose reference takes any material")
    if not isinstance(value, wanted):
        first, *_ = get_args(wanted) or [wanted]
        raise ValueError(f"{name}: {value!r} is not a {first.__name__}; give one such as {example}")


A_SHAPE = "springtune.Shape.rectangle('200 mm', '40 mm')"
"""Call that makes a shape, for messages."""

A_BEAM, A_MESH, A_MATERIAL = (
    "springtune.Beam('200 mm', '40 mm')",
    "springtune.make_mesh(beam, 'structured', '5 mm')",
    "springtune.Material('210 GPa', 0.3)",
)
"""Calls that make arguments, for messages."""


def check_filled(mesh: Mesh, beam: Beam) -> None:
    """Refuse a mesh that does not fill its beam exactly once, as its reference does."""
    low, high, box = mesh.points.min(axis=0), mesh.points.max(axis=0), np.array([beam.length, beam.height])
    remedy = "make it with springtune.make_mesh(beam, ...) or springtune.read_mesh(file, beam)"
    if np.abs(np.concatenate([low, high - box])).max() > MOST_GAP * box.max():
        shown = " x ".join(f"{low_:.6g} to {high_:.6g}" for low_, high_ in zip(1e3 * low, 1e3 * high))
        wanted = " x ".join(f"{side:.6g}" for side in 1e3 * box)
        raise ValueError(f"mesh: extends over {shown} mm, its beam over {wanted} mm from the origin; {remedy}")
    wrong = box_fault(mesh)
    if wrong:
        raise ValueError(f"mesh: does not fill its beam: {wrong}; or {remedy}")


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
    >>> from springtune.mesh import write_mesh
    >>> beam = st.Beam("100 mm", "20 mm")
    >>> write_mesh("own.vtu", st.make_mesh(beam, "free", "5 mm"))
    >>> print(f"{1e6 * st.read_mesh('own.vtu', beam).area:.0f} mm2")
    2000 mm2
    """
    is_a(beam, Beam, "beam", A_BEAM)
    return read_beam_mesh(path, beam.length, beam.height, positive(unit, "length", "unit"))

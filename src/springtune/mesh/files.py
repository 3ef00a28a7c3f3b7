"""Mesh files: VTU, as meshio and ParaView open them."""

import os

import numpy as np

from .triangles import TriangleMesh


def write_mesh(path, mesh):
    """Write a mesh; the file appears whole or not at all.

    Parameters
    ----------
    path : str or Path
        File to write, ending in ``.vtu``.
    mesh : TriangleMesh
    """
    import meshio

    points = np.column_stack([mesh.points, np.zeros(len(mesh.points))])
    unfinished = f"{path}.unfinished.vtu"
    meshio.Mesh(points, [("triangle", mesh.triangles)]).write(unfinished, file_format="vtu")
    os.replace(unfinished, path)


def read_mesh(path):
    """Read a mesh written by `write_mesh` or any that meshio reads and that has triangles.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    TriangleMesh

    Raises
    ------
    ValueError
        If the file has no triangles.
    """
    import meshio

    content = meshio.read(path)
    triangles = [block.data for block in content.cells if block.type == "triangle"]
    if not triangles:
        raise ValueError(f"{path}: no cell block 'triangle'; write the mesh with triangles")
    return TriangleMesh(content.points[:, :2].copy(), np.concatenate(triangles).astype(np.int64))

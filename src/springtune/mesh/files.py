"""Mesh files: VTU, as meshio and ParaView open them, and whatever else meshio reads."""

import os

import numpy as np

from .cells import Mesh, no_cells, signed_areas

CELLS = {"triangle": 3, "quad": 4}
"""Corners of the cells that can be read, by meshio's name."""

LEFT_OUT = ("line", "vertex")
"""Cells that carry no springs: boundaries and tags, left out."""


class MeshError(ValueError):
    """A mesh that cannot be used; the message says why and what to do."""


def write_mesh(path, mesh):
    """Write a mesh; the file appears whole or not at all.

    Parameters
    ----------
    path : str or Path
        File to write, ending in ``.vtu``.
    mesh : Mesh
    """
    import meshio

    points = np.column_stack([mesh.points, np.zeros(len(mesh.points))])
    cells = [(name, mesh.cells[count]) for name, count in CELLS.items() if count in mesh.cells]
    unfinished = f"{path}.unfinished.vtu"
    meshio.Mesh(points, cells).write(unfinished, file_format="vtu")
    os.replace(unfinished, path)


def read_mesh(path, unit=1.0):
    """Read a mesh of any format that meshio knows.

    Particles that belong to no cell are left out, clockwise cells are turned.

    Parameters
    ----------
    path : str or Path
    unit : float, optional
        Unit of the coordinates in the file [m].

    Returns
    -------
    Mesh

    Raises
    ------
    MeshError
        If the file cannot be read, has cells other than linear triangles and quadrilaterals or none of these, is not
        plane, or has cells without area.
    """
    import meshio

    try:
        content = meshio.read(path)
    except (Exception, SystemExit) as error:  # meshio exits where it does not know the format
        raise MeshError(
            f"{path}: meshio cannot read it: {error or 'unknown format'}; convert it to .vtu or .msh"
        ) from None
    points = unit * np.asarray(content.points, dtype=float)
    cells = {}
    for block in content.cells:
        if block.type in CELLS:
            cells.setdefault(CELLS[block.type], []).append(block.data)
        elif block.type not in LEFT_OUT:
            raise MeshError(f"{path}: has cells '{block.type}'; write linear triangles and quadrilaterals only")
    if not cells:
        raise MeshError(f"{path}: no cell block 'triangle' or 'quad'; write the mesh with triangles or quadrilaterals")
    cells = {count: np.concatenate(blocks).astype(np.int64) for count, blocks in cells.items()}
    used, numbers = np.unique(np.concatenate([corners.ravel() for corners in cells.values()]), return_inverse=True)
    points = points[used]
    if points.shape[1] > 2 and np.ptp(points[:, 2]) > 1e-9 * np.ptp(points[:, :2]):
        raise MeshError(f"{path}: points leave the plane of x and y; give a plane mesh")
    points = points[:, :2].copy()
    start = 0
    for count, corners in cells.items():
        corners = numbers[start : start + corners.size].reshape(corners.shape)
        start += corners.size
        areas = signed_areas(points, corners)
        flat = np.abs(areas) <= 1e-12 * np.abs(areas).max()
        if flat.any():
            raise MeshError(
                f"{path}: {flat.sum()} cells have no area, the first one at {_place(points, corners[flat][0])}"
            )
        clockwise = areas < 0
        corners[clockwise] = corners[clockwise][:, ::-1]
        cells[count] = corners
    return Mesh(points, cells.get(3, no_cells(3)), cells.get(4, no_cells(4)))


def read_beam_mesh(path, length, height, unit=1.0):
    """Read a mesh that is to fill a box, and put its lower left corner at the origin.

    Parameters
    ----------
    path : str or Path
    length, height : float
        Extent of the box [m].
    unit : float, optional
        Unit of the coordinates in the file [m].

    Returns
    -------
    Mesh

    Raises
    ------
    MeshError
        As `read_mesh`, and if the mesh does not fill the box exactly once.
    """
    mesh = read_mesh(path, unit)
    box = np.array([length, height])
    points = mesh.points - mesh.points.min(axis=0)
    extent = points.max(axis=0)
    if np.abs(extent / box - 1).max() > 1e-6:
        shown, asked = (" x ".join(f"{1e3 * side:.6g}" for side in sides) for sides in (extent, box))
        raise MeshError(f"{path}: extends over {shown} mm, its beam over {asked} mm; correct the unit or the beam")
    # Formats with few digits: sides shall be straight.
    near = np.abs(points - extent) <= 1e-6 * extent
    points = np.where(near, box, np.where(points <= 1e-6 * extent, 0.0, points))
    mesh = Mesh(points, mesh.triangles, mesh.quads)
    if abs(mesh.area / (length * height) - 1) > 1e-6 or mesh.inverted(points) or mesh.cells_per_edge.max() > 2:
        share = 100 * mesh.area / (length * height)
        raise MeshError(f"{path}: its cells cover {share:.6g} % of the box or overlap; give a mesh that fills it once")
    return mesh


def _place(points, corners):
    return "({:.6g}, {:.6g}) mm".format(*(1e3 * points[corners].mean(axis=0)))

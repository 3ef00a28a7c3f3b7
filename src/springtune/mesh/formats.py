"""Mesh files: VTU, as meshio and ParaView open them, and whatever else meshio reads."""

import io
import os
import platform
import warnings
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from ..safe_io.inputs import BeyondBound, DataElsewhere, bounded, check_alone, fault
from .box import box_fault, on_sides
from .cells import Mesh, MeshError, no_cells, signed_areas
from .groups import GroupedMesh
from .sheets import DIGITS, in_words

CELLS = {"triangle": 3, "quad": 4}
"""Corners of the cells that can be read, by meshio's name."""

CELL_DIMENSIONS = {"vertex": 0, "line": 1, "triangle": 2, "quad": 2}
"""Of cells that are read and of those that make groups, by meshio's name."""

PART_NUMBERS = "part"
"""Cell data whose whole numbers are parts of the body; 0 is the main one."""

PHYSICAL = "gmsh:physical"
"""Cell data in which meshio gives numbers of Gmsh's physical groups; 0 is none."""

LEFT_OUT = ("line", "vertex")
"""Cells that carry no springs: boundaries and tags, left out."""

COMPANIONS = (".xdmf", ".xmf", ".node", ".ele")
"""Endings of files that hold only a part of a mesh."""

LARGEST_FILE = 60_000_000
"""Bytes of the largest file that is read: formats in text take a second for some megabytes."""

HDF5 = b"\x89HDF\r\n"
"""What files of HDF5 begin with, some after a block of their own."""

READ_MEMORY, READ_MEMORY_SHARE = 5e8, 40.0
"""Memory that reading a file may take [bytes], and how often its size besides: no sound file takes as much."""

READ_SECONDS, READ_SECONDS_SHARE = 2.0, 3e-6
"""Seconds of the processor that it may take, and for each byte besides: some readers wait for lines for ever."""

MOST_IN_FILE = 1_000_000
"""Most points of a file; such a mesh is read within seconds and in less than a gigabyte."""

LONGEST_SAID = 120
"""Most characters of a message of meshio that are shown."""


def write_mesh(path: str | Path, mesh: Mesh | GroupedMesh) -> None:
    """Write a mesh atomically, with its groups.

    Sides become lines and points vertices. ``.vtu`` has cell data of zeros and ones for each group, ``.msh`` (Gmsh
    format 2.2) physical groups. `springtune.read_shape` reads both.
    """
    if not isinstance(mesh, Mesh | GroupedMesh):
        raise MeshError(f"mesh: {type(mesh).__name__} is not a Mesh; give a springtune.Mesh")
    kinds = {".vtu": "vtu", **({".msh": "gmsh22"} if isinstance(mesh, GroupedMesh) else {})}
    ending = Path(path).suffix
    if ending not in kinds:
        raise MeshError(f"{path}: is not to end in '{ending}'; give a name that ends in {' or '.join(kinds)}")
    import meshio

    grouped = mesh if isinstance(mesh, GroupedMesh) else GroupedMesh(mesh)
    mesh = grouped.mesh
    # A named point that is no particle becomes a point of its own.
    places: list[np.ndarray] = []
    blocks: list[tuple[str, np.ndarray, list[str]]] = []
    for name, count in CELLS.items():
        if count in mesh.cells:
            inside = {part: masks[count] for part, masks in grouped.parts.items() if count in masks}
            rest = ~np.any([*inside.values(), np.zeros(len(mesh.cells[count]), dtype=bool)], axis=0)
            blocks += [
                (name, mesh.cells[count][mask], [part] * bool(part))
                for part, mask in {"": rest, **inside}.items()
                if mask.any()
            ]
    blocks += [("line", edges, [side]) for side, edges in grouped.sides.items()]
    for point, place in grouped.points.items():
        number = grouped.particle(point)
        if number is None:
            number = len(mesh.points) + len(places)
            places.append(np.asarray(place))
        blocks.append(("vertex", np.array([[number]]), [point]))
    points = np.concatenate([mesh.points, np.reshape(places, (-1, 2))])
    points = np.column_stack([points, np.zeros(len(points))])
    unfinished = f"{path}.{os.getpid()}@{platform.node().replace('.', '-')}.unfinished"
    data, fields = (_vtu_marks if ending == ".vtu" else _gmsh_tags)(path, blocks)
    try:
        cells = [(kind, corners) for kind, corners, _ in blocks]
        meshio.Mesh(points, cells, cell_data=data, field_data=fields).write(unfinished, file_format=kinds[ending])
        os.replace(unfinished, path)
    except BaseException:
        Path(unfinished).unlink(missing_ok=True)
        raise


def _vtu_marks(
    path: str | Path, blocks: list[tuple[str, np.ndarray, list[str]]]
) -> tuple[dict[str, list[np.ndarray]], dict[str, np.ndarray]]:
    """Cell data of zeros and ones by group, and no field data."""
    names = dict.fromkeys(name for *_, names in blocks for name in names)
    if PART_NUMBERS in names:
        raise MeshError(f"{path}: a group is named '{PART_NUMBERS}', by which VTU files number parts; rename it")
    return {name: [np.full(len(corners), name in of, dtype=np.int8) for _, corners, of in blocks] for name in names}, {}


def _gmsh_tags(
    path: str | Path, blocks: list[tuple[str, np.ndarray, list[str]]]
) -> tuple[dict[str, list[np.ndarray]], dict[str, np.ndarray]]:
    """Numbers of physical groups, and their names."""
    fields: dict[str, np.ndarray] = {}
    tags = []
    for kind, corners, names in blocks:
        for name in names:
            if fields.setdefault(name, np.array([len(fields) + 1, CELL_DIMENSIONS[kind]]))[1] != CELL_DIMENSIONS[kind]:
                raise MeshError(f"{path}: '{name}' names groups of two kinds, and Gmsh's are of one; write .vtu")
        tags.append(np.full(len(corners), fields[names[0]][0] if names else 0))
    return {PHYSICAL: tags, "gmsh:geometrical": tags}, fields


def read_mesh(path: str | Path, unit: float = 1.0) -> Mesh:
    """Read a mesh of any format that meshio supports.

    Particles without cells are dropped, clockwise cells are turned.

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
        If the file is unreadable or too large, has no linear triangles or quadrilaterals or other cells, cells with
        missing points, points that are not finite or not in one plane, or cells without area.
    """
    return assembled(path, file_content(path), unit)[0]


def assembled(path: str | Path, content: Any, unit: float) -> tuple[Mesh, np.ndarray]:
    """Return the mesh of meshio's data, and its particles' numbers in the file; `unit` in m."""
    cells = _read_cells(path, content)
    used, numbers = np.unique(np.concatenate([corners.ravel() for corners in cells.values()]), return_inverse=True)
    with np.errstate(over="ignore"):  # what is too far away is refused
        points = _read_points(path, unit * coordinates(path, content), used)
    start = 0
    for count, corners in cells.items():
        corners = numbers[start : start + corners.size].reshape(corners.shape)
        start += corners.size
        cells[count] = _counter_clockwise(path, points, corners)
    return Mesh(points, cells.get(3, no_cells(3)), cells.get(4, no_cells(4))), used


def _is_the_machines(error: BaseException, memory: float) -> bool:
    """Return whether a read failed for the system's reasons, such as a lack of memory."""
    if isinstance(error, MemoryError) and not isinstance(error, BeyondBound):
        return float(np.prod(getattr(error, "shape", 0), dtype=float)) * 8 <= memory
    return isinstance(error, OSError) and (error.errno or 0) > 0  # netCDF has numbers of its own, below


def file_content(path: str | Path) -> Any:
    """Read a file by meshio; a MeshError gives the reason for a failure."""
    if fault(path):
        raise MeshError(f"{path}: there is no such file; give the path of a mesh file")
    size = Path(path).stat().st_size
    if size == 0:
        raise MeshError(f"{path}: the file is empty; write the mesh again")
    if size > LARGEST_FILE:
        most = f"{LARGEST_FILE // 1_000_000} MB"
        raise MeshError(
            f"{path}: {size / 1e6:.0f} MB, and at most {most} are read; write a coarser mesh, or binary VTU"
        )
    content = Path(path).read_bytes()
    if Path(path).suffix.lower() in COMPANIONS or b"*include" in content.lower():
        raise MeshError(
            f"{path}: parts of it are in other files, whose changes would not be seen; write it as one .vtu or .msh"
        )
    if HDF5 in content:
        try:
            check_alone(path)
        except OSError:  # meshio says it
            pass
        except DataElsewhere as error:
            raise MeshError(str(error)) from None
    import meshio

    told, memory = io.StringIO(), READ_MEMORY + READ_MEMORY_SHARE * size
    try:
        # meshio tells people of what it leaves out, and exits where it does not know the format.
        with redirect_stdout(told), redirect_stderr(told), warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            with bounded(memory, READ_SECONDS + READ_SECONDS_SHARE * size):
                return meshio.read(path)
    except MemoryError as error:
        if _is_the_machines(error, memory):
            raise
        raise MeshError(
            f"{path}: is damaged: it states more points or cells than its {size / 1e3:.3g} kB can hold; write it again"
        ) from None
    except (Exception, SystemExit) as error:
        if _is_the_machines(error, memory):
            raise
        said = " ".join(told.getvalue().split() if isinstance(error, SystemExit) else str(error).split())
        said = said.partition("Error: Couldn't read")[0].removeprefix("ReadError:").strip()
        if not isinstance(error, SystemExit):
            said = said or type(error).__name__
        shown = f" ({said[:LONGEST_SAID]}{'...' * (len(said) > LONGEST_SAID)})" if said else ""
        why = f"it is damaged, or not what its name says{shown}; write it again"
        if PHYSICAL in said:
            why = f"some of its elements are in no physical group{shown}; give all of them one, or write format 2.2"
        if Path(path).suffix.lower() not in meshio.extension_to_filetypes:
            why = f"unknown format '{Path(path).suffix}'; convert it to .vtu or .msh"
        raise MeshError(f"{path}: meshio cannot read it: {why}") from None


def coordinates(path: str | Path, content: Any) -> np.ndarray:
    """Coordinates of all points, shape (n_points, 2 or 3)."""
    try:
        points = np.asarray(content.points, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise MeshError(f"{path}: coordinates that are no numbers; write the mesh again") from None
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        shape = " x ".join(map(str, points.shape))
        raise MeshError(f"{path}: coordinates of points are {shape}, not 2 or 3 for each; write the mesh again")
    if len(points) > MOST_IN_FILE:
        raise MeshError(f"{path}: {len(points)} points, and at most {MOST_IN_FILE} are read; write a coarser mesh")
    return points


def _read_cells(path: str | Path, content: Any) -> dict[int, np.ndarray]:
    """Corner indices of what meshio read, by number of corners; refused where cells are of other types."""
    cells: dict[int, list[np.ndarray]] = {}
    for block in content.cells:
        if block.type in CELLS:
            data = np.asarray(block.data)
            if not len(data):
                continue
            if data.ndim != 2 or data.shape[1] != CELLS[block.type] or data.dtype.kind not in "iu":
                shape = f"numbers {data.dtype} of shape {data.shape}"
                raise MeshError(f"{path}: cells '{block.type}' by {shape}; write the mesh again")
            cells.setdefault(CELLS[block.type], []).append(data)
        elif block.type not in LEFT_OUT:
            raise MeshError(f"{path}: has cells '{block.type}'; write linear triangles and quadrilaterals only")
    if not cells:
        raise MeshError(f"{path}: no cell block 'triangle' or 'quad'; write the mesh with triangles or quadrilaterals")
    return {count: np.concatenate(blocks).astype(np.int64) for count, blocks in cells.items()}


def _read_points(path: str | Path, points: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Coordinates in the plane of the points that cells have, `used`, sorted; refused where these are not there."""
    for number in used[[0, -1]]:
        if not 0 <= number < len(points):
            raise MeshError(f"{path}: a cell has point {number}, and points are 0 to {len(points) - 1}; renumber them")
    points = points[used]
    nowhere = ~np.isfinite(points).all(axis=1)
    if nowhere.any():
        first = used[nowhere][0]
        raise MeshError(
            f"{path}: points with coordinates that are no numbers: {nowhere.sum()}, the first one {first}; mend them"
        )
    extent = np.ptp(points, axis=0)
    if not np.isfinite(extent**4).all():
        raise MeshError(f"{path}: extends over {extent.max():.3g} m; correct coordinates or the unit")
    if points.shape[1] > 2 and extent[2] > 1e-9 * extent[:2].max():
        away = np.abs(points[:, 2] - points[0, 2])
        first = f"point {used[np.argmax(away > 1e-9 * extent[:2].max())]}"
        raise MeshError(
            f"{path}: points leave the plane of x and y, the first one {first}, by up to {1e3 * away.max():.3g} mm; "
            "give a plane mesh"
        )
    return points[:, :2].copy()


def _counter_clockwise(path: str | Path, points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Corner indices of cells, clockwise ones turned; refused where cells have no area."""
    areas = signed_areas(points, corners)
    flat = np.abs(areas) <= 1e-12 * np.abs(areas).max()
    if flat.any():
        first = in_words(points[corners[flat][0]])
        raise MeshError(f"{path}: cells with no area: {flat.sum()}, the first one at {first}; remove them")
    clockwise = areas < 0
    corners[clockwise] = corners[clockwise][:, ::-1]
    return corners


def read_beam_mesh(path: str | Path, length: float, height: float, unit: float = 1.0) -> Mesh:
    """Read a mesh that must fill a box, and move its lower left corner to the origin; lengths in m."""
    mesh = read_mesh(path, unit)
    box = np.array([length, height])
    mesh = Mesh(mesh.points - mesh.points.min(axis=0), mesh.triangles, mesh.quads)
    extent = mesh.points.max(axis=0)
    if np.abs(extent / box - 1).max() > DIGITS:
        shown, wanted = (" x ".join(f"{1e3 * side:.6g}" for side in sides) for sides in (extent, box))
        raise MeshError(f"{path}: extends over {shown} mm, its beam over {wanted} mm; correct the unit or the beam")
    try:
        mesh = on_sides(mesh, box)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None
    wrong = box_fault(mesh)
    if wrong:
        raise MeshError(f"{path}: {wrong}")
    return mesh

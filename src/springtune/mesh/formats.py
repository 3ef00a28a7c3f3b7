"""Mesh files: Gmsh's, Abaqus', Nastran's and Exodus by readers of their own, all others by meshio.

Groups are Gmsh's physical groups, sets of Abaqus and others, and marks in VTU.
"""

import io
import re
import warnings
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout, suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..registry import NAME, NAME_RULE
from ..safe_io.atomic import check_folder, replacing
from ..safe_io.inputs import BeyondBound, DataElsewhere, bounded, check_alone, fault
from . import abaqus, exodus, gmsh, nastran, vtu
from .cells import Mesh, MeshError, no_cells, signed_areas
from .content import IN_OTHER_FILES, LINEAR
from .groups import GroupedMesh, part_names
from .sheets import DIGITS, box_fault, in_words, on_sides, outline_of, sheet_fault

CELLS = {"triangle": 3, "quad": 4}
"""Corners of the cells that can be read, by meshio's name."""

CELL_DIMENSIONS = {"vertex": 0, "line": 1, "triangle": 2, "quad": 2}
"""Of cells that are read and of those that make groups, by meshio's name."""

PART_NUMBERS = "part"
"""Cell data whose whole numbers are parts of the body; 0 is the main one."""

PHYSICAL = "gmsh:physical"
"""Cell data in which meshio gives numbers of Gmsh's physical groups; 0 is none."""

TAGS = (PHYSICAL, "medit:ref", "avsucd:material", "su2:tag", "ugrid:ref", "netgen:index")
"""Cell data in which meshio gives numbers of groups; 0 is none."""

FAMILIES = ("cell_tags", "point_tags")
"""Data in which meshio gives families of MED, and attributes with the groups of each."""

READERS: dict[str, Callable[[bytes], Any]] = {
    ".inp": abaqus.read,
    **dict.fromkeys((".bdf", ".nas", ".fem"), nastran.read),
    **dict.fromkeys((".e", ".exo", ".ex2"), exodus.read),
}
"""Readers of a file's bytes, by ending."""

COMPANIONS = (".xdmf", ".xmf", ".node", ".ele", ".pvtu", ".pvd", ".vtm")
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


def library() -> Any:
    """Package that reads and writes mesh files, imported here alone; one with its interface can take its place."""
    import meshio

    return meshio


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
    check_folder(path)
    grouped = mesh if isinstance(mesh, GroupedMesh) else GroupedMesh(mesh)
    mesh = grouped.mesh
    if len(mesh.bonds):
        raise MeshError(f"{path}: a mesh file has no place for {len(mesh.bonds)} bonds; write the springs of a scene")
    # A named point that is no particle becomes a point of its own.
    places: list[np.ndarray] = []
    blocks: list[tuple[str, np.ndarray, list[str]]] = []
    labels = part_names(grouped)
    for name, count in CELLS.items():
        for part in ("", *grouped.parts) if count in labels else ():
            mask = labels[count] == part
            if mask.any():
                blocks.append((name, mesh.cells[count][mask], [part] * bool(part)))
    blocks += [("line", edges, [side]) for side, edges in grouped.sides.items()]
    for point, place in grouped.points.items():
        number = grouped.particle(point)
        if number is None:
            number = len(mesh.points) + len(places)
            places.append(np.asarray(place))
        blocks.append(("vertex", np.array([[number]]), [point]))
    points = np.concatenate([mesh.points, np.reshape(places, (-1, 2))])
    points = np.column_stack([points, np.zeros(len(points))])
    data, fields = (_vtu_marks if ending == ".vtu" else _gmsh_tags)(path, blocks)
    cells = [(kind, corners) for kind, corners, _ in blocks]
    content = library().Mesh(points, cells, cell_data=data, field_data=fields)
    with replacing(path) as unfinished:
        content.write(unfinished, file_format=kinds[ending])


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


def read_stored(path: str | Path) -> Mesh:
    """Read a mesh that `write_mesh` wrote and whose checksum was compared: of any size."""
    return assembled(path, library().read(path), 1.0, np.inf)[0]


def assembled(path: str | Path, content: Any, unit: float, most: float = MOST_IN_FILE) -> tuple[Mesh, np.ndarray]:
    """Return the mesh of meshio's data, and its particles' numbers in the file; `unit` in m."""
    cells = _read_cells(path, content)
    used = np.unique(np.concatenate([corners.ravel() for corners in cells.values()]))
    with np.errstate(over="ignore"):  # what is too far away is refused
        points = _read_points(path, unit * coordinates(path, content, most), used)
    for count, corners in cells.items():
        cells[count] = _counter_clockwise(path, points, np.searchsorted(used, corners))
    return Mesh(points, cells.get(3, no_cells(3)), cells.get(4, no_cells(4))), used


def file_content(path: str | Path) -> Any:
    """Read a file by meshio; a MeshError gives the reason for a failure."""
    if fault(path):
        raise MeshError(f"{path}: there is no such file; give the path of a mesh file")
    size = Path(path).stat().st_size
    if size == 0:
        raise MeshError(f"{path}: the file is empty; write the mesh again")
    if size > LARGEST_FILE:
        most = f"at most {LARGEST_FILE // 1_000_000} MB are read"
        raise MeshError(f"{path}: {size / 1e6:.0f} MB, and {most}; write a coarser mesh, or binary VTU")
    content = Path(path).read_bytes()
    ending = Path(path).suffix.lower()
    if ending in COMPANIONS:
        raise MeshError(f"{path}: {IN_OTHER_FILES}")
    if HDF5 in content:
        try:
            with suppress(OSError):  # meshio says it
                check_alone(path)
        except DataElsewhere as error:
            raise MeshError(str(error)) from None
    told, memory, package = io.StringIO(), READ_MEMORY + READ_MEMORY_SHARE * size, library()
    try:
        # meshio tells people of what it leaves out, and exits where it does not know the format.
        with redirect_stdout(told), redirect_stderr(told), warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            with bounded(memory, READ_SECONDS + READ_SECONDS_SHARE * size):
                return _read(path, content, ending)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None
    except MemoryError as error:
        wanted = np.inf if isinstance(error, BeyondBound) else 8 * np.prod(getattr(error, "shape", 0), dtype=float)
        if wanted <= memory:
            raise  # the machine has too little
        stated = f"it states more points or cells than its {size / 1e3:.3g} kB can hold"
        raise MeshError(f"{path}: is damaged: {stated}; write it again") from None
    except (Exception, SystemExit) as error:
        if isinstance(error, OSError) and (error.errno or 0) > 0:  # the system's; netCDF has numbers of its own, below
            raise
        said = " ".join(told.getvalue().split() if isinstance(error, SystemExit) else str(error).split())
        said = said.partition("Error: Couldn't read")[0].removeprefix("ReadError:").strip()
        said = said if re.search(r"\w{2} \S", said) else ""  # a key alone says nothing
        shown = f" ({said[:LONGEST_SAID]}{'...' * (len(said) > LONGEST_SAID)})" if said else ""
        why = f"it is damaged, or has what is not supported{shown}; write it again, in text, or as .vtu"
        if ending not in {**package.extension_to_filetypes, **READERS}:
            why = f"unknown format '{Path(path).suffix}'; convert it to .vtu or .msh"
        raise MeshError(f"{path}: cannot be read: {why}") from None


def _read(path: str | Path, content: bytes, ending: str) -> Any:
    """Content of a file, by the reader of its format."""
    if ending in READERS:
        return READERS[ending](content)
    if ending == ".vtu":
        return vtu.read(path, content, library().read)
    if ending == ".msh" and content.lstrip()[:1] == b"$":  # others are of Ansys
        return gmsh.read(content, partial(library().read, path))
    return library().read(path)


def coordinates(path: str | Path, content: Any, most: float = MOST_IN_FILE) -> np.ndarray:
    """Coordinates of all points, shape (n_points, 2 or 3)."""
    try:
        points = np.asarray(content.points, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise MeshError(f"{path}: coordinates that are no numbers; write the mesh again") from None
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        shape = " x ".join(map(str, points.shape))
        raise MeshError(f"{path}: coordinates of points are {shape}, not 2 or 3 for each; write the mesh again")
    if len(points) > most:
        raise MeshError(f"{path}: {len(points)} points, and at most {most} are read; write a coarser mesh")
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
        elif block.type not in CELL_DIMENSIONS:
            raise MeshError(f"{path}: has cells '{block.type}'; {LINEAR}")
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
        first = f"{nowhere.sum()}, the first one {used[nowhere][0]}"
        raise MeshError(f"{path}: points with coordinates that are no numbers: {first}; mend them")
    extent = np.ptp(points, axis=0)
    if not np.isfinite(extent**4).all():
        raise MeshError(f"{path}: extends over {extent.max():.3g} m; correct coordinates or the unit")
    if points.shape[1] > 2 and extent[2] > 1e-9 * extent[:2].max():
        away = np.abs(points[:, 2] - points[0, 2])
        first = f"point {used[np.argmax(away > 1e-9 * extent[:2].max())]}"
        raise MeshError(f"{path}: points leave the plane of x and y, the first one {first}; give a plane mesh")
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


def read_shape(path: str | Path, unit: float = 1.0) -> GroupedMesh:
    """Read a mesh with its groups, of any format that meshio supports.

    Groups are physical groups of Gmsh (by number if unnamed), sets of cells and points of Abaqus and others, and
    named arrays of zeros and ones in VTU; cell data ``part`` numbers parts. Lines, and points joined by the outline,
    make sides; one point makes a point; triangles and quadrilaterals make a part, unless they are all cells.

    Parameters
    ----------
    path : str or Path
    unit : float, optional
        Unit of the coordinates in the file [m].

    Returns
    -------
    GroupedMesh
        `unusable` says why groups of the file are not usable.

    Raises
    ------
    MeshError
        As `read_mesh`, and if the cells are not a conforming plane sheet.
    """
    content = file_content(path)
    mesh, used = assembled(path, content, unit)
    fault = sheet_fault(mesh)
    if fault:
        raise MeshError(f"{path}: {fault}")
    return _Groups(mesh, used, unit * coordinates(path, content)[:, :2], content).grouped()


class _Groups:
    """Groups of a file, by what meshio read."""

    def __init__(self, mesh: Mesh, used: np.ndarray, places: np.ndarray, content: Any):
        self.mesh, self.places, self.content = mesh, places, content
        self.numbers = np.full(len(places), -1)
        self.numbers[used] = np.arange(len(used))
        self.sides: dict[str, np.ndarray] = {}
        self.points: dict[str, np.ndarray] = {}
        self.parts: dict[str, dict[int, np.ndarray]] = {}
        self.unusable: dict[str, str] = dict(getattr(content, "unusable", {}))
        self.cell_sets = [name for name in content.cell_sets if not name.startswith("gmsh:")]
        self.outline, _ = outline_of(mesh)
        self.codes = self.outline @ [len(mesh.points), 1]

    def grouped(self) -> GroupedMesh:
        """The mesh with what can be groups of it."""
        lines: dict[str, list[np.ndarray]] = defaultdict(list)
        points: dict[str, list[np.ndarray]] = defaultdict(list)
        cells: dict[str, dict[int, np.ndarray]] = {}
        blocks = self.content.cells
        for name, number, chosen in self._sets():
            block = blocks[number] if number >= 0 else None
            if block is None and len(chosen):
                points[name].append(chosen)
            if block is None or not len(chosen):
                continue
            if not 0 <= chosen.min() <= chosen.max() < len(block.data):
                self.unusable[name] = "has cells that are not in the file; remove these"
            elif block.type in CELLS:
                # Cells of one number of corners stand in the mesh in the order of the file's blocks.
                before = sum(len(other.data) for other in blocks[:number] if other.type == block.type)
                none = {count: np.zeros(len(corners), dtype=bool) for count, corners in self.mesh.cells.items()}
                cells.setdefault(name, none)[CELLS[block.type]][before + chosen] = True
            elif block.type in CELL_DIMENSIONS:
                (lines if block.type == "line" else points)[name].append(np.asarray(block.data)[chosen])
        for name in {**lines, **points, **cells}:
            if not NAME.fullmatch(name):
                self.unusable[name] = f"cannot be a name; {NAME_RULE}"
            given = [one.ravel() for one in [*lines.get(name, []), *points.get(name, [])]]
            if any(not 0 <= one.min() <= one.max() < len(self.numbers) for one in given):
                self.unusable[name] = "has points that are not in the file; remove these"
            if name in self.unusable:
                continue
            if name in lines:
                self._add_lines(name, np.unique(np.concatenate(lines[name]).reshape(-1, 2), axis=0))
            if name in points and name not in self.unusable:
                self._add_points(name, np.unique(np.concatenate(points[name])))
        self._add_parts({name: masks for name, masks in cells.items() if name not in self.unusable})
        for name in [name for name in self.sides if name in self.points]:
            del self.points[name], self.sides[name]
            self.unusable[name] = "names sides and a point in the file; rename one"
        for name in (*self.content.field_data, *self.content.point_sets, *self.content.cell_sets):
            if ":" not in name and name not in {*lines, *points, *cells}:  # others are notes of a format, as of MED
                self.unusable.setdefault(name, "has nothing in the file; put something in it")
        return GroupedMesh(self.mesh, self.sides, self.points, self.parts, self.unusable)

    def _sets(self) -> Iterator[tuple[str, int, np.ndarray]]:
        """Name, number of the block of cells, or -1 for points, and numbers of members in it, of all sets."""
        content = self.content
        yield from getattr(content, "members", ())
        for name in self.cell_sets:
            parts = content.cell_sets[name]
            if len(parts) != len(content.cells):
                self.unusable[name] = "is a set of which meshio does not tell the cells; give it as cells"
                continue
            yield from ((name, n, np.ravel(part).astype(np.int64)) for n, part in enumerate(parts) if part is not None)
        for key, arrays in content.cell_data.items():
            for number, (values, block) in enumerate(zip(arrays, content.cells)):
                if block.type in CELL_DIMENSIONS:
                    for name, chosen in self._in_data(key, values, arrays, CELL_DIMENSIONS[block.type]):
                        yield name, number, chosen
        yield from ((name, -1, np.ravel(nodes).astype(np.int64)) for name, nodes in content.point_sets.items())
        for key, values in content.point_data.items():
            yield from ((name, -1, chosen) for name, chosen in self._in_data(key, values, [values]))

    def _in_data(
        self, key: str, given: Any, arrays: list[Any], dimension: int = -1
    ) -> Iterator[tuple[str, np.ndarray]]:
        """Groups in an array of data, by families of MED, numbers of groups or marks, and their members."""
        values = np.asarray(given)
        if values.ndim != 1 or values.dtype.kind not in "iub":
            return
        if key in FAMILIES:
            found = [(name, tag) for tag, names in getattr(self.content, key, {}).items() for name in names]
        elif dimension >= 0 and key == PART_NUMBERS:
            found = [(str(tag), tag) for tag in np.unique(values[values != 0]).tolist()]
        elif dimension >= 0 and key in TAGS:
            known = {tuple(map(int, one)): name for name, one in self.content.field_data.items() if len(one) == 2}
            found = [(known.get((tag, dimension), str(tag)), tag) for tag in np.unique(values[values != 0]).tolist()]
            found = [(name, tag) for name, tag in found if name not in self.cell_sets]
        else:
            found = [(key, 1)] if ":" not in key and self._marks(key, arrays) else []
        yield from ((name, np.flatnonzero(values == tag)) for name, tag in found)

    def _marks(self, name: str, arrays: list[Any]) -> bool:
        """Whether data are zeros and ones."""
        if any(((np.asarray(values) != 0) & (np.asarray(values) != 1)).any() for values in arrays):
            self.unusable[name] = "has other values than 0 and 1 in the file; mark what belongs to it by 1"
            return False
        if not any(np.any(values) for values in arrays):
            self.unusable[name] = "is 0 all over in the file; mark what belongs to it by 1"
            return False
        return True

    def _add_lines(self, name: str, lines: np.ndarray) -> None:
        """Sides of lines, by points of the file."""
        ends = self.numbers[lines]
        count = len(self.mesh.points)
        forth, back = np.isin(ends @ [count, 1], self.codes), np.isin(ends @ [1, count], self.codes)
        wrong = (ends < 0).any(axis=1) | ~(forth | back)
        if wrong.any():
            why = f"is not on the outline: of its {len(lines)} lines {wrong.sum()} are no sides"
            self._refuse(name, why, lines[wrong])
            return
        self.sides[name] = np.unique(np.where(forth[:, None], ends, ends[:, ::-1]), axis=0)

    def _refuse(self, name: str, why: str, nodes: np.ndarray) -> None:
        self.unusable[name] = f"{why}, the first one at {in_words(self.places[nodes[0]])}; take these out"

    def _add_points(self, name: str, nodes: np.ndarray) -> None:
        """A point, or sides of points, by points of the file."""
        if len(nodes) == 1:
            self.points[name] = self.places[nodes[0]]
            return
        particles = self.numbers[nodes]
        edges = self.outline[np.isin(self.outline, particles).all(axis=1)]
        alone = ~np.isin(particles, edges)
        if alone.any():
            what = f"of its {len(nodes)} points {alone.sum()} are at the end of no side"
            self._refuse(name, f"is neither one point nor sides: {what}", nodes[alone])
            return
        if name in self.sides and {*map(tuple, edges.tolist())} != {*map(tuple, self.sides[name].tolist())}:
            del self.sides[name]
            self.unusable[name] = "is lines and points in the file that are not the same sides; rename one"
            return
        self.sides[name] = edges

    def _add_parts(self, found: dict[str, dict[int, np.ndarray]]) -> None:
        """Parts of the body, where no cell is in two."""
        found = {name: masks for name, masks in found.items() if not all(mask.all() for mask in masks.values())}
        for name, masks in found.items():
            several = {other: any((masks[n] & their[n]).any() for n in masks) for other, their in found.items()}
            if others := [other for other, shared in several.items() if shared and other != name]:
                self.unusable[name] = f"has cells that part '{others[0]}' has, too; a cell has one material"
            else:
                self.parts[name] = masks

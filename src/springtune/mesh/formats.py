"""Mesh files and their groups: Gmsh's 4.1 and Abaqus' by readers of their own, all others by meshio."""

import io
import re
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ..registry import NAME, NAME_RULE
from ..safe_io import DataElsewhere, bounded, check_alone, check_folder, replacing, why_unreadable
from . import abaqus, gmsh
from .cells import Mesh, MeshError, counter_clockwise, no_cells, signed_areas
from .sheets import COORDINATE_TOLERANCE, Content, GroupedMesh, box_fault, on_sides, outline_of, part_names, sheet_fault
from .sides import in_words

CELL_TYPES = {3: "triangle", 4: "quad"}  # meshio's names of cells by their number of corners

CORNER_COUNTS = {"vertex": 1, "line": 2, "triangle": 3, "quad": 4}
"""Points of cells that are read and of those that make groups, by meshio's name."""

PART_NUMBERS = "part"  # cell data whose whole numbers are parts of the body; 0 is the main one

NUMBER_KEYS = (PART_NUMBERS, "gmsh:physical", "medit:ref", "avsucd:material", "su2:tag", "ugrid:ref", "netgen:index")
"""Cell data with numbers of groups; 0 is none."""

MED_FAMILY_KEYS = ("cell_tags", "point_tags")
"""Data in which meshio gives families of MED, and attributes with the groups of each."""

GHOST_KEYS = ("vtkGhostType", "vtkGhostLevels")  # data in which what belongs to other files is not 0

REASONS_BY_ENDING = {
    **dict.fromkeys((".xdmf", ".xmf", ".node", ".ele", ".pvtu", ".pvd", ".vtm"), abaqus.OTHER_FILES_REASON),
    **dict.fromkeys((".bdf", ".nas", ".fem"), "is of Nastran, which is not read; export it as .msh, .inp or .vtu"),
    **dict.fromkeys((".e", ".exo", ".ex2"), "is of Exodus, which is not read; export it as .msh, .inp or .vtu"),
}
"""Why files are refused by their ending: meshio would miss parts of them, or their groups."""

HDF5_SIGNATURE = b"\x89HDF\r\n"  # first bytes of HDF5 files, some after a block of their own

MOST_FILE_BYTES = 60_000_000  # bytes of the largest file that is read: formats in text take a second for some megabytes

READ_BYTES, READ_BYTES_PER_BYTE = 5e8, 40.0
"""Memory that reading a file may take [bytes], and how often its size besides: no sound file takes as much."""

READ_SECONDS, READ_SECONDS_PER_BYTE = 2.0, 3e-6
"""Seconds of the processor that it may take, and for each byte besides: some readers wait for lines for ever."""

MOST_FILE_POINTS = 1_000_000  # most points of a file; such a mesh is read within seconds and in less than a gigabyte

MOST_MESSAGE_CHARACTERS = 120  # most characters of a message of meshio that are shown


def library() -> Any:
    """Package that reads and writes mesh files, imported here alone; one with its interface can take its place."""
    import meshio

    return meshio


def write_mesh(path: str | Path, mesh: Mesh | GroupedMesh) -> None:
    """Write a mesh atomically as ``.vtu``, with its groups as cell data; `springtune.read_shape` reads them."""
    if Path(path).suffix != ".vtu":
        raise MeshError(f"{path}: cannot end in '{Path(path).suffix}'; give a name that ends in .vtu")
    check_folder(path)
    grouped = mesh if isinstance(mesh, GroupedMesh) else GroupedMesh(mesh)
    mesh = grouped.mesh
    if len(mesh.bonds):
        raise MeshError(f"{path}: a mesh file has no place for {len(mesh.bonds)} bonds; write the springs of a scene")
    # A named point that is no particle becomes a point of its own.
    places, blocks = list[np.ndarray](), list[tuple[str, np.ndarray, str]]()
    for count, labels in part_names(grouped).items():
        for part in ("", *grouped.parts):
            if (mask := labels == part).any():
                blocks.append((CELL_TYPES[count], mesh.cells[count][mask], part))
    blocks += [("line", edges, side) for side, edges in grouped.sides.items()]
    for point, place in grouped.points.items():
        number = grouped.particle(point)
        if number is None:
            number = len(mesh.points) + len(places)
            places.append(np.asarray(place))
        blocks.append(("vertex", np.array([[number]]), point))
    names = dict.fromkeys(group for *_, group in blocks if group)
    if PART_NUMBERS in names:
        raise MeshError(f"{path}: a group is named '{PART_NUMBERS}', by which VTU files number parts; rename it")
    points = np.concatenate([mesh.points, np.reshape(places, (-1, 2))])
    points = np.column_stack([points, np.zeros(len(points))])
    data = {name: [np.full(len(corners), name == own, dtype=np.int8) for _, corners, own in blocks] for name in names}
    content = library().Mesh(points, [(kind, corners) for kind, corners, _ in blocks], cell_data=data)
    with replacing(path) as unfinished:
        content.write(unfinished, file_format="vtu")


def read_mesh(path: str | Path, unit: float = 1.0) -> Mesh:
    """Read a mesh of any format that meshio reads, without loose particles; `unit` is the file's [m]."""
    return _build_mesh(path, _file_content(path), unit)[0]


def read_stored(path: str | Path) -> Mesh:
    """Read a mesh that `write_mesh` wrote and whose checksum was compared: of any size."""
    return _build_mesh(path, _by_meshio(library().read(path)), 1.0, np.inf)[0]


def _build_mesh(
    path: str | Path, content: Content, unit: float, most: float = MOST_FILE_POINTS
) -> tuple[Mesh, np.ndarray]:
    """Return the mesh of a file, and its particles' numbers in the file; `unit` in m."""
    if len(content.points) > most:
        raise MeshError(f"{path}: {len(content.points)} points, and at most {most} are read; write a coarser mesh")
    blocks = {n: [corners for kind, corners in content.cells if CORNER_COUNTS[kind] == n] for n in (3, 4)}
    cells = {n: np.concatenate([no_cells(n), *found]).astype(np.int64) for n, found in blocks.items()}
    if not any(map(len, cells.values())):
        raise MeshError(f"{path}: no cell block 'triangle' or 'quad'; write the mesh with triangles or quadrilaterals")
    used = np.unique(np.concatenate([corners.ravel() for corners in cells.values()]))
    with np.errstate(over="ignore"):  # what is too far away is refused
        points = _read_points(path, unit * content.points, used)
    for count, corners in cells.items():
        cells[count] = corners = counter_clockwise(points, np.searchsorted(used, corners))
        areas = signed_areas(points, corners)
        if len(flat := corners[areas <= 1e-12 * areas.max(initial=0.0)]):
            first = in_words(points[flat[0]])
            raise MeshError(f"{path}: cells with no area: {len(flat)}, the first one at {first}; remove them")
    return Mesh(points, cells[3], cells[4]), used


def _file_content(path: str | Path) -> Content:
    """Read a file; a MeshError gives the reason for a failure."""
    if why_unreadable(path):
        raise MeshError(f"{path}: there is no such file; give the path of a mesh file")
    size, ending = Path(path).stat().st_size, Path(path).suffix.lower()
    if ending in REASONS_BY_ENDING:
        raise MeshError(f"{path}: {REASONS_BY_ENDING[ending]}")
    if ending not in library().extension_to_filetypes:
        raise MeshError(f"{path}: unknown format '{ending}'; convert it to .vtu or .msh")
    if size == 0:
        raise MeshError(f"{path}: the file is empty; write the mesh again")
    if size > MOST_FILE_BYTES:
        most = f"at most {MOST_FILE_BYTES // 1_000_000} MB are read"
        raise MeshError(f"{path}: {size / 1e6:.0f} MB, and {most}; write a coarser mesh, or binary VTU")
    memory, seconds = READ_BYTES + READ_BYTES_PER_BYTE * size, READ_SECONDS + READ_SECONDS_PER_BYTE * size
    aside = io.StringIO()
    try:
        # meshio prints what it leaves out, and exits where it reads nothing.
        with redirect_stderr(aside), redirect_stdout(aside), np.errstate(all="ignore"), bounded(memory, seconds):
            return _read(path, ending)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None
    except DataElsewhere as error:  # names the file
        raise MeshError(str(error)) from None
    except (Exception, SystemExit) as error:
        message = " ".join(str(error).split())[:MOST_MESSAGE_CHARACTERS]
        detail = f" ({message})" if re.search(r"\w{2} \S", message) else ""  # a key alone tells nothing
        why = f"it is damaged, or has what is not supported{detail}; write it again, in text, or as .vtu"
        raise MeshError(f"{path}: cannot be read: {why}") from None


def _read(path: str | Path, ending: str) -> Content:
    """Content of a file, by the reader of its format."""
    raw = Path(path).read_bytes()
    if ending == ".inp":
        return abaqus.read(raw)
    if ending == ".vtu":
        return _read_vtu(raw)
    if ending == ".msh" and raw.lstrip()[:1] == b"$":  # others are of Ansys
        return gmsh.read(raw) or gmsh.check_once(_by_meshio(library().read(path)))
    if HDF5_SIGNATURE in raw:
        check_alone(path)
    return _by_meshio(library().read(path))


def _read_vtu(raw: bytes) -> Content:
    """Content of a VTU file of one piece, with all of its mesh."""
    head, mark, tail = raw.partition(b"<AppendedData")
    if re.search(rb"compressor\s*=\s*.vtkLZ4", head):
        raise MeshError("is compressed by LZ4, which is not read; write it with ZLib, or without compression")
    if re.search(rb"type\s*=\s*.P(Unstr|Poly)", head):
        raise MeshError(abaqus.OTHER_FILES_REASON)
    if (pieces := len(re.findall(rb"<Piece\b", head))) > 1:
        raise MeshError(f"has {pieces} pieces, and one is read; join them, in ParaView by the filter Clean to Grid")
    if re.search(rb"NumberOfCells\s*=\s*.0\b", head):  # which meshio does not read
        raise MeshError("has no cells; write the mesh with triangles or quadrilaterals")
    with TemporaryDirectory() as folder:
        file = Path(folder) / "piece.vtu"
        # Version 2 tells copies and polyhedra in another way, cells alike; meshio knows version 1.
        file.write_bytes(re.sub(rb"(<VTKFile[^>]*version\s*=\s*.)2\.\d", rb"\g<1>1.0", head) + mark + tail)
        found = library().read(file)
    if any(np.any(array) for key in GHOST_KEYS for array in found.cell_data.get(key, ())):
        raise MeshError(abaqus.OTHER_FILES_REASON)
    return _by_meshio(found)


def _by_meshio(found: Any) -> Content:
    """Content of a file read by meshio: groups are sets, numbers in cell data, and marks of zeros and ones."""
    points = np.asarray(found.points, dtype=float)
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise ValueError(f"coordinates of points of shape {points.shape}")
    if others := [block.type for block in found.cells if block.type not in CORNER_COUNTS]:
        raise MeshError(f"has cells '{others[0]}'; {gmsh.LINEAR_CELLS_REMEDY}")
    content = Content(points, [(block.type, np.asarray(block.data)) for block in found.cells])
    for kind, corners in content.cells:
        if len(corners) and (corners.shape[1:] != (CORNER_COUNTS[kind],) or corners.dtype.kind not in "iu"):
            raise ValueError(f"cells '{kind}' by numbers {corners.dtype} of shape {corners.shape}")
    # Names with a colon are notes of a format, as of MED.
    content.cell_groups.update({name: [] for name in found.field_data if ":" not in name})
    dimensions = np.repeat([min(CORNER_COUNTS[kind] - 1, 2) for kind, _ in content.cells], np.diff(content.starts()))
    names = {tuple(map(int, one)): name for name, one in found.field_data.items() if len(one) == 2}
    data = [(key, np.concatenate(arrays), content.cell_groups) for key, arrays in found.cell_data.items()]
    data += [(key, np.asarray(values), content.point_groups) for key, values in found.point_data.items()]
    for key, values, groups in data:
        if groups is content.cell_groups and key in NUMBER_KEYS and values.dtype.kind in "iu":
            for tag, dimension in np.unique(np.stack([values, dimensions])[:, values != 0], axis=1).T.tolist():
                name = names.get((tag, dimension), str(tag))
                groups[name].append(np.flatnonzero((values == tag) & (dimensions == dimension)))
        elif values.ndim != 1 or values.dtype.kind not in "iub":
            continue
        elif key in MED_FAMILY_KEYS:
            for tag, families in getattr(found, key, {}).items():
                for name in families:
                    groups[name].append(np.flatnonzero(values == tag))
        elif ":" not in key and np.isin(values, (0, 1)).all() and values.any():
            groups[key].append(np.flatnonzero(values))
        elif ":" not in key:
            what = "has other values than 0 and 1" if values.any() else "is 0 all over"
            content.unusable[key] = f"{what} in the file; mark what belongs to it by 1"
    return content


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


def read_beam_mesh(path: str | Path, length: float, height: float, unit: float = 1.0) -> Mesh:
    """Read a mesh that must fill a box, and move its lower left corner to the origin; lengths in m."""
    mesh = read_mesh(path, unit)
    box = np.array([length, height])
    mesh = Mesh(mesh.points - mesh.points.min(axis=0), mesh.triangles, mesh.quads)
    extent = mesh.points.max(axis=0)
    if np.abs(extent / box - 1).max() > COORDINATE_TOLERANCE:
        of_file, of_beam = (" x ".join(f"{1e3 * side:.6g}" for side in sides) for sides in (extent, box))
        raise MeshError(f"{path}: extends over {of_file} mm, its beam over {of_beam} mm; correct the unit or the beam")
    try:
        mesh = on_sides(mesh, box)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from None
    if fault := box_fault(mesh):
        raise MeshError(f"{path}: {fault}")
    return mesh


def read_shape(path: str | Path, unit: float = 1.0) -> GroupedMesh:
    """Read a mesh with its groups, of any format that meshio reads; `unit` is that of coordinates in the file [m].

    Lines, and points joined by the outline, make sides; one point makes a point; triangles and quadrilaterals make a
    part, unless they are all cells. In VTU groups are named arrays of zeros and ones; cell data ``part`` numbers parts.
    """
    content = _file_content(path)
    mesh, used = _build_mesh(path, content, unit)
    if fault := sheet_fault(mesh):
        raise MeshError(f"{path}: {fault}")
    return _Groups(mesh, used, unit * content.points[:, :2]).grouped(content)


class _Groups:
    """Groups of a mesh by numbers of points in its file."""

    def __init__(self, mesh: Mesh, used: np.ndarray, places: np.ndarray):
        self.mesh, self.places = mesh, places
        self.particles = np.full(len(places), -1)
        self.particles[used] = np.arange(len(used))
        self.outline, _ = outline_of(mesh)

    def grouped(self, content: Content) -> GroupedMesh:
        """Return the mesh with its groups, and the reasons why others are not usable."""
        sides, points, parts = {}, {}, {}
        unusable = dict(content.unusable)
        for name in [one for one in {**content.cell_groups, **content.point_groups} if one not in unusable]:
            try:
                lines, nodes, cells = self._members(name, content)
                edges = self._sides(lines, nodes)
            except MeshError as error:
                unusable[name] = str(error)
                continue
            if len(edges):
                sides[name] = edges
            elif len(nodes):
                points[name] = self.places[nodes[0]]
            if any(mask.any() for mask in cells.values()) and not all(mask.all() for mask in cells.values()):
                parts[name] = cells
        for name, cells in parts.items():
            others = (one for one in parts if one != name and any((cells[n] & parts[one][n]).any() for n in cells))
            if other := next(others, ""):
                unusable[name] = f"has cells that part '{other}' has, too; a cell has one material"
        parts = {name: cells for name, cells in parts.items() if name not in unusable}
        return GroupedMesh(self.mesh, sides, points, parts, unusable)

    def _members(self, name: str, content: Content) -> tuple[np.ndarray, np.ndarray, dict[int, np.ndarray]]:
        """Lines (n, 2) and points of a group, by points of the file, and masks of its cells by number of corners."""
        starts = content.starts()
        mask = np.zeros(starts[-1], dtype=bool)
        chosen = np.concatenate([[], *content.cell_groups.get(name, [])]).astype(np.int64)
        mask[chosen] = True
        blocks = [(CORNER_COUNTS[kind], cells) for kind, cells in content.cells]
        cells = [(count, cells, own) for (count, cells), own in zip(blocks, np.split(mask, starts[1:-1]))]
        masks = {n: np.concatenate([own for count, _, own in cells if count == n]) for n in self.mesh.cells}
        vertices, lines = ([corners[own] for count, corners, own in cells if count == n] for n in (1, 2))
        edges = np.unique(np.concatenate([no_cells(2), *lines]), axis=0)
        points = [*map(np.ravel, vertices), *content.point_groups.get(name, [])]
        nodes = np.unique(np.concatenate([[], *points]).astype(np.int64))
        if not NAME.fullmatch(name):
            raise MeshError(f"cannot be a name; {NAME_RULE}")
        if not mask.any() and not len(nodes):
            raise MeshError("is empty in the file; put sides, points or cells into it")
        if any(len(own) and not 0 <= own.min() <= own.max() < len(self.places) for own in (edges, nodes)):
            raise MeshError("has points that are not in the file; remove these")
        return edges, nodes, masks

    def _sides(self, lines: np.ndarray, nodes: np.ndarray) -> np.ndarray:
        """Edges of the outline that are lines, or join points; none of them for one point."""
        if len(lines) and len(nodes) == 1:
            raise MeshError("names sides and a point in the file; rename one")
        base = len(self.places)
        codes, ends = self.outline @ [base, 1], self.particles[lines]
        forth, back = np.isin(ends @ [base, 1], codes), np.isin(ends @ [1, base], codes)
        wrong = (ends < 0).any(axis=1) | ~(forth | back)
        if wrong.any():
            why = f"is not on the outline: of its {len(lines)} lines {wrong.sum()} are no sides"
            raise self._refusal(why, lines[wrong][0])
        sides = np.unique(np.where(forth[:, None], ends, ends[:, ::-1]), axis=0)
        if len(nodes) < 2:
            return sides
        edges = self.outline[np.isin(self.outline, self.particles[nodes]).all(axis=1)]
        loose = ~np.isin(self.particles[nodes], edges)
        if loose.any():
            what = f"of its {len(nodes)} points {loose.sum()} are at the end of no side"
            raise self._refusal(f"is neither one point nor sides: {what}", nodes[loose])
        if len(lines) and set(edges @ [base, 1]) != set(sides @ [base, 1]):
            raise MeshError("is lines and points in the file that are not the same sides; rename one")
        return edges

    def _refusal(self, why: str, nodes: np.ndarray) -> MeshError:
        return MeshError(f"{why}, the first one at {in_words(self.places[nodes[0]])}; take these out")

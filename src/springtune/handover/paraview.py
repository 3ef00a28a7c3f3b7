"""Files for ParaView: an unstructured grid with its data (.vtu), and collections of such files (.pvd)."""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from xml.sax.saxutils import quoteattr, unescape

import numpy as np

from ..mesh.formats import library
from ..safe_io.atomic import UNFINISHED, replacing
from ..safe_io.escapes import shown

CELL_NAMES = {2: "line", 3: "triangle", 4: "quad"}
"""meshio's names of cells by their corners."""


def write_vtu(
    path: str | Path,
    points: np.ndarray,
    cells: Mapping[int, np.ndarray],
    point_data: Mapping[str, np.ndarray],
    cell_data: Mapping[str, Mapping[int, np.ndarray]],
    numbers: Mapping[str, float],
    comment: str,
) -> None:
    """Write points [m] and cells with their data; the file appears whole or not at all.

    `cells` are particles by number of corners, 2 for lines. `cell_data` is by name and number of corners, NaN on cells
    without it. Vectors get a third component of zero for ParaView.
    """

    def flat(values: np.ndarray) -> np.ndarray:
        if values.ndim == 1:
            return values
        return np.column_stack([values, np.zeros(len(values), dtype=values.dtype)])

    present = {count: corners for count, corners in cells.items() if len(corners)}
    data = {}
    for name, given in cell_data.items():
        shape = next(iter(given.values())).shape[1:]
        data[name] = [
            given[count] if count in given else np.full((len(corners), *shape), np.nan)
            for count, corners in present.items()
        ]
    grid = library().Mesh(
        flat(points),
        [(CELL_NAMES[count], corners) for count, corners in present.items()],
        point_data={name: flat(values) for name, values in point_data.items()},
        cell_data=data,
    )
    with replacing(path) as unfinished:
        grid.write(unfinished, file_format="vtu")
        added = "".join(
            f'<DataArray type="Float64" Name={name} NumberOfTuples="1" format="ascii">{value!r}</DataArray>'
            for name, value in ((quoteattr(shown(key)), number) for key, number in numbers.items())
        )
        # A comment must not have two hyphens in a row; as JSON has them they are the same.
        said = comment.replace("--", "-\\u002d")
        fields = f"<FieldData>{added}</FieldData>" if added else ""
        grid_tag = "<UnstructuredGrid>"
        begin = f"<!--\n{said}\n-->{grid_tag}{fields}"
        unfinished.write_bytes(unfinished.read_bytes().replace(grid_tag.encode(), begin.encode(), 1))


MOST_PIECES = 10_000
"""Most files of a collection: more are slow in ParaView and file systems."""

Add = Callable[..., None]
"""Adds a piece to a collection: its time, what writes it to a file of a given name, and a name where it has one."""


@contextmanager
def series(path: str | Path) -> Iterator[Add]:
    """Context in which a collection of files is written, which ParaView opens as one that changes in time.

    ``swing.pvd`` names ``swing/swing_0000.vtu`` and so on; all are written or none, and files of an older collection of
    that name are removed. It yields ``add(time, write, name="")``: the time of a piece [s], the function that writes it
    to a path, and a name in the place of a number.
    """
    path = Path(path)
    folder, before = path.with_suffix(""), pieces_of(path)[1:]
    made = not folder.exists()
    folder.mkdir(parents=True, exist_ok=True)
    times: list[float] = []
    pieces: list[Path] = []

    def add(time: float, write: Callable[[Path], None], name: str = "") -> None:
        name = name or f"{folder.name}_{len(pieces):04}"
        pieces.append(folder / f"{name}.vtu{UNFINISHED}")
        times.append(time)
        write(pieces[-1])

    finished: list[Path] = []
    try:
        yield add
        names = [piece.stem for piece in pieces]
        rows = [
            f'    <DataSet timestep="{time!r}" part="0" file={quoteattr(f"{folder.name}/{name}")}/>'
            for time, name in zip(times, names)
        ]
        lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">', "  <Collection>"]
        with replacing(path) as unfinished:
            # All that takes room on a disk comes before the first file gets its name.
            unfinished.write_text("\n".join([*lines, *rows, "  </Collection>", "</VTKFile>", ""]), encoding="utf-8")
            for piece, name in zip(pieces, names):
                finished.append(piece.replace(folder / name))
    except BaseException:
        for piece in {*pieces, *finished} - set(before):
            piece.unlink(missing_ok=True)
        if made:
            with suppress(OSError):  # not empty: the first error is the one to raise
                folder.rmdir()
        raise
    for old in set(before) - set(finished):
        old.unlink(missing_ok=True)
    if not finished:
        with suppress(OSError):
            folder.rmdir()


def pieces_of(path: str | Path) -> list[Path]:
    """A collection that `series` wrote and the files that it names; none where there is no such file."""
    path = Path(path)
    if not path.is_file():
        return []
    folder = path.with_suffix("")
    named = re.findall(r' file="([^"]*)"', path.read_text(encoding="utf-8", errors="replace"))
    mine = re.compile(rf"{re.escape(folder.name)}/([^/]*\.vtu)")  # other programs' collections may name any file
    return [path, *(folder / found.group(1) for name in named if (found := mine.fullmatch(unescape(name))))]

"""Files for ParaView: an unstructured grid with its data (.vtu)."""

from collections.abc import Mapping
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from ..mesh.formats import library
from ..safe_io import replacing, shown

CELL_NAMES = {2: "line", 3: "triangle", 4: "quad"}  # meshio's names of cells by their corners


def write_vtu(
    path: str | Path,
    points: np.ndarray,
    cells: Mapping[int, np.ndarray],
    point_data: Mapping[str, np.ndarray],
    cell_data: Mapping[str, Mapping[int, np.ndarray]],
    numbers: Mapping[str, float],
    comment: str,
) -> None:
    """Write points [m] and cells, by number of corners, with their data; the file appears whole or not at all."""

    def flat(values: np.ndarray) -> np.ndarray:
        return values if values.ndim == 1 else np.pad(values, ((0, 0), (0, 1)))

    present = {count: corners for count, corners in cells.items() if len(corners)}
    data = {}
    for name, given in cell_data.items():
        shape = next(iter(given.values())).shape[1:]
        data[name] = [given[n] if n in given else np.full((len(one), *shape), np.nan) for n, one in present.items()]
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
        header = comment.replace("--", "-\\u002d")
        fields = f"<FieldData>{added}</FieldData>" if added else ""
        grid_tag = "<UnstructuredGrid>"
        begin = f"<!--\n{header}\n-->{grid_tag}{fields}"
        unfinished.write_bytes(unfinished.read_bytes().replace(grid_tag.encode(), begin.encode(), 1))

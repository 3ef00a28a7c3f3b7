"""Read the mesh of Exodus files with its blocks, side sets and node sets; those without name have their number."""

import io
import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from .cells import MeshError
from .content import LINEAR, Content

ELEMENT_NAMES = {
    1: (r"(SPHERE|NODE|POINT|CIRCLE)\w*", "vertex"),
    2: (r"(BEAM|BAR|TRUSS|EDGE|ROD)\w*", "line"),
    3: (r"(TRI|SHELL)\w*", "triangle"),
    4: (r"(QUAD|SHELL)\w*", "quad"),
}
"""Names of elements, and meshio's, by number of points."""


def read(raw: bytes) -> Content:
    """Read a file of Exodus, in HDF5 or in the classic format of netCDF."""
    if raw[:3] != b"CDF":
        import h5py

        with h5py.File(io.BytesIO(raw)) as file:
            return _content(file)
    if raw[3] not in (1, 2):
        raise MeshError("is netCDF of 64-bit data, which is not read; write it as netCDF-4")
    from scipy.io import netcdf_file

    return _content(netcdf_file(io.BytesIO(raw), mmap=False).variables)


def _named(file: Any, array: str, kind: str) -> Iterator[tuple[str, str]]:
    """Number in the file and name of blocks or sets."""
    texts = [b"".join(row).partition(b"\0")[0].decode("utf-8", "replace") for row in file.get(f"{kind}_names", ())]
    ids = file[f"{kind}_prop1"][:] if f"{kind}_prop1" in file else range(1, len(file))
    for number in sorted(int(name[len(array) :]) for name in file if re.fullmatch(rf"{array}\d+", name)):
        own = str(ids[number - 1]) if min(ids) > 0 else ""  # meshio writes numbers from 0, which mean nothing
        yield str(number), "".join(texts[number - 1 : number]).strip() or own


def _content(file: Any) -> Content:
    """Points, cells and sets."""
    axes = file["coord"][:] if "coord" in file else [file[f"coord{one}"][:] for one in "xyz" if f"coord{one}" in file]
    content = Content(np.column_stack(list(axes)).astype(float))
    starts, faces = [0], []
    for number, name in _named(file, "connect", "eb"):
        array = file[f"connect{number}"]
        given = np.bytes_(array.attrs["elem_type"] if hasattr(array, "attrs") else array.elem_type).decode().upper()
        corners = array[:].astype(np.int64) - 1
        pattern, kind = ELEMENT_NAMES.get(corners.shape[1], ("", ""))
        if not re.fullmatch(pattern, given):
            raise MeshError(f"has cells '{given}' of {corners.shape[1]} points; {LINEAR}")
        content.add(kind, corners, *filter(None, [name]))
        starts.append(starts[-1] + len(corners))
        # Sides 1 and 2 of a shell are its faces.
        faces.append(2 * ("SHELL" in given or (given.startswith("TRI") and len(axes) == 3)))
    for number, name in _named(file, "side_ss", "ss"):
        edges = []
        for cell, side in zip(file[f"elem_ss{number}"][:] - 1, file[f"side_ss{number}"][:] - 1):
            block = int(np.searchsorted(starts, cell, "right")) - 1
            corners, first = content.cells[block].data[cell - starts[block]], side - faces[block]
            edges.append(corners[[first, (first + 1) % len(corners)]] if 0 <= first < len(corners) else [-1, -1])
        content.add("line", np.array(edges), name)
    for number, name in _named(file, "node_ns", "ns"):
        content.point_sets[name] = file[f"node_ns{number}"][:].astype(np.int64) - 1
    return content

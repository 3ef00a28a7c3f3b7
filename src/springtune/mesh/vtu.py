"""Join the pieces of VTU files, of which meshio reads the last one only."""

import re
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from .cells import MeshError
from .content import IN_OTHER_FILES, Content

COPIED = ("vtkGhostType", "vtkGhostLevels")
"""Data in which what belongs to other pieces is not 0."""


def read(path: str | Path, raw: bytes, by_meshio: Callable[[str | Path], Any]) -> Any:
    """Read a VTU file by meshio, one piece after the other."""
    head, mark, tail = raw.partition(b"<AppendedData")
    if re.search(rb"compressor\s*=\s*.vtkLZ4", head):
        raise MeshError("is compressed by LZ4, which is not read; write it with ZLib, or without compression")
    if re.search(rb"type\s*=\s*.P(Unstr|Poly)", head):
        raise MeshError(IN_OTHER_FILES)
    # Version 2 tells copies and polyhedra in another way, cells alike; meshio knows version 1.
    head = re.sub(rb"(<VTKFile[^>]*version\s*=\s*.)2\.\d", rb"\g<1>1.0", head)
    pieces = list(re.finditer(rb"<Piece\b([^>]*/>|.*?</Piece>)", head, flags=re.DOTALL))
    if len(pieces) > 1 and re.match(rb"[^>]*.raw.", tail):
        raise MeshError(f"has {len(pieces)} pieces in raw bytes; write it in text or base64, or as one piece")
    found = []
    with TemporaryDirectory() as folder:
        file = Path(folder) / "piece.vtu"
        for piece in pieces:
            if len(pieces) == 1 or not re.match(rb"<Piece[^>]*NumberOf(Points|Cells)\s*=\s*.0\D", piece[0]):
                file.write_bytes(head[: pieces[0].start()] + piece[0] + head[pieces[-1].end() :] + mark + tail)
                found.append(by_meshio(file))
    if len(pieces) > 1:
        return _joined(found)
    content = found[0] if found else by_meshio(path)
    if any(np.any(array) for key in COPIED for array in content.cell_data.get(key, ())):
        raise MeshError(IN_OTHER_FILES)
    return content


def _joined(pieces: list[Any]) -> Content:
    """Return pieces as one, without copies of cells: a point of two pieces is one, two points of a piece stay two."""
    counts = [len(one.points) for one in pieces]
    starts, count = np.cumsum([0, *counts]), sum(counts)
    points = np.concatenate([one.points for one in pieces]) + 0.0  # no negative zeros
    place = np.unique(points, axis=0, return_inverse=True)[1].ravel()
    of = place * len(pieces) + np.repeat(np.arange(len(pieces)), counts)
    _, same, often = np.unique(of, return_inverse=True, return_counts=True)
    first = np.full(count, count)
    np.minimum.at(first, place, np.arange(count))
    joint = np.where(np.isin(place, place[often[same] > 1]), np.arange(count), first[place])
    content = Content(points)
    whole = {key for one in pieces for key, values in one.point_data.items() if values.dtype.kind in "iu"}
    for key in sorted(whole.difference(COPIED)):
        values = np.concatenate([one.point_data.get(key, np.zeros(n, int)) for one, n in zip(pieces, counts)])
        content.point_data[key] = np.zeros_like(values)
        np.maximum.at(content.point_data[key], joint, values)
    keys = sorted({key for one in pieces for key in one.cell_data}.difference(COPIED))
    for one, start, count in zip(pieces, starts, counts):
        for number, block in enumerate(one.cells):
            if not 0 <= block.data.min() <= block.data.max() < count:
                raise MeshError(f"a cell has point {block.data.max()}, and its piece has {count} points; renumber them")
            given = {key: one.cell_data[key][number] for key in one.cell_data}
            none = np.zeros(len(block.data), dtype=np.int64)
            own = np.all([given.get(key, none) == 0 for key in COPIED], axis=0)
            content.add(block.type, joint[block.data[own] + start])
            for key in keys:
                content.cell_data.setdefault(key, []).append(given.get(key, none)[own])
    return content

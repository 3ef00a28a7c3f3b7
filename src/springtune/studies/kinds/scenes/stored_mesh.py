"""Stored meshes: a VTU file each, and a note with its key, its checksum and its quality.

A mesh that cannot be made has no VTU file, and its note says why.
"""

from pathlib import Path
from typing import Any

from springtune.mesh import Mesh, read_mesh, write_mesh

from ...runs import checked_json
from ...runs.checked_json import DamagedError, set_aside
from ...runs.driver import RefusedError
from ...runs.records import checksum


def files(folder: str | Path, name: str) -> tuple[Path, Path]:
    """File of a mesh, and that of its notes."""
    return Path(folder) / f"{name}.vtu", Path(folder) / f"{name}.json"


def write(folder: str | Path, name: str, key: str, mesh: Mesh, known: dict[str, float]) -> None:
    """Store a mesh."""
    path, notes = files(folder, name)
    path.parent.mkdir(parents=True, exist_ok=True)
    # The notes name the mesh they belong to, so they go first and come last.
    notes.unlink(missing_ok=True)
    write_mesh(path, mesh)
    checked_json.write(notes, {"key": key, "checksum": checksum(path), **known})


def refuse(folder: str | Path, name: str, key: str, why: dict[str, str]) -> None:
    """Store that a mesh cannot be made: ``message``, and ``limits`` where it went beyond them."""
    path, notes = files(folder, name)
    path.unlink(missing_ok=True)
    checked_json.write(notes, {"key": key, **why})


def is_stored(folder: str | Path, name: str, key: str, limits: str) -> bool:
    """Whether a mesh is stored, or that it cannot be made; one that is damaged is set aside."""
    path, notes = files(folder, name)
    if not notes.exists():
        return False
    try:
        known = read_notes(folder, name)
        if known["key"] != key or known.get("limits", limits) != limits:
            return False
        if "message" not in known and path.exists():
            _checked(path, known["checksum"])
        return "message" in known or path.exists()
    except DamagedError as error:
        set_aside(error)
        return False


def read_notes(folder: str | Path, name: str) -> dict[str, Any]:
    """What is known of a mesh: its ``key`` and ``checksum``, what it took and its quality."""
    notes: dict[str, Any] = checked_json.demand(files(folder, name)[1])
    return notes


def is_refused(folder: str | Path, name: str) -> bool:
    """Whether a mesh could not be made."""
    return "message" in read_notes(folder, name)


def prepared(folder: str | Path, name: str) -> Mesh:
    """Mesh by its name, for tasks that need it."""
    notes = read_notes(folder, name)
    if "message" in notes:
        raise RefusedError(notes["message"], "limits" in notes)
    return read(folder, name)


def read(folder: str | Path, name: str) -> Mesh:
    """Mesh by its name."""
    path, _ = files(folder, name)
    _checked(path, read_notes(folder, name)["checksum"])
    return read_mesh(path)


def _checked(path: Path, wanted: str) -> None:
    if not path.exists():
        raise DamagedError(path, "it is missing")
    if checksum(path) != wanted:
        raise DamagedError(path, "its checksum is not that of its content")

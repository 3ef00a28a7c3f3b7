"""Stored meshes: a VTU file each, and a note beside it with its key, its checksum and what is known of it."""

from pathlib import Path
from typing import Any

from ...jobs import sealed
from ...jobs.damage import DamagedError, set_aside
from ...jobs.records import checksum
from ...mesh import Mesh, read_mesh, write_mesh


def files(folder: str | Path, name: str) -> tuple[Path, Path]:
    """File of a mesh, and that of its notes."""
    return Path(folder) / f"{name}.vtu", Path(folder) / f"{name}.json"


def write(folder: str | Path, name: str, key: str, mesh: Mesh, known: dict[str, float]) -> None:
    """Store a mesh.

    Parameters
    ----------
    folder : str or Path
    name : str
    key : str
        Of what it is made from.
    mesh : Mesh
    known : dict
        Figures of it.
    """
    path, notes = files(folder, name)
    path.parent.mkdir(parents=True, exist_ok=True)
    # The notes name the mesh they belong to, so they go first and come last.
    notes.unlink(missing_ok=True)
    write_mesh(path, mesh)
    sealed.write(notes, {"key": key, "checksum": checksum(path), **known})


def is_stored(folder: str | Path, name: str, key: str) -> bool:
    """Whether a mesh is stored; one that is damaged is set aside.

    Parameters
    ----------
    folder : str or Path
    name : str
    key : str
        Of what it is to be made from.

    Returns
    -------
    bool
    """
    path, notes = files(folder, name)
    if not (path.exists() and notes.exists()):
        return False
    try:
        return read_notes(folder, name)["key"] == key and _checked(path, notes) == path
    except DamagedError as error:
        set_aside(error)
        return False


def read_notes(folder: str | Path, name: str) -> dict[str, Any]:
    """What is known of a mesh: its ``key`` and ``checksum``, what it took and its quality.

    Parameters
    ----------
    folder : str or Path
    name : str

    Returns
    -------
    dict

    Raises
    ------
    DamagedError
        If they are not there, or not what was written.
    """
    notes: dict[str, Any] = sealed.demand(files(folder, name)[1])
    return notes


def read(folder: str | Path, name: str) -> Mesh:
    """Mesh by its name.

    Parameters
    ----------
    folder : str or Path
    name : str

    Returns
    -------
    Mesh

    Raises
    ------
    DamagedError
        If it is not there, or not what was written.
    """
    return read_mesh(_checked(*files(folder, name)))


def _checked(path: Path, notes: Path) -> Path:
    wanted = sealed.demand(notes)["checksum"]
    if not path.exists():
        raise DamagedError(path, "it is missing")
    if checksum(path) != wanted:
        raise DamagedError(path, "its checksum is not that of its content")
    return path

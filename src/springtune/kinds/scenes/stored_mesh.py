"""Meshes as the stage `mesh` stored them: a VTU file each and notes beside it, or notes that say why there is none."""

from pathlib import Path
from typing import Any

from ...jobs import atomic
from ...mesh import Mesh, read_mesh

REFUSED = "without mesh"
"""What tasks are counted as that have no mesh."""


def notes_path(folder: str | Path, name: str) -> Path:
    """File of the notes on a mesh: its key, its figures, or why it could not be made."""
    return Path(folder) / f"{name}.json"


def mesh_path(folder: str | Path, name: str) -> Path:
    """File of a mesh."""
    return Path(folder) / f"{name}.vtu"


def notes(folder: str | Path, name: str) -> dict[str, Any]:
    """What is noted on a mesh; nothing where there are no notes yet."""
    path = notes_path(folder, name)
    found: dict[str, Any] = atomic.read_json(path) if path.exists() else {}
    return found


def refusal(folder: str | Path, name: str) -> str:
    """Why a mesh could not be made, such as ``"mesh: own.vtu: cells with no area: 1, ..."``; empty where it was."""
    return str(notes(folder, name).get("message", ""))


def read(folder: str | Path, name: str) -> Mesh:
    """A mesh that was made."""
    return read_mesh(mesh_path(folder, name))

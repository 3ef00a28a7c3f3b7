"""Reading and writing of stored meshes (VTU files with a stored result beside), references and scenes."""

from pathlib import Path
from typing import Any

import numpy as np

from springtune.mesh.cells import MESH_TYPES, Mesh
from springtune.mesh.formats import read_beam_mesh, read_stored, write_mesh
from springtune.mesh.sheets import GroupedMesh

from ...runs import store
from ...runs.attempts import RefusedError
from ...runs.source import checksum, hash_of
from ...runs.store import DamagedError

# -- meshes ------------------------------------------------------------------------------------------------------------


def make_beam(source: dict[str, Any]) -> Mesh:
    """Mesh of a box ``length`` by ``height``: by ``mesh_type`` and ``mesh_size``, or of a ``file`` and its ``unit``."""
    box = source["length"], source["height"]
    if "file" in source:
        check_unchanged(source)
        return read_beam_mesh(source["file"], *box, source["unit"])
    return MESH_TYPES[source["mesh_type"]](*box, source["mesh_size"])


def check_unchanged(source: dict[str, Any]) -> None:
    """End the job if a mesh file changed since the study was read."""
    if checksum(source["file"]) != source["content"]:
        raise SystemExit(f"{source['file']} was changed while the study ran; call the same command again")


NOTES_KEY = "notes"  # key of the only result in a mesh's note


def files(folder: str | Path, name: str) -> tuple[Path, Path]:
    """Files of a mesh and of its notes."""
    return Path(folder) / f"{name}.vtu", Path(folder) / f"{name}.h5"


def write(folder: str | Path, name: str, key: str, made: GroupedMesh | None, known: dict[str, Any]) -> None:
    """Store a mesh with its groups, or the ``message`` of one that cannot be made."""
    path, notes = files(folder, name)
    path.parent.mkdir(parents=True, exist_ok=True)
    if made is None:
        path.unlink(missing_ok=True)
    else:
        write_mesh(path, made.mesh)
        known |= {"checksum": checksum(path), "unusable": made.unusable, "sides": made.sides, "points": made.points}
        parts = made.parts.items()
        known["parts"] = {name: {count: np.flatnonzero(inside) for count, inside in own.items()} for name, own in parts}
    store.add(notes, {NOTES_KEY: {"key": key, **known}})


def is_stored(folder: str | Path, name: str, key: str) -> bool:
    """Return whether a mesh, or the reason why it cannot be made, is stored."""
    path, notes = files(folder, name)
    if NOTES_KEY not in store.stored_keys(notes):
        return False
    known = read_notes(folder, name)
    return bool(known["key"] == key and ("message" in known or path.exists()))


def read_notes(folder: str | Path, name: str) -> dict[str, Any]:
    """Notes of a mesh: its ``key``, ``checksum``, seconds and quality."""
    return store.read(files(folder, name)[1], [NOTES_KEY])[NOTES_KEY]


def prepared_mesh(content: dict[str, Any], file: dict[str, Any]) -> GroupedMesh:
    """Mesh of a job's file; raises RefusedError if it cannot be made."""
    folder = Path(content["results"]) / "meshes"
    if found := read(folder, file["name"]):
        return found
    raise RefusedError(read_notes(folder, file["name"])["message"].removeprefix("mesh: "))


def read(folder: str | Path, name: str) -> GroupedMesh | None:
    """Mesh with its groups by name, or None if it cannot be made."""
    (path, _), notes = files(folder, name), read_notes(folder, name)
    if "message" in notes:
        return None
    if not path.exists():
        raise DamagedError(path, "it is missing")
    if checksum(path) != notes["checksum"]:
        raise DamagedError(path, "it is damaged (its checksum is another one)")
    mesh = read_stored(path)
    count = {str(corners): len(cells) for corners, cells in mesh.cells.items()}
    sides = {side: np.array(edges, dtype=np.int64).reshape(-1, 2) for side, edges in notes["sides"].items()}
    points = {point: np.array(place) for point, place in notes["points"].items()}
    parts = {
        part: {int(corners): np.isin(np.arange(count[corners]), inside) for corners, inside in cells.items()}
        for part, cells in notes["parts"].items()
    }
    return GroupedMesh(mesh, sides, points, parts, notes["unusable"])


# -- references --------------------------------------------------------------------------------------------------------


def read_reference(folder: str | Path, reference: dict[str, Any], fields: tuple[str, ...] = ()) -> dict[str, Any]:
    """Reference solved by itself, for 1 N [m, rad, 1]; not converged, it has ``message`` and ``seconds`` alone."""
    return scaled(store.read_one(folder, reference["key"], fields), reference)


def scaled(found: dict[str, Any], reference: dict[str, Any]) -> dict[str, Any]:
    """Answer of a unit problem at the size of a beam and for 1 N."""
    scales = dict.fromkeys(("displacement", "mean_displacement", "displacements"), reference["displacement"])
    scales |= dict.fromkeys("xy", reference["length"])
    scales |= dict.fromkeys(("rotation", "strain"), reference["displacement"] / reference["length"])
    return {name: value * scales[name] if name in scales else value for name, value in found.items()}


# -- scenes ------------------------------------------------------------------------------------------------------------

FACE_POSITIONS = np.linspace(0.0, 1.0, 101)  # places of the profile of a pressed face, over its length [1]

FIELD_ARRAYS = dict.fromkeys(("displacements", "reference_displacements"), "f8")
FIELD_ARRAYS |= dict.fromkeys(("spring_stiffnesses", "spring_forces"), "f4")
"""Types of stored arrays of particles and springs."""


CALIBRATION_STEM = "calibration"  # stem of the file of calibrated stiffnesses


def read_calibration(folder: str | Path) -> dict[str, Any]:
    """Calibrated stiffnesses [N/m] of a study by key."""
    path = Path(folder) / "curves" / f"{CALIBRATION_STEM}.h5"
    return store.read_all(path) if path.exists() else {}


def stored_key(scene: dict[str, Any], calibration: dict[str, Any]) -> str:
    """Key of a scene's result, which depends on its calibrated stiffness."""
    group = scene.get("calibration")
    return hash_of(scene["key"], calibration[group]["stiffness"]) if group else str(scene["key"])


def fields_key(key: str) -> str:
    """Key of the fields of a scene."""
    return hash_of(key, "fields")


def parts(task: dict[str, Any], result: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Stored parts of a result by key: numbers and, if the task keeps them, fields."""
    found = {task["key"]: {name: value for name, value in result.items() if name not in FIELD_ARRAYS}}
    if task.get("keep_fields"):
        kept = {name: result[name].astype(kind) for name, kind in FIELD_ARRAYS.items() if name in result}
        found[fields_key(task["key"])] = kept
    return found

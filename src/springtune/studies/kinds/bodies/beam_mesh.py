"""Meshes of beams, and the check of mesh files."""

import hashlib
from pathlib import Path

from springtune.mesh.formats import read_beam_mesh
from springtune.mesh.types import MESH_TYPES


def make_beam(source):
    """Mesh of a box ``length`` by ``height``: by ``mesh_type`` and ``mesh_size``, or of a ``file`` and its ``unit``."""
    box = source["length"], source["height"]
    if "file" in source:
        check_unchanged(source)
        return read_beam_mesh(source["file"], *box, source["unit"])
    return MESH_TYPES[source["mesh_type"]](*box, source["mesh_size"])


def check_unchanged(source):
    """End the job if a mesh file changed since the study was read."""
    if hashlib.sha256(Path(source["file"]).read_bytes()).hexdigest() != source["content"]:
        raise SystemExit(f"{source['file']} was changed while the study ran; call the same command again")

"""Keys of results: hashes of all that they depend on, code and libraries included."""

import hashlib
import json
import os
from dataclasses import asdict
from functools import cache
from typing import TYPE_CHECKING, Any

from ..mesh import MESH_TYPES
from .dependencies import digest, mesh_type_digest

if TYPE_CHECKING:
    from ..problem.geometry import Beam
    from ..problem.materials import Material


def hash_of(*parts: Any) -> str:
    """Hash of what a result depends on.

    Parameters
    ----------
    *parts : object
        Nested dicts, lists, texts and numbers.

    Returns
    -------
    str

    Examples
    --------
    >>> hash_of({"a": 1.0, "b": [2]}) == hash_of({"b": [2], "a": 1.0})
    True
    """
    text = json.dumps(parts, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:24]


def installed(package: str) -> str:
    """Version of a package; "none" where it is an extra that is not there, or not wanted."""
    from importlib.metadata import PackageNotFoundError, version  # here: it costs as much as the rest of a key

    unused = package == "cvxopt" and os.environ.get("SPRINGTUNE_SOLVER") == "superlu"
    try:
        return "none" if unused else version(package)
    except PackageNotFoundError:
        return "none"


@cache
def stage_key(module: str, *packages: str) -> list[str]:
    """What the results of a stage depend on besides their parameters: its modules and these packages."""
    return [digest(module), *(f"{package} {installed(package)}" for package in packages)]


@cache
def mesh_type_key(name: str) -> list[str]:
    """What meshes of a type depend on besides their parameters; nothing that is known of meshes from files."""
    if name not in MESH_TYPES:
        return []
    return [mesh_type_digest(name), *(f"{package} {installed(package)}" for package in MESH_TYPES[name].packages)]


@cache
def beam_key(beam: "Beam") -> dict[str, Any]:
    """What of a beam results depend on: a new label is not a new beam."""
    return asdict(beam) | {"name": ""}


@cache
def material_key(material: "Material", density: bool = False) -> dict[str, Any]:
    """What of a material results depend on: statics depend on no density."""
    known = asdict(material) | {"name": ""}
    if not density:
        del known["density"]
    return known

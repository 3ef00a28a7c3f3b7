"""Keys of results: hashes of all inputs, code and packages.

Python's minor version counts: sums of floats change with 3.12, and compiled packages differ.
"""

import os
import sys
from dataclasses import asdict
from functools import cache
from typing import TYPE_CHECKING, Any

from springtune.mesh import MESH_TYPES

from . import dependencies
from .checked_json import hash_of

if TYPE_CHECKING:
    from springtune.problem.geometry import Beam
    from springtune.problem.materials import Material


@cache
def installed(distribution: str) -> str:
    """Version of a distribution; "none" if it is not installed or not wanted."""
    from importlib.metadata import PackageNotFoundError, version  # here: it costs as much as the rest of a key

    unused = distribution == "cvxopt" and os.environ.get("SPRINGTUNE_SOLVER") == "superlu"
    try:
        return "none" if unused else version(distribution)
    except PackageNotFoundError:
        return "none"


@cache
def stage_key(*modules: str, without: tuple[str, ...] = ()) -> str:
    """Key of modules' code and the versions of their packages."""
    return code_key(dependencies.stage_closure(*modules, without=without))


def definition_key(name: str) -> str:
    """Key of a definition's code."""
    return code_key(dependencies.definition_closure(name))


def mesh_type_key(name: str) -> str:
    """Key of a mesh type's code; for mesh files of the reader's."""
    if name not in MESH_TYPES:
        return code_key(dependencies.mesh_file_closure())
    return code_key(dependencies.mesh_type_closure(name))


@cache
def code_key(code: dependencies.Closure) -> str:
    """Key of code and the versions of its packages."""
    versions = (f"{name} {installed(name)}" for name in map(dependencies.distribution, code.packages))
    return hash_of(code.digest, [f"python {sys.version_info[0]}.{sys.version_info[1]}", *sorted(set(versions))])


@cache
def beam_key(beam: "Beam") -> dict[str, Any]:
    """Properties of a beam that results depend on; its label is not one."""
    return asdict(beam) | {"name": ""}


@cache
def material_key(material: "Material", density: bool = False) -> dict[str, Any]:
    """Properties of a material that results depend on; statics ignore density."""
    known = asdict(material) | {"name": ""}
    known.pop("test_errors", None)
    if not density:
        del known["density"]
    return known

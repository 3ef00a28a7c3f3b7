"""Keys of results: hashes of all that they depend on, code and packages included.

Of Python itself the minor version counts: the sum of floats is another from 3.12 on, and compiled packages differ.
"""

import os
import sys
from dataclasses import asdict
from functools import cache
from typing import TYPE_CHECKING, Any

from springtune.mesh import MESH_TYPES

from . import dependencies
from .hashing import hash_of

if TYPE_CHECKING:
    from springtune.problem.geometry import Beam
    from springtune.problem.materials import Material


@cache
def installed(distribution: str) -> str:
    """Version of a distribution; "none" where it is an extra that is not there, or not wanted."""
    from importlib.metadata import PackageNotFoundError, version  # here: it costs as much as the rest of a key

    unused = distribution == "cvxopt" and os.environ.get("SPRINGTUNE_SOLVER") == "superlu"
    try:
        return "none" if unused else version(distribution)
    except PackageNotFoundError:
        return "none"


@cache
def stage_key(*modules: str, without: tuple[str, ...] = ()) -> str:
    """What results of modules depend on besides their parameters: their code, and versions of the packages it uses."""
    return code_key(dependencies.stage_closure(*modules, without=without))


def definition_key(name: str) -> str:
    """What springs of a definition depend on besides their parameters."""
    return code_key(dependencies.definition_closure(name))


def mesh_type_key(name: str) -> str:
    """What meshes of a type depend on besides their parameters, and those from files besides their content."""
    if name not in MESH_TYPES:
        return code_key(dependencies.mesh_file_closure())
    return code_key(dependencies.mesh_type_closure(name))


@cache
def code_key(code: dependencies.Closure) -> str:
    """Key of code, and of the versions of the packages that it uses."""
    versions = (f"{name} {installed(name)}" for name in map(dependencies.distribution, code.packages))
    return hash_of(code.digest, [f"python {sys.version_info[0]}.{sys.version_info[1]}", *sorted(set(versions))])


@cache
def beam_key(beam: "Beam") -> dict[str, Any]:
    """What of a beam results depend on: a new label is not a new beam."""
    return asdict(beam) | {"name": ""}


@cache
def material_key(material: "Material", density: bool = False) -> dict[str, Any]:
    """What of a material results depend on: statics depend on no density."""
    known = asdict(material) | {"name": ""}
    known.pop("test_errors", None)
    if not density:
        del known["density"]
    return known

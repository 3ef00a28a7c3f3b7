"""Predictions without a study: which definition on a mesh, how large its error, and which mesh keeps an error.

`choices` solves the definitions on one mesh, `bands` extrapolates to meshes too large for that, and `search`
finds the coarsest mesh that keeps an error.
"""

from ..reference.small_strain import ReferenceNotConvergedError
from .bands import extrapolate
from .choices import (
    CASES,
    PREDICTED,
    SOLVED,
    SOLVED_FROM_FILE,
    Choice,
    Number,
    QuantityReference,
    References,
    ShapeReferences,
    check_beam,
    predict,
    references,
    shape_references,
)
from .search import MeshChoice, MeshSearch, SolvedMesh, find_mesh, find_shape_mesh

__all__ = [
    "CASES",
    "PREDICTED",
    "SOLVED",
    "SOLVED_FROM_FILE",
    "Choice",
    "MeshChoice",
    "MeshSearch",
    "Number",
    "QuantityReference",
    "ReferenceNotConvergedError",
    "References",
    "ShapeReferences",
    "SolvedMesh",
    "check_beam",
    "extrapolate",
    "find_mesh",
    "find_shape_mesh",
    "predict",
    "references",
    "shape_references",
]

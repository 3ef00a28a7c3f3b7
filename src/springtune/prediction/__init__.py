"""What a user without a study needs: which definition on a mesh, how far off it is, and which mesh keeps an error.

`choices` solves the definitions on one mesh, `bands` says what can be said of meshes too large for that, and `search`
finds the coarsest mesh that keeps an error.
"""

from .bands import extrapolate
from .choices import (
    CASES,
    PREDICTED,
    SOLVED,
    SOLVED_FROM_FILE,
    Choice,
    Number,
    References,
    check_beam,
    predict,
    references,
)
from .search import MeshChoice, MeshSearch, SolvedMesh, find_mesh

__all__ = [
    "CASES",
    "PREDICTED",
    "SOLVED",
    "SOLVED_FROM_FILE",
    "Choice",
    "MeshChoice",
    "MeshSearch",
    "Number",
    "References",
    "SolvedMesh",
    "check_beam",
    "extrapolate",
    "find_mesh",
    "predict",
    "references",
]

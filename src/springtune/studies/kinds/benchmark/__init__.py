"""Run time against error: names of the approaches of the benchmark."""

from collections.abc import Iterable
from itertools import product

from springtune.mesh.cells import MESH_TYPES
from springtune.springs.base import DEFINITIONS

OTHER_APPROACHES = (
    "linear-triangles",
    "quadratic-triangles",
    "tensor-mass",
    "condensation",
    "boundary-elements",
    "free-form",
    "calculix-cps3",
    "calculix-cps8",
)
"""Approaches of the benchmark besides definitions, see `springtune.studies.kinds.benchmark.solve`."""

PARTS = ("meshing", "assembling", "factorizing", "solving")  # timed parts of a case

THREAD_COUNTS = (1, 2)  # numbers of threads of the benchmark's explicit steps


def approach_names(definitions: Iterable[str], mesh_types: Iterable[str], others: Iterable[str]) -> tuple[str, ...]:
    """Return the names of approaches: ``definition/mesh type`` for pairs that fit, and others."""
    able = (name for name in definitions if not DEFINITIONS[name].needs)
    pairs = (pair for pair in product(able, mesh_types) if MESH_TYPES[pair[1]].corners in DEFINITIONS[pair[0]].cells)
    return (*map("/".join, pairs), *others)

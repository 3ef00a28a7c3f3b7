"""Run time against error: names of the approaches of the benchmark."""

from collections.abc import Iterable, Sequence

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


def approach_names(definitions: Iterable[str], mesh_types: Sequence[str], others: Iterable[str]) -> tuple[str, ...]:
    """Return the names of approaches: ``definition/mesh type`` for pairs that fit, and others."""
    names = []
    for name in definitions:
        for mesh_type in mesh_types:
            made, definition = MESH_TYPES.get(mesh_type), DEFINITIONS[name]
            # The model of the study refuses unknown mesh types.
            if not definition.needs and (made is None or made.corners in definition.cells):
                names.append(f"{name}/{mesh_type}")
    return (*names, *others)

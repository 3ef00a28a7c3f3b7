"""Names of the approaches of the benchmark."""

from ...mesh import QUADS
from ...springs import DEFINITIONS

OTHER_APPROACHES = (
    "relaxation",
    "backward-euler",
    "truncated-backward-euler",
    "linear-triangles",
    "quadratic-triangles",
    "tensor-mass",
    "condensation",
    "boundary-elements",
    "free-form",
    "calculix-cps3",
    "calculix-cps8",
)
"""Approaches of the benchmark besides definitions, see `springtune.kinds.benchmark.approaches`."""

CURVE_COUNTS = (1, 11, 61, 201)
"""Numbers of stiffnesses of the benchmark's sensitivity curves."""


def approach_names(definitions, mesh_types, others):
    """Names of the approaches: ``definition/mesh type``, those that go together, and others."""
    names = []
    for name in definitions:
        for mesh_type in mesh_types:
            count = 4 if mesh_type in QUADS else 3
            if count in DEFINITIONS[name].cells and not DEFINITIONS[name].needs:
                names.append(f"{name}/{mesh_type}")
    return (*names, *others)

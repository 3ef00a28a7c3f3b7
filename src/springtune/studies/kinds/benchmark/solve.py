"""Stage `benchmark`: run time against error."""

import numpy as np

from springtune.problem.geometry import Beam
from springtune.problem.materials import material_of
from springtune.problem.status import Status

from . import measure as benchmark

CURVE_SIZE = 1e-3
"""Mesh size of the curves whose cost is measured, on the first scene's beam [m]."""


def failed(task, why):
    """Result of a scene of which nothing is measured."""
    shape = len(task["approaches"]), len(task["mesh_sizes"])
    return {
        "status": np.full(shape, Status.FAILED, dtype=np.int8),
        "message": np.full(shape, why, dtype=object).tolist(),
    }


def solve(task):
    """Errors and seconds of a scene."""
    scene = benchmark.LoadedBeam(Beam(**task["beam"]), material_of(task["material"]), task["load"], task["force"])
    second = Beam(**task["second_beam"]) if task["second_beam"] else None
    most, sizes = task["most_seconds"], task["mesh_sizes"]
    found = benchmark.run(scene, task["approaches"], sizes, task["finest"], most, second)
    if task["curves"]:
        found |= benchmark.curves(scene, max(CURVE_SIZE, min(sizes)), most)
        found |= benchmark.explicit(scene, sizes, most) | benchmark.solvers(scene, sizes, most)
    return {name: values.tolist() if name.endswith("message") else values for name, values in found.items()}

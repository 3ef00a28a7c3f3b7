"""Stage `benchmark`: run time against error."""

import time

from ...jobs import store
from ...problem.geometry import Beam
from ...problem.materials import Material
from . import measure as benchmark

CURVE_SIZE = 1e-3
"""Mesh size of the curves and of the explicit steps whose cost is measured, on the first scene's beam [m]."""


def run(tasks, spent):
    """Time the scenes that are not stored yet.

    Parameters
    ----------
    tasks : dict
        ``folder`` and ``cases``, each with ``key``, ``curves`` and what
        `springtune.kinds.benchmark.measure.run` takes.
    spent : Spent
        What tasks cost is added to it.
    """
    for path, task in store.missing(tasks["folder"], tasks["cases"], spent.limits):
        begin = time.perf_counter()
        store.add(path, {task["key"]: _case(task)})
        spent.add("benchmark", 0, time.perf_counter() - begin)


def _case(task):
    scene = benchmark.LoadedBeam(Beam(**task["beam"]), Material(**task["material"]), task["load"], task["force"])
    second = Beam(**task["second_beam"]) if task["second_beam"] else None
    limits = task["most_seconds"], task["thorough"], task["most_thorough"]
    found = benchmark.run(scene, task["approaches"], task["mesh_sizes"], *limits, second)
    if task["curves"]:
        size = max(CURVE_SIZE, min(task["mesh_sizes"]))
        found |= benchmark.curves(scene, size) | benchmark.explicit(scene, size)
        found |= benchmark.solvers(scene, task["mesh_sizes"], task["most_thorough"])
    return found | {"message": found["message"].tolist()}

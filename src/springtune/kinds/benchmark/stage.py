"""Stage `benchmark`: run time against error."""

import sys

from ...jobs import atomic, store
from ...problem.geometry import Beam
from ...problem.materials import Material
from . import measure as benchmark

CURVE_SIZE = 1e-3
"""Mesh size of the curves and of the explicit steps whose cost is measured, on the first scene's beam [m]."""


def run(tasks, done):
    """Time the scenes that are not stored yet.

    Parameters
    ----------
    tasks : str or Path
        JSON file: ``folder`` and ``cases``, each with ``key``, ``curves`` and what
        `springtune.kinds.benchmark.measure.run` takes.
    done : str or Path
        JSON file to write: how many were timed.
    """
    tasks = atomic.read_json(tasks)
    count = 0
    for path, task in store.missing(tasks["folder"], tasks["cases"]):
        store.add(path, {task["key"]: _case(task)})
        count += 1
    atomic.write_json(done, {"cases": count})


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


if __name__ == "__main__":
    run(*sys.argv[1:])

"""Stage `sensitivity`: displacement against uniform stiffness, one equilibrium path for all loads of a mesh."""

import sys
import time
from pathlib import Path

import numpy as np

from ..boundary import held, measured, weights
from ..mesh import read_mesh
from ..network import Network
from ..path import trace
from ..springs.lattice import uniform
from ..statics import StaticProblem
from . import files, store
from .work import Work


def run(tasks, done):
    """Trace the curves of a bundle that are not stored yet.

    Parameters
    ----------
    tasks : str or Path
        JSON file: ``folder``, ``meshes`` (folder) and ``families``, each with ``name`` and ``curves``, and each of
        these with ``key, kind, force, kinematics, stiffnesses``.
    done : str or Path
        JSON file to write: what the work was.
    """
    tasks, work = files.read_json(tasks), Work()
    for family in tasks["families"]:
        path = Path(tasks["folder"]) / f"{family['name']}.h5"
        present = store.stored(path)
        missing = [curve for curve in family["curves"] if curve["key"] not in present]
        if not missing:
            continue
        mesh = read_mesh(Path(tasks["meshes"]) / f"{family['name']}.vtu")
        problems = {}
        for kind in {curve["kind"]: None for curve in missing}:
            problem = StaticProblem(Network(mesh, held(mesh, kind), uniform(mesh)), weights(mesh, kind))
            problems[kind] = problem, measured(mesh, kind)
        results = {curve["key"]: _trace(*problems[curve["kind"]], curve) for curve in missing}
        store.add(path, results)
        for result in results.values():
            work.add("curve", len(mesh.points), result["seconds"])
    files.write_json(done, work.summary())


def _trace(problem, weights, curve):
    begin = time.perf_counter()
    targets = curve["force"] / np.array(curve["stiffnesses"])
    if curve["kinematics"] == "linear":
        displacement = targets * np.tensordot(problem.slope, weights, axes=2)
        stable = np.ones(len(targets), dtype=bool)
    else:
        displacement, stable = trace(problem, weights, targets)
    return {"displacement": displacement, "stable": stable, "seconds": time.perf_counter() - begin}


if __name__ == "__main__":
    run(*sys.argv[1:])

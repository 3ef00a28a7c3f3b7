"""Stage `sensitivity`: displacement against uniform stiffness, one equilibrium path for all loads of a mesh.

Here, where equilibria are at hand, the stiffness at which a curve meets its reference is solved for, too.
"""

import sys
import time
from pathlib import Path

import numpy as np

from ..boundary import held, measured, weights
from ..compare import best_stiffness
from ..mesh import read_mesh
from ..network import Network
from ..path import StablePath
from ..springs.lattice import uniform
from ..statics import StaticProblem
from . import files, references, store
from .work import Work


def run(tasks, done):
    """Trace the curves of a bundle that are not stored yet.

    Parameters
    ----------
    tasks : str or Path
        JSON file: ``folder``, ``meshes`` and ``references`` (folders) and ``families``, each with ``name`` and
        ``curves``, and each of these with ``key, kind, force, kinematics, stiffnesses, reference`` (see
        `springtune.stages.references.read`).
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
        results = {
            curve["key"]: _trace(
                *problems[curve["kind"]], curve, references.read(tasks["references"], curve["reference"])
            )
            for curve in missing
        }
        store.add(path, results)
        for result in results.values():
            work.add("curve", len(mesh.points), result["seconds"])
    files.write_json(done, work.summary())


def _trace(problem, weights, curve, reference):
    begin = time.perf_counter()
    force, stiffnesses = curve["force"], np.array(curve["stiffnesses"])
    if curve["kinematics"] == "linear":
        slope = np.tensordot(problem.slope, weights, axes=2)
        displacement, stable, message = force / stiffnesses * slope, np.ones(len(stiffnesses), dtype=bool), ""

        def solve(stiffness):
            return force / stiffness * slope

    else:
        path = StablePath(problem, weights, force / stiffnesses)
        displacement, stable, message = path.values, path.stable, _ending(path, force)

        def solve(stiffness):
            return path.value(force / stiffness)

    best = best_stiffness(stiffnesses, displacement, stable, force * reference.get("displacement", np.nan), solve)
    return {
        "displacement": displacement,
        "stable": stable,
        "message": message,
        "best_stiffness": best.stiffness,
        "best_status": best.status,
        "best_message": best.message,
        "seconds": time.perf_counter() - begin,
    }


def _ending(path, force):
    """Why a curve is not solved throughout."""
    if path.stable.all():
        return ""
    reason = path.end or "not followed through its turn"
    return f"{reason}: solved from {abs(force) / path.stable_to:.6g} N/m" if path.stable_to else reason


if __name__ == "__main__":
    run(*sys.argv[1:])

"""Stage `reference`: one finite-element solution a beam, material and kind of load, for 1 N; loads scale it."""

import sys
import time
from pathlib import Path

from ..geometry import Beam
from ..materials import Material
from ..reference.small_strain import solve_small_strain
from . import files, store


def run(tasks, done):
    """Solve the references that are not there yet.

    Parameters
    ----------
    tasks : str or Path
        JSON file: ``folder``, ``references``, each with ``name, key, beam, material, kind``, and ``finite``, each with
        ``name, key, beam, material, force, plane, follower``.
    done : str or Path
        JSON file to write: what was solved.
    """
    tasks = files.read_json(tasks)
    made = []
    for task in tasks["references"]:
        path = Path(tasks["folder"]) / f"{task['name']}.h5"
        if task["key"] in store.stored(path):
            continue
        begin = time.perf_counter()
        try:
            material = Material(**task["material"])
            solution = solve_small_strain(Beam(**task["beam"]), material, 1.0, kind=task["kind"])
        except RuntimeError as error:
            result = {"message": str(error)}
        else:
            result = {
                "displacement": solution.displacement,
                "mean_displacement": solution.mean_displacement,
                "error_estimate": solution.error_estimate,
                "x": solution.x,
                "y": solution.y,
                "displacements": solution.displacements,
                "message": "",
            }
        result["seconds"] = time.perf_counter() - begin
        store.add(path, {task["key"]: result})
        made.append(task["name"])
    for task in tasks["finite"]:
        path = Path(tasks["folder"]) / f"{task['name']}.h5"
        if task["key"] not in store.stored(path):
            store.add(path, {task["key"]: _finite(task)})
            made.append(task["name"])
    files.write_json(done, {"made": made})


def _finite(task):
    """Result at finite strain."""
    from ..reference.finite_strain import solve_neo_hooke  # here, since few studies need it

    begin = time.perf_counter()
    try:
        beam, material = Beam(**task["beam"]), Material(**task["material"])
        solution = solve_neo_hooke(beam, material, task["force"], plane=task["plane"], follower=task["follower"])
    except (RuntimeError, ValueError) as error:
        result = {"message": str(error)}
    else:
        result = {
            "displacement": solution.displacement,
            "mean_displacement": solution.mean_displacement,
            "error_estimate": solution.error_estimate,
            "positions": solution.positions,
            "profile": solution.profile,
            "message": "",
        }
    return result | {"seconds": time.perf_counter() - begin}


if __name__ == "__main__":
    run(*sys.argv[1:])

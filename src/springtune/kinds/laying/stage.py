"""Stage `laying`: strips laid on a trapezoid."""

import sys
import time
from dataclasses import asdict

from ...jobs import atomic, store
from ...jobs.spent import Spent
from ...problem.geometry import Strip, Trapezoid
from ...problem.materials import Material
from ...problem.status import Status
from ...springs import DefinitionError
from .cost import cost_units
from .lay import lay


def run(tasks, done):
    """Lay the strips that are not stored yet.

    A strip that does not lie is stored with its status and message; it never stops the others.

    Parameters
    ----------
    tasks : str or Path
        JSON file: ``folder`` and ``strips``, each with ``key`` and what `springtune.kinds.laying.lay.lay` takes.
    done : str or Path
        JSON file to write: what was spent.
    """
    tasks, spent = atomic.read_json(tasks), Spent()
    for path, task in store.missing(tasks["folder"], tasks["strips"]):
        begin = time.perf_counter()
        store.add(path, {task["key"]: _lay(task)})
        spent.add("laying", cost_units(task["mesh_size"]), time.perf_counter() - begin)
    atomic.write_json(done, spent.summary())


def _lay(task):
    try:
        found = lay(
            Strip(**task["strip"]), Trapezoid(**task["trapezoid"]), Material(**task["material"]),
            Material(**task["support"]), task["definition"], task["mesh_size"], loading=task["loading"],
            pressure=task["pressure"], friction=task["friction"],
        )  # fmt: skip
    except DefinitionError as error:
        return {"status": Status.FAILED, "message": f"{task['definition']}: {error}"}
    except Exception as error:  # the other strips shall still arrive
        return {"status": Status.FAILED, "message": f"{type(error).__name__}: {error}"}
    return asdict(found) | {"status": Status.NOT_CONVERGED if found.message else Status.SOLVED}


if __name__ == "__main__":
    run(*sys.argv[1:])

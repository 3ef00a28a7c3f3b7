"""Stage `laying`: strips laid on a trapezoid."""

import time
from dataclasses import asdict
from functools import partial

from springtune.problem.geometry import Strip, Trapezoid
from springtune.problem.materials import material_of
from springtune.problem.status import Status
from springtune.springs import DefinitionError

from ...runs import store
from .cost import cost_units
from .lay import lay


def run(tasks, spent):
    """Lay the strips that are not stored yet.

    A strip that does not lie is stored with its status and message; it never stops the others.
    """
    for path, task in store.missing(tasks["folder"], tasks["strips"], spent.limits):
        begin = time.perf_counter()
        result = spent.attempt(task["key"], partial(_lay, task), _hole)
        if result is None:
            continue
        store.add(path, {task["key"]: result})
        spent.add("laying", cost_units(task["mesh_size"]), time.perf_counter() - begin)


def lose(tasks, key, why, limits):
    """Store that a strip is beyond its limits."""
    store.lose(tasks["folder"], key, _hole(why), limits)


def _hole(why):
    return {"status": Status.FAILED, "message": why}


def _lay(task):
    try:
        found = lay(
            Strip(**task["strip"]), Trapezoid(**task["trapezoid"]), material_of(task["material"]),
            material_of(task["support"]), task["definition"], task["mesh_size"], loading=task["loading"],
            pressure=task["pressure"], friction=task["friction"],
        )  # fmt: skip
    except DefinitionError as error:
        return {"status": Status.FAILED, "message": f"{task['definition']}: {error}"}
    return asdict(found) | {"status": Status.NOT_CONVERGED if found.message else Status.SOLVED}

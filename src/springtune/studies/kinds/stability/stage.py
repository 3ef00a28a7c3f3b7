"""Stage `stability`: experiments on numerical stability."""

import time
from functools import partial

import numpy as np

from springtune.problem.geometry import Beam
from springtune.problem.materials import material_of

from ...runs import store
from . import experiments as stability


def run(tasks, spent):
    """Do the experiments that are not stored yet.

    An experiment that fails is stored with its message; it never stops the others.
    """
    for path, task in store.missing(tasks["folder"], tasks["experiments"], spent.limits):
        result = spent.attempt(task["key"], partial(_experiment, task), _hole)
        if result is None:
            continue
        store.add(path, {task["key"]: result})
        spent.add(task["name"], 0, result.get("seconds", 0.0))


def lose(tasks, key, why, limits):
    """Store that an experiment is beyond its limits."""
    store.lose(tasks["folder"], key, _hole(why), limits)


def _hole(why):
    return {"failure": why}


def _experiment(task):
    setup = stability.Setup(
        Beam(**task["beam"]), material_of(task["material"]), task["force"], task["definition"], task["mesh_type"],
        tuple(task["mesh_sizes"]),
    )  # fmt: skip
    begin = time.perf_counter()
    found = stability.run(task["name"], setup)
    # Texts are no arrays of a file.
    found = {name: np.asarray(values) for name, values in found.items()}
    texts = {name: values.tolist() for name, values in found.items() if values.dtype.kind == "O"}
    arrays = {name: values for name, values in found.items() if name not in texts}
    return arrays | texts | {"seconds": time.perf_counter() - begin}

"""Stage `stability`: experiments on numerical stability."""

import time

import numpy as np

from springtune.problem.geometry import Beam
from springtune.problem.materials import material_of

from . import experiments as stability


def failed(task, why):
    """Result of an experiment that fails."""
    return {"failure": why}


def solve(task):
    """Result of an experiment."""
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

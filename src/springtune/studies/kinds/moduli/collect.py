"""Moduli, gathered in the group ``/moduli``."""

import numpy as np

from ...output.dataset import Filler, Group
from ...runs.stages import results
from .kind import STAGE
from .outputs import PATCH

MODULI = Group(
    "/moduli",
    {
        "young_modulus_error": (PATCH, "1", "error of Young's modulus along x, effective / asked - 1", np.nan),
        "effective_poisson_ratio": (PATCH, "1", "effective Poisson's ratio under load along x", np.nan),
        "shear_modulus_error": (PATCH, "1", "error of the shear modulus, effective / asked - 1", np.nan),
        "definition_seconds": (PATCH, "s", "time to derive the springs' parameters", np.nan),
        "definition_evaluations": (PATCH, "1", "solves that deriving the springs' parameters took", np.nan),
        "spring_ratio": (PATCH, "1", "largest spring stiffness over the smallest", np.nan),
        "status": (PATCH, "1", "what became of the patch test", 0),
        "message": (PATCH, "1", "why there are no moduli", ""),
    },
    dimensions={
        "poisson_ratio": "Poisson's ratio that the definition is asked for",
    },
)


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    part = study.parts["moduli"]
    moduli = Filler(MODULI.empty(study.axes))
    box = {"patch_length": part.patch.length, "patch_height": part.patch.height}
    moduli.data.attrs = {"comment": "of the mesh that a beam of this length and height [m] gets"} | box
    for task, result in results(STAGE, study, folder):
        moduli.put(result, **task.labels)
    return {MODULI.name: moduli.data}

"""Variables of the group ``/moduli``."""

import numpy as np

from ...output.dataset import Group

PATCH = ("definition", "mesh_type", "mesh_size", "poisson_ratio")

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

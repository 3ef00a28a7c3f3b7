"""Stiffness of each spring by exact gradients: the mesh itself in even tension and shear, no reference solution.

L-BFGS-B minimises the misfit of `springtune.springs.identification` under tension along x and y and shear, whose
displacements are known exactly; the gradient costs one back-substitution a case. Uneven motion of the particles
reaches Poisson's ratios other than 1/3, with uneven stiffnesses. Derived here.
"""

import math

import numpy as np

from ..mesh import Mesh
from ..problem.materials import AnyMaterial
from .base import Springs, definition
from .identification import SPAN, Misfit, patch_cases

MAX_EVALUATIONS = 400


@definition("adjoint", order=170, anisotropic=True)
def springs(mesh: Mesh, material: AnyMaterial, thickness: float) -> Springs:
    """Stiffness of each spring by exact gradients, bounded, from even tension and shear of the mesh itself."""
    from scipy.optimize import minimize  # here: see `springtune.springs`

    misfit = Misfit(mesh, material, thickness, patch_cases(mesh, material, thickness))
    limit = math.log(SPAN)
    found = minimize(
        misfit.evaluate, np.zeros(len(mesh.edges)), jac=True, method="L-BFGS-B",
        bounds=[(-limit, limit)] * len(mesh.edges),
        options={"maxfun": MAX_EVALUATIONS, "maxiter": MAX_EVALUATIONS, "maxcor": 20, "ftol": 1e-12, "gtol": 1e-10},
    )  # fmt: skip
    return Springs(misfit.reference, misfit.start * np.exp(found.x), evaluations=misfit.evaluations)

"""Stiffness of each spring by simulated annealing on the displacements of a scene's reference.

As Deussen, Kobbelt and Tuecke (1995) tuned springs: random changes of all stiffnesses, worse ones accepted with
falling probability. Uses scipy's generalised annealing without its local search, from a fixed seed.
"""

import math
from collections.abc import Sequence

import numpy as np

from ..mesh import Mesh
from ..problem.materials import AnyMaterial
from .base import Springs, definition
from .identification import SPAN, Case, Misfit

MAX_EVALUATIONS = 1000


@definition("annealed", order=150, needs="cases", anisotropic=True)
def springs(
    mesh: Mesh, material: AnyMaterial, thickness: float, cases: Sequence[Case], evaluations: int = MAX_EVALUATIONS
) -> Springs:
    """Stiffness of each spring by simulated annealing on a scene's reference displacements."""
    from scipy.optimize import dual_annealing  # here: see `springtune.springs`

    misfit = Misfit(mesh, material, thickness, cases)
    limit = math.log(SPAN)
    found = dual_annealing(
        misfit, [(-limit, limit)] * len(mesh.edges), maxfun=evaluations - 1, maxiter=evaluations, seed=1,
        no_local_search=True, x0=np.zeros(len(mesh.edges)),
        # Cold and with short steps: in hundreds of dimensions others hit nothing (tried on two meshes).
        initial_temp=0.1, visit=1.1,
    )  # fmt: skip
    return Springs(misfit.reference, misfit.start * np.exp(found.x), evaluations=misfit.evaluations)

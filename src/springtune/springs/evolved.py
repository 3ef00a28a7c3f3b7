"""Stiffness of each spring by a genetic search on the displacements of a scene's reference.

As Bianchi and others (2003, 2004) did for topology and stiffness, here for stiffness: mutants and crossings replace
the worse networks of a population. Uses scipy's differential evolution, from a fixed seed.
"""

import math
from collections.abc import Sequence

import numpy as np

from ..mesh import Mesh
from ..problem.materials import AnyMaterial
from .base import Springs, definition
from .identification import SPAN, Case, Misfit

MAX_EVALUATIONS = 1000
POPULATION = 20


@definition("evolved", order=160, needs="cases", anisotropic=True)
def springs(
    mesh: Mesh, material: AnyMaterial, thickness: float, cases: Sequence[Case], evaluations: int = MAX_EVALUATIONS
) -> Springs:
    """Stiffness of each spring by a genetic search on a scene's reference displacements."""
    from scipy.optimize import differential_evolution  # here: see `springtune.springs`

    misfit = Misfit(mesh, material, thickness, cases)
    limit = math.log(SPAN)
    generator = np.random.default_rng(1)
    first = 0.2 * generator.standard_normal((POPULATION, len(mesh.edges)))
    first[0] = 0.0
    found = differential_evolution(
        misfit, [(-limit, limit)] * len(mesh.edges), init=np.clip(first, -limit, limit), rng=generator, polish=False,
        maxiter=evaluations // POPULATION - 1, tol=0.0, mutation=(0.2, 0.6), recombination=0.3,
    )  # fmt: skip
    return Springs(misfit.reference, misfit.start * np.exp(found.x), evaluations=misfit.evaluations)

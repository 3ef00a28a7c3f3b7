"""Stiffness of each spring by a search that minimises the misfit of `springtune.springs.identification`.

- `annealed`: as Deussen, Kobbelt and Tuecke (1995, abstract read) tuned springs: random changes of all stiffnesses,
  worse ones accepted with falling probability. Uses scipy's generalised annealing without its local search, from a
  fixed seed.
- `evolved`: as Bianchi and others (2003; 2004, abstract read) did for topology and stiffness, here for stiffness:
  mutants and crossings replace the worse networks of a population. Uses scipy's differential evolution, from a fixed
  seed.
- `adjoint`: the mesh itself in even tension and shear, no reference solution. L-BFGS-B minimises the misfit under
  tension along x and y and shear, whose displacements are known exactly; the gradient costs one back-substitution a
  case. Uneven motion of the particles reaches Poisson's ratios other than 1/3, with uneven stiffnesses. Derived here.
"""

from collections.abc import Sequence

import numpy as np

from ..mesh.cells import Mesh
from ..problem.materials import AnyMaterial
from .base import Springs, definition
from .identification import Case, Misfit, patch_cases

MAX_EVALUATIONS = 1000  # networks that a random search tries

POPULATION = 20  # networks of a generation of `evolved`

MAX_GRADIENTS = 400  # networks that `adjoint` tries, each with the gradient of its misfit


@definition("annealed", order=150, needs="cases", anisotropic=True, cost=2)
def annealed(
    mesh: Mesh, material: AnyMaterial, thickness: float, cases: Sequence[Case], evaluations: int = MAX_EVALUATIONS
) -> Springs:
    """Stiffness of each spring by simulated annealing on a scene's reference displacements.

    Source: Deussen, Kobbelt and Tuecke, 1995 (abstract).
    """
    from scipy.optimize import dual_annealing  # here: see `springtune.springs`

    misfit = Misfit(mesh, material, thickness, cases)
    found = dual_annealing(
        misfit, misfit.bounds, maxfun=evaluations - 1, maxiter=evaluations, seed=1, no_local_search=True,
        x0=np.zeros(len(mesh.edges)),
        # Cold and with short steps: in hundreds of dimensions others hit nothing (tried on two meshes).
        initial_temp=0.1, visit=1.1,
    )  # fmt: skip
    return misfit.springs(found.x)


@definition("evolved", order=160, needs="cases", anisotropic=True, cost=2)
def evolved(
    mesh: Mesh, material: AnyMaterial, thickness: float, cases: Sequence[Case], evaluations: int = MAX_EVALUATIONS
) -> Springs:
    """Stiffness of each spring by a genetic search on a scene's reference displacements.

    Source: Bianchi, Solenthaler, Szekely and Harders, 2004 (abstract).
    """
    from scipy.optimize import differential_evolution  # here: see `springtune.springs`

    misfit = Misfit(mesh, material, thickness, cases)
    generator = np.random.default_rng(1)
    first = 0.2 * generator.standard_normal((POPULATION, len(mesh.edges)))
    first[0] = 0.0
    found = differential_evolution(
        misfit, misfit.bounds, init=np.clip(first, *misfit.bounds[0]), rng=generator, polish=False,
        maxiter=evaluations // POPULATION - 1, tol=0.0, mutation=(0.2, 0.6), recombination=0.3,
    )  # fmt: skip
    return misfit.springs(found.x)


@definition("adjoint", order=170, anisotropic=True, cost=2)
def adjoint(mesh: Mesh, material: AnyMaterial, thickness: float) -> Springs:
    """Stiffness of each spring by exact gradients, bounded, from even tension and shear of the mesh itself.

    Source: own rule (derived).
    """
    from scipy.optimize import minimize  # here: see `springtune.springs`

    misfit = Misfit(mesh, material, thickness, patch_cases(mesh, material, thickness))
    options = {"maxfun": MAX_GRADIENTS, "maxiter": MAX_GRADIENTS, "maxcor": 20, "ftol": 1e-12, "gtol": 1e-10}
    start = np.zeros(len(mesh.edges))
    found = minimize(misfit.evaluate, start, jac=True, method="L-BFGS-B", bounds=misfit.bounds, options=options)
    return misfit.springs(found.x)

"""Names of time integrators, of the experiments on stability and of the methods of the benchmark."""

import numpy as np

from .mesh import QUADS
from .springs import DEFINITIONS

EXPLICIT = ("symplectic-euler", "central-difference-lagged", "central-difference")
"""Explicit schemes. Of the same steps, apart from the velocity: that of `symplectic-euler` belongs to the displacements
it comes with, to first order; that of central differences half a step earlier. `central-difference` takes damping in
proportion to mass implicitly; dampers along springs lag by half a step in all of them."""

IMPLICIT = ("backward-euler", "implicit-midpoint")
"""Implicit schemes: the first one in the manner of SOFA, one linear solve a step, the second one of second order."""

INTEGRATORS = (*EXPLICIT, *IMPLICIT)

LAGGED = ("symplectic-euler", "central-difference-lagged")
"""Schemes in which all damping lags, and narrows the step."""

BEHAVIOURS = ("stable", "decaying", "growing", "nan")
"""Meanings of the flags of ``behaviour``: what a run makes of noise."""

EXPERIMENTS = {
    "limits": "largest stable step of the explicit schemes, predicted and measured",
    "maps": "what noise becomes over step and damping",
    "drift": "energy and momentum over many steps",
    "rest": "steps to rest over damping; truncated solvers; dynamic relaxation",
    "slivers": "triangles of down to half a degree",
    "contrast": "stiff parts beside soft ones",
    "poisson": "up to an incompressible material",
    "sizes": "mesh sizes over three decades, single precision",
    "strains": "compression and traction of up to 300 %, a follower pressure",
    "perturbation": "particles moved at random, inverted starts",
    "buckling": "a slender column, a shallow arch",
}
"""Experiments of `springtune.stability` by name."""

ONCE = ("maps", "drift", "rest", "contrast", "sizes")
"""Experiments about schemes and numbers, not definitions: the first definition of a study stands for all."""

AXES = {
    "integrator": INTEGRATORS,
    "damper": ("mass", "springs"),
    "damping_ratio": (0.0, 0.1, 1.0),
    "step_ratio": tuple(np.geomspace(0.1, 4.0, 25).round(4).tolist()),
    "map_damping_ratio": tuple(np.geomspace(0.01, 3.0, 17).round(4).tolist()),
    "sample": tuple(range(1000)),
    "critical_ratio": (0.125, 0.25, 0.354, 0.5, 0.707, 0.85, 1.0, 1.2, 1.414, 2.0, 2.83, 4.0, 8.0),
    "cg_iterations": (5, 25, 100, 0),
    "implicit_steps": (10, 50, 200),
    "sliver_angle": (30.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.5),
    "stiffness_contrast": tuple(10.0**power for power in range(0, 17, 2)),
    "stressed_poisson_ratio": (0.0, 0.3, 0.45, 0.49, 0.499, 0.4999, 0.5),
    "scale": (1e-5, 1e-4, 1e-3, 1e-2),
    "precision": ("float64", "float32"),
    "strain_load": ("axial", "follower-pressure"),
    "strain": (-0.6, -0.4, -0.2, -0.1, -0.05, -0.01, 0.01, 0.05, 0.1, 0.3, 0.5, 1.0, 2.0, 3.0),
    "perturbation": (0.0, 0.05, 0.1, 0.2, 0.3, 0.4),
    "rows": (10, 20),
    "arch_point": tuple(range(200)),
}
"""Values of the experiments' own dimensions. ``cg_iterations`` 0 is a direct solver."""

RIVALS = (
    "relaxation",
    "backward-euler",
    "truncated-backward-euler",
    "linear-triangles",
    "quadratic-triangles",
    "tensor-mass",
    "condensation",
    "boundary-elements",
    "free-form",
    "calculix-cps3",
    "calculix-cps8",
)
"""Methods of the benchmark besides definitions, see `springtune.rivals`."""

SOLVERS = ("Cholesky", "SuperLU", "multigrid")
"""Solvers of linear systems."""

CURVE_COUNTS = (1, 11, 61, 201)
"""Numbers of stiffnesses of the benchmark's sensitivity curves."""


def method_names(definitions, mesh_types, rivals):
    """Names of the methods: ``definition/mesh type``, those that go together, and rivals."""
    names = []
    for name in definitions:
        for mesh_type in mesh_types:
            count = 4 if mesh_type in QUADS else 3
            if count in DEFINITIONS[name].cells and not DEFINITIONS[name].needs:
                names.append(f"{name}/{mesh_type}")
    return (*names, *rivals)

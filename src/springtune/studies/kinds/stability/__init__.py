"""Experiments on numerical stability: their names and the values of their own dimensions."""

import numpy as np

from springtune.mechanics import INTEGRATORS

EXPERIMENTS = {
    "limits": "largest stable time step",
    "maps": "noise over step and damping",
    "drift": "energy and momentum over many steps",
    "rest": "steps to rest; truncated solvers",
    "slivers": "angles down to 0.5 degree",
    "contrast": "stiff parts beside soft ones",
    "poisson": "up to incompressible",
    "sizes": "mesh sizes over three decades",
    "strains": "up to 300 %",
    "perturbation": "particles moved at random, inverted starts",
    "buckling": "a slender column, a shallow arch",
}

DEFINITION_FREE = ("maps", "drift", "rest", "contrast", "sizes")
"""Experiments on schemes and numbers, which use only the first definition of a study."""

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

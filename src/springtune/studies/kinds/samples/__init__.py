"""Samples: scenes of continuous parameters that are drawn at random, and which of these matter."""

QUANTITIES = {
    "displacement": "displacement of the network",
    "deformation_error": "deformation error",
    "best_stiffness": "uniform stiffness without an error",
}
"""Quantities with Sobol indices."""

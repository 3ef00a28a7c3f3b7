"""Samples: scenes of continuous parameters that are drawn at random, and which of these matter."""

QUANTITIES = {
    "displacement": "displacement of the network",
    "deformation_error": "deformation error",
    "best_stiffness": "uniform stiffness without an error",
}
"""Quantities with Sobol indices."""


def problem_key(interpolant: str, aspect_ratio: float, nu: float) -> str:
    """Key of a reference that is solved alone, in the file of the interpolant that could not be built."""
    return f"{interpolant} {float(aspect_ratio)!r} {float(nu)!r}"

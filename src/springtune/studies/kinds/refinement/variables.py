"""Variables of the group ``/refinement``."""

from collections.abc import Collection

import numpy as np

from ...output.dataset import Group
from .names import VARIED

OF_ONE = ("refinement",)
VALUE, CROSSING = (*OF_ONE, "definition", "point"), (*OF_ONE, "definition", "crossing")

COORDINATES = (*(f"refined_{name}" for name in VARIED), "batch", "parameter")
"""Auxiliary coordinates."""


def refinement_group(parameters: Collection[str]) -> Group:
    """The group of a study."""
    values, found = {}, {}
    for name in (name for name in VARIED if name in parameters):
        known = VARIED[name]
        values[f"refined_{name}"] = (VALUE, known.unit, f"{known.meaning}, where it is varied", np.nan)
        found[f"crossing_{name}"] = (CROSSING, known.unit, f"{known.meaning} at which the error is crossed", np.nan)
        found[f"crossing_{name}_width"] = (CROSSING, known.unit, "distance of the values that enclose it", np.nan)
    return Group(
        "/refinement",
        {
            "parameter": (OF_ONE, "1", "what is varied", ""),
            "scene": (OF_ONE, "1", "the scene of which it is varied: beam, mesh, material, load and kinematics", ""),
            "spacing": (OF_ONE, "1", "whether values or their logarithms are evenly spaced", ""),
            "tolerance": (OF_ONE, "1", "size of the error that matters", np.nan),
            "value_count": (("refinement", "definition"), "1", "number of values", 0),
            "halved": (("refinement", "definition"), "1", "batches after the first one", 0),
            **values,
            "batch": (VALUE, "1", "batch that the value came in, from 0; -1 where there is no value", -1),
            "displacement": (VALUE, "m", "displacement of the network", np.nan),
            "reference_displacement": (VALUE, "m", "displacement of the reference", np.nan),
            "reference_error_estimate": (VALUE, "1", "bound on the relative error of the reference", np.nan),
            "reference_applies": (VALUE, "1", "whether small strain applies; -1 where there is no reference", -1),
            "deformation_error": (VALUE, "1", "(network - reference) / |reference|", np.nan),
            "particles": (VALUE, "1", "number of particles", 0),
            "status": (VALUE, "1", "what became of the scene", 0),
            "message": (VALUE, "1", "why the scene is not solved, or its reference does not apply", ""),
            "crossing_level": (CROSSING, "1", "error that is crossed: zero, or the tolerance", np.nan),
            **found,
            "crossing_change": (CROSSING, "1", "change of the error between the enclosing values", np.nan),
        },
        dimensions={
            "refinement": "refinement, by name",
            "point": "number of a value, in the order of their addition",
            "crossing": "number of a crossing, ascending",
        },
    )


REFINEMENT = refinement_group(VARIED)
"""The group with all that a study may vary."""

"""Variables of the groups ``/samples``, ``/effects`` and ``/sobol``."""

import numpy as np

from ...output.dataset import Group

BODY = ("sample",)
SAMPLED_REFERENCE = ("sample", "load")
SAMPLED = ("sample", "load", "definition")

SAMPLES = Group(
    "/samples",
    {
        "displacement": (SAMPLED, "m", "displacement of the loaded side, network", np.nan),
        "deformation_error": (SAMPLED, "1", "(network - reference) / |reference|, signed", np.nan),
        "stiffness": (SAMPLED, "N/m", "stiffness of all springs, where they have one", np.nan),
        "status": (SAMPLED, "1", "what became of the scene", 0),
        "message": (SAMPLED, "1", "why the scene is not solved", ""),
        "reference_displacement": (SAMPLED_REFERENCE, "m", "displacement of the loaded side, finite elements", np.nan),
        "reference_error_estimate": (
            SAMPLED_REFERENCE,
            "1",
            "bound on the relative error of the reference, that of its interpolation included",
            np.nan,
        ),
        "reference_applies": (
            SAMPLED_REFERENCE,
            "1",
            "whether a reference of small strain applies to the network: not where it turns or strains too far for it",
            np.int8(0),
        ),
        "reference_message": (("load",), "1", "why there is no reference", ""),
        "best_stiffness": (SAMPLED_REFERENCE, "N/m", "uniform stiffness without a deformation error", np.nan),
        "particles": (BODY, "1", "number of particles", 0),
    },
    dimensions={"sample": "row of the design"},
    further={"reference_applies": {"flag_values": np.array([0, 1], "int8"), "flag_meanings": "no yes"}},
)

EFFECT = ("quantity", "parameter", "bin", "load", "definition")

EFFECTS = Group(
    "/effects",
    {
        "parameter_value": (("parameter", "bin"), "1", "mean of the parameter in the bin, in its SI unit", np.nan),
        "main_effect": (EFFECT, "1", "mean of the quantity in the bin, in its SI unit", np.nan),
        "main_effect_error": (EFFECT, "1", "standard error of the mean, in its SI unit", np.nan),
    },
    dimensions={
        "quantity": "what is looked at",
        "parameter": "parameter that varies",
        "bin": "part of the parameter's distribution, each of the same probability",
    },
)

INDEX = ("quantity", "parameter", "load", "definition")

SOBOL = Group(
    "/sobol",
    {
        "first_order": (INDEX, "1", "first-order Sobol index: share of the variance by the parameter alone", np.nan),
        "first_order_low": (INDEX, "1", "lower end of its bootstrap band", np.nan),
        "first_order_high": (INDEX, "1", "upper end of its bootstrap band", np.nan),
        "total_order": (INDEX, "1", "total-order Sobol index: share that the parameter takes part in", np.nan),
        "total_order_low": (INDEX, "1", "lower end of its bootstrap band", np.nan),
        "total_order_high": (INDEX, "1", "upper end of its bootstrap band", np.nan),
        "base_samples": (("quantity", "load", "definition"), "1", "base samples that the indices are of", 0),
        "base_samples_without": (
            ("quantity", "load", "definition"),
            "1",
            "base samples with a scene that has no value",
            0,
        ),
    },
    dimensions={"quantity": "what is looked at", "parameter": "parameter that varies"},
)

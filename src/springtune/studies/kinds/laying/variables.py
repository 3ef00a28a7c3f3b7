"""Variables of the group ``/laying``."""

import numpy as np

from ...output.dataset import Group

LAID = ("definition", "mesh_size", "loading", "friction")
LAID_REFERENCE = ("loading", "friction")

LAYING = Group(
    "/laying",
    {
        "area_under_strip": (LAID, "m2", "area between the strip and the floor, network", np.nan),
        "area_error": (LAID, "1", "area under the strip over the trapezoid's, less 1", np.nan),
        "elongation": (LAID, "1", "elongation of the strip's lower fibre, network", np.nan),
        "penetration": (LAID, "1", "largest penetration over the mesh size", np.nan),
        "contact_force_error": (LAID, "1", "vertical contact force less the load, over the load", np.nan),
        "load_share": (LAID, "1", "share of the load that was reached", np.nan),
        "iterations": (LAID, "1", "Newton steps", np.nan),
        "laying_seconds": (LAID, "s", "time to lay the strip", np.nan),
        "status": (LAID, "1", "what became of the scene", 0),
        "message": (LAID, "1", "why the strip is not laid", ""),
        "skipped": (LAID, "1", "what the scene did not need", ""),
        "strip_x": ((*LAID, "outline_point"), "m", "outline of the laid strip along x", np.nan),
        "strip_y": ((*LAID, "outline_point"), "m", "outline of the laid strip along y", np.nan),
        "reference_area": (LAID_REFERENCE, "m2", "area between the strip and the floor, finite elements", np.nan),
        "reference_area_error_estimate": (
            LAID_REFERENCE,
            "m2",
            "band of the area between strip and floor, twice its spread over three meshes of finite elements",
            np.nan,
        ),
        "reference_elongation": (LAID_REFERENCE, "1", "elongation of the lower fibre, finite elements", np.nan),
        "reference_elongation_error_estimate": (
            LAID_REFERENCE,
            "1",
            "band of the elongation of the lower fibre, twice its spread over three meshes of finite elements",
            np.nan,
        ),
        "reference_x": (
            (*LAID_REFERENCE, "outline_point"),
            "m",
            "outline of the strip of finite elements along x",
            np.nan,
        ),
        "reference_y": (
            (*LAID_REFERENCE, "outline_point"),
            "m",
            "outline of the strip of finite elements along y",
            np.nan,
        ),
        "trapezoid_x": (("corner",), "m", "corners of the trapezoid along x", np.nan),
        "trapezoid_y": (("corner",), "m", "corners of the trapezoid along y", np.nan),
    },
    dimensions={
        "loading": "what lays the strip",
        "friction": "Coulomb's coefficient of friction",
    },
)

"""Variables of the groups ``/shapes`` and ``/shape_fields``."""

import numpy as np

from ...output.dataset import OF_PARTICLES, OF_SPRINGS, UGRID
from ..scenes import variables as shared
from ..scenes.variables import declared, topology

MESH_AXES = ("shape", "mesh_type", "mesh_size")
CASE_AXES = ("shape", "material", "load")
SCENE_AXES = (*MESH_AXES, "material", "load", "definition", "kinematics")

MIXED: dict[str, object] = {"comment": "in SI units: quantity_units says which", "units_variable": "quantity_units"}

SEVEN_DIGITS = {name: (*row, np.float32(np.nan)) for name, row in shared.DISPLACEMENT_ROWS.items()}

SHAPES = declared(
    "/shapes",
    {
        (*SCENE_AXES, "quantity"): {
            "value": ("1", "quantity of interest, network"),
            "error": ("1", "signed error, (network - reference) / |reference|"),
            "expected_error": ("1", "signed difference, (network - expected) / |expected|"),
        },
        (*CASE_AXES, "quantity"): {
            "reference_value": ("1", "quantity of interest, reference"),
            **shared.ESTIMATE_ROW,
            "reference_expected_error": ("1", "signed difference, (reference - expected) / |expected|"),
        },
        ("shape", "load", "quantity"): {
            "expected_value": ("1", "quantity of interest, as others give it"),
            "quantity_kind": ("1", "what the quantity is", ""),
            "quantity_component": ("1", "its component", ""),
            "quantity_of": ("1", "the group or point that it is of", ""),
            "quantity_units": ("1", "units of its values", ""),
            "source": ("1", "who gives the expected value", ""),
        },
        SCENE_AXES: shared.SCENE_ROWS,
        MESH_AXES: shared.MESH_ROWS,
        CASE_AXES: {
            **shared.REFERENCE_ROWS,
            "reference_seconds": ("s", "time to solve the reference"),
            "reference_unknowns": ("1", "unknowns of the finest reference"),
        },
        (*CASE_AXES, "kinematics"): shared.APPLIES_ROW,
        ("shape",): {"shape_thickness": ("m", "thickness of the shape")},
    },
    dimensions={"shape": "shape, by name", "quantity": "quantity of interest, by name"},
    flags=shared.YES_OR_NO,
    further=dict.fromkeys(("value", "reference_value", "expected_value"), MIXED),
)

SHAPE_FIELDS = declared(
    "/shape_fields",
    topology(("case",), "case")
    | {
        ("case",): {
            f"{name}_name": ("1", name.replace("_", " "), "") for name in (*CASE_AXES, "kinematics", "mesh_type")
        }
        | {"case_mesh_size": ("m", "asked length of an edge; 0 where the mesh is that of a file")},
        ("case", "definition", "particle"): SEVEN_DIGITS,
        ("case", "definition", "spring"): shared.SPRING_FORCE_ROW,
        ("case", "outline_point"): {
            "outline_round": ("1", "number of the round that a point is of, from 0", -1),
            **shared.OUTLINE_ROWS,
            **shared.OUTLINE_DISPLACEMENT_ROWS,
        },
    },
    dimensions={"case": "shape and load"},
    further=UGRID | dict.fromkeys(("displacement_x", "displacement_y"), OF_PARTICLES) | {"spring_force": OF_SPRINGS},
)
"""Networks that are drawn, each shape's and load's on its finest mesh of a size that can be: they are there to be
looked at, their displacements and forces with seven digits."""

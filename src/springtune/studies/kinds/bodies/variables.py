"""Variables of the groups of beams and shapes, as ``variables.csv`` declares them."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from springtune.problem.quantities import OF_BODIES, SWEPT

from ...config.kind import declared_variables
from ...output.dataset import PARTICLE_ATTRIBUTES, SPRING_ATTRIBUTES, UGRID, Group
from ...output.selection import SHOWN_PREFIX
from .outputs import CASE_AXES, MESH_AXES, SCENE_AXES

if TYPE_CHECKING:
    from ...config.model import Study

MESH = ("beam", "mesh_type", "mesh_size")
REFERENCE = ("beam", "material", "load")
CELL = (*MESH, "material", "load")
CURVE = (*CELL, "kinematics")
SCENE = (*CELL, "definition", "kinematics")

DIMENSIONS = {"MESH": MESH, "REFERENCE": REFERENCE, "CELL": CELL, "CURVE": CURVE, "SCENE": SCENE}
DIMENSIONS |= {"SHAPE_MESH": MESH_AXES, "SHAPE_CASE": CASE_AXES, "SHAPE_SCENE": SCENE_AXES}
"""Dimensions that the file gives one name."""


def declared(group: str, **options: Any) -> Group:
    """Group of the dataset with its variables from the file."""
    return Group(group, declared_variables(__file__, group, **DIMENSIONS), **options)


YES_OR_NO = {"applies": ("no", "yes")}
MESH_ATTRIBUTES = (
    UGRID
    | dict.fromkeys(("displacement_x", "displacement_y"), PARTICLE_ATTRIBUTES)
    | {"spring_force": SPRING_ATTRIBUTES}
)
KIND_OF_REFERENCE = {"reference": "kind of reference"}

ROOT = declared("/", flags=YES_OR_NO)
SENSITIVITY = declared("/sensitivity", dimensions={"stiffness_ratio": "uniform stiffness over E t"})
FINITE_STRAIN = declared("/finite_strain", dimensions=KIND_OF_REFERENCE)
BLOCK = declared("/block", dimensions=KIND_OF_REFERENCE | {"face_position": "place on the loaded face over its length"})
FIELDS = declared(
    "/fields",
    further=MESH_ATTRIBUTES
    | dict.fromkeys(("particle_reference_x", "particle_reference_y"), PARTICLE_ATTRIBUTES)
    | {"stiffness": SPRING_ATTRIBUTES},
)
"""Whole fields of the coarsest mesh of each beam and mesh type, by UGRID-1.0 without the padding of its arrays.

The force of springs is not called "force", a dimension of the root where a study sweeps it.
"""

MIXED_UNITS: dict[str, object] = {
    "comment": "in SI units: quantity_units says which",
    "units_variable": "quantity_units",
}

SHAPES = declared(
    "/shapes",
    dimensions={"shape": "shape, by name", "quantity": "quantity of interest, by name"},
    flags=YES_OR_NO,
    further=dict.fromkeys(("value", "reference_value", "expected_value"), MIXED_UNITS),
)
AT_FINITE_STRAIN = declared(
    "/shapes_finite_strain",
    dimensions=SHAPES.dimensions
    | {"law": "law at finite strain: that of the material, or of St. Venant and Kirchhoff"},
    further={"reference_value": MIXED_UNITS},
)
SHAPE_FIELDS = declared("/shape_fields", dimensions={"case": "shape and load"}, further=MESH_ATTRIBUTES)
"""Networks to draw: of each shape and load on one mesh, displacements and forces with seven digits."""

PRINTED_PREFIX = "paper_"
"""Prefix of variables of printed cells, which have no swept dimensions."""


def swept(group: Group, study: "Study") -> Group:
    """Group whose variables also have the swept dimensions that they depend on."""
    further: dict[str, list[str]] = {}
    for name, (dimensions, *_) in group.variables.items():
        if name in OF_BODIES.values():
            further[name] = [one for one in study.swept if OF_BODIES.get(one) == name]
        elif "load" in dimensions and not name.startswith(PRINTED_PREFIX):
            further[name] = [one for one in study.swept if one != "stiffness_scale" or "definition" in dimensions]
    found = group.over(further, without=["force"] if group is ROOT and "force" in study.swept else [])
    if group in (ROOT, FINITE_STRAIN, BLOCK) and study.plane_strain:
        row = ("material",), "1", "plane of the material, 'stress' or 'strain'; its constants are those in 3-D", ""
        found = replace(found, variables=found.variables | {"material_plane": row})
    return found


def fields_of(study: "Study") -> Group:
    """Group of whole fields, which are stored for one value of each swept parameter: the group says which."""
    place = "beam", "mesh_type", "material", "load"
    swept = {
        f"{SHOWN_PREFIX}{name}": (place, SWEPT[name][1], f"{SWEPT[name][0]}, of the fields", np.nan)
        for name in study.swept
    }
    return replace(FIELDS, variables=FIELDS.variables | swept)

"""Variables of scenes, curves and references: the root of a dataset and its groups, and what shapes share with them."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from springtune.problem.parameters import OF_BODIES, SWEPT

from ...output.dataset import NO_NODE, OF_PARTICLES, OF_SPRINGS, UGRID, Group
from ...output.selection import OF_FIELDS
from .outputs import CASE_AXES, MESH_AXES, SCENE_AXES

if TYPE_CHECKING:
    from ...config.model import Study

    Row = tuple[str, str] | tuple[str, str, Any]
    Rows = dict[str, Row]

MESH = ("beam", "mesh_type", "mesh_size")
REFERENCE = ("beam", "material", "load")
CELL = (*MESH, "material", "load")
CURVE = (*CELL, "kinematics")
SCENE = (*CELL, "definition", "kinematics")

FURTHER = (*REFERENCE, "reference")

SOLVER_NAMES = "(pinned) Cholesky, SuperLU or multigrid, by what is installed and the number of unknowns"


def declared(name: str, tables: "Mapping[tuple[str, ...], Rows]", **options: Any) -> Group:
    """Group of rows by the dimensions that they share: units, long name and what empty cells hold, by default NaN."""
    variables = {
        name: (dimensions, units, words, *(nothing or [np.nan]))
        for dimensions, table in tables.items()
        for name, (units, words, *nothing) in table.items()
    }
    return Group(name, variables, **options)


SCENE_ROWS: "Rows" = {
    "status": ("1", "what became of the scene", 0),
    "message": ("1", "why the scene is not solved, or what there is against its reference", ""),
    "solve_seconds": ("s", "time to solve the scene, networks shared"),
    "definition_seconds": ("s", "time to derive the springs' parameters, shared by loads"),
    "negative_pivots": ("1", "negative pivots of the tangent; 0 where the equilibrium is stable"),
}
MESH_ROWS: "Rows" = {
    "particles": ("1", "number of particles"),
    "springs": ("1", "number of springs"),
    "minimum_angle": ("degree", "smallest angle of all triangles"),
    "edge_length_spread": ("1", "standard deviation of the edge lengths over their mean"),
    "mesh_seconds": ("s", "time to make the mesh"),
}
ESTIMATE_ROW: "Rows" = {"reference_error_estimate": ("1", "estimated relative error of the reference")}
REFERENCE_ROWS: "Rows" = {
    "reference_message": ("1", "why there is no reference, or none for nonlinear kinematics", ""),
    "reference_rotation": ("rad", "rotation that 95 % of the reference does not exceed"),
    "reference_strain": ("1", "principal strain that 95 % of the reference does not exceed"),
}
APPLIES_ROW: "Rows" = {
    "reference_applies": (
        "1",
        "whether small strain applies to networks of these kinematics, by rotation and strain",
        -1,
    )
}
YES_OR_NO = {"applies": ("no", "yes")}
DISPLACEMENT_ROWS: "Rows" = {
    "displacement_x": ("m", "displacement along x, network"),
    "displacement_y": ("m", "displacement along y, network"),
}
# Not "force", which is a dimension of the root where a study sweeps it, and would hide this one.
SPRING_FORCE_ROW: "Rows" = {
    "spring_force": ("N", "axial force of each spring, tension positive, energies' part left out", np.float32(np.nan))
}
OUTLINE_ROWS: "Rows" = {
    "outline_x": ("m", "position at rest along x, reference"),
    "outline_y": ("m", "position at rest along y, reference"),
}
OUTLINE_DISPLACEMENT_ROWS: "Rows" = {
    "reference_displacement_x": ("m", "displacement along x, reference"),
    "reference_displacement_y": ("m", "displacement along y, reference"),
}
"""Rows that beams and shapes have, over dimensions of each."""


def topology(one: "tuple[str, ...]", words: str) -> "dict[tuple[str, ...], Rows]":
    """Rows of meshes by UGRID-1.0; `one` are the dimensions that tell meshes apart."""
    return {
        (): {"mesh": ("1", f"topology of a network, of one {words}", np.int32(0))},
        (*one, "particle"): {"x": ("m", "position at rest along x"), "y": ("m", "position at rest along y")},
        (*one, "spring", "spring_end"): {"spring_nodes": ("1", "particles at the ends of a spring", NO_NODE)},
        (*one, "cell", "cell_corner"): {"cell_nodes": ("1", "particles at the corners of a cell", NO_NODE)},
    }


ROOT = declared(
    "/",
    {
        SCENE: {
            "displacement": ("m", "mean displacement of the loaded side along the force, network"),
            "deformation_error": ("1", "signed deformation error, (network - reference) / |reference|"),
            "field_error": ("1", "difference of the whole displacement fields in L2, over the reference"),
            "stiffness": ("N/m", "uniform spring stiffness"),
            **SCENE_ROWS,
            "iterations": ("1", "Newton steps"),
            "residual": ("1", "out-of-balance force over the load"),
            "load_share": ("1", "largest share of the load with a good equilibrium, nonlinear"),
            "solver": ("1", f"what solved: {SOLVER_NAMES}", ""),
            "definition_evaluations": ("1", "solves that deriving the springs' parameters took"),
            "spring_ratio": ("1", "largest spring stiffness over the smallest"),
        },
        ("material",): {
            "material_young_modulus": ("Pa", "Young's modulus"),
            "material_poisson_ratio": ("1", "Poisson's ratio"),
            "material_density": ("kg/m3", "density"),
        },
        ("beam",): {f"beam_{name}": ("m", f"{name} of the beam") for name in ("length", "height", "thickness")},
        REFERENCE: {
            "force": ("N", "force on the loaded side, tension positive"),
            "reference_displacement": ("m", "mean displacement of the loaded side along the force, reference"),
            **ESTIMATE_ROW,
            **REFERENCE_ROWS,
            "reference_seconds": ("s", "time to solve the reference, shared by all loads"),
        },
        (*REFERENCE, "kinematics"): APPLIES_ROW,
        MESH: MESH_ROWS,
        CELL: {
            "paper_displacement": ("m", "displacement of the network as the paper prints it"),
            "paper_reference_displacement": ("m", "displacement of the reference as the paper prints it"),
            "paper_deformation_error": ("1", "deformation error as the paper prints it, without sign"),
            "paper_stiffness": ("N/m", "stiffness as the paper prints it"),
            "paper_table": ("1", "number of the paper's table"),
            "paper_remark": ("1", "where the print contradicts itself", ""),
        },
    },
    flags=YES_OR_NO,
)

SENSITIVITY = declared(
    "/sensitivity",
    {
        (*CURVE, "stiffness_ratio"): {
            "stiffness": ("N/m", "uniform spring stiffness"),
            "displacement": ("m", "mean displacement of the loaded side along the force, network"),
            "deformation_error": ("1", "signed deformation error, (network - reference) / |reference|"),
            "status": ("1", "what became of the point", 0),
        },
        CURVE: {
            "message": ("1", "why the curve is not solved throughout", ""),
            "best_stiffness": ("N/m", "stiffness of a stable equilibrium with no deformation error"),
            "best_stiffness_status": ("1", "what became of the best stiffness", 0),
            "best_stiffness_message": ("1", "why there is no best stiffness", ""),
            "predicted_stiffness": ("N/m", "stiffness by closed form, full outline"),
            "curve_seconds": ("s", "time to trace the curve, networks shared"),
        },
    },
    dimensions={"stiffness_ratio": "uniform stiffness over E t"},
)

OF_PRINT = "paper_"
"""First letters of variables of printed cells, which know no parameters but those of `CELL`."""


def swept(group: Group, study: "Study") -> Group:
    """Group whose variables also have the swept dimensions that they depend on."""
    further: dict[str, list[str]] = {}
    for name, (dimensions, *_) in group.variables.items():
        if name in OF_BODIES.values():
            further[name] = [one for one in study.swept if OF_BODIES.get(one) == name]
        elif "load" in dimensions and not name.startswith(OF_PRINT):
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
        f"{OF_FIELDS}{name}": (place, SWEPT[name][1], f"{SWEPT[name][0]}, of the fields", np.nan)
        for name in study.swept
    }
    return replace(FIELDS, variables=FIELDS.variables | swept)


NO_REFERENCE_ROW: "Rows" = {"reference_message": ("1", "why there is no reference", "")}

FINITE_STRAIN = declared(
    "/finite_strain",
    {
        FURTHER: {
            "reference_displacement": ("m", "displacement of the load, reference at finite strain"),
            **ESTIMATE_ROW,
            **NO_REFERENCE_ROW,
        },
        (*SCENE, "reference"): {
            "deformation_error": (
                "1",
                "signed deformation error against finite strain, (network - reference) / |reference|",
            )
        },
    },
    dimensions={"reference": "kind of reference"},
)

BLOCK = declared(
    "/block",
    {
        SCENE: {
            "face_displacement": ("m", "displacement of the middle of the loaded face along the force, network"),
            "face_mean_displacement": ("m", "mean displacement of the loaded face along the force, network"),
            "last_face_displacement": ("m", "of the middle at the last good load step, where there is no whole one"),
        },
        (*SCENE, "face_position"): {
            "face_profile": ("m", "displacement over the loaded face along the force, network")
        },
        FURTHER: {
            "reference_face_displacement": ("m", "displacement of the middle of the face, reference"),
            "reference_face_mean_displacement": ("m", "mean displacement of the face, reference"),
            **ESTIMATE_ROW,
            **NO_REFERENCE_ROW,
        },
        (*FURTHER, "face_position"): {"reference_face_profile": ("m", "displacement over the face, reference")},
        (*SCENE, "reference"): {
            "face_error": ("1", "signed error of the middle of the face, (network - reference) / |reference|")
        },
    },
    dimensions={"reference": "kind of reference", "face_position": "place on the loaded face over its length"},
)

FIELDS = declared(
    "/fields",
    topology(MESH, "beam, mesh type and mesh size")
    | {
        (*SCENE, "particle"): DISPLACEMENT_ROWS,
        (*CELL, "particle"): {
            f"particle_reference_{axis}": ("m", f"{words} of the reference where the particles are at rest")
            for axis, words in {"x": "displacement along x", "y": "displacement along y"}.items()
        },
        (*SCENE, "spring"): {"stiffness": ("N/m", "stiffness of each spring", np.float32(np.nan)), **SPRING_FORCE_ROW},
        ("beam", "outline_point"): OUTLINE_ROWS,
        ("beam", "material", "load", "outline_point"): OUTLINE_DISPLACEMENT_ROWS,
    },
    further=UGRID
    | dict.fromkeys(("displacement_x", "displacement_y", "particle_reference_x", "particle_reference_y"), OF_PARTICLES)
    | dict.fromkeys(("stiffness", "spring_force"), OF_SPRINGS),
)
"""Whole fields, of each beam's and mesh type's coarsest mesh: they are there to be looked at.

Each mesh is one by the conventions UGRID-1.0, once it is selected and what its arrays have too much is left out, as
`springtune.studies.output.reading.field` does. Forces and stiffnesses have seven digits.
"""

MIXED: dict[str, object] = {"comment": "in SI units: quantity_units says which", "units_variable": "quantity_units"}

SEVEN_DIGITS = {name: (*row, np.float32(np.nan)) for name, row in DISPLACEMENT_ROWS.items()}

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
            **ESTIMATE_ROW,
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
        SCENE_AXES: SCENE_ROWS,
        MESH_AXES: MESH_ROWS,
        CASE_AXES: {
            **REFERENCE_ROWS,
            "reference_seconds": ("s", "time to solve the reference"),
            "reference_unknowns": ("1", "unknowns of the finest reference"),
        },
        (*CASE_AXES, "kinematics"): APPLIES_ROW,
        ("shape",): {"shape_thickness": ("m", "thickness of the shape")},
    },
    dimensions={"shape": "shape, by name", "quantity": "quantity of interest, by name"},
    flags=YES_OR_NO,
    further=dict.fromkeys(("value", "reference_value", "expected_value"), MIXED),
)

AT_FINITE_STRAIN = declared(
    "/shapes_finite_strain",
    {
        (*CASE_AXES, "law", "quantity"): {
            "reference_value": ("1", "quantity of interest, reference at finite strain"),
            **ESTIMATE_ROW,
        },
        (*CASE_AXES, "law"): NO_REFERENCE_ROW,
        (*SCENE_AXES, "quantity"): {
            "error": ("1", "signed error against finite strain, (network - reference) / |reference|"),
        },
    },
    dimensions=SHAPES.dimensions
    | {"law": "law at finite strain: that of the material, or of St. Venant and Kirchhoff"},
    further={"reference_value": MIXED},
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
        ("case", "definition", "spring"): SPRING_FORCE_ROW,
        ("case", "outline_point"): {
            "outline_round": ("1", "number of the round that a point is of, from 0", -1),
            **OUTLINE_ROWS,
            **OUTLINE_DISPLACEMENT_ROWS,
        },
    },
    dimensions={"case": "shape and load"},
    further=UGRID | dict.fromkeys(("displacement_x", "displacement_y"), OF_PARTICLES) | {"spring_force": OF_SPRINGS},
)
"""Networks that are drawn, each shape's and load's on its finest mesh of a size that can be: they are there to be
looked at, their displacements and forces with seven digits."""

"""Variables of the groups ``/shapes`` and ``/shape_fields``."""

import numpy as np

from ...output.dataset import NO_NODE, OF_PARTICLES, OF_SPRINGS, UGRID, Group

MESH_AXES = ("shape", "mesh_type", "mesh_size")
CASE_AXES = ("shape", "material", "load")
SCENE_AXES = (*MESH_AXES, "material", "load", "definition", "kinematics")
ASKED = ("shape", "load", "quantity")

MIXED: dict[str, object] = {"comment": "in SI units: quantity_units says which", "units_variable": "quantity_units"}

SHAPES = Group(
    "/shapes",
    {
        "value": ((*SCENE_AXES, "quantity"), "1", "quantity of interest, network", np.nan),
        "reference_value": ((*CASE_AXES, "quantity"), "1", "quantity of interest, reference", np.nan),
        "reference_error_estimate": (
            (*CASE_AXES, "quantity"),
            "1",
            "estimated relative error of the reference",
            np.nan,
        ),
        "error": ((*SCENE_AXES, "quantity"), "1", "signed error, (network - reference) / |reference|", np.nan),
        "expected_value": (ASKED, "1", "quantity of interest, as others give it", np.nan),
        "expected_error": (
            (*SCENE_AXES, "quantity"),
            "1",
            "signed difference, (network - expected) / |expected|",
            np.nan,
        ),
        "reference_expected_error": (
            (*CASE_AXES, "quantity"),
            "1",
            "signed difference, (reference - expected) / |expected|",
            np.nan,
        ),
        "quantity_kind": (ASKED, "1", "what the quantity is", ""),
        "quantity_component": (ASKED, "1", "its component", ""),
        "quantity_of": (ASKED, "1", "the group or point that it is of", ""),
        "quantity_units": (ASKED, "1", "units of its values", ""),
        "source": (ASKED, "1", "who gives the expected value", ""),
        "status": (SCENE_AXES, "1", "what became of the scene", 0),
        "message": (SCENE_AXES, "1", "why the scene is not solved, or what there is against its reference", ""),
        "solve_seconds": (SCENE_AXES, "s", "time to solve the scene, networks shared", np.nan),
        "definition_seconds": (SCENE_AXES, "s", "time to derive the springs' parameters, shared by loads", np.nan),
        "negative_pivots": (
            SCENE_AXES,
            "1",
            "negative pivots of the tangent; 0 where the equilibrium is stable",
            np.nan,
        ),
        "particles": (MESH_AXES, "1", "number of particles", np.nan),
        "springs": (MESH_AXES, "1", "number of springs", np.nan),
        "minimum_angle": (MESH_AXES, "degree", "smallest angle of all triangles", np.nan),
        "edge_length_spread": (MESH_AXES, "1", "standard deviation of the edge lengths over their mean", np.nan),
        "mesh_seconds": (MESH_AXES, "s", "time to make the mesh", np.nan),
        "reference_message": (CASE_AXES, "1", "why there is no reference, or none for nonlinear kinematics", ""),
        "reference_seconds": (CASE_AXES, "s", "time to solve the reference", np.nan),
        "reference_unknowns": (CASE_AXES, "1", "unknowns of the finest reference", np.nan),
        "reference_rotation": (CASE_AXES, "rad", "rotation that 95 % of the reference does not exceed", np.nan),
        "reference_strain": (CASE_AXES, "1", "principal strain that 95 % of the reference does not exceed", np.nan),
        "reference_applies": (
            (*CASE_AXES, "kinematics"),
            "1",
            "whether small strain applies to networks of these kinematics, by rotation and strain",
            -1,
        ),
        "shape_thickness": (("shape",), "m", "thickness of the shape", np.nan),
    },
    dimensions={"shape": "shape, by name", "quantity": "quantity of interest, by name"},
    flags={"applies": ("no", "yes")},
    further={name: MIXED for name in ("value", "reference_value", "expected_value")},
)

OF_CASE = ("case",)
NETWORK = ("case", "definition")

SHAPE_FIELDS = Group(
    "/shape_fields",
    {
        "mesh": ((), "1", "topology of a network, of one case", np.int32(0)),
        "shape_name": (OF_CASE, "1", "shape", ""),
        "load_name": (OF_CASE, "1", "load", ""),
        "material_name": (OF_CASE, "1", "material", ""),
        "kinematics_name": (OF_CASE, "1", "kinematics", ""),
        "mesh_type_name": (OF_CASE, "1", "mesh type", ""),
        "case_mesh_size": (OF_CASE, "m", "asked length of an edge; 0 where the mesh is that of a file", np.nan),
        "x": (("case", "particle"), "m", "position at rest along x", np.nan),
        "y": (("case", "particle"), "m", "position at rest along y", np.nan),
        "spring_nodes": (("case", "spring", "spring_end"), "1", "particles at the ends of a spring", NO_NODE),
        "cell_nodes": (("case", "cell", "cell_corner"), "1", "particles at the corners of a cell", NO_NODE),
        "displacement_x": ((*NETWORK, "particle"), "m", "displacement along x, network", np.float32(np.nan)),
        "displacement_y": ((*NETWORK, "particle"), "m", "displacement along y, network", np.float32(np.nan)),
        "spring_force": (
            (*NETWORK, "spring"),
            "N",
            "axial force of each spring, tension positive, energies' part left out",
            np.float32(np.nan),
        ),
        "outline_round": (("case", "outline_point"), "1", "number of the round that a point is of, from 0", -1),
        "outline_x": (("case", "outline_point"), "m", "position at rest along x, reference", np.nan),
        "outline_y": (("case", "outline_point"), "m", "position at rest along y, reference", np.nan),
        "reference_displacement_x": (("case", "outline_point"), "m", "displacement along x, reference", np.nan),
        "reference_displacement_y": (("case", "outline_point"), "m", "displacement along y, reference", np.nan),
    },
    dimensions={
        "case": "shape and load",
    },
    further=UGRID | dict.fromkeys(("displacement_x", "displacement_y"), OF_PARTICLES) | {"spring_force": OF_SPRINGS},
)
"""Networks that are drawn, each shape's and load's on its finest mesh of a size that can be: they are there to be
looked at, their displacements and forces with seven digits."""

"""Variables of scenes, curves and references: the root of a dataset and its groups."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from springtune.problem.parameters import OF_BODIES, SWEPT

from ...output.dataset import NO_NODE, OF_PARTICLES, OF_SPRINGS, UGRID, Group
from ...output.selection import OF_FIELDS

if TYPE_CHECKING:
    from ...config.model import Study

SCENE = ("beam", "mesh_type", "mesh_size", "material", "load", "definition", "kinematics")
MESH = ("beam", "mesh_type", "mesh_size")
REFERENCE = ("beam", "material", "load")
CURVE = ("beam", "mesh_type", "mesh_size", "material", "load", "kinematics")
CELL = ("beam", "mesh_type", "mesh_size", "material", "load")

ROOT = Group(
    "/",
    {
        # name: (dimensions, units, long name, what a cell without a value holds)
        "displacement": (SCENE, "m", "mean displacement of the loaded side along the force, network", np.nan),
        "deformation_error": (SCENE, "1", "signed deformation error, (network - reference) / |reference|", np.nan),
        "field_error": (SCENE, "1", "difference of the whole displacement fields in L2, over the reference", np.nan),
        "stiffness": (SCENE, "N/m", "uniform spring stiffness", np.nan),
        "status": (SCENE, "1", "what became of the scene", 0),
        "message": (
            SCENE,
            "1",
            "why the scene is not solved, or what there is against its reference",
            "",
        ),
        "iterations": (SCENE, "1", "Newton steps", np.nan),
        "residual": (SCENE, "1", "out-of-balance force over the load", np.nan),
        "load_share": (SCENE, "1", "largest share of the load with a good equilibrium, nonlinear", np.nan),
        "negative_pivots": (SCENE, "1", "negative pivots of the tangent; 0 where the equilibrium is stable", np.nan),
        "solve_seconds": (SCENE, "s", "time to solve the scene, networks shared", np.nan),
        "solver": (
            SCENE,
            "1",
            "what solved: (pinned) Cholesky, SuperLU or multigrid, by what is installed and the number of unknowns",
            "",
        ),
        "definition_seconds": (SCENE, "s", "time to derive the springs' parameters, shared by loads", np.nan),
        "definition_evaluations": (SCENE, "1", "solves that deriving the springs' parameters took", np.nan),
        "spring_ratio": (SCENE, "1", "largest spring stiffness over the smallest", np.nan),
        "material_young_modulus": (("material",), "Pa", "Young's modulus", np.nan),
        "material_poisson_ratio": (("material",), "1", "Poisson's ratio", np.nan),
        "beam_length": (("beam",), "m", "length of the beam", np.nan),
        "beam_height": (("beam",), "m", "height of the beam", np.nan),
        "beam_thickness": (("beam",), "m", "thickness of the beam", np.nan),
        "material_density": (("material",), "kg/m3", "density", np.nan),
        "force": (REFERENCE, "N", "force on the loaded side, tension positive", np.nan),
        "reference_displacement": (
            REFERENCE,
            "m",
            "mean displacement of the loaded side along the force, reference",
            np.nan,
        ),
        "reference_error_estimate": (REFERENCE, "1", "estimated relative error of the reference", np.nan),
        "reference_message": (REFERENCE, "1", "why there is no reference, or none for nonlinear kinematics", ""),
        "reference_rotation": (REFERENCE, "rad", "rotation that 95 % of the reference does not exceed", np.nan),
        "reference_strain": (REFERENCE, "1", "principal strain that 95 % of the reference does not exceed", np.nan),
        "reference_applies": (
            (*REFERENCE, "kinematics"),
            "1",
            "whether small strain applies to networks of these kinematics, by rotation and strain",
            -1,
        ),
        "reference_seconds": (REFERENCE, "s", "time to solve the reference, shared by all loads", np.nan),
        "particles": (MESH, "1", "number of particles", np.nan),
        "springs": (MESH, "1", "number of springs", np.nan),
        "minimum_angle": (MESH, "degree", "smallest angle of all triangles", np.nan),
        "edge_length_spread": (MESH, "1", "standard deviation of the edge lengths over their mean", np.nan),
        "mesh_seconds": (MESH, "s", "time to make the mesh", np.nan),
        "paper_displacement": (CELL, "m", "displacement of the network as the paper prints it", np.nan),
        "paper_reference_displacement": (CELL, "m", "displacement of the reference as the paper prints it", np.nan),
        "paper_deformation_error": (CELL, "1", "deformation error as the paper prints it, without sign", np.nan),
        "paper_stiffness": (CELL, "N/m", "stiffness as the paper prints it", np.nan),
        "paper_table": (CELL, "1", "number of the paper's table", np.nan),
        "paper_remark": (CELL, "1", "where the print contradicts itself", ""),
    },
    flags={"applies": ("no", "yes")},
)

SENSITIVITY = Group(
    "/sensitivity",
    {
        "stiffness": ((*CURVE, "stiffness_ratio"), "N/m", "uniform spring stiffness", np.nan),
        "displacement": (
            (*CURVE, "stiffness_ratio"),
            "m",
            "mean displacement of the loaded side along the force, network",
            np.nan,
        ),
        "deformation_error": (
            (*CURVE, "stiffness_ratio"),
            "1",
            "signed deformation error, (network - reference) / |reference|",
            np.nan,
        ),
        "status": ((*CURVE, "stiffness_ratio"), "1", "what became of the point", 0),
        "message": (CURVE, "1", "why the curve is not solved throughout", ""),
        "best_stiffness": (CURVE, "N/m", "stiffness of a stable equilibrium with no deformation error", np.nan),
        "best_stiffness_status": (CURVE, "1", "what became of the best stiffness", 0),
        "best_stiffness_message": (CURVE, "1", "why there is no best stiffness", ""),
        "predicted_stiffness": (CURVE, "N/m", "stiffness by closed form, full outline", np.nan),
        "curve_seconds": (CURVE, "s", "time to trace the curve, networks shared", np.nan),
    },
    dimensions={
        "stiffness_ratio": "uniform stiffness over E t",
    },
)

OF_PRINT = "paper_"
"""First letters of variables of printed cells, which know no parameters but those of `CELL`."""


def swept(group: Group, study: "Study") -> Group:
    """Group whose variables are over what a study sweeps, each over what it depends on."""
    further: dict[str, list[str]] = {}
    for name, (dimensions, *_) in group.variables.items():
        if name in OF_BODIES.values():
            further[name] = [one for one in study.swept if OF_BODIES.get(one) == name]
        elif "load" in dimensions and not name.startswith(OF_PRINT):
            further[name] = [one for one in study.swept if one != "stiffness_scale" or "definition" in dimensions]
    return group.over(further, without=["force"] if group is ROOT and "force" in study.swept else [])


def fields_of(study: "Study") -> Group:
    """Group of whole fields of a study: of what it sweeps they are of one value each, which the group says."""
    place = "beam", "mesh_type", "material", "load"
    said = {}
    for name in study.swept:
        words, unit = SWEPT[name]
        said[f"{OF_FIELDS}{name}"] = place, unit, f"{words}, of the fields", np.nan
    return replace(FIELDS, variables=FIELDS.variables | said)


FURTHER = (*REFERENCE, "reference")

FINITE_STRAIN = Group(
    "/finite_strain",
    {
        "reference_displacement": (FURTHER, "m", "displacement of the load, reference at finite strain", np.nan),
        "reference_error_estimate": (FURTHER, "1", "estimated relative error of the reference", np.nan),
        "deformation_error": (
            (*SCENE, "reference"),
            "1",
            "signed deformation error against finite strain, (network - reference) / |reference|",
            np.nan,
        ),
        "reference_message": (FURTHER, "1", "why there is no reference", ""),
    },
    dimensions={
        "reference": "kind of reference",
    },
)

BLOCK = Group(
    "/block",
    {
        "face_displacement": (
            SCENE,
            "m",
            "displacement of the middle of the loaded face along the force, network",
            np.nan,
        ),
        "face_mean_displacement": (SCENE, "m", "mean displacement of the loaded face along the force, network", np.nan),
        "face_profile": (
            (*SCENE, "face_position"),
            "m",
            "displacement over the loaded face along the force, network",
            np.nan,
        ),
        "last_face_displacement": (
            SCENE,
            "m",
            "of the middle at the last good load step, where there is no whole one",
            np.nan,
        ),
        "reference_face_displacement": (FURTHER, "m", "displacement of the middle of the face, reference", np.nan),
        "reference_face_mean_displacement": (FURTHER, "m", "mean displacement of the face, reference", np.nan),
        "reference_face_profile": (
            (*FURTHER, "face_position"),
            "m",
            "displacement over the face, reference",
            np.nan,
        ),
        "reference_error_estimate": (FURTHER, "1", "estimated relative error of the reference", np.nan),
        "face_error": (
            (*SCENE, "reference"),
            "1",
            "signed error of the middle of the face, (network - reference) / |reference|",
            np.nan,
        ),
        "reference_message": (FURTHER, "1", "why there is no reference", ""),
    },
    dimensions={
        "reference": "kind of reference",
        "face_position": "place on the loaded face over its length",
    },
)

FIELD = (*SCENE, "particle")
OUTLINE = ("beam", "material", "load", "outline_point")

SPRING = (*SCENE, "spring")

FIELDS = Group(
    "/fields",
    {
        "mesh": ((), "1", "topology of a network, of one beam, mesh type and mesh size", np.int32(0)),
        "x": ((*MESH, "particle"), "m", "position at rest along x", np.nan),
        "y": ((*MESH, "particle"), "m", "position at rest along y", np.nan),
        "spring_nodes": ((*MESH, "spring", "spring_end"), "1", "particles at the ends of a spring", NO_NODE),
        "cell_nodes": ((*MESH, "cell", "cell_corner"), "1", "particles at the corners of a cell", NO_NODE),
        "displacement_x": (FIELD, "m", "displacement along x, network", np.nan),
        "displacement_y": (FIELD, "m", "displacement along y, network", np.nan),
        "particle_reference_x": (
            (*CELL, "particle"),
            "m",
            "displacement along x of the reference where the particles are at rest",
            np.nan,
        ),
        "particle_reference_y": (
            (*CELL, "particle"),
            "m",
            "displacement along y of the reference where the particles are at rest",
            np.nan,
        ),
        "stiffness": (SPRING, "N/m", "stiffness of each spring", np.float32(np.nan)),
        # Not "force", which is a dimension of the root where a study sweeps it, and would hide this one.
        "spring_force": (
            SPRING,
            "N",
            "axial force of each spring, tension positive, energies' part left out",
            np.float32(np.nan),
        ),
        "outline_x": (("beam", "outline_point"), "m", "position at rest along x, reference", np.nan),
        "outline_y": (("beam", "outline_point"), "m", "position at rest along y, reference", np.nan),
        "reference_displacement_x": (OUTLINE, "m", "displacement along x, reference", np.nan),
        "reference_displacement_y": (OUTLINE, "m", "displacement along y, reference", np.nan),
    },
    further=UGRID
    | dict.fromkeys(("displacement_x", "displacement_y", "particle_reference_x", "particle_reference_y"), OF_PARTICLES)
    | dict.fromkeys(("stiffness", "spring_force"), OF_SPRINGS),
)
"""Whole fields, of each beam's and mesh type's coarsest mesh: they are there to be looked at.

Each mesh is one by the conventions UGRID-1.0, once it is selected and what its arrays have too much is left out, as
`springtune.studies.output.reading.field` does. Forces and stiffnesses have seven digits.
"""

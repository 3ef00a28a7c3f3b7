"""The dataset of a study: dense labelled arrays, their units, and what is missing and why."""

import os
from pathlib import Path

import numpy as np
import xarray as xr

from ..mechanics.integrators import BEHAVIOURS

STATUS = ("not_requested", "solved", "linear_only", "not_converged", "unstable", "failed")
"""Meanings of the flags of `status`; a flag's value is its place here."""

FLAGS = {"status": STATUS, "behaviour": BEHAVIOURS, "applies": ("no", "yes")}
"""Meanings of flags by the last word of a variable's name."""

DIMENSIONS = {
    "beam": "beam, length x height in mm",
    "mesh_type": "mesh type",
    "mesh_size": "asked length of an edge",
    "material": "material",
    "load": "load",
    "definition": "definition of the spring stiffness",
    "kinematics": "kinematics of the network",
    "stiffness_ratio": "uniform stiffness over E t",
    "poisson_ratio": "Poisson's ratio that the definition is asked for",
    "loading": "what lays the strip",
    "friction": "Coulomb's coefficient of friction",
    "reference": "kind of reference",
    "face_position": "place on the loaded face over its length",
    "integrator": "time integrator",
    "damper": "damping in proportion to mass, or of dampers along springs",
    "damping_ratio": "damping ratio of the highest mode",
    "step_ratio": "time step over 2 / omega_max",
    "map_damping_ratio": "damping ratio of the highest mode, damping in proportion to mass",
    "sample": "number of the sample in time",
    "critical_ratio": "damping over that critical for the lowest loaded mode",
    "cg_iterations": "conjugate-gradient iterations a step of backward Euler; 0 is a direct solver",
    "implicit_steps": "steps of backward Euler",
    "sliver_angle": "smallest angle of the drawn triangle",
    "stiffness_contrast": "stiffness of the stiff parts over that of the soft ones",
    "stressed_poisson_ratio": "Poisson's ratio",
    "scale": "length of an edge of the scaled beam",
    "precision": "floating-point numbers of an explicit run",
    "strain_load": "axial load, or a follower pressure on a long face, its force taken for the strain",
    "strain": "force over E t times the loaded side",
    "perturbation": "largest move of an inner particle over the mesh size",
    "rows": "triangles over the height of the column",
    "arch_point": "point of the arch's path",
    "experiment": "experiment on stability",
    "scene": "scene of the benchmark",
    "method": "definition / mesh type, or another method",
    "linear_solver": "solver of linear systems",
    "curve_count": "number of stiffnesses of a sensitivity curve",
}
UNITS = {"mesh_size": "m", "scale": "m", "sliver_angle": "degree"}
"""Units of the coordinates that have one; the others are labels or ratios."""

SCENE = ("beam", "mesh_type", "mesh_size", "material", "load", "definition", "kinematics")
MESH = ("beam", "mesh_type", "mesh_size")
REFERENCE = ("beam", "material", "load")
CURVE = ("beam", "mesh_type", "mesh_size", "material", "load", "kinematics")
CELL = ("beam", "mesh_type", "mesh_size", "material", "load")

ROOT_VARIABLES = {
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
        "what solved: Cholesky, SuperLU or multigrid, by what is installed and the number of unknowns",
        "",
    ),
    "definition_seconds": (SCENE, "s", "time to derive the springs' parameters, shared by loads", np.nan),
    "definition_evaluations": (SCENE, "1", "solves that deriving the springs' parameters took", np.nan),
    "spring_ratio": (SCENE, "1", "largest spring stiffness over the smallest", np.nan),
    "material_young_modulus": (("material",), "Pa", "Young's modulus", np.nan),
    "material_poisson_ratio": (("material",), "1", "Poisson's ratio", np.nan),
    "beam_length": (("beam",), "m", "length of the beam", np.nan),
    "beam_height": (("beam",), "m", "height of the beam", np.nan),
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
}

SENSITIVITY_VARIABLES = {
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
}

PATCH = ("definition", "mesh_type", "mesh_size", "poisson_ratio")

MODULI_VARIABLES = {
    "young_modulus_error": (PATCH, "1", "error of Young's modulus along x, effective / asked - 1", np.nan),
    "effective_poisson_ratio": (PATCH, "1", "effective Poisson's ratio under load along x", np.nan),
    "shear_modulus_error": (PATCH, "1", "error of the shear modulus, effective / asked - 1", np.nan),
    "definition_seconds": (PATCH, "s", "time to derive the springs' parameters", np.nan),
    "definition_evaluations": (PATCH, "1", "solves that deriving the springs' parameters took", np.nan),
    "spring_ratio": (PATCH, "1", "largest spring stiffness over the smallest", np.nan),
    "status": (PATCH, "1", "what became of the patch test", 0),
    "message": (PATCH, "1", "why there are no moduli", ""),
}

BLOCK_REFERENCE = (*REFERENCE, "reference")

FINITE_STRAIN_VARIABLES = {
    "reference_displacement": (BLOCK_REFERENCE, "m", "displacement of the load, reference at finite strain", np.nan),
    "reference_error_estimate": (BLOCK_REFERENCE, "1", "estimated relative error of the reference", np.nan),
    "deformation_error": (
        (*SCENE, "reference"),
        "1",
        "signed deformation error against finite strain, (network - reference) / |reference|",
        np.nan,
    ),
    "reference_message": (BLOCK_REFERENCE, "1", "why there is no reference", ""),
}

BLOCK_VARIABLES = {
    "face_displacement": (SCENE, "m", "displacement of the middle of the loaded face along the force, network", np.nan),
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
    "reference_face_displacement": (BLOCK_REFERENCE, "m", "displacement of the middle of the face, reference", np.nan),
    "reference_face_mean_displacement": (BLOCK_REFERENCE, "m", "mean displacement of the face, reference", np.nan),
    "reference_face_profile": (
        (*BLOCK_REFERENCE, "face_position"),
        "m",
        "displacement over the face, reference",
        np.nan,
    ),
    "reference_error_estimate": (BLOCK_REFERENCE, "1", "estimated relative error of the reference", np.nan),
    "face_error": (
        (*SCENE, "reference"),
        "1",
        "signed error of the middle of the face, (network - reference) / |reference|",
        np.nan,
    ),
    "reference_message": (BLOCK_REFERENCE, "1", "why there is no reference", ""),
}

LAID = ("definition", "mesh_size", "loading", "friction")
LAID_REFERENCE = ("loading", "friction")

LAYING_VARIABLES = {
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
    "reference_x": ((*LAID_REFERENCE, "outline_point"), "m", "outline of the strip of finite elements along x", np.nan),
    "reference_y": ((*LAID_REFERENCE, "outline_point"), "m", "outline of the strip of finite elements along y", np.nan),
    "trapezoid_x": (("corner",), "m", "corners of the trapezoid along x", np.nan),
    "trapezoid_y": (("corner",), "m", "corners of the trapezoid along y", np.nan),
}

SCHEME = ("definition", "mesh_size", "integrator", "damper", "damping_ratio")
SLIVER = ("definition", "sliver_angle")
CONTRAST = ("stiffness_contrast",)
STRESSED = ("definition", "stressed_poisson_ratio")
STRAINED = ("definition", "strain_load", "strain")
PERTURBED = ("definition", "perturbation")
ARCH = ("definition", "arch_point")


def _judged(name, dimensions, long_name):
    """Variables that say what became of solves."""
    return {
        f"{name}_status": (dimensions, "1", f"what became of {long_name}", 0),
        f"{name}_message": (dimensions, "1", f"why it is not solved: {long_name}", ""),
    }


STABILITY_VARIABLES = {
    "dt_limit_predicted": (SCHEME, "s", "largest stable step, predicted", np.nan),
    "dt_limit_measured": (SCHEME, "s", "largest step that does not grow noise, by bisection of runs", np.nan),
    "dt_particle_bound": (("definition", "mesh_size"), "s", "safe step from each particle's springs alone", np.nan),
    "omega_max": (("definition", "mesh_size"), "rad/s", "highest frequency at rest", np.nan),
    "behaviour": (
        ("integrator", "step_ratio", "map_damping_ratio"),
        "1",
        "what a run makes of noise",
        -1,
    ),
    "step_ratio_predicted": (
        ("integrator", "map_damping_ratio"),
        "1",
        "largest stable step over 2 / omega_max, predicted; 1000 where there is none",
        np.nan,
    ),
    "energy_drift": (("integrator",), "1", "mean energy of the last tenth of a run over that of the first", np.nan),
    "energy_swing": (("integrator",), "1", "largest less smallest energy of a run over the first", np.nan),
    "energy": (("integrator", "sample"), "1", "energy over that at the start, undamped", np.nan),
    "momentum_drift": (("integrator",), "1", "change of momentum over the sum of its parts", np.nan),
    "steps_to_rest": (("critical_ratio",), "1", "steps to rest within 0.1 %, central difference", np.nan),
    "loaded_frequency": ((), "rad/s", "lowest frequency that the load excites", np.nan),
    "truncated_error": (
        ("mesh_size", "cg_iterations", "implicit_steps"),
        "1",
        "distance of backward Euler from the static solution over its largest displacement",
        np.nan,
    ),
    "relaxation_error": (("mesh_size",), "1", "distance of dynamic relaxation from the static solution", np.nan),
    "relaxation_steps": (("mesh_size",), "1", "steps of dynamic relaxation", np.nan),
    **_judged("sliver", SLIVER, "a mesh with a sliver"),
    "sliver_negative_pivots": (SLIVER, "1", "negative pivots of the tangent with a sliver", np.nan),
    "sliver_step_limit": (SLIVER, "s", "largest stable step with a sliver", np.nan),
    "sliver_error": (SLIVER, "1", "displacement with a sliver over that without, less 1", np.nan),
    **_judged("contrast", CONTRAST, "a network with stiff and soft parts"),
    "contrast_negative_pivots": (CONTRAST, "1", "negative pivots of the tangent with a contrast", np.nan),
    "contrast_error": (CONTRAST, "1", "error of the linear solution, against extended precision", np.nan),
    "contrast_estimate": (CONTRAST, "1", "its estimate, by which it is judged", np.nan),
    **_judged("poisson", STRESSED, "a material near the incompressible one"),
    "poisson_negative_pivots": (STRESSED, "1", "negative pivots of the tangent", np.nan),
    "poisson_modulus_error": (STRESSED, "1", "error of Young's modulus along x", np.nan),
    "poisson_step_limit": (STRESSED, "s", "largest stable step", np.nan),
    "scaled_step_limit": (("scale",), "s/m", "largest stable step over the mesh size", np.nan),
    "precision_error": (("scale", "precision"), "1", "error of a run to rest, against the static solution", np.nan),
    **_judged("strain", STRAINED, "a large strain"),
    "negative_pivots": (STRAINED, "1", "negative pivots of the tangent; 0 where the equilibrium is stable", np.nan),
    "strain_displacement": (STRAINED, "m", "mean displacement of the loaded side along the force", np.nan),
    "strain_load_share": (STRAINED, "1", "largest share of the load with a good equilibrium", np.nan),
    **_judged("perturbed", PERTURBED, "a mesh with particles moved"),
    "perturbed_negative_pivots": (PERTURBED, "1", "negative pivots of the tangent", np.nan),
    "perturbed_error": (PERTURBED, "1", "displacement with particles moved over that without, less 1", np.nan),
    "perturbed_step_limit": (PERTURBED, "s", "largest stable step with particles moved", np.nan),
    "inverted_starts_right": (("definition",), "1", "share of inverted starts that end in the right solution", np.nan),
    "inverted_starts_wrong": (("definition",), "1", "share of inverted starts that end as solved elsewhere", np.nan),
    "buckling_load": (("definition", "rows"), "N", "buckling load of a column twenty times as long as high", np.nan),
    "euler_load": (("definition",), "N", "its load by Euler", np.nan),
    "arch_load": (ARCH, "N", "force on the middle of a shallow arch along its path", np.nan),
    "arch_deflection": (ARCH, "m", "its deflection", np.nan),
    "arch_negative_pivots": (ARCH, "1", "negative pivots of the tangent there", np.nan),
    "experiment_seconds": (("experiment", "definition"), "s", "time of an experiment", np.nan),
    "experiment_message": (("experiment", "definition"), "1", "why an experiment has no results", ""),
}

CASE = ("scene", "method", "mesh_size")
RACE = ("scene",)
SOLVED = ("linear_solver", "mesh_size")

BENCHMARK_VARIABLES = {
    "displacement": (CASE, "m", "displacement of the loaded side along the force", np.nan),
    "error": (CASE, "1", "signed error of the displacement, over the reference's", np.nan),
    "second_error": (CASE, "1", "signed error of the displacement on the second beam", np.nan),
    "assured_error": (
        CASE,
        "1",
        "largest absolute error of this and all finer mesh sizes that were run, on both beams",
        np.nan,
    ),
    "seconds": (CASE, "s", "time from nothing to the displacement, median of warm runs", np.nan),
    "seconds_spread": (CASE, "s", "longest less shortest of the warm runs", np.nan),
    "cold_seconds": (CASE, "s", "time of the first run, imports included", np.nan),
    "meshing_seconds": (CASE, "s", "time to make the mesh", np.nan),
    "assembling_seconds": (CASE, "s", "time to derive parameters and assemble", np.nan),
    "factorising_seconds": (CASE, "s", "time to factorise, or of what is paid once", np.nan),
    "solving_seconds": (CASE, "s", "time to solve", np.nan),
    "peak_memory": (CASE, "B", "largest memory of the process above that at its start", np.nan),
    "unknowns": (CASE, "1", "number of unknowns", np.nan),
    "pareto": (CASE, "1", "1 where no method of the scene is both more accurate and faster", 0),
    "status": (CASE, "1", "what became of the case", 0),
    "message": (CASE, "1", "why there are no numbers", ""),
    "error_rate": (
        ("scene", "method"),
        "1",
        "exponent of the error in the mesh size, where it falls with that and keeps its sign",
        np.nan,
    ),
    "cost_exponent": (("scene", "method"), "1", "exponent of the seconds in the unknowns, from 3000 on", np.nan),
    "reference_displacement": (RACE, "m", "displacement of the converged reference", np.nan),
    "reference_error_estimate": (RACE, "1", "estimated relative error of the reference", np.nan),
    "reference_seconds": (RACE, "s", "time of the reference", np.nan),
    "machine_load": (RACE, "1", "load of the machine at the start, processes", np.nan),
    "solver_seconds": (SOLVED, "s", "time from a matrix to a solution, its sparsity analysed", np.nan),
    "solver_again_seconds": (SOLVED, "s", "time of the next matrix of that sparsity", np.nan),
    "curve_seconds": (("curve_count",), "s", "time of a sensitivity curve as one path, 9470 particles", np.nan),
    "separate_seconds": (("curve_count",), "s", "time of as many nonlinear solves", np.nan),
    "nonlinear_seconds": ((), "s", "time of one nonlinear solve there", np.nan),
    "linear_seconds": ((), "s", "time of one linear solve there", np.nan),
    "explicit_steps": ((), "s-1", "explicit steps a second of nonlinear springs there", np.nan),
    "explicit_bandwidth": ((), "B/s", "memory that these steps read and write", np.nan),
    "copy_bandwidth": ((), "B/s", "memory that a plain copy reads and writes", np.nan),
}

FIELD = (*SCENE, "particle")
OUTLINE = ("beam", "material", "load", "outline_point")

FIELD_VARIABLES = {
    "x": ((*MESH, "particle"), "m", "position at rest along x", np.nan),
    "y": ((*MESH, "particle"), "m", "position at rest along y", np.nan),
    "spring_first": ((*MESH, "spring"), "1", "particle at the first end", np.nan),
    "spring_second": ((*MESH, "spring"), "1", "particle at the second end", np.nan),
    "displacement_x": (FIELD, "m", "displacement along x, network", np.nan),
    "displacement_y": (FIELD, "m", "displacement along y, network", np.nan),
    "outline_x": (("beam", "outline_point"), "m", "position at rest along x, reference", np.nan),
    "outline_y": (("beam", "outline_point"), "m", "position at rest along y, reference", np.nan),
    "reference_displacement_x": (OUTLINE, "m", "displacement along x, reference", np.nan),
    "reference_displacement_y": (OUTLINE, "m", "displacement along y, reference", np.nan),
}
"""Whole fields, of each beam's and mesh type's coarsest mesh: they are there to be looked at."""


def most_asked(root, dimension):
    """Label of a dimension that most scenes of a dataset's root are of."""
    asked = root.status != 0
    counts = asked.sum([name for name in asked.dims if name != dimension])
    return str(counts[dimension].values[int(counts.values.argmax())])


def empty(axes, variables):
    """Dataset whose cells hold nothing yet.

    Parameters
    ----------
    axes : dict of str to tuple
        Labels of each dimension.
    variables : dict
        `ROOT_VARIABLES` or the like.

    Returns
    -------
    xarray.Dataset
    """
    data = {}
    for name, (dimensions, units, long_name, nothing) in variables.items():
        shape = [len(axes[dimension]) for dimension in dimensions]
        values = np.full(shape, nothing, dtype=object if isinstance(nothing, str) else None)
        attributes = {"long_name": long_name, "units": units}
        meanings = FLAGS.get(name.rpartition("_")[2])
        if meanings:
            values = values.astype("int8")
            attributes |= {"flag_values": np.arange(len(meanings), dtype="int8"), "flag_meanings": " ".join(meanings)}
        data[name] = (dimensions, values, attributes)
    used = {dimension for dimensions, *_ in variables.values() for dimension in dimensions}
    coordinates = {}
    for dimension, long_name in DIMENSIONS.items():
        if dimension in used:
            values = np.array(axes[dimension])
            if values.dtype.kind == "U":
                values = values.astype(object)
            coordinates[dimension] = (dimension, values, {"long_name": long_name, "units": UNITS.get(dimension, "1")})
    return xr.Dataset(data, coordinates)


def write(path, groups, attributes):
    """Write a dataset; the file appears whole or not at all.

    Parameters
    ----------
    path : str or Path
    groups : dict of str to xarray.Dataset
        Dataset of each group, ``"/"`` for the root.
    attributes : dict of str to str
        Attributes of the root.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    unfinished = path.with_name(path.name + ".unfinished")
    tree = xr.DataTree.from_dict(groups)
    tree.attrs = attributes
    encoding = {
        group: {
            name: {"zlib": True, "complevel": 4} for name, array in data.items() if array.ndim and array.dtype != object
        }
        for group, data in groups.items()
    }
    tree.to_netcdf(unfinished, engine="h5netcdf", encoding=encoding)
    os.replace(unfinished, path)

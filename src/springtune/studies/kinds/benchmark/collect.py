"""Errors and seconds, gathered in the group ``/benchmark``."""

import numpy as np

from ...output.dataset import Group
from ...runs.stages import results
from .kind import STAGE

CASE = ("scene", "approach", "mesh_size")
OF_SCENE = ("scene",)
SOLVER_AXES = ("linear_solver", "mesh_size")
EXPLICIT_AXES = ("mesh_size", "thread_count", "precision")

BENCHMARK = Group(
    "/benchmark",
    {
        "displacement": (CASE, "m", "displacement of the loaded side along the force", np.nan),
        "error": (CASE, "1", "signed error of the displacement, over the reference's", np.nan),
        "second_error": (CASE, "1", "signed error of the displacement on the second beam", np.nan),
        "second_status": (CASE, "1", "what became of the case on the second beam", 0),
        "second_message": (CASE, "1", "why there is no error on the second beam", ""),
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
        "factorizing_seconds": (CASE, "s", "time to factorize, or of what is paid once", np.nan),
        "solving_seconds": (CASE, "s", "time to solve", np.nan),
        "peak_memory": (CASE, "byte", "largest memory of the process above that at its start", np.nan),
        "unknowns": (CASE, "1", "number of unknowns", np.nan),
        "pareto": (CASE, "1", "1 where no approach of the scene is both more accurate and faster", 0),
        "status": (CASE, "1", "what became of the case", 0),
        "message": (CASE, "1", "why there are no numbers", ""),
        "error_rate": (
            ("scene", "approach"),
            "1",
            "exponent of the error in the mesh size, where it falls with that and keeps its sign",
            np.nan,
        ),
        "cost_exponent": (("scene", "approach"), "1", "exponent of the seconds in the unknowns, from 3000 on", np.nan),
        "reference_displacement": (OF_SCENE, "m", "displacement of the converged reference", np.nan),
        "reference_error_estimate": (OF_SCENE, "1", "estimated relative error of the reference", np.nan),
        "reference_seconds": (OF_SCENE, "s", "time of the reference", np.nan),
        "machine_load": (OF_SCENE, "1", "load of the machine at the start, processes", np.nan),
        "solver_seconds": (SOLVER_AXES, "s", "time from a matrix to a solution, its sparsity analysed", np.nan),
        "solver_again_seconds": (SOLVER_AXES, "s", "time of the next matrix of that sparsity", np.nan),
        "solver_status": (SOLVER_AXES, "1", "what became of the linear system", 0),
        "solver_message": (SOLVER_AXES, "1", "why there are no seconds", ""),
        "curve_seconds": (("curve_count",), "s", "time of a sensitivity curve as one path, 9470 particles", np.nan),
        "separate_seconds": (("curve_count",), "s", "time of as many nonlinear solves", np.nan),
        "nonlinear_seconds": ((), "s", "time of one nonlinear solve there", np.nan),
        "linear_seconds": ((), "s", "time of one linear solve there", np.nan),
        "curve_status": ((), "1", "what became of the curves", 0),
        "curve_message": ((), "1", "why there are no seconds of curves", ""),
        "explicit_steps": (EXPLICIT_AXES, "s-1", "explicit steps a second of nonlinear springs", np.nan),
        "spring_updates": (EXPLICIT_AXES, "s-1", "springs that these steps advance, each step counted anew", np.nan),
        "explicit_bandwidth": (EXPLICIT_AXES, "byte s-1", "what these steps read and write, be it in a cache", np.nan),
        "explicit_error": (
            ("mesh_size", "precision"),
            "1",
            "largest difference of their displacements from those in double precision, over the largest of these",
            np.nan,
        ),
        "explicit_status": (("mesh_size",), "1", "what became of the explicit steps", 0),
        "explicit_message": (("mesh_size",), "1", "why there are no explicit steps", ""),
        "copy_bandwidth": (("thread_count",), "byte s-1", "memory that a plain copy reads and writes", np.nan),
    },
    dimensions={
        "scene": "scene of the benchmark",
        "approach": "definition / mesh type, or another approach",
        "linear_solver": "solver of linear systems",
        "curve_count": "number of stiffnesses of a sensitivity curve",
        "thread_count": "number of threads of explicit steps",
        "precision": "floating-point numbers of explicit steps",
    },
)


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    data = BENCHMARK.empty(study.axes)
    for task, result in results(STAGE, study, folder, BENCHMARK.variables):
        case = task.of
        data.attrs["second_beam"] = case.second_beam.name if case.second_beam else ""
        place = {"scene": case.name, "mesh_size": list(case.mesh_sizes)}
        for name, values in result.items():
            array = data[name]
            array.loc[{dimension: place[dimension] for dimension in array.dims if dimension in place}] = values
    return {BENCHMARK.name: data}

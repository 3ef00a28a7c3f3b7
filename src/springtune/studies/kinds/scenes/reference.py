"""Stage `reference`: one finite-element solution a unit problem, and one a scene at finite strain.

Where a study has many unit problems, an interpolant answers for all of a kind of load.
"""

import sys
import time
from pathlib import Path

from springtune.problem.geometry import Beam
from springtune.problem.loads import LOAD_KINDS
from springtune.problem.materials import Rubber, material_of

from ...runs import job, store
from .unit_references import failed, make_interpolant, solve_unit_problem

NOT_TESTED = "has no uniaxial_test, and so no law of Yeoh's: its references are neo-Hookean"
OF_TESTED = "has a uniaxial_test, and so Yeoh's law: its reference is 'yeoh-plane-stress'"
OF_PLANE_STRAIN = "is in plane strain: its reference is 'neo-hooke-plane-strain'"
"""Why a material has no reference of another law or plane."""


def run(content, attempts):
    """Solve the missing references of a bundle."""
    interpolants, others = _divided(content)
    job.solve_files(sys.modules[__name__], others, attempts)
    for task in interpolants:
        make_interpolant(Path(content["folder"]) / f"{task['key']}.h5", task, attempts)


def crashed(content, key, why):
    """Store the failed result of a reference whose process died."""
    interpolants, others = _divided(content)
    job.crashed_of_files(sys.modules[__name__], others, key, why)
    # What an interpolant cannot do goes into its own file.
    for task in interpolants:
        if key in (task["key"], *task["problems"]):
            store.add(Path(content["folder"]) / f"{task['key']}.h5", {key: failed(task, why)})


def _divided(content):
    """Tasks of interpolants, and the content of a job without them."""
    tasks = [task for file in content["files"] for task in file["tasks"] if "box" in task]
    return tasks, content | {"files": [file for file in content["files"] if "box" not in file["tasks"][0]]}


def solve(task):
    """Result of a unit problem, or at finite strain."""
    begin = time.perf_counter()
    return (_finite(task) if "law" in task else solve_unit_problem(task)) | {"seconds": time.perf_counter() - begin}


def _finite(task):
    """Result at finite strain."""
    # Here, since few studies need it.
    from springtune.reference.finite_strain import FiniteStrainError, solve_finite_strain

    beam, material, kind = Beam(**task["beam"]), material_of(task["material"]), LOAD_KINDS[task["load"]]
    if material.plane == "strain" and task["plane"] == "stress":
        return {"message": f"material {OF_PLANE_STRAIN}"}
    tested = isinstance(material, Rubber)
    if tested != (task["law"] == "yeoh"):
        return {"message": f"material {OF_TESTED if tested else NOT_TESTED}"}
    try:
        solution = solve_finite_strain(beam, material, task["force"], kind, task["plane"], task["follower"])
    except FiniteStrainError as error:
        return {"message": str(error)}
    names = ("displacement", "mean_displacement", "error_estimate", "positions", "profile")
    return {name: getattr(solution, name) for name in names} | {"message": ""}

"""Stage `reference`: finite elements, or an interpolant for a kind of load if a study has many unit problems."""

import sys
import time
from pathlib import Path

from springtune.problem.loads import LOAD_KINDS
from springtune.problem.materials import Rubber, material_of
from springtune.problem.shapes import Beam

from ...runs.attempts import solve_files
from . import unit_references

failed = unit_references.failed

WITHOUT_TEST = "has no uniaxial_test, and so no law of Yeoh's: its references are neo-Hookean"
WITH_TEST = "has a uniaxial_test, and so Yeoh's law: its reference is 'yeoh-plane-stress'"
IN_PLANE_STRAIN = "is in plane strain: its reference is 'neo-hooke-plane-strain'"
"""Why a material has no reference of another law or plane."""


def run(content, attempts):
    """Solve the missing references of a bundle."""
    others = [file for file in content["files"] if "box" not in file["tasks"][0]]
    solve_files(sys.modules[__name__], content | {"files": others}, attempts)
    for task in (task for file in content["files"] for task in file["tasks"] if "box" in task):
        unit_references.make_interpolant(Path(content["folder"]) / f"{task['key']}.h5", task, attempts)


def solve(task):
    """Result of a unit problem, at finite strain, or of a shape."""
    begin = time.perf_counter()
    if "shape" in task:
        from .shape_reference import solve as solve_task  # here: most studies have no shapes
    else:
        solve_task = _solve_finite_strain if "law" in task else unit_references.solve_unit_problem
    return solve_task(task) | {"seconds": time.perf_counter() - begin}


def _solve_finite_strain(task):
    """Result at finite strain."""
    # Here, since few studies need it.
    from springtune.reference.finite_strain import FiniteStrainError, solve_finite_strain

    beam, material, kind = Beam(**task["beam"]), material_of(task["material"]), LOAD_KINDS[task["load"]]
    if material.plane == "strain" and task["plane"] == "stress":
        return {"message": f"material {IN_PLANE_STRAIN}"}
    tested = isinstance(material, Rubber)
    if tested != (task["law"] == "yeoh"):
        return {"message": f"material {WITH_TEST if tested else WITHOUT_TEST}"}
    try:
        solution = solve_finite_strain(beam, material, task["force"], kind, task["plane"], task["follower"])
    except FiniteStrainError as error:
        return {"message": str(error)}
    names = ("displacement", "mean_displacement", "error_estimate", "positions", "profile")
    return {name: getattr(solution, name) for name in names} | {"message": ""}

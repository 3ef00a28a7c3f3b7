"""Stage `reference`: one finite-element solution a unit problem, and one a scene at finite strain.

Where a study has many unit problems, an interpolant answers for all of a kind of load. The file of one that meets no
tolerance has the reason and, solved one by one, the unit problems that were asked of it.
"""

import sys
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from springtune.problem.geometry import Beam
from springtune.problem.loads import LOAD_KINDS
from springtune.problem.materials import Rubber, material_of
from springtune.reference.small_strain import ReferenceNotConvergedError, solve_unit

from ...runs import driver, store

if TYPE_CHECKING:
    from ...runs.task_costs import TaskCosts

NOT_TESTED = "has no uniaxial_test, and so no law of Yeoh's: its references are neo-Hookean"
OF_TESTED = "has a uniaxial_test, and so Yeoh's law: its reference is 'yeoh-plane-stress'"
"""Why a material has no reference of the other law."""

REFERENCE_TOLERANCE = 1e-4
"""Largest error estimate of an interpolant that stands for references that are solved by themselves [1]: theirs."""


def run(content, costs):
    """Solve the missing references of a bundle."""
    driver.solve_files(sys.modules[__name__], content, costs)
    for task in content.get("interpolants", ()):
        make_interpolant(Path(content["folder"]) / f"{task['key']}.h5", task, costs)


def make_interpolant(path: Path, task: dict[str, Any], costs: "TaskCosts") -> None:
    """Build a missing interpolant; if it meets no tolerance, solve its unit problems one by one."""
    if task["key"] not in store.stored(path, costs.limits):
        begin = time.perf_counter()
        result = costs.attempt(task["key"], partial(_built, task), partial(failed, task))
        if result is None:
            return
        result["seconds"], result["asked"] = time.perf_counter() - begin, len(task["problems"])
        store.add(path, {task["key"]: result})
        costs.add("interpolant", result.get("solves", 0), result["seconds"])
    known = store.stored(path, costs.limits)
    if "solves" in store.read(path, [task["key"]])[task["key"]]:
        return
    missing = [key for key in task["problems"] if key not in known]
    # Those that share elements follow each other.
    with store.Keeper(path) as keeper:
        for key in sorted(missing, key=lambda key: task["problems"][key]):
            begin = time.perf_counter()
            problem = {"problem": (*task["problems"][key], task["kind"])}
            result = costs.attempt(key, partial(_unit, problem, fields=False), partial(failed, task))
            if result is None:
                continue
            keeper[key] = result | {"seconds": time.perf_counter() - begin}
            costs.add("interpolant", 1, time.perf_counter() - begin, 0)


def _built(task):
    """Interpolant within its own tolerance or that of references, else the reason."""
    # Here, since few studies need it.
    from springtune.reference.interpolant import TOLERANCE, Interpolant, NotCertifiedError

    kind, (aspect_range, nu_range) = LOAD_KINDS[task["kind"]], task["box"]
    for tolerance in (TOLERANCE, REFERENCE_TOLERANCE):
        try:
            return Interpolant.build(kind, aspect_range, nu_range, tolerance).arrays() | {"message": ""}
        except NotCertifiedError as error:
            why = str(error)
    return {"message": why}


def gone(content, key, why, limits):
    """Store the failed result of a reference beyond its limits."""
    if driver.gone_of_files(sys.modules[__name__], content, key, why, limits):
        return
    # What an interpolant cannot do goes into its own file.
    for task in content.get("interpolants", ()):
        if key in (task["key"], *task["problems"]):
            noted = failed(task, why) | {store.LIMITS: limits}
            store.add(Path(content["folder"]) / f"{task['key']}.h5", {key: noted})


def failed(task: dict[str, Any], why: str) -> dict[str, Any]:
    """Result of a reference that fails."""
    return {"message": why, "seconds": 0.0}


def solve(task):
    """Result of a unit problem, or at finite strain."""
    begin = time.perf_counter()
    return (_finite(task) if "law" in task else _unit(task)) | {"seconds": time.perf_counter() - begin}


def _unit(task, fields=True):
    """Result of a unit problem, with whole fields or without."""
    aspect_ratio, nu, kind = task["problem"]
    try:
        solution = solve_unit(aspect_ratio, nu, LOAD_KINDS[kind])
    except ReferenceNotConvergedError as error:
        return {"message": str(error)}
    names = ("displacement", "mean_displacement", "error_estimate", "rotation", "strain")
    names += ("x", "y", "displacements") if fields else ()
    return {name: getattr(solution, name) for name in names} | {"message": ""}


def _finite(task):
    """Result at finite strain."""
    # Here, since few studies need it.
    from springtune.reference.finite_strain import FiniteStrainError, IncompressibleError, solve_neo_hooke, solve_yeoh

    beam, material, kind = Beam(**task["beam"]), material_of(task["material"]), LOAD_KINDS[task["load"]]
    tested = isinstance(material, Rubber)
    if tested != (task["law"] == "yeoh"):
        return {"message": f"material {OF_TESTED if tested else NOT_TESTED}"}
    try:
        if tested:
            solution = solve_yeoh(beam, material, task["force"], kind, task["follower"])
        else:
            solution = solve_neo_hooke(beam, material, task["force"], kind, task["plane"], task["follower"])
    except (FiniteStrainError, IncompressibleError) as error:
        return {"message": str(error)}
    names = ("displacement", "mean_displacement", "error_estimate", "positions", "profile")
    return {name: getattr(solution, name) for name in names} | {"message": ""}

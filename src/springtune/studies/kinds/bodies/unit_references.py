"""References in small strain: unit problems, and interpolants that answer for many of them."""

import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from springtune.problem.loads import LOAD_KINDS
from springtune.reference.small_strain import ReferenceNotConvergedError, solve_unit

from ...runs import store

if TYPE_CHECKING:
    from ...runs.attempts import Attempts

REFERENCE_TOLERANCE = 1e-4
"""Largest error estimate of an interpolant [1], as of solved references."""


def make_interpolant(path: Path, task: dict[str, Any], attempts: "Attempts") -> None:
    """Build a missing interpolant; if it meets no tolerance, solve its unit problems one by one."""
    if task["key"] not in store.stored_keys(path):
        begin = time.perf_counter()
        result = attempts.attempt(task["key"], partial(_build_interpolant, task), partial(failed, task))
        if result is None:
            return
        result["seconds"], result["asked"] = time.perf_counter() - begin, len(task["problems"])
        store.add(path, {task["key"]: result})
        attempts.computed += 1
    known = store.stored_keys(path)
    if "solves" in store.read(path, [task["key"]])[task["key"]]:
        return
    missing = [key for key in task["problems"] if key not in known]
    # Those that share elements follow each other.
    with store.ResultBuffer(path) as keeper:
        for key in sorted(missing, key=lambda key: task["problems"][key]):
            begin = time.perf_counter()
            problem = {"problem": (*task["problems"][key], task["kind"])}
            result = attempts.attempt(key, partial(solve_unit_problem, problem, fields=False), partial(failed, task))
            if result is None:
                continue
            keeper[key] = result | {"seconds": time.perf_counter() - begin}


def _build_interpolant(task: dict[str, Any]) -> dict[str, Any]:
    """Arrays of an interpolant within its tolerance or that of references, or the reason why there is none."""
    # Here, since few studies need it.
    from springtune.reference.interpolant import TOLERANCE, Interpolant, NotCertifiedError

    kind, (aspect_range, nu_range) = LOAD_KINDS[task["kind"]], task["box"]
    for tolerance in (TOLERANCE, REFERENCE_TOLERANCE):
        try:
            return Interpolant.build(kind, aspect_range, nu_range, tolerance).arrays() | {"message": ""}
        except NotCertifiedError as error:
            why = str(error)
    return {"message": why}


def failed(task: dict[str, Any], why: str) -> dict[str, Any]:
    """Result of a reference that fails."""
    return {"message": why, "seconds": 0.0}


def solve_unit_problem(task: dict[str, Any], fields: bool = True) -> dict[str, Any]:
    """Result of a unit problem, with whole fields or without."""
    aspect_ratio, nu, kind = task["problem"]
    try:
        solution = solve_unit(aspect_ratio, nu, LOAD_KINDS[kind])
    except ReferenceNotConvergedError as error:
        return {"message": str(error)}
    names = ["displacement", "mean_displacement", "error_estimate", "rotation", "strain"]
    names += ["x", "y", "displacements"] if fields else []
    return {name: getattr(solution, name) for name in names} | {"message": ""}

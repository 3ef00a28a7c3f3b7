"""Stored interpolants of references, of grids and of samples.

The file of one that meets no tolerance has the reason and, solved one by one, the unit problems that were asked of it.
"""

import time
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from springtune.problem.loads import LOAD_KINDS

from ...runs import store

if TYPE_CHECKING:
    from collections.abc import Mapping

    from springtune.reference.interpolant import Interpolant

    from ...runs.task_costs import TaskCosts

    Found = tuple[Interpolant | None, dict[str, dict[str, Any]], float, str]

REFERENCE_TOLERANCE = 1e-4
"""Largest error estimate of an interpolant that stands for references that are solved by themselves [1]: theirs."""

ANSWERS = ("displacement", "mean_displacement", "rotation", "strain", "error_estimate")
"""What an interpolant answers for a unit problem."""


def make(path: Path, task: "Mapping[str, Any]", costs: "TaskCosts") -> None:
    """Build an interpolant if it is not there yet; without one, solve the unit problems that are asked of it."""
    if task["key"] not in store.stored(path, costs.limits):
        begin = time.perf_counter()
        result = costs.attempt(task["key"], partial(_built, task), failed)
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
            aspect_ratio, nu = task["problems"][key]
            result = costs.attempt(key, partial(_solved, aspect_ratio, nu, task["kind"]), failed)
            if result is None:
                continue
            keeper[key] = result | {"seconds": time.perf_counter() - begin}
            costs.add("interpolant", 1, time.perf_counter() - begin, 0)


def failed(why: str) -> dict[str, Any]:
    """Result of a reference that fails."""
    return {"message": why, "seconds": 0.0}


def read(folder: str | Path, key: str) -> "Found":
    """Interpolant, or what there is in its place."""
    path = Path(folder) / f"{key}.h5"
    state = path.stat() if path.exists() else None
    return _opened(path, key, (state.st_size, state.st_mtime_ns) if state else None)


@lru_cache(maxsize=8)
def _opened(path: Path, key: str, state: tuple[int, int] | None) -> "Found":
    """What `read` gives of a file in its state."""
    arrays = ("aspect_range", "nu_range", "values")
    results = store.read(path, {key} | (store.stored(path) if state else set()), arrays)
    known = results.pop(key)
    if "solves" not in known:
        return None, results, 0.0, known["message"]
    from springtune.reference.interpolant import Interpolant  # here: few studies need it

    each = known["seconds"] / max(known["asked"], 1)
    return Interpolant.from_arrays(LOAD_KINDS[known["kind"]], known), results, each, ""


def _built(task: "Mapping[str, Any]") -> dict[str, Any]:
    """An interpolant, within its own tolerance or within that of references; else why there is none."""
    # Here, since readers build none.
    from springtune.reference.interpolant import TOLERANCE, Interpolant, NotCertifiedError

    kind, (aspect_range, nu_range) = LOAD_KINDS[task["kind"]], task["box"]
    for tolerance in (TOLERANCE, REFERENCE_TOLERANCE):
        try:
            return Interpolant.build(kind, aspect_range, nu_range, tolerance).arrays() | {"message": ""}
        except NotCertifiedError as error:
            why = str(error)
    return {"message": why}


def _solved(aspect_ratio: float, nu: float, kind: str) -> dict[str, Any]:
    """Answers of a unit problem that is solved by itself."""
    from springtune.reference.small_strain import ReferenceNotConvergedError, solve_unit  # here, as above

    try:
        solution = solve_unit(aspect_ratio, nu, LOAD_KINDS[kind])
    except ReferenceNotConvergedError as error:
        return {"message": str(error)}
    return {name: getattr(solution, name) for name in ANSWERS} | {"message": ""}

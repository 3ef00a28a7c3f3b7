"""Stage `reference`: finite elements for beams and shapes, or an interpolant if a load has many unit problems."""

import sys
import time
from functools import partial
from pathlib import Path

import numpy as np

from springtune.problem.loads import LOAD_KINDS
from springtune.problem.materials import Rubber, material_of, materials_by_part
from springtune.problem.shapes import Beam
from springtune.reference.small_strain import ReferenceNotConvergedError, solve_unit

from ...runs import store
from ...runs.attempts import solve_files

REFERENCE_TOLERANCE = 1e-4  # largest error estimate of an interpolant [1], as of solved references

WITHOUT_TEST = "has no uniaxial_test, and so no law of Yeoh's: its references are neo-Hookean"
WITH_TEST = "has a uniaxial_test, and so Yeoh's law: its reference is 'yeoh-plane-stress'"
IN_PLANE_STRAIN = "is in plane strain: its reference is 'neo-hooke-plane-strain'"
"""Why a material has no reference of another law or plane."""

POINTS_ALONG_SIDE = 24  # points along a side of a drawn outline


def run(content, attempts):
    """Solve the missing references of a bundle."""
    others = [file for file in content["files"] if "box" not in file["tasks"][0]]
    solve_files(sys.modules[__name__], content | {"files": others}, attempts)
    for task in (task for file in content["files"] for task in file["tasks"] if "box" in task):
        make_interpolant(Path(content["folder"]) / f"{task['key']}.h5", task, attempts)


def failed(task, why):
    """Result of a reference that fails."""
    return {"message": why, "seconds": 0.0}


def solve(task, **options):
    """Result of a unit problem, at finite strain, or of a shape."""
    begin = time.perf_counter()
    solve_task = _solve_shape if "shape" in task else _solve_finite_strain if "law" in task else _solve_unit_problem
    try:
        found = solve_task(task, **options)
    except ReferenceNotConvergedError as error:
        found = {"message": str(error)}
    return found | {"seconds": time.perf_counter() - begin}


# -- beams -------------------------------------------------------------------------------------------------------------


def _solve_unit_problem(task, fields=True):
    """Result of a unit problem, with whole fields or without."""
    aspect_ratio, nu, kind = task["problem"]
    solution = solve_unit(aspect_ratio, nu, LOAD_KINDS[kind])
    names = ["displacement", "mean_displacement", "error_estimate", "rotation", "strain"]
    names += ["x", "y", "displacements"] if fields else []
    return {name: getattr(solution, name) for name in names} | {"message": ""}


def _solve_finite_strain(task):
    # Here, since few studies need it.
    from springtune.reference.finite_strain import solve_finite_strain

    beam, material, kind = Beam(**task["beam"]), material_of(task["material"]), LOAD_KINDS[task["load"]]
    if material.plane == "strain" and task["plane"] == "stress":
        return {"message": f"material {IN_PLANE_STRAIN}"}
    tested = isinstance(material, Rubber)
    if tested != (task["law"] == "yeoh"):
        return {"message": f"material {WITH_TEST if tested else WITHOUT_TEST}"}
    solution = solve_finite_strain(beam, material, task["force"], kind, task["plane"], task["follower"])
    names = ("displacement", "mean_displacement", "error_estimate", "positions", "profile")
    return {name: getattr(solution, name) for name in names} | {"message": ""}


def make_interpolant(path, task, attempts):
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
    # Those that share elements follow each other.
    with store.ResultBuffer(path) as keeper:
        for key, problem in sorted(task["problems"].items(), key=lambda pair: pair[1]):
            unit = partial(solve, {"problem": (*problem, task["kind"])}, fields=False)
            if key not in known and (result := attempts.attempt(key, unit, partial(failed, task))):
                keeper[key] = result


def _build_interpolant(task):
    """Arrays of an interpolant within its tolerance or that of references, or the reason if it cannot be built."""
    # Here, since few studies need it.
    from springtune.reference.interpolant import TOLERANCE, Interpolant, NotCertifiedError

    kind, (aspect_range, nu_range) = LOAD_KINDS[task["kind"]], task["box"]
    for tolerance in (TOLERANCE, REFERENCE_TOLERANCE):
        try:
            return Interpolant.build(kind, aspect_range, nu_range, tolerance).arrays() | {"message": ""}
        except NotCertifiedError as error:
            why = str(error)
    return {"message": why}


# -- shapes ------------------------------------------------------------------------------------------------------------


def _solve_shape(task):
    """Result of a shape; its ``shape`` is an argument of `make_shape`."""
    # Here: most studies have no shapes, and most references are of small strain.
    from springtune.mesh.sheets import parts_of
    from springtune.reference.shapes import solve_each

    from .task_values import LOAD_NAME, make_shape, materials_of, quantity_key, shape_of, values_by_key

    solver = None
    if "law" in task:
        from springtune.reference.finite_shapes import solve_finite_shape

        solver = partial(solve_finite_shape, law=task["law"])
    grouped = make_shape(task["shape"]) if "file" in task["shape"] else None
    shape, materials = shape_of(task["shape"], task["thickness"], task["load"]), materials_of(task["materials"])
    try:
        materials = materials_by_part(materials, parts_of(grouped)) if grouped else materials
    except ValueError as error:  # of a file that is too large to be checked before
        return {"message": str(error)}
    case = shape.loads[LOAD_NAME]
    found, lacking = solve_each(shape, case, materials, grouped, solver)
    if not found:
        return {"message": "; ".join(dict.fromkeys(lacking.values()))}
    values, estimates = {}, {}
    for one in found:
        values |= values_by_key(one.values, case)
        estimates |= values_by_key(one.error_estimates, case)
    outlines = _outlines(shape, grouped)
    points = np.concatenate(outlines)
    return {
        "message": "",
        "values": values,
        "error_estimates": estimates,
        "lacking": {quantity_key(one): lacking[one.name] for one in case.quantities if one.name in lacking},
        "unknowns": max(int(one.unknowns) for one in found),
        "rotation": found[0].rotation,
        "strain": found[0].strain,
        "outline_points": points,
        "outline_displacements": found[0].at(points),
        "outline_lengths": np.array([len(one) for one in outlines]),
    }


def _outlines(shape, grouped):
    """Points around the outline and around each hole [m]."""
    from springtune.mesh.sheets import outline_of, rounds

    if grouped is None:
        outer = [one.sides for one in shape.rounds if one.inner is None or one.outer is None]
        shares = [number / POINTS_ALONG_SIDE for number in range(POINTS_ALONG_SIDE)]
        return [np.array([side.at(share) for side in sides for share in shares]) for sides in outer]
    mesh = grouped.mesh
    return [mesh.points[one] for one in rounds(outline_of(mesh)[0])]

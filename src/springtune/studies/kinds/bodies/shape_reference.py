"""References of shapes for the stage `reference`: one for each shape, material and load."""

from functools import partial

import numpy as np

from springtune.mesh.sheets import outline_of, parts_of, rounds
from springtune.problem.materials import of_parts
from springtune.reference.shapes import solve_each

from .task_values import LOAD_NAME, make_shape, materials_of, quantity_key, shape_of, values_by_key

POINTS_ALONG_SIDE = 24
"""Points along a side of a drawn outline."""


def solve(task):
    """Result of a reference; its ``shape`` is an argument of `make_shape`."""
    solver = None
    if "law" in task:
        from springtune.reference.finite_shapes import solve_finite_shape  # here: most references are of small strain

        solver = partial(solve_finite_shape, law=task["law"])
    grouped = make_shape(task["shape"]) if "file" in task["shape"] else None
    shape, materials = shape_of(task["shape"], task["thickness"], task["load"]), materials_of(task["materials"])
    try:
        materials = of_parts(materials, parts_of(grouped)) if grouped else materials
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
        "energy": float(found[0].energy),
        "rotation": float(found[0].rotation),
        "strain": float(found[0].strain),
        "outline_points": points,
        "outline_displacements": found[0].at(points),
        "outline_lengths": np.array([len(one) for one in outlines]),
    }


def _outlines(shape, grouped):
    """Points around the outline and around each hole [m]."""
    if grouped is None:
        outer = [one.sides for one in shape.rounds if one.inner is None or one.outer is None]
        shares = [number / POINTS_ALONG_SIDE for number in range(POINTS_ALONG_SIDE)]
        return [np.array([side.at(share) for side in sides for share in shares]) for sides in outer]
    mesh = grouped.mesh
    return [mesh.points[one] for one in rounds(outline_of(mesh)[0])]

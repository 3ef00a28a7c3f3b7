"""Laid strips, gathered in the group ``/laying``."""

from collections import defaultdict

import numpy as np

from springtune.problem.compare import band
from springtune.problem.status import Status

from ...output.dataset import Filler
from ...runs.stages import results
from .kind import STAGE
from .variables import LAYING


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    part = study.parts["laying"]
    found = {task.of: result for task, result in results(STAGE, study, folder, ["outline"])}
    points = max(len(result.get("outline", ())) for result in found.values())
    axes = study.axes | {"outline_point": tuple(range(points)), "corner": tuple(range(4))}
    laid = Filler(LAYING.empty(axes))
    for one in part.strips:
        _strip(one, found[one], laid)
    meshes = defaultdict(list)
    for one in part.references:
        meshes[one.loading, one.friction].append(found[one])
    for (loading, friction), solved in meshes.items():
        _reference(solved, {"loading": loading, "friction": friction}, laid)
    corners = np.array(part.strips[0].trapezoid.corners)
    laid.put({"trapezoid_x": corners[:, 0], "trapezoid_y": corners[:, 1]})
    return {LAYING.name: laid.data}


def _strip(one, result, laid):
    """Put the result of a strip of springs."""
    labels = {"definition": one.definition, "mesh_size": one.mesh_size}
    labels |= {"loading": one.loading, "friction": one.friction}
    values = {"status": result["status"], "message": result["message"]}
    if "area" in result:
        values |= {
            "load_share": result["load_share"],
            "iterations": result["iterations"],
            "laying_seconds": result["seconds"],
            "skipped": result["skipped"],
            "penetration": result["penetration"],
        }
    if result["status"] == Status.SOLVED:
        values |= {
            "area_under_strip": result["area"],
            "area_error": result["area"] / one.trapezoid.area - 1,
            "elongation": result["elongation"],
            "contact_force_error": result["force_error"],
        }
    laid.put(values, **labels)
    if "outline" in result:
        laid.put_rows({"strip_x": result["outline"][:, 0], "strip_y": result["outline"][:, 1]}, **labels)


def _reference(meshes, labels, laid):
    """Put the result of finite elements on several meshes: that of the first, with a band of all."""
    result = meshes[0]
    if result["status"] != Status.SOLVED:
        return
    values = {}
    for name in ("area", "elongation"):
        values[f"reference_{name}"] = result[name]
        others = [mesh[name] if mesh["status"] == Status.SOLVED else np.nan for mesh in meshes]
        values[f"reference_{name}_error_estimate"] = band(others)
    laid.put(values, **labels)
    laid.put_rows({"reference_x": result["outline"][:, 0], "reference_y": result["outline"][:, 1]}, **labels)

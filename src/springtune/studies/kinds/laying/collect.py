"""Laid strips, gathered in the group ``/laying``."""

from collections import defaultdict

import numpy as np

from springtune.problem.compare import band
from springtune.problem.status import Status

from ...output.dataset import Filler, Group
from ...runs.stages import results
from .kind import STAGE

LAID = ("definition", "mesh_size", "loading", "friction")
LAID_REFERENCE = ("loading", "friction")

LAYING = Group(
    "/laying",
    {
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
        "reference_x": (
            (*LAID_REFERENCE, "outline_point"),
            "m",
            "outline of the strip of finite elements along x",
            np.nan,
        ),
        "reference_y": (
            (*LAID_REFERENCE, "outline_point"),
            "m",
            "outline of the strip of finite elements along y",
            np.nan,
        ),
        "trapezoid_x": (("corner",), "m", "corners of the trapezoid along x", np.nan),
        "trapezoid_y": (("corner",), "m", "corners of the trapezoid along y", np.nan),
    },
    dimensions={
        "loading": "what lays the strip",
        "friction": "Coulomb's coefficient of friction",
    },
)


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

"""Laid strips, gathered in the group ``/laying``."""

from collections import defaultdict

import numpy as np

from springtune.problem.compare import band
from springtune.problem.status import Status

from ...output.dataset import Filler, Group
from ...runs.stages import results
from .kind import STAGE

LAYING_WAY = ("loading", "friction")
LAID = ("definition", "mesh_size", *LAYING_WAY)

BAND = "twice its spread over three meshes of finite elements"


def _outline(name, dimensions, whose):
    """Variables of the points of an outline."""
    return {f"{name}_{axis}": (dimensions, "m", f"{whose} along {axis}", np.nan) for axis in "xy"}


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
        **_outline("strip", (*LAID, "outline_point"), "outline of the laid strip"),
        "reference_area": (LAYING_WAY, "m2", "area between the strip and the floor, finite elements", np.nan),
        "reference_area_error_estimate": (
            LAYING_WAY, "m2", f"band of the area between strip and floor, {BAND}", np.nan,
        ),
        "reference_elongation": (LAYING_WAY, "1", "elongation of the lower fibre, finite elements", np.nan),
        "reference_elongation_error_estimate": (
            LAYING_WAY, "1", f"band of the elongation of the lower fibre, {BAND}", np.nan,
        ),
        **_outline("reference", (*LAYING_WAY, "outline_point"), "outline of the strip of finite elements"),
        **_outline("trapezoid", ("corner",), "corners of the trapezoid"),
    },
    dimensions={"loading": "what lays the strip", "friction": "Coulomb's coefficient of friction"},
)  # fmt: skip

OF_ALL = ("status", "message", "load_share", "iterations", "laying_seconds", "skipped", "penetration")
OF_SOLVED = ("area_under_strip", "elongation", "contact_force_error")
"""Results that the dataset takes as they are."""


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
    for labels, solved in meshes.items():
        _reference(solved, dict(zip(LAYING_WAY, labels)), laid)
    laid.put(dict(zip(("trapezoid_x", "trapezoid_y"), np.transpose(part.strips[0].trapezoid.corners))))
    return {LAYING.name: laid.data}


def _strip(one, result, laid):
    """Put the result of a strip of springs."""
    labels, solved = {name: getattr(one, name) for name in LAID}, result["status"] == Status.SOLVED
    values = {name: result[name] for name in OF_ALL + OF_SOLVED * solved if name in result}
    if solved:
        values["area_error"] = result["area_under_strip"] / one.trapezoid.area - 1
    laid.put(values, **labels)
    if "outline" in result:
        laid.put(dict(zip(("strip_x", "strip_y"), result["outline"].T)), **labels)


def _reference(meshes, labels, laid):
    """Put the result of finite elements on the first of several meshes, with a band of all."""
    result = meshes[0]
    if result["status"] != Status.SOLVED:
        return
    values = {}
    for variable, name in (("reference_area", "area_under_strip"), ("reference_elongation", "elongation")):
        all_values = [mesh[name] if mesh["status"] == Status.SOLVED else np.nan for mesh in meshes]
        values |= {variable: result[name], f"{variable}_error_estimate": band(all_values)}
    laid.put(values, **labels)
    laid.put(dict(zip(("reference_x", "reference_y"), result["outline"].T)), **labels)

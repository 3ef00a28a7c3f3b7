"""Laid strips, gathered in the group ``/laying``."""

from collections import defaultdict
from types import MappingProxyType

import numpy as np

from springtune.problem.compare import band
from springtune.problem.status import Status

from ...output.dataset import Group
from ...runs.stages import results
from .kind import LAID, LAYING_WAY, STAGE

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


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    rows, meshes, points = [], defaultdict(list), 0
    for task, result in results(STAGE, study, folder, ["outline"]):
        points = max(points, len(result.get("outline", ())))
        if "definition" in task.labels:
            rows += [task.labels | result, *_points("strip", result.get("outline", ()), "outline_point", task.labels)]
        else:
            meshes[tuple(task.labels.items())].append(result)
    for labels, found in meshes.items():
        rows += _reference(dict(labels), found) if found[0]["status"] == Status.SOLVED else []
    rows += _points("trapezoid", study.parts["laying"].strips[0].trapezoid.corners, "corner")
    axes = study.axes | {"outline_point": tuple(range(points)), "corner": tuple(range(4))}
    return {LAYING.name: LAYING.of_rows(axes, rows)}


def _points(name, points, dimension, labels=MappingProxyType({})):
    """Rows of points along an outline."""
    return [{**labels, dimension: place, f"{name}_x": x, f"{name}_y": y} for place, (x, y) in enumerate(points)]


def _reference(labels, meshes):
    """Rows of finite elements on the first of several meshes, with a band of all."""
    values = {}
    for variable, name in (("reference_area", "area_under_strip"), ("reference_elongation", "elongation")):
        values[variable] = meshes[0][name]
        values[f"{variable}_error_estimate"] = band([mesh.get(name, np.nan) for mesh in meshes])
    return [labels | values, *_points("reference", meshes[0]["outline"], "outline_point", labels)]

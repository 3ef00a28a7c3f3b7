"""Stage `solve`: the mass-spring network of every scene, all scenes of a mesh together."""

import time
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from springtune.problem.boundary import FACE_POSITIONS
from springtune.problem.loads import LOAD_KINDS
from springtune.problem.materials import material_of
from springtune.problem.status import Status
from springtune.reference.answers import field_error, interpolate
from springtune.scene.sheet import Sheet, definition_of
from springtune.springs.base import DEFINITIONS, DefinitionError

from . import stored
from .stored import stored_key

parts = stored.parts


def tasks(family, content):
    """Scenes of a mesh under the keys of their results, with their calibrated stiffness."""
    if not any("calibration" in scene for scene in family["tasks"]):
        return family["tasks"]
    calibration = stored.read_calibration(content["results"])
    return [
        scene | {"key": stored_key(scene, calibration), "calibrated": calibration.get(scene.get("calibration"))}
        for scene in family["tasks"]
    ]


def prepare(family, content):
    """Sheet of a mesh, and a function that reads the fields of references on it for 1 N [m].

    ``family`` is a file of the job's content (`springtune.studies.runs.job`): the scenes of one mesh.
    """
    mesh, labels = stored.prepared(content, family).mesh, ("x", "y", "displacements")

    @cache
    def for_one(key, length):
        """Displacements for 1 N of a material that moves by 1 m; None where the reference has none."""
        scales = {"key": key, "length": length, "displacement": 1.0}
        found = stored.read_reference(Path(content["results"]) / "references", scales, labels)
        return interpolate(*(found[label] for label in labels), mesh.points) if "x" in found else None

    def field(reference):
        unit = for_one(reference["key"], reference["length"])
        return None if unit is None else reference["displacement"] * unit

    return Sheet(mesh, family["thickness"]), field


def failed(scene, why):
    """Result of a scene that fails."""
    return {"status": Status.FAILED, "message": why, "seconds": 0.0}


def order(scene):
    """Order in which scenes of one network follow each other."""
    uniform = DEFINITIONS[scene["definition"]].uniform
    return ("" if uniform else scene["definition"], scene["material"]["poisson_ratio"], LOAD_KINDS[scene["kind"]].held)


def solve(scene, shared):
    """Result of a scene on what scenes of its bundle share."""
    sheet, field = shared
    return solved(sheet, scene, field)


def solved(sheet, scene, reference=None):
    """Result of a scene, ready to be stored: lengths [m], stiffnesses [N/m], forces [N].

    ``reference`` returns the displacements of the scene's reference for 1 N at the particles [m], or None.
    """
    begin, derived = time.perf_counter(), sheet.deriving
    try:
        result = _solved(sheet, scene, reference)
    except DefinitionError as error:
        result = {"status": Status.FAILED, "message": f"{scene['definition']}: {error}"}
    return result | {"seconds": time.perf_counter() - begin - (sheet.deriving - derived)}


def _solved(sheet, scene, reference):
    stiffness, group = scene.get("stiffness"), scene.get("calibrated")
    if group:
        if group["stiffness"] is None:
            return {"status": Status.FAILED, "message": group["message"]}
        stiffness = group["stiffness"] * scene["thickness_ratio"]
    field = reference(scene["reference"]) if reference and "reference" in scene else None
    kind, force, kinematics = LOAD_KINDS[scene["kind"]], scene["force"], scene["kinematics"]
    definition = definition_of(scene["definition"])
    springs, seconds = sheet.derive(definition, material_of(scene["material"]), stiffness, (kind, force, field))
    if "stiffness_scale" in scene:
        springs = replace(springs, reference=scene["stiffness_scale"] * springs.reference)
    solution = sheet.solve(kind, springs, force, kinematics, scene["follower"])
    found = solution.equilibrium
    result = {
        "status": solution.status,
        "message": solution.message,
        "iterations": found.iterations,
        "residual": found.residual,
        "stiffness": springs.reference if definition.uniform else np.nan,
        "definition_seconds": seconds,
        "definition_evaluations": springs.evaluations,
        "spring_ratio": springs.spring_ratio,
        "solver": found.factor.name if found.factor else "",
        "load_share": found.load_share if kinematics == "nonlinear" else np.nan,
    }
    if not found.converged:
        if found.last is not None:
            result["last_displacement"] = sheet.displacement(kind, found.last)
        return result
    result |= {"displacement": solution.displacement, "negative_pivots": solution.negative_pivots}
    if kind.pressed:
        result |= _face(sheet, kind, found.displacements)
    if field is not None:
        result["field_error"] = field_error(sheet.mesh, found.displacements, force * field)
    return result | (_fields(springs, solution, kinematics) if scene.get("keep_fields") else {})


def _fields(springs, solution, kinematics):
    """Displacements of the particles [m], stiffness [N/m] and axial force [N] of the springs."""
    network, moved = solution.problem.network, solution.equilibrium.displacements
    forces = springs.reference * network.spring_forces(moved, kinematics == "linear")
    return {
        "displacements": moved,
        "spring_stiffnesses": (springs.reference * springs.relative).astype("float32"),
        "spring_forces": forces.astype("float32"),
    }


def _face(sheet, kind, displacements):
    """Mean displacement of a pressed face and its profile, along the force [m]."""
    weights = sheet.weights(kind)
    face = np.flatnonzero(weights[:, kind.axis] > 0)
    x, moved = sheet.mesh.points[face, kind.along], displacements[face, kind.axis]
    order = np.argsort(x)
    profile = np.interp(FACE_POSITIONS * np.ptp(x), x[order], moved[order])
    return {"face_mean": float((weights * displacements).sum()), "face_profile": profile}

"""Stage `solve`: the mass-spring network of every scene, all scenes of a mesh together."""

import time
from dataclasses import replace

import numpy as np

from springtune.problem.boundary import FACE_POSITIONS
from springtune.problem.loads import LOAD_KINDS
from springtune.problem.materials import material_of
from springtune.problem.status import Status
from springtune.reference.answers import field_error, interpolate
from springtune.scene.sheet import Sheet, definition_of
from springtune.springs import DEFINITIONS, DefinitionError

from ...runs import checked_json
from . import stored
from .stored import calibrated_key

parts = stored.parts


def tasks(family, content):
    """Scenes of a mesh under the keys of their results, and what is calibrated for them."""
    calibration = checked_json.demand(content["calibration"]) if content["calibration"] else {}
    if not calibration:
        return family["tasks"]
    return [
        scene | {"key": stored_key(scene, calibration), "calibrated": calibration.get(scene.get("calibration"))}
        for scene in family["tasks"]
    ]


def prepare(family, content):
    """Sheet of a mesh, and the fields of references on it."""
    mesh = stored.prepared(content["meshes"], family["name"]).mesh
    return Sheet(mesh, family["thickness"]), References(content["references"], mesh)


def failed(scene, why):
    """Result of a scene that fails."""
    return {"status": Status.FAILED, "message": why, "seconds": 0.0}


def order(scene):
    """Order in which scenes of one network follow each other."""
    uniform = DEFINITIONS[scene["definition"]].uniform
    return ("" if uniform else scene["definition"], scene["material"]["poisson_ratio"], LOAD_KINDS[scene["kind"]].held)


def stored_key(scene, calibration):
    """Key of a scene's result; as `springtune.studies.kinds.scenes.plan.solved_key`, from the task."""
    group = scene.get("calibration")
    return calibrated_key(scene["key"], calibration[group]["stiffness"]) if group else scene["key"]


class References:
    """Fields of references at the particles of a mesh, read when first asked for."""

    def __init__(self, folder, mesh):
        self.folder, self.mesh, self.fields = folder, mesh, {}

    def field(self, reference):
        """Displacements for 1 N [m], shape (n_points, 2); None where the reference has none."""
        key = reference["key"]
        if key not in self.fields:  # for 1 N, of whichever material asks first
            labels = ("x", "y", "displacements")
            found = stored.read_reference(self.folder, reference | {"displacement": 1.0}, labels)
            grid = [found.get(label) for label in labels]
            self.fields[key] = None if grid[0] is None else interpolate(*grid, self.mesh.points)
        field = self.fields[key]
        return None if field is None else reference["displacement"] * field


def solve(scene, shared):
    """Result of a scene, and the seconds of deriving its springs."""
    sheet, references = shared
    derived = sheet.deriving
    result = solved(sheet, scene, references.field)
    return result | {"deriving": sheet.deriving - derived}


def cost(scene, shared, result, seconds):
    """Seconds of a scene by the particles of its mesh, and those of its definition."""
    particles = len(shared[0].mesh.points)
    yield scene["kinematics"], particles, result["seconds"]
    yield scene["definition"], particles, result.pop("deriving", 0.0)


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
    """Displacements of the particles [m], stiffness [N/m] and axial force [N] of the springs, these to be looked at."""
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

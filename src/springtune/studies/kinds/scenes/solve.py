"""Stage `solve`: the mass-spring network of every scene, all scenes of a mesh together."""

import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from springtune.problem.boundary import FACE_POSITIONS
from springtune.problem.loads import LOAD_KINDS
from springtune.problem.materials import material_of
from springtune.problem.status import Status
from springtune.reference.field import field_error, interpolate
from springtune.scene.sheet import Sheet, definition_of
from springtune.springs import DEFINITIONS, DefinitionError

from ...runs import checked_json, store
from . import stored_mesh
from . import stored_reference as references
from .stored_scene import FIELD_ARRAYS, calibrated_key, fields_key, packed


def run(tasks, spent):
    """Solve the scenes of a bundle that are not stored yet.

    A scene that fails is stored with its status and message; it never stops the others.
    """
    calibration = checked_json.demand(tasks["calibration"]) if tasks["calibration"] else {}
    for family in tasks["families"]:
        path = Path(tasks["folder"]) / f"{family['name']}.h5"
        present = store.stored(path, spent.limits)
        scenes = {stored_key(scene, calibration): scene for scene in family["scenes"]}
        kept = {name: fields_key(name) for name, scene in scenes.items() if scene.get("keep_fields")}
        missing = {name: scene for name, scene in scenes.items() if not {name, kept.get(name, name)} <= present}
        if not missing:
            continue
        refused = stored_mesh.refusal(tasks["meshes"], family["name"])
        if refused:
            holes = {name: _hole(**refused) for name in missing if name not in present}
            store.add(path, holes | {kept[name]: {} for name in missing if name in kept})
            spent.add(stored_mesh.REFUSED, 0, 0.0, len(missing))
            continue
        mesh = stored_mesh.read(tasks["meshes"], family["name"])
        fields = References(tasks["references"], mesh)
        sheet = Sheet(mesh, family["thickness"])
        order = sorted(missing, key=lambda name: _turn(missing[name]))
        with store.Keeper(path) as keeper:
            for name in order:
                scene, derived = missing[name], sheet.deriving
                solved = partial(solve, sheet, scene, fields.field, calibration)
                result = spent.attempt(name, solved, _hole)
                if result is None:
                    continue
                if name in kept:
                    keeper[kept[name]] = packed(result)
                if name not in present:
                    keeper[name] = {label: value for label, value in result.items() if label not in FIELD_ARRAYS}
                work = "fields" if name in present else scene["kinematics"]
                spent.add(work, len(mesh.points), result["seconds"])
                spent.add(scene["definition"], len(mesh.points), sheet.deriving - derived)


def lose(tasks, name, why, limits):
    """Store that a scene is beyond its limits."""
    calibration = checked_json.demand(tasks["calibration"]) if tasks["calibration"] else {}
    for family in tasks["families"]:
        kept = {stored_key(scene, calibration): scene.get("keep_fields") for scene in family["scenes"]}
        if name in kept:
            path = Path(tasks["folder"]) / f"{family['name']}.h5"
            holes = {fields_key(name): {"limits": limits}} if kept[name] else {}
            if name not in store.stored(path, limits):  # else its fields alone are beyond them
                holes[name] = _hole(why, limits=limits)
            store.add(path, holes)


def _hole(message, **limits):
    return limits | {"status": Status.FAILED, "message": message, "seconds": 0.0}


def stored_key(scene, calibration):
    """Key of a scene's result; as `springtune.studies.kinds.scenes.plan.solved_key`, from the task."""
    group = scene.get("calibration")
    return calibrated_key(scene["key"], calibration[group]["stiffness"]) if group else scene["key"]


def _turn(scene):
    """Order in which scenes of one network follow each other."""
    uniform = DEFINITIONS[scene["definition"]].uniform
    return ("" if uniform else scene["definition"], scene["material"]["poisson_ratio"], LOAD_KINDS[scene["kind"]].held)


class References:
    """Fields of references at the particles of a mesh, read when first asked for."""

    def __init__(self, folder, mesh):
        self.folder, self.mesh, self.fields = folder, mesh, {}

    def field(self, reference):
        """Displacements for 1 N [m], shape (n_points, 2); None where the reference has none."""
        key = reference["key"]
        if key not in self.fields:  # for 1 N, of whichever material asks first
            labels = ("x", "y", "displacements")
            found = references.read(self.folder, reference | {"displacement": 1.0}, labels)
            grid = [found.get(label) for label in labels]
            self.fields[key] = None if grid[0] is None else interpolate(*grid, self.mesh.points)
        field = self.fields[key]
        return None if field is None else reference["displacement"] * field


def solve(sheet, scene, reference=None, calibration=None):
    """Result of a scene, ready to be stored.

    Parameters
    ----------
    reference : callable, optional
        Displacements of the scene's reference for 1 N at the particles [m]; None without.

    Returns
    -------
    dict
        ``status`` (a `springtune.problem.status.Status`), ``message``, ``displacement`` [m], ``stiffness`` [N/m],
        ``field_error``, ``iterations``, ``residual``, ``negative_pivots``, ``seconds``, those of the definition:
        ``definition_seconds``, ``definition_evaluations``, ``spring_ratio``, and ``displacements`` [m] of the
        particles, ``spring_stiffnesses`` [N/m] and ``spring_forces`` [N] where they are kept.
    """
    begin, derived = time.perf_counter(), sheet.deriving
    try:
        result = _solved(sheet, scene, reference, calibration)
    except DefinitionError as error:
        result = {"status": Status.FAILED, "message": f"{scene['definition']}: {error}"}
    return result | {"seconds": time.perf_counter() - begin - (sheet.deriving - derived)}


def _solved(sheet, scene, reference, calibration):
    stiffness = scene.get("stiffness")
    if "calibration" in scene:
        group = calibration[scene["calibration"]]
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

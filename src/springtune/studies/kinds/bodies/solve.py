"""Stage `solve`: the networks of beams and shapes, all scenes of a mesh together."""

import time
from dataclasses import replace
from functools import cache, partial
from math import copysign
from pathlib import Path

import numpy as np

from springtune.mechanics.statics import SingularError
from springtune.problem.boundary import check_case
from springtune.problem.loads import LOAD_KINDS, Load
from springtune.problem.materials import material_of
from springtune.problem.quantities import Status
from springtune.problem.shapes import Beam
from springtune.reference.answers import field_error, interpolate
from springtune.scene.boundary_problem import BeamProblem, ShapeProblem
from springtune.scene.mesh_cache import MeshCache, definition_of, naming_errors
from springtune.springs.base import DEFINITIONS, EQUAL_STIFFNESS, DefinitionError

from ...runs.source import hash_of
from . import stored
from .stored import FACE_POSITIONS, stored_key

parts = stored.parts


def tasks(file, content):
    """Tasks of the scenes of a mesh, with calibrated stiffnesses and the keys that depend on them."""
    if not any("calibration" in scene for scene in file["tasks"]):
        return file["tasks"]
    calibration = stored.read_calibration(content["results"])
    return [
        scene | {"key": stored_key(scene, calibration), "calibrated": calibration.get(scene.get("calibration"))}
        for scene in file["tasks"]
    ]


def prepare(file, content):
    """Function that solves a scene of a mesh."""
    grouped = stored.prepared_mesh(content, file)
    if "shape" in file:
        return partial(solve_shape, file["shape"], grouped, {})
    mesh, labels = grouped.mesh, ("x", "y", "displacements")

    @cache
    def unit_displacements(key, length):
        """Displacements of a unit problem at the particles, or None if the reference has no field."""
        scales = {"key": key, "length": length, "displacement": 1.0}
        found = stored.read_reference(Path(content["results"]) / "references", scales, labels)
        return interpolate(*(found[label] for label in labels), mesh.points) if "x" in found else None

    def field(reference):
        unit = unit_displacements(reference["key"], reference["length"])
        return None if unit is None else reference["displacement"] * unit

    beam = Beam(*file["beam"])
    return partial(solve_beam, beam, MeshCache(mesh, beam.thickness), field)


def failed(task, why):
    """Result of a scene that fails."""
    return {"status": Status.FAILED, "message": why, "seconds": 0.0}


def order(task):
    """Sort key that keeps scenes of one network together."""
    if "materials" in task:
        return task["definition"], hash_of(task["materials"])
    uniform = DEFINITIONS[task["definition"]].uniform
    return ("" if uniform else task["definition"], task["material"]["poisson_ratio"], LOAD_KINDS[task["kind"]].held)


def solve(task, solve_one):
    """Result of a scene, ready to be stored: lengths [m], stiffnesses [N/m], forces [N]."""
    begin = time.perf_counter()
    try:
        return solve_one(task)
    except DefinitionError as error:
        return failed(task, f"{task['definition']}: {error}") | {"seconds": time.perf_counter() - begin}


def _solve_problem(problem, springs, seconds, task):
    """Equilibrium of a scene and its stored values, with arrays if the task keeps fields."""
    begin = time.perf_counter()
    found = problem.solve(springs)
    result = {"seconds": time.perf_counter() - begin, "definition_seconds": seconds}
    result |= {name: getattr(found, name) for name in ("status", "message", "negative_pivots")}
    result |= _typical_stiffness(problem.mesh, springs)
    result["further_energies"] = len(springs.energies)
    if task.get("keep_fields") and found.equilibrium.converged:
        moved = found.equilibrium.displacements
        forces = found.problem.network.spring_forces_over_k(moved, task["kinematics"] == "linear")
        result |= {"displacements": moved, "spring_stiffnesses": springs.reference * springs.relative}
        result["spring_forces"] = springs.reference * forces
    return found, result


def _typical_stiffness(mesh, springs):
    """Stiffness of springs at rest [N/m]: medians inside and on the outline, or NaN, least, most; whether alike."""
    alike = springs.linear_springs is None  # else they belong to an energy
    sizes = springs.relative if alike else springs.linear_springs
    found = {"least": sizes.min(), "most": sizes.max()}
    for part, chosen in (("inside", ~mesh.on_outline), ("outline", mesh.on_outline)):
        there = np.sort(sizes[chosen])  # `np.median` would take a twentieth of a small scene's time
        count = len(there)
        found[part] = 0.5 * (there[(count - 1) // 2] + there[count // 2]) if count else np.nan
        alike = alike and (not count or there[-1] - there[0] <= EQUAL_STIFFNESS * abs(found[part]))
    stiffnesses = {f"stiffness_{part}": float(springs.reference * value) for part, value in found.items()}
    return stiffnesses | {"stiffness_alike": int(alike)}


def solve_beam(beam, cache, field, task):
    """Result of a scene of a beam; ``field`` returns a reference's displacements for 1 N at particles, or None."""
    stiffness, group = task.get("stiffness"), task.get("calibrated")
    if group:
        if group["stiffness"] is None:
            return failed(task, group["message"])
        stiffness = group["stiffness"] * task["thickness_ratio"]
    reference_field = field(task["reference"]) if "reference" in task else None
    kind, force, kinematics = LOAD_KINDS[task["kind"]], task["force"], task["kinematics"]
    definition, material = definition_of(task["definition"]), material_of(task["material"])
    springs, seconds = cache.derive(definition, material, stiffness, (kind, force, reference_field))
    springs = replace(springs, reference=task.get("stiffness_scale", 1) * springs.reference)
    load = Load(kind, copysign(1, force), task["follower"])
    problem = BeamProblem(beam, cache.mesh, material, load, abs(force), kinematics, cache)
    solution, result = _solve_problem(problem, springs, seconds, task)
    found = solution.equilibrium
    result |= {
        "iterations": found.iterations,
        "residual": found.residual,
        "stiffness": springs.reference if definition.uniform else np.nan,
        "definition_evaluations": springs.evaluations,
        "spring_ratio": springs.spring_ratio,
        "solver": found.factor.name if found.factor else "",
        "load_share": found.load_share if kinematics == "nonlinear" else np.nan,
    }
    if reference_field is not None and task.get("keep_fields"):
        result["reference_displacements"] = force * reference_field
    if not found.converged:
        return result | ({} if found.last is None else {"last_displacement": cache.displacement(kind, found.last)})
    result["displacement"] = solution.displacement
    if kind.pressed:
        result |= _pressed_face(cache, kind, found.displacements)
    if reference_field is not None:
        result["field_error"] = field_error(cache.mesh, found.displacements, force * reference_field)
    return result


def _pressed_face(cache, kind, displacements):
    """Mean displacement of a pressed face and its profile, along the force [m]."""
    weights = cache.loading(kind).pattern
    face = np.flatnonzero(weights[:, kind.axis] > 0)
    x, moved = cache.mesh.points[face, kind.along], displacements[face, kind.axis]
    order = np.argsort(x)
    profile = np.interp(FACE_POSITIONS * np.ptp(x), x[order], moved[order])
    return {"face_mean": float((weights * displacements).sum()), "face_profile": profile}


def solve_shape(described, grouped, caches, task):
    """Result of a scene of a shape; ``caches`` has those of the mesh by thickness."""
    from .task_values import LOAD_NAME, materials_of, shape_of, values_by_key  # here: most studies have no shapes

    shape = shape_of(described, task["thickness"], task["load"])
    case, materials, kinematics = shape.loads[LOAD_NAME], materials_of(task["materials"]), task["kinematics"]
    definition, cache = definition_of(task["definition"]), caches.get(shape.thickness)
    try:
        check_case(grouped, case)
        problem = ShapeProblem(shape, grouped, materials, LOAD_NAME, 1.0, kinematics, cache)
        problem.check(definition)
        caches[shape.thickness] = problem.cache
        with naming_errors(definition):
            springs, seconds = problem.springs(definition, None)
        solution, result = _solve_problem(problem, springs, seconds, task)
    # Loads on what is held, quantities that the mesh has not, definitions that refuse it; mechanisms.
    except (ValueError, SingularError) as error:
        return failed(task, str(error))
    return result | {"values": values_by_key(problem.values(springs, solution), case)}

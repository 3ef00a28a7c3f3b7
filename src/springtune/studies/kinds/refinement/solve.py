"""Stage `refinement`: values of a parameter, added where the error changes its sign or crosses a tolerance.

The loop is here, since further values depend on results. Each value has a key of its own, so a run that was stopped
goes on where it ended.
"""

import time
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

from springtune.problem.compare import deformation_error
from springtune.problem.geometry import Beam
from springtune.problem.loads import LOAD_KINDS
from springtune.problem.materials import material_of
from springtune.problem.status import Status
from springtune.reference.limits import beyond_linear
from springtune.reference.similarity import unit_problem, unit_scales
from springtune.reference.small_strain import ReferenceNotConvergedError, solve_unit
from springtune.scene.meshes import make_mesh
from springtune.scene.sheet import Sheet
from springtune.springs import DefinitionError

from ...runs import store
from .batches import Rule, refine, value_key

SEPARATOR = "/"
"""Between the key of a file and that of a value, in the name of a task."""


def run(content, costs):
    """Solve the values that refinements ask for and that are not stored yet."""
    for file in content["files"]:
        (task,) = file["tasks"]
        path = Path(content["folder"]) / f"{file['name']}.h5"
        present = store.stored(path, costs.limits)
        known = store.read(path, present) if present else {}
        solver = _Solver(task)
        with store.Keeper(path) as keeper:
            for rule in task["rules"]:
                refine(Rule(**rule), partial(_errors, task, solver, known, keeper, costs))
        if solver.seconds:
            costs.add("refinement", solver.particles, solver.seconds)


def _errors(task, solver, known, keeper, costs, values):
    """Errors of a batch of values: of those that are not known by solving them."""
    found = []
    for value in values:
        name = value_key(value)
        if name not in known:
            result = costs.attempt(f"{task['key']}{SEPARATOR}{name}", partial(solver.solve, value), _failed)
            if result is None:  # the program is broken: the job ends with an error
                found.append(np.nan)
                continue
            known[name] = keeper[name] = result
        found.append(known[name].get("deformation_error", np.nan))
    return found


def gone(content, key, why, limits):
    """Store the failed result of a value beyond its limits."""
    name, _, value = key.partition(SEPARATOR)
    store.add(Path(content["folder"]) / f"{name}.h5", {value: _failed(why) | {store.LIMITS: limits}})


def _failed(why):
    return {"status": Status.FAILED, "message": why}


class _Solver:
    """Scenes of a refinement, one a value."""

    def __init__(self, task):
        self.task, self.sheet, self.seconds, self.particles = task, None, 0.0, 0

    def solve(self, value):
        """Result of a scene."""
        begin, task = time.perf_counter(), self.task
        given = {"mesh_size": task["mesh_size"], "force": 1.0, "stiffness_scale": 1.0} | {task["parameter"]: value}
        beam, material = (
            replace(body, **{name: given[name] for name in names if name in given})
            for body, names in (
                (Beam(**task["beam"]), ("thickness",)),
                (material_of(task["material"]), ("young_modulus", "poisson_ratio")),
            )
        )
        force, kind = task["force"] * given["force"], LOAD_KINDS[task["kind"]]
        try:
            result = self._solved(beam, material, force, kind, given)
        except DefinitionError as error:
            result = _failed(f"{task['definition']}: {error}")
        result["seconds"] = time.perf_counter() - begin
        self.seconds += result["seconds"]
        return result

    def _solved(self, beam, material, force, kind, given):
        task, size = self.task, given["mesh_size"]
        if self.sheet is None or task["parameter"] in ("mesh_size", "thickness"):
            mesh = make_mesh(beam, task["mesh_type"], size)
            self.sheet = Sheet(mesh, beam.thickness)
        self.particles += len(self.sheet.mesh.points)
        springs, _ = self.sheet.derive(task["definition"], material)
        springs = replace(springs, reference=given["stiffness_scale"] * springs.reference)
        solution = self.sheet.solve(kind, springs, force, task["kinematics"], task["follower"])
        result = {"status": solution.status, "message": solution.message, "particles": len(self.sheet.mesh.points)}
        if np.isfinite(solution.displacement):
            result["displacement"] = solution.displacement
        return _compared(result, beam, material, force, kind, task["kinematics"])


def _compared(result, beam, material, force, kind, kinematics):
    """Result with its reference and the error."""
    try:
        unit = _reference(*unit_problem(beam, material, kind))
    except ReferenceNotConvergedError as error:
        return result | {"message": "; ".join(filter(None, (result["message"], f"no reference: {error}")))}
    length, scale = unit_scales(beam, material, kind)
    displacement = force * scale * unit.displacement
    result |= {"reference_displacement": displacement, "reference_error_estimate": unit.error_estimate}
    if "displacement" in result:
        result["deformation_error"] = float(deformation_error(result["displacement"], displacement))
    result["reference_applies"] = True
    if kinematics == "nonlinear":
        size = abs(force) * scale / length
        why = beyond_linear(size * unit.rotation, size * unit.strain)
        result["reference_applies"] = not why
        result["message"] = "; ".join(filter(None, (result["message"], why)))
    return result


@lru_cache(maxsize=4)
def _reference(aspect_ratio, nu, kind):
    """Reference of a unit problem, which all values but Poisson's ratios share."""
    return solve_unit(aspect_ratio, nu, kind)

"""Stage `refinement`: values of a parameter, added where the error changes its sign or crosses a tolerance.

Further values depend on results, so that a job looks for its tasks again after each batch. Each value has a result of
its own: a run that was stopped goes on where it ended.
"""

import sys
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from springtune.problem.compare import deformation_error
from springtune.problem.geometry import Beam
from springtune.problem.loads import LOAD_KINDS
from springtune.problem.materials import material_of
from springtune.problem.status import Status
from springtune.reference.answers import beyond_linear, unit_problem, unit_scales
from springtune.reference.small_strain import ReferenceNotConvergedError, solve_unit
from springtune.scene.meshes import make_mesh
from springtune.scene.sheet import Sheet
from springtune.springs import DefinitionError

from ...runs import driver, store
from .batches import Rule, refine, value_key


def run(content, costs):
    """Solve the values that refinements ask for, batch after batch."""
    before, asked = -1, 0
    while asked > before and not costs.broken:
        driver.solve_files(sys.modules[__name__], content, costs)
        before, asked = asked, sum(len(tasks(file, content)) for file in content["files"])


def tasks(file, content):
    """Values that are asked for by the errors that are stored."""
    path, (shared,) = Path(content["folder"]) / f"{file['name']}.h5", file["tasks"]
    present, asked = store.stored(path), {}
    known = store.read(path, present) if present else {}

    def errors(values):
        batch = {value_key(file["name"], value): value for value in values}
        asked.update(batch)
        return [known[key].get("deformation_error", np.nan) for key in batch] if batch.keys() <= present else None

    for rule in shared["rules"]:
        refine(Rule(**rule), errors)
    return [shared | {"key": key, "value": value} for key, value in asked.items()]


def solve(task):
    """Result of the scene of a value."""
    given = {"mesh_size": task["mesh_size"], "force": 1.0, "stiffness_scale": 1.0} | {task["parameter"]: task["value"]}
    beam, material = (
        replace(body, **{name: given[name] for name in names if name in given})
        for body, names in (
            (Beam(**task["beam"]), ("thickness",)),
            (material_of(task["material"]), ("young_modulus", "poisson_ratio")),
        )
    )
    force, kind = task["force"] * given["force"], LOAD_KINDS[task["kind"]]
    sheet = _sheet(beam, task["mesh_type"], given["mesh_size"])
    try:
        springs, _ = sheet.derive(task["definition"], material)
    except DefinitionError as error:
        return {"status": Status.FAILED, "message": f"{task['definition']}: {error}"}
    springs = replace(springs, reference=given["stiffness_scale"] * springs.reference)
    solution = sheet.solve(kind, springs, force, task["kinematics"], task["follower"])
    found = {"status": solution.status, "message": solution.message, "particles": len(sheet.mesh.points)}
    if np.isfinite(solution.displacement):
        found["displacement"] = solution.displacement
    return _compared(found, beam, material, force, kind, task["kinematics"])


def cost(task, result, seconds):
    """Particles of a value's network."""
    yield "refinement", result.get("particles", 0), seconds


@lru_cache(maxsize=1)
def _sheet(beam, mesh_type, size):
    """Sheet that all values share unless they vary the mesh size or the thickness."""
    return Sheet(make_mesh(beam, mesh_type, size), beam.thickness)


def _compared(result, beam, material, force, kind, kinematics):
    """Add the reference and the error to a result."""
    try:
        unit = _reference(*unit_problem(beam, material, kind))
    except ReferenceNotConvergedError as error:
        return result | {"message": "; ".join(filter(None, (result["message"], f"no reference: {error}")))}
    length, scale = unit_scales(beam, material, kind)
    displacement = force * scale * unit.displacement
    result |= {"reference_displacement": displacement, "reference_error_estimate": unit.error_estimate}
    if "displacement" in result:
        result["deformation_error"] = float(deformation_error(result["displacement"], displacement))
    size = abs(force) * scale / length
    why = beyond_linear(size * unit.rotation, size * unit.strain) if kinematics == "nonlinear" else ""
    message = "; ".join(filter(None, (result["message"], why)))
    return result | {"reference_applies": not why, "message": message}


@lru_cache(maxsize=4)
def _reference(aspect_ratio, nu, kind):
    """Reference of a unit problem, which all values but Poisson's ratios share."""
    return solve_unit(aspect_ratio, nu, kind)

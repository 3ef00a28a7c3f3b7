"""Stage `engines`: a scene in an engine at a setting, beside its network's equilibrium and the reference."""

from functools import lru_cache

from springtune.engines.base import ENGINES, EngineAbsentError, EngineError
from springtune.engines.run import in_engine
from springtune.problem.compare import deformation_error
from springtune.problem.materials import material_of
from springtune.problem.quantities import Status
from springtune.problem.shapes import Beam
from springtune.reference.small_strain import ReferenceNotConvergedError
from springtune.scene.single import Scene, make_mesh

from . import RUN_ENDS, SETTING


def failed(task, why, end="failed"):
    """Result of a run that did not start, or that failed."""
    return {"status": Status.FAILED, "engine_status": RUN_ENDS.index(end), "message": why}


def solve(task):
    """Run a scene in an engine; a refusal or a failure becomes a status with a message."""
    of = (task[name] for name in ("mesh_type", "mesh_size", "load", "force", "definition"))
    scene, known, objection = _scene(Beam(**task["beam"]), material_of(task["material"]), *of)
    engine, how = ENGINES[task["engine"]], {name: task[name] for name in (*SETTING, "frames", "tolerance")}
    try:
        found = in_engine(scene, engine.name, factor=task["stiffness_factor"], **how)
    except EngineError as error:
        return known | failed(task, str(error), "absent" if isinstance(error, EngineAbsentError) else "refused")
    except Exception as error:  # a program of others may raise anything, and other runs go on
        if engine.program == "springtune" or isinstance(error, MemoryError):
            raise
        return known | failed(task, f"{engine.name}: {type(error).__name__}: {error}")
    result = known | {
        "status": Status.NOT_CONVERGED,
        "engine_status": RUN_ENDS.index(found.status),
        "message": "; ".join(filter(None, (found.message, objection))),
        "engine_version": task["engine_version"],
    }
    result |= {name: getattr(found, name) for name in ("swing", "frames", "frame_seconds")}
    if found.status != "rest":
        return result | {"last_displacement": found.displacement}
    reference = known["reference_displacement"]
    return result | {
        "status": Status.SOLVED,
        "displacement": found.displacement,
        "residual": found.residual,
        "error": float(deformation_error(found.displacement, reference)),
        "solver_error": (found.displacement - found.by_law) / abs(reference),
    }


@lru_cache(maxsize=8)
def _scene(beam, material, mesh_type, mesh_size, load, force, definition):
    """Return a scene, its network and reference displacements [m], and why they cannot be compared."""
    mesh = make_mesh(beam, mesh_type, mesh_size)
    scene = Scene(beam, mesh, material, load, force, definition=definition)
    solved = scene.solve()
    why = [f"network: {solved.status}, {solved.message}"] if solved.status != Status.SOLVED else []
    try:
        reference = next(iter(scene.reference_values().values()))
        why += filter(None, [scene.objection])
    except ReferenceNotConvergedError as error:
        reference = float("nan")
        why.append(f"no reference: {error}")
    known = {
        "network_displacement": solved.displacement,
        "reference_displacement": reference,
        "definition_error": float(deformation_error(solved.displacement, reference)),
        "particles": len(mesh.points),
    }
    return scene, known, "; ".join(why)

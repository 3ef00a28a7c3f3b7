"""Stage `laying`: strips laid on a trapezoid."""

from dataclasses import asdict

from springtune.problem.geometry import Strip, Trapezoid
from springtune.problem.materials import material_of
from springtune.problem.status import Status
from springtune.springs import DefinitionError

from .lay import lay


def solve(task):
    """Result of a strip; one that does not lie has a status and a message."""
    try:
        found = lay(
            Strip(**task["strip"]), Trapezoid(**task["trapezoid"]), material_of(task["material"]),
            material_of(task["support"]), task["definition"], task["mesh_size"], loading=task["loading"],
            pressure=task["pressure"], friction=task["friction"],
        )  # fmt: skip
    except DefinitionError as error:
        return {"status": Status.FAILED, "message": f"{task['definition']}: {error}"}
    return asdict(found) | {"status": Status.NOT_CONVERGED if found.message else Status.SOLVED}

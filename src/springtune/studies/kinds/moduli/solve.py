"""Stage `moduli`: effective moduli of definitions on patches, for E = 1 and t = 1."""

from springtune.problem.materials import InPlane, Material
from springtune.problem.quantities import Status
from springtune.scene.sheet import MeshModuli
from springtune.springs.base import DefinitionError

from ..bodies.stored import make_beam


def prepare(patch, content):
    """Moduli of the mesh of a patch, shared by definitions."""
    return MeshModuli(make_beam(patch["mesh"]))


def solve(task, moduli):
    """Errors of E and G [1], effective Poisson's ratio and cost of a definition, or a message."""
    try:
        made = Material if task["poisson_ratio"] <= 0.5 else InPlane  # as of materials in plane strain alone
        found = moduli(made(1.0, task["poisson_ratio"]), task["definition"])
    except DefinitionError as error:
        return {"status": Status.FAILED, "message": f"{task['definition']}: {error}"}
    return {
        "status": Status.SOLVED,
        "young_modulus_error": found.young_modulus_error,
        "effective_poisson_ratio": found.poisson_ratio,
        "shear_modulus_error": found.shear_modulus_error,
        "definition_seconds": found.seconds,
        "definition_evaluations": found.springs.evaluations,
        "spring_ratio": found.springs.spring_ratio,
    }

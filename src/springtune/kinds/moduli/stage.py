"""Stage `moduli`: effective moduli of definitions on patches, for E = 1 and t = 1."""

import sys
import time
from pathlib import Path

from ...jobs import atomic, store
from ...jobs.spent import Spent
from ...mechanics.moduli import PatchTest
from ...problem.materials import Material
from ...springs import DEFINITIONS, DefinitionError
from ...springs.identification import patch_cases
from ..scenes.mesh import make


def run(tasks, done):
    """Measure the moduli that are not stored yet.

    Parameters
    ----------
    tasks : str or Path
        JSON file: ``folder`` and ``patches``, each with ``name``, ``mesh`` (what the stage `mesh` takes) and
        ``measurements``, each of these with ``key, definition, poisson_ratio``.
    done : str or Path
        JSON file to write: what was spent.
    """
    tasks, spent = atomic.read_json(tasks), Spent()
    for patch in tasks["patches"]:
        path = Path(tasks["folder"]) / f"{patch['name']}.h5"
        present = store.stored(path)
        missing = [asked for asked in patch["measurements"] if asked["key"] not in present]
        if not missing:
            continue
        mesh = make(patch["mesh"])
        measure = _Measure(mesh)
        results = {}
        for asked in missing:
            begin = time.perf_counter()
            results[asked["key"]] = result = measure(asked)
            seconds = time.perf_counter() - begin
            of_definition = result.get("definition_seconds", 0.0)
            spent.add("moduli", len(mesh.points), seconds - of_definition)
            spent.add(asked["definition"], len(mesh.points), of_definition)
        store.add(path, results)
    atomic.write_json(done, spent.summary())


class _Measure:
    """Measures definitions on a patch; networks that differ in reference stiffness alone once.

    Parameters
    ----------
    mesh : Mesh
    """

    def __init__(self, mesh):
        self.mesh, self.test, self.found = mesh, PatchTest(mesh), {}

    def __call__(self, asked):
        """Errors of E and G [1], effective Poisson's ratio, and what the definition cost; or why there are none."""
        nu = asked["poisson_ratio"]
        material, definition = Material("unit", 1.0, nu), DEFINITIONS[asked["definition"]]
        given = patch_cases(self.mesh, material, 1.0) if definition.needs else None
        begin = time.perf_counter()
        try:
            springs = definition.springs(self.mesh, material, 1.0, given)
            seconds = time.perf_counter() - begin
            young_modulus, poisson_ratio, shear = self.moduli(springs)
        except (DefinitionError, ArithmeticError) as error:
            return {"status": "failed", "message": f"{definition.name}: {error}"}
        return {
            "status": "solved",
            "message": "",
            "young_modulus_error": young_modulus * springs.reference - 1,
            "effective_poisson_ratio": poisson_ratio,
            "shear_modulus_error": shear * springs.reference * 2 * (1 + nu) - 1,
            "definition_seconds": seconds,
            "definition_evaluations": springs.evaluations,
            "spring_ratio": springs.spring_ratio,
        }

    def moduli(self, springs):
        """E, Poisson's ratio and G over the reference stiffness."""
        name = springs.relative.tobytes(), springs.lateral, *(energy.key for energy in springs.energies)
        if name not in self.found:
            self.found[name] = *self.test.axial(springs), self.test.shear(springs)
        return self.found[name]


if __name__ == "__main__":
    run(*sys.argv[1:])

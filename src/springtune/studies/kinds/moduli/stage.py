"""Stage `moduli`: effective moduli of definitions on patches, for E = 1 and t = 1."""

import time
from functools import partial
from pathlib import Path

from springtune.problem.materials import Material
from springtune.problem.status import Status
from springtune.scene.moduli import MeshModuli
from springtune.springs import DefinitionError

from ...runs import store
from ..scenes.mesh import make
from ..scenes.stored_mesh import REFUSED


def run(tasks, spent):
    """Measure the moduli that are not stored yet."""
    for patch in tasks["patches"]:
        path = Path(tasks["folder"]) / f"{patch['name']}.h5"
        present = store.stored(path, spent.limits)
        missing = [one for one in patch["measurements"] if one["key"] not in present]
        if not missing:
            continue
        mesh = spent.attempt(patch["name"], partial(make, patch["mesh"]), lambda why: _hole(f"mesh: {why}"))
        if mesh is None:
            continue
        if isinstance(mesh, dict):
            store.add(path, {one["key"]: mesh for one in missing})
            spent.add(REFUSED, 0, 0.0, len(missing))
            continue
        moduli = MeshModuli(mesh)
        with store.Keeper(path) as keeper:
            for measurement in missing:
                begin = time.perf_counter()
                result = spent.attempt(measurement["key"], partial(_measured, moduli, measurement), _hole)
                if result is None:
                    continue
                keeper[measurement["key"]] = result
                seconds = time.perf_counter() - begin
                of_definition = result.get("definition_seconds", 0.0)
                spent.add("moduli", len(mesh.points), seconds - of_definition)
                spent.add(measurement["definition"], len(mesh.points), of_definition)


def lose(tasks, name, why, limits):
    """Store that a measurement, or the mesh of a patch, is beyond its limits."""
    for patch in tasks["patches"]:
        lost = [one["key"] for one in patch["measurements"] if name in (one["key"], patch["name"])]
        store.add(Path(tasks["folder"]) / f"{patch['name']}.h5", dict.fromkeys(lost, _hole(why) | {"limits": limits}))


def _hole(why):
    return {"status": Status.FAILED, "message": why}


def _measured(moduli, measurement):
    """Errors of E and G [1], effective Poisson's ratio, and what the definition cost; or why there are none."""
    try:
        found = moduli(Material(1.0, measurement["poisson_ratio"]), measurement["definition"])
    except DefinitionError as error:
        return {"status": Status.FAILED, "message": f"{measurement['definition']}: {error}"}
    return {
        "status": Status.SOLVED,
        "message": "",
        "young_modulus_error": found.young_modulus_error,
        "effective_poisson_ratio": found.poisson_ratio,
        "shear_modulus_error": found.shear_modulus_error,
        "definition_seconds": found.seconds,
        "definition_evaluations": found.springs.evaluations,
        "spring_ratio": found.springs.spring_ratio,
    }

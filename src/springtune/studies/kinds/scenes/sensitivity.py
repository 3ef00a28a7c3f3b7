"""Stage `sensitivity`: displacement against uniform stiffness.

Loads of a mesh have their network, its factor at rest and the series about it in common. Each curve follows a path of
its own from there: where a path takes its steps depends on the loads that it is asked for, and a result may not depend
on which others are computed along with it.

Here, where equilibria are at hand, the stiffness at which a curve meets its reference is solved for, too.
"""

import time
from functools import partial
from pathlib import Path

import numpy as np

from springtune.problem.loads import LOAD_KINDS
from springtune.problem.status import Status
from springtune.reference.limits import objection
from springtune.scene.curve import ending, follow, meeting
from springtune.scene.sheet import Sheet

from ...runs import store
from . import any_reference as references
from . import stored_mesh


def run(tasks, spent):
    """Trace the curves of a bundle that are not stored yet."""
    for family in tasks["families"]:
        path = Path(tasks["folder"]) / f"{family['name']}.h5"
        present = store.stored(path, spent.limits)
        missing = [curve for curve in family["curves"] if curve["key"] not in present]
        if not missing:
            continue
        refused = stored_mesh.refusal(tasks["meshes"], family["name"])
        if refused:
            store.add(path, {curve["key"]: _hole(curve, **refused) for curve in missing})
            spent.add(stored_mesh.REFUSED, 0, 0.0, len(missing))
            continue
        mesh = stored_mesh.read(tasks["meshes"], family["name"])
        sheet = Sheet(mesh, 1.0)  # curves know stiffnesses alone
        with store.Keeper(path) as keeper:
            for curve in missing:
                traced = partial(_traced, sheet, curve, tasks["references"])
                result = spent.attempt(curve["key"], traced, partial(_hole, curve))
                if result is not None:
                    keeper[curve["key"]] = result
                    spent.add("curve", len(mesh.points), result["seconds"])


def lose(tasks, key, why, limits):
    """Store that a curve is beyond its limits."""
    for family in tasks["families"]:
        for curve in family["curves"]:
            if curve["key"] == key:
                store.add(Path(tasks["folder"]) / f"{family['name']}.h5", {key: _hole(curve, why, limits=limits)})


def _hole(curve, message, **limits):
    """Result of a curve that cannot be traced."""
    count = len(curve["stiffnesses"])
    return limits | {
        "displacement": np.full(count, np.nan),
        "stable": np.zeros(count, dtype=bool),
        "status": Status.FAILED,
        "message": message,
        "best_stiffness": np.nan,
        "best_status": Status.FAILED,
        "best_message": message,
        "seconds": 0.0,
    }


def _traced(sheet, curve, folder):
    """Result of a curve."""
    begin = time.perf_counter()
    loads = curve["force"] / np.array(curve["stiffnesses"])
    path = follow(sheet, LOAD_KINDS[curve["kind"]], curve["kinematics"], loads)
    return _result(path, curve, folder) | {"seconds": time.perf_counter() - begin}


def _result(path, curve, folder):
    force, stiffness = curve["force"], np.array(curve["stiffnesses"])
    displacement, stable = path.values, path.stable
    reference = references.read(folder, curve["reference"])
    why = objection(reference, force, curve["kinematics"])
    wanted = force * reference.get("displacement", np.nan)
    best = meeting(path, force, stiffness, displacement, stable, wanted, why)
    return {
        "displacement": displacement,
        "stable": stable,
        "message": ending(path, force, stable),
        "best_stiffness": best.stiffness,
        "best_status": best.status,
        "best_message": best.message,
    }

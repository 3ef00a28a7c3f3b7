"""Stage `sensitivity`: displacement against uniform stiffness, one equilibrium path for all loads of a mesh.

Here, where equilibria are at hand, the stiffness at which a curve meets its reference is solved for, too.
"""

import time
from pathlib import Path

import numpy as np

from ...jobs import store
from ...problem.loads import LOAD_KINDS
from ...reference.limits import objection
from ...scene.curve import ending, follow, meeting
from ...scene.sheet import Sheet
from . import stored_mesh
from . import stored_reference as references


def run(tasks, spent):
    """Trace the curves of a bundle that are not stored yet.

    Parameters
    ----------
    tasks : dict
        ``folder``, ``meshes`` and ``references`` (folders) and ``families``, each with ``name`` and
        ``curves``, and each of these with ``key, kind, force, kinematics, stiffnesses, reference`` (see
        `springtune.kinds.scenes.stored_reference.read`).
    spent : Spent
        What tasks cost is added to it.
    """
    for family in tasks["families"]:
        path = Path(tasks["folder"]) / f"{family['name']}.h5"
        present = store.stored(path)
        missing = [curve for curve in family["curves"] if curve["key"] not in present]
        if not missing:
            continue
        mesh = stored_mesh.read(tasks["meshes"], family["name"])
        results = {}
        sheet = Sheet(mesh, 1.0)  # curves know stiffnesses alone
        for kind in {curve["kind"]: None for curve in missing}:
            alike = [curve for curve in missing if curve["kind"] == kind]
            results |= _trace(sheet, LOAD_KINDS[kind], alike, tasks["references"])
        store.add(path, results)
        for result in results.values():
            spent.add("curve", len(mesh.points), result["seconds"])


def _trace(sheet, kind, curves, folder):
    """Results of the curves of a kind of load by key; those under loads of one sign lie on one path."""
    results = {}
    for kinematics, sign in {(curve["kinematics"], np.sign(curve["force"])): None for curve in curves}:
        begin = time.perf_counter()
        alike = [curve for curve in curves if (curve["kinematics"], np.sign(curve["force"])) == (kinematics, sign)]
        loads = [curve["force"] / np.array(curve["stiffnesses"]) for curve in alike]
        path = follow(sheet, kind, kinematics, np.concatenate(loads))
        parts = np.cumsum([len(each) for each in loads])[:-1]
        found = zip(alike, np.split(path.values, parts), np.split(path.stable, parts))
        of_these = {curve["key"]: _result(path, curve, *values, folder) for curve, *values in found}
        seconds = (time.perf_counter() - begin) / len(alike)
        results |= {key: result | {"seconds": seconds} for key, result in of_these.items()}
    return results


def _result(path, curve, displacement, stable, folder):
    force, stiffness = curve["force"], np.array(curve["stiffnesses"])
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

"""Stage `sensitivity`: displacement against uniform stiffness, and the stiffness that meets the reference.

Each curve follows a path of its own: a result may not depend on which others are computed along with it.
"""

import time
from pathlib import Path

import numpy as np

from springtune.problem.loads import LOAD_KINDS
from springtune.problem.quantities import Status
from springtune.reference.answers import objection
from springtune.scene.curve import follow, incomplete_reason, meeting_stiffness
from springtune.scene.mesh_cache import MeshCache

from . import any_reference, stored


def prepare(file, content):
    """Cache of a mesh, and the folder of references."""
    # Curves depend on stiffnesses alone, so the thickness is 1 m.
    return MeshCache(stored.prepared_mesh(content, file).mesh, 1.0), Path(content["results"]) / "references"


def failed(curve, why):
    """Result of a curve that cannot be traced."""
    empty = np.full(len(curve["stiffnesses"]), np.nan)
    found = {"displacement": empty, "stable": empty > 0, "best_stiffness": np.nan, "seconds": 0.0}
    found |= dict.fromkeys(("status", "best_status"), Status.FAILED)
    return found | dict.fromkeys(("message", "best_message"), why)


def solve(curve, shared):
    """Result of a curve."""
    begin, (cache, folder) = time.perf_counter(), shared
    force, stiffness = curve["force"], np.array(curve["stiffnesses"])
    path = follow(cache, LOAD_KINDS[curve["kind"]], curve["kinematics"], force / stiffness)
    reference = any_reference.read(folder, curve["reference"])
    why, target = objection(reference, force, curve["kinematics"]), force * reference.get("displacement", np.nan)
    best = meeting_stiffness(path, force, stiffness, target, why)
    return {f"best_{name}": getattr(best, name) for name in ("stiffness", "status", "message")} | {
        "displacement": path.values,
        "stable": path.stable,
        "message": incomplete_reason(path, force),
        "seconds": time.perf_counter() - begin,
    }

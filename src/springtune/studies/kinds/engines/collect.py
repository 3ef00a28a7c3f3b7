"""Scenes in engines, gathered in the groups ``/engines`` and ``/engine_curves``."""

from collections import defaultdict
from math import nan

import numpy as np

from ...output.dataset import Group
from ...runs.plan import results
from . import RUN_ENDS, SETTING
from .kind import STAGE

NETWORK, FACTOR = ("scene", "definition"), "stiffness_factor"
RUN = (*NETWORK, "engine", *SETTING)

RUN_COORDINATES = {
    "scene_beam": (("scene",), "1", "beam", ""),
    "scene_mesh_type": (("scene",), "1", "mesh type", ""),
    "scene_mesh_size": (("scene",), "m", "asked length of an edge", nan),
    "scene_material": (("scene",), "1", "material", ""),
    "scene_load": (("scene",), "1", "load", ""),
    "scene_force": (("scene",), "N", "magnitude of the force", nan),
    "program": (("engine",), "1", "program that the engine is of", ""),
}
"""Descriptions of scenes and engines."""


def _variables(cell):
    """Variables of runs, networks and engines."""
    return {
        "displacement": (cell, "m", "displacement at rest", nan),
        "last_displacement": (cell, "m", "displacement that a run ends with that is not at rest, mean where it swings",
                              nan),
        "error": (cell, "1", "error in the engine, (displacement - reference) / |reference|", nan),
        "solver_error": (cell, "1", "what the engine's solver adds to the errors of definition and law", nan),
        "residual": (cell, "1", "out-of-balance force of the network at rest in the engine, over the load", nan),
        "frame_seconds": (cell, "s", "time of a frame, without the first ones", nan),
        "frames": (cell, "1", "frames that were taken", nan),
        "swing": (cell, "m", "largest amplitude about the mean", nan),
        "status": (cell, "1", "what became of the run", 0),
        "engine_status": (cell, "1", "how the run ended", 0),
        "message": (cell, "1", "why it is not at rest, or not comparable", ""),
        "network_displacement": (NETWORK, "m", "displacement of the network in equilibrium", nan),
        "reference_displacement": (NETWORK, "m", "displacement of the converged finite elements", nan),
        "definition_error": (NETWORK, "1", "error of the network in equilibrium: that of the definition", nan),
        "particles": (NETWORK, "1", "number of particles", nan),
        "engine_version": (("engine",), "1", "versions of what the engine needs, as it was run", ""),
        **RUN_COORDINATES,
    }  # fmt: skip


ENGINE_DIMENSIONS: dict[str, str | tuple[str, str]] = {
    "scene": "scene in engines",
    "engine": "program and solver",
    "precision": "floating-point numbers",
    "dt": ("time of a frame", "s"),
    "substeps": "steps of a frame",
    "iterations": "iterations of the solver in a step",
    FACTOR: "factor on all stiffnesses that are typed",
}
"""Dimensions of these groups."""

BEST_VARIABLES = {
    "best_factor": (RUN, "1", "factor at which the displacement is the reference's", nan),
    "best_factor_message": (RUN, "1", "why no factor is the best", ""),
}

FLAGS: dict[str, tuple[str, ...]] = {"engine_status": RUN_ENDS}

ENGINE_RUNS = Group("/engines", _variables(RUN), ENGINE_DIMENSIONS, FLAGS)
ENGINE_CURVES = Group("/engine_curves", _variables((*RUN, FACTOR)) | BEST_VARIABLES, ENGINE_DIMENSIONS, FLAGS)


def groups(study, folder):
    """Build the groups of a dataset."""
    runs = zip(study.parts["engines"], results(STAGE, study, folder), strict=True)
    made, found = {}, [(run.of_curve, run.labels | result) for run, (_, result) in runs]
    for group, wanted in ((ENGINE_RUNS, False), (ENGINE_CURVES, True)):
        rows = [row for of_curve, row in found if of_curve == wanted]
        axes = {name: sorted({row[name] for row in rows}) for name in ("dt", "substeps", "iterations", FACTOR)}
        curves = defaultdict(list)
        for row in rows if wanted else ():
            curves[tuple(row[name] for name in RUN)].append((row[FACTOR], row))
        rows += [dict(zip(RUN, setting)) | _best_factor(points) for setting, points in curves.items()]
        if rows:
            shared = {name: study.axes[name] for name in study.axes.keys() - ENGINE_DIMENSIONS.keys()}
            made[group.name] = group.of_rows(shared | axes, rows).set_coords([*RUN_COORDINATES])
    return made


def _best_factor(points):
    """Factor at which the displacement equals the reference's, interpolated linearly in 1 / factor."""
    known = sorted((factor, result["error"]) for factor, result in points if np.isfinite(result.get("error", np.nan)))
    found = []
    for (below, high), (above, low) in zip(known, known[1:]):
        if high * low <= 0 and high != low:
            share = high / (high - low)
            found.append(1 / ((1 - share) / below + share / above))
    if found:
        return {"best_factor": min(found, key=lambda factor: abs(np.log(factor)))}
    why = f"{len(known)} of {len(points)} runs came to rest; two are needed"
    if len(known) > 1:
        factor, error = min(known, key=lambda one: abs(one[1]))
        why = f"no factor from {known[0][0]:g} to {known[-1][0]:g} is right; {factor:g} is off by {100 * error:+.3g} %"
    return {"best_factor_message": why}

"""Scenes in engines, gathered in the groups ``/engines`` and ``/engine_curves``."""

from operator import itemgetter

import numpy as np

from ...config.model import declared
from ...output.dataset import Group
from ...runs.plan import rows as stored_rows
from ..bodies.kind import group_by
from . import RUN_ENDS, SETTING
from .kind import STAGE

FACTOR = "stiffness_factor"
RUN = ("scene", "definition", "engine", *SETTING)

RUN_COORDINATES = [f"scene_{part}" for part in ("beam", "mesh_type", "mesh_size", "material", "load", "force")]
"""Variables that describe scenes."""

FLAGS = {"engine_status": RUN_ENDS}
ENGINE_RUNS = Group("/engines", **declared(__file__, "runs", RUN=RUN), flags=FLAGS)
CURVES, BEST = declared(__file__, "runs", RUN=(*RUN, FACTOR)), declared(__file__, "best", RUN=RUN)
ENGINE_CURVES = Group("/engine_curves", CURVES["variables"] | BEST["variables"], CURVES["dimensions"], FLAGS)


def groups(study, folder):
    """Build the groups of a dataset."""
    made, found = {}, [*zip(study.parts["engines"], stored_rows(STAGE, study, folder), strict=True)]
    for group, of_curve in ((ENGINE_RUNS, False), (ENGINE_CURVES, True)):
        rows = [row for run, row in found if run.of_curve == of_curve]
        axes = {name: sorted({row[name] for row in rows}) for name in ("dt", "substeps", "iterations", FACTOR)}
        curves = group_by(rows if of_curve else (), itemgetter(*RUN))
        rows += [dict(zip(RUN, setting)) | _best_factor(runs) for setting, runs in curves.items()]
        if rows:
            shared = {name: study.axes[name] for name in study.axes.keys() - CURVES["dimensions"].keys()}
            made[group.name] = group.of_rows(shared | axes, rows).set_coords([*RUN_COORDINATES, "program"])
    return made


def _best_factor(runs):
    """Factor at which the displacement equals the reference's, interpolated linearly in 1 / factor."""
    known = sorted((run[FACTOR], run["error"]) for run in runs if np.isfinite(run.get("error", np.nan)))
    found = []
    for (below, high), (above, low) in zip(known, known[1:]):
        if high * low <= 0 and high != low:
            share = high / (high - low)
            found.append(1 / ((1 - share) / below + share / above))
    if found:
        return {"best_factor": min(found, key=lambda factor: abs(np.log(factor)))}
    why = f"{len(known)} of {len(runs)} runs came to rest; two are needed"
    if len(known) > 1:
        factor, error = min(known, key=lambda one: abs(one[1]))
        why = f"no factor from {known[0][0]:g} to {known[-1][0]:g} is right; {factor:g} is off by {100 * error:+.3g} %"
    return {"best_factor_message": why}

"""Scenes in engines, gathered in the groups ``/engines`` and ``/engine_curves``."""

from collections import defaultdict

import numpy as np

from ...output.dataset import Filler, Group
from ...runs.stages import results
from . import ENDS, SETTING
from .kind import STAGE
from .outputs import divided

NETWORK = ("scene", "definition")
RUN = (*NETWORK, "engine", *SETTING)
CURVE = (*RUN, "stiffness_factor")

OF_NETWORK = {
    "network_displacement": (NETWORK, "m", "displacement of the network in equilibrium", np.nan),
    "reference_displacement": (NETWORK, "m", "displacement of the converged finite elements", np.nan),
    "definition_error": (NETWORK, "1", "error of the network in equilibrium: that of the definition", np.nan),
    "particles": (NETWORK, "1", "number of particles", np.nan),
}


def _of_runs(cell):
    """Variables of single runs."""
    return {
        "displacement": (cell, "m", "displacement at rest", np.nan),
        "last_displacement": (cell, "m", "displacement that a run ends with that is not at rest, mean where it swings",
                              np.nan),
        "error": (cell, "1", "error in the engine, (displacement - reference) / |reference|", np.nan),
        "solver_error": (cell, "1", "what the engine adds to the definition's error", np.nan),
        "residual": (cell, "1", "out-of-balance force of the network at rest in the engine, over the load", np.nan),
        "frame_seconds": (cell, "s", "time of a frame, without the first ones", np.nan),
        "frames": (cell, "1", "frames that were taken", np.nan),
        "swing": (cell, "m", "largest amplitude about the mean", np.nan),
        "status": (cell, "1", "what became of the run", 0),
        "engine_status": (cell, "1", "how the run ended", 0),
        "message": (cell, "1", "why it is not at rest, or not comparable", ""),
    }  # fmt: skip


OF_ENGINE = {
    "engine_version": (("engine",), "1", "versions of what the engine needs, as it was run", ""),
}

FURTHER = {"engine_status": {"flag_values": np.arange(len(ENDS), dtype="int8"), "flag_meanings": " ".join(ENDS)}}

WORDS = {
    "scene": "scene in engines",
    "engine": "program and solver",
    "precision": "floating-point numbers",
    "dt": ("time of a frame", "s"),
    "substeps": "steps of a frame",
    "iterations": "iterations of the solver in a step",
    "stiffness_factor": "factor on all stiffnesses that are typed",
}
"""Own dimensions."""

RUNS = Group("/engines", _of_runs(RUN) | OF_NETWORK | OF_ENGINE, WORDS, further=FURTHER)

CURVES = Group(
    "/engine_curves",
    _of_runs(CURVE)
    | {
        "best_factor": (RUN, "1", "factor at which the displacement is the reference's", np.nan),
        "best_factor_message": (RUN, "1", "why no factor is the best", ""),
    }
    | OF_NETWORK
    | OF_ENGINE,
    WORDS,
    further=FURTHER,
)

OF_SCENE = {
    "scene_beam": ("beam", "beam"),
    "scene_mesh_type": ("mesh_type", "mesh type"),
    "scene_material": ("material", "material"),
    "scene_load": ("load", "load"),
    "scene_mesh_size": ("mesh_size", "asked length of an edge"),
    "scene_force": ("force", "magnitude of the force"),
}
"""Coordinates of scenes: attribute of a run, and long name."""

UNITS = {"scene_mesh_size": "m", "scene_force": "N"}


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    found = {task.of: (task.labels, result) for task, result in results(STAGE, study, folder)}
    made = {}
    for group, runs in zip((RUNS, CURVES), divided(found)):
        if runs:
            made[group.name] = _gathered(group, study, [(run, *found[run]) for run in runs])
    return made


def _gathered(group, study, found):
    axes = {name: tuple(dict.fromkeys(labels[name] for _, labels, _ in found)) for name in WORDS}
    numbers = {name: tuple(sorted(axes[name])) for name in ("dt", "substeps", "iterations", "stiffness_factor")}
    filler, curves = Filler(group.empty(study.axes | axes | numbers)), defaultdict(list)
    for _, labels, result in found:
        filler.put({name: result[name] for name in group.variables if name in result}, **labels)
        curves[tuple(labels[name] for name in RUN)].append((labels["stiffness_factor"], result))
    if group is CURVES:
        for setting, points in curves.items():
            filler.put(_best(points), **dict(zip(RUN, setting)))
    scenes = {run.scene: run for run, _, _ in found}
    coordinates = {name: [_named(getattr(run, attribute)) for run in scenes.values()]
                   for name, (attribute, _) in OF_SCENE.items()}  # fmt: skip
    coordinates = {
        name: ("scene", np.array(values, dtype=None if name in UNITS else object),
               {"long_name": OF_SCENE[name][1], "units": UNITS.get(name, "1")})
        for name, values in coordinates.items()
    }  # fmt: skip
    programs = np.array([_programs()[name] for name in axes["engine"]], dtype=object)
    coordinates["program"] = "engine", programs, {"long_name": "program that the engine is of", "units": "1"}
    return filler.data.assign_coords(coordinates)


def _named(value):
    return getattr(value, "name", value)


def _programs():
    from springtune.engines.base import ENGINES

    return {name: one.program for name, one in ENGINES.items()}


def _best(points):
    """Factor at which the displacement is the reference's: between two, displacements are linear in 1 / factor."""
    known = sorted((factor, float(result["error"])) for factor, result in points if np.isfinite(result.get("error", np.nan)))
    found = []
    for (below, high), (above, low) in zip(known, known[1:]):
        if high * low <= 0 and high != low:
            share = high / (high - low)
            found.append(1 / ((1 - share) / below + share / above))
    if found:
        return {"best_factor": min(found, key=lambda factor: abs(np.log(factor)))}
    if len(known) < 2:
        return {"best_factor_message": f"{len(known)} of {len(points)} runs are at rest, and two are needed"}
    factor, error = min(known, key=lambda one: abs(one[1]))
    said = f"no factor from {known[0][0]:g} to {known[-1][0]:g} is right; {factor:g} is off by {100 * error:+.3g} %"
    return {"best_factor_message": said}

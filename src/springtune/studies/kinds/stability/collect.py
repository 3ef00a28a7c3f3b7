"""Experiments on stability, gathered in the group ``/stability``."""

import numpy as np

from ...runs.stages import results
from .kind import STAGE
from .variables import STABILITY


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    found = {task.of: result for task, result in results(STAGE, study, folder, STABILITY.variables)}
    there = {name for result in found.values() for name in result} | {"experiment_seconds", "experiment_message"}
    data = STABILITY.empty(study.axes, there)
    for one, result in found.items():
        place = {"experiment": one.name, "definition": one.definition, "mesh_size": list(one.mesh_sizes)}
        result["experiment_seconds"] = result.pop("seconds", np.nan)
        result["experiment_message"] = result.pop("failure", "")
        for name, values in result.items():
            array = data[name]
            array.loc[{dimension: place[dimension] for dimension in array.dims if dimension in place}] = values
    return {STABILITY.name: data}

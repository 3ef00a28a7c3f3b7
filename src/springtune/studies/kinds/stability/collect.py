"""Experiments on stability, gathered in the group ``/stability``."""

import numpy as np

from ...runs import store
from . import plan
from .variables import STABILITY


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    results = {}
    for one in study.parts["stability"]:
        results[one] = store.read_one(folder / "stability", plan.experiment_key(one), STABILITY.variables)
    there = {name for result in results.values() for name in result} | {"experiment_seconds", "experiment_message"}
    data = STABILITY.empty(study.axes, there)
    for one, result in results.items():
        place = {"experiment": one.name, "definition": one.definition, "mesh_size": list(one.mesh_sizes)}
        result["experiment_seconds"] = result.pop("seconds", np.nan)
        result["experiment_message"] = result.pop("failure", "")
        for name, values in result.items():
            array = data[name]
            array.loc[{dimension: place[dimension] for dimension in array.dims if dimension in place}] = values
    return {STABILITY.name: data}

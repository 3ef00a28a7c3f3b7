"""Errors and seconds, gathered in the group ``/benchmark``."""

from ...runs.stages import results
from .kind import STAGE
from .variables import BENCHMARK


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    data = BENCHMARK.empty(study.axes)
    for task, result in results(STAGE, study, folder, BENCHMARK.variables):
        case = task.of
        data.attrs["second_beam"] = case.second_beam.name if case.second_beam else ""
        place = {"scene": case.name, "mesh_size": list(case.mesh_sizes)}
        for name, values in result.items():
            array = data[name]
            array.loc[{dimension: place[dimension] for dimension in array.dims if dimension in place}] = values
    return {BENCHMARK.name: data}

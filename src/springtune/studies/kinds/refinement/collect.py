"""Refinements, gathered in the group ``/refinement``."""

import numpy as np

from ...output.dataset import Filler
from ...runs import store
from .batches import crossings, refine, value_key
from .kind import file_key
from .names import SPACINGS, VARIED
from .variables import COORDINATES, refinement_group

OF_A_VALUE = (
    "status",
    "message",
    "displacement",
    "reference_displacement",
    "reference_error_estimate",
    "reference_applies",
    "deformation_error",
    "particles",
)
"""What of a value's result goes into the dataset as it is."""


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    part = study.parts["refinement"]
    found = [_read(one, folder / "refinement" / f"{file_key(one)}.h5") for one in part]
    lengths = {
        "point": max(len(places) for places, *_ in found),
        "crossing": max(1, *(len(where) for *_, where in found)),
    }
    axes = study.axes | {name: tuple(range(length)) for name, length in lengths.items()}
    group = refinement_group({one.parameter for one in part})
    data = Filler(group.empty(axes))
    for one, values in zip(part, found):
        _put(one, *values, data)
    return {group.name: data.data.set_coords([name for name in COORDINATES if name in data.data])}


def _read(one, path):
    """Places, batches and results of a refinement's values, and its crossings: the loop again, on what is stored."""
    results = {}

    def errors(values):
        batch = {value: value_key(value) for value in values}
        known = store.read(path, batch.values())
        results.update({value: known[key] for value, key in batch.items()})
        return [results[value].get("deformation_error", np.nan) for value in values]

    places, batches, errors = refine(one.rule, errors)
    return places, batches, results, crossings(one.rule, places, errors)


def _scene(one):
    """What a refinement does not vary, in words."""
    said = {"mesh_size": f"{one.mesh_type} mesh", "force": one.load}
    for name, given in (("mesh_size", one.mesh_size), ("force", abs(one.force))):
        if name != one.parameter:
            unit, size = VARIED[name].scale(given)
            said[name] += f" {given / size:.6g} {unit}"
    return ", ".join((one.beam.name, said["mesh_size"], one.material.name, said["force"], one.kinematics))


def _put(one, places, batches, results, where, data):
    labels = {"refinement": one.name, "definition": one.definition}
    about = {"parameter": one.parameter, "tolerance": one.rule.tolerance, "spacing": SPACINGS[one.rule.logarithmic]}
    data.put(about | {"scene": _scene(one)}, refinement=one.name)
    data.put({"value_count": len(places), "halved": max(batches)}, **labels)
    for point, (place, batch) in enumerate(zip(places, batches)):
        value = one.rule.value(place)
        result = results[value]
        values = {f"refined_{one.parameter}": value, "batch": batch}
        data.put(values | {name: result[name] for name in OF_A_VALUE if name in result}, point=point, **labels)
    for number, crossing in enumerate(where):
        values = {"crossing_level": crossing.level, "crossing_change": crossing.change}
        values |= {f"crossing_{one.parameter}": crossing.value, f"crossing_{one.parameter}_width": crossing.width}
        data.put(values, crossing=number, **labels)

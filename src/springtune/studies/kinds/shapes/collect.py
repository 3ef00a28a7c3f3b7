"""Shapes, gathered in the group ``/shapes``."""

import numpy as np

from springtune.problem.compare import deformation_error
from springtune.reference.answers import beyond_linear

from ...output.dataset import Filler
from ...runs import store
from ..scenes import stored
from ..scenes.collect import with_objection
from ..scenes.variables import MESH_ROWS, SCENE_ROWS
from . import plan
from .task_values import named, quantity_key
from .variables import SHAPES

QUANTITY_UNITS = {"displacement": "m", "stress": "Pa", "reaction": "N", "area": "m2", "energy": "J"}
"""Units of the values in the dataset."""


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    part = study.parts["shapes"]
    found = Filler(SHAPES.empty(study.axes))
    _quantities(part, found)
    references = _references(study, part, folder, found)
    for scenes in plan.by_mesh(part).values():
        _mesh(scenes[0], folder, found)
        keys = {one: plan.scene_task(part, one)["key"] for one in scenes}
        results = store.read(folder / "solutions" / f"{plan.file_name(scenes[0])}.h5", set(keys.values()))
        for one, key in keys.items():
            _scene(part, one, results[key], references, found)
    return {SHAPES.name: found.data}


def _quantities(part, found):
    """Write what quantities are."""
    for shape, load in dict.fromkeys((one.shape, one.load) for one in part.scenes):
        found.put({"shape_thickness": part.shape[shape].thickness}, shape=shape)
        for one in part.shape[shape].loads[load].quantities:
            values = {f"quantity_{name}": getattr(one, name) for name in ("kind", "component", "of")}
            values |= {"quantity_units": QUANTITY_UNITS[one.kind], "source": one.source}
            if one.expected is not None:
                values["expected_value"] = one.expected
            found.put(values, shape=shape, load=load, quantity=one.name)


def _references(study, part, folder, found):
    """Write references; return result and objections by shape, material and load."""
    answers = {}
    for shape, material, load in part.referred:
        task = plan.reference_task(part, shape, material, load)
        result = store.read_one(folder / "shape_references", task["key"])
        labels = {"shape": shape, "material": material, "load": load}
        case = part.shape[shape].loads[load]
        message, objections = named(result["message"], part.shape[shape], case), {}
        values = {"reference_seconds": result["seconds"]}
        if not message:
            values |= {f"reference_{name}": result[name] for name in ("unknowns", "rotation", "strain")}
            objections = {"linear": "", "nonlinear": beyond_linear(result["rotation"], result["strain"])}
            for kinematics in study.axes["kinematics"]:
                found.put({"reference_applies": not objections[kinematics]}, kinematics=kinematics, **labels)
            for one in case.quantities:
                key = quantity_key(one)
                value = result["values"].get(key, np.nan)
                compared = {
                    "reference_value": value,
                    "reference_error_estimate": result["error_estimates"].get(key, np.nan),
                    "reference_expected_error": _error(value, one.expected),
                }
                found.put(compared, quantity=one.name, **labels)
            lacking = (named(why, part.shape[shape], case) for why in result["lacking"].values())
            message = "; ".join(filter(None, (*lacking, objections["nonlinear"])))
        values["reference_message"] = message
        found.put(values, **labels)
        answers[shape, material, load] = result, objections
    return answers


def _mesh(one, folder, found):
    notes = stored.read_notes(folder / "meshes", plan.file_name(one))
    labels = {"shape": one.shape, "mesh_type": one.mesh_type, "mesh_size": one.mesh_size}
    found.put({name: notes[name] for name in MESH_ROWS if name in notes}, **labels)


def _scene(part, one, result, references, found):
    labels = vars(one)
    reference, objections = references.get((one.shape, one.material, one.load), ({}, {}))
    values = {name: result[name] for name in SCENE_ROWS if name in result} | {"solve_seconds": result["seconds"]}
    case = part.shape[one.shape].loads[one.load]
    whys = [reference.get("message", ""), *reference.get("lacking", {}).values()]
    whys = [f"no reference: {named(why, part.shape[one.shape], case)}" for why in whys if why]
    why = "; ".join(filter(None, (*whys, objections.get(one.kinematics, ""))))
    values["message"] = with_objection(result, named(result.get("message", ""), part.shape[one.shape], case), why)
    found.put(values, **labels)
    for quantity in case.quantities:
        key = quantity_key(quantity)
        value = result.get("values", {}).get(key, np.nan)
        compared = {
            "value": value,
            "error": _error(value, reference.get("values", {}).get(key, np.nan)),
            "expected_error": _error(value, quantity.expected),
        }
        found.put(compared, quantity=quantity.name, **labels)


def _error(value, reference):
    """Signed relative error; NaN where there is nothing to divide by."""
    return deformation_error(value, reference) if reference else np.nan

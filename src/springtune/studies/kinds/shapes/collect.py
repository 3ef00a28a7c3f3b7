"""Shapes, gathered in the group ``/shapes``."""

import numpy as np

from springtune.problem.compare import deformation_error
from springtune.problem.status import Status
from springtune.reference.answers import beyond_linear

from ...output.dataset import Filler
from ...runs import store
from ..scenes import stored
from ..scenes.variables import OF_MESH
from . import plan
from .names import QUANTITY_UNITS
from .task_values import named, quantity_key
from .variables import SHAPES

COPIED_OF_SCENE = ("status", "message", "definition_seconds", "negative_pivots")


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    part = study.parts["shapes"]
    found = Filler(SHAPES.empty(study.axes))
    expected = _quantities(part, found)
    references = _references(study, part, folder, found, expected)
    for scenes in plan.by_mesh(part).values():
        _mesh(scenes[0], folder, found)
        tasks = {plan.scene_task(part, one)["key"]: one for one in scenes}
        results = store.read(folder / "solutions" / f"{plan.file_name(scenes[0])}.h5", tasks)
        for one in scenes:
            _scene(part, one, results[plan.scene_task(part, one)["key"]], references, expected, found)
    return {SHAPES.name: found.data}


def _quantities(part, found):
    """Put what quantities are; by shape and load, the expected values by name."""
    expected = {}
    for shape, load in dict.fromkeys((one.shape, one.load) for one in part.scenes):
        found.put({"shape_thickness": part.shape[shape].thickness}, shape=shape)
        expected[shape, load] = {}
        for one in part.shape[shape].loads[load].quantities:
            known = np.nan if one.expected is None else one.expected
            expected[shape, load][one.name] = known
            values = {
                "quantity_kind": one.kind,
                "quantity_component": one.component,
                "quantity_of": one.of,
                "quantity_units": QUANTITY_UNITS[one.kind],
                "expected_value": known,
                "source": one.source,
            }
            found.put(values, shape=shape, load=load, quantity=one.name)
    return expected


def _references(study, part, folder, found, expected):
    """Put references; by shape, material and load their values by key, and the objection to each kinematics."""
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
                    "reference_expected_error": _error(value, expected[shape, load][one.name]),
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
    found.put({name: notes[name] for name in OF_MESH if name in notes}, **labels)


def _scene(part, one, result, references, expected, found):
    labels = {
        name: getattr(one, name)
        for name in ("shape", "mesh_type", "mesh_size", "material", "load", "definition", "kinematics")
    }
    reference, objections = references.get((one.shape, one.material, one.load), ({}, {}))
    values = {name: result[name] for name in COPIED_OF_SCENE if name in result} | {"solve_seconds": result["seconds"]}
    case = part.shape[one.shape].loads[one.load]
    whys = [reference.get("message", ""), *reference.get("lacking", {}).values()]
    whys = [f"no reference: {named(why, part.shape[one.shape], case)}" for why in whys if why]
    why = "; ".join(filter(None, (*whys, objections.get(one.kinematics, ""))))
    values["message"] = named(values.get("message", ""), part.shape[one.shape], case)
    if why and result["status"] in (Status.SOLVED, Status.UNSTABLE):
        values["message"] = "; ".join(filter(None, (values["message"], why)))
    found.put(values, **labels)
    for quantity in case.quantities:
        key = quantity_key(quantity)
        value = result.get("values", {}).get(key, np.nan)
        compared = {
            "value": value,
            "error": _error(value, reference.get("values", {}).get(key, np.nan)),
            "expected_error": _error(value, expected[one.shape, one.load][quantity.name]),
        }
        found.put(compared, quantity=quantity.name, **labels)


def _error(value, reference):
    """Signed relative error; nothing where there is nothing to divide by."""
    return deformation_error(value, reference) if reference else np.nan

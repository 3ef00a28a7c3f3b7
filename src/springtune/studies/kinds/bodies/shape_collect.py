"""Shapes, gathered in the groups ``/shapes`` and ``/shape_fields``."""

import numpy as np

from springtune.problem.compare import deformation_error
from springtune.problem.shapes import QUANTITY_UNITS
from springtune.reference.answers import beyond_linear

from ...runs import store
from . import shape_plan, stored
from .outputs import CASE_AXES, DRAWING, MESH_AXES
from .rows import displaced, fields_of_rows, mesh_row, outline_row, with_objection
from .shape_expand import law_of
from .stored import FIELD_ARRAYS, fields_key
from .task_values import named, quantity_key
from .variables import AT_FINITE_STRAIN, MESH_ROWS, SCENE_ROWS, SHAPE_FIELDS, SHAPES


def groups(study, folder):
    """Groups of shapes."""
    shapes = study.shapes
    answers = {case: _answer(shapes, folder, *case) for case in shapes.referred}
    rows = [*_quantities(shapes), *_references(study.axes, shapes, answers), *_scenes(shapes, folder, answers)]
    data = SHAPES.of_rows(study.axes, rows)
    finite = {AT_FINITE_STRAIN.name: _finite_strain(study, shapes, folder, data.value)} if shapes.finite else {}
    return {SHAPES.name: data} | finite | (_fields(study, folder) if DRAWING in study.outputs else {})


def _answer(shapes, folder, *case, arrays=()):
    """Stored result of a reference: of a shape, material and load, and a law at finite strain."""
    return store.read_one(folder / "references", shape_plan.reference_task(shapes, *case)["key"], arrays)


def _quantities(shapes):
    """Rows of what quantities are."""
    for shape, load in dict.fromkeys((one.shape, one.load) for one in shapes.scenes):
        yield {"shape": shape, "shape_thickness": shapes.shape[shape].thickness}
        for one in shapes.shape[shape].loads[load].quantities:
            about = {f"quantity_{name}": getattr(one, name) for name in ("kind", "component", "of")}
            about |= {"quantity_units": QUANTITY_UNITS[one.kind], "source": one.source, "expected_value": one.expected}
            yield {"shape": shape, "load": load, "quantity": one.name} | about


def _whys(shapes, shape, load, result):
    """Why a reference, or a quantity of it, is missing, in the names of the study."""
    whys = (result["message"], *result.get("lacking", {}).values())
    return [named(why, shapes.shape[shape], shapes.shape[shape].loads[load]) for why in whys if why]


def _objection(result, kinematics):
    """Why a reference does not apply to networks of some kinematics."""
    return "" if result["message"] or kinematics == "linear" else beyond_linear(result["rotation"], result["strain"])


def _references(axes, shapes, answers):
    """Rows of references."""
    for (shape, material, load), result in answers.items():
        labels = {"shape": shape, "material": material, "load": load}
        whys = [*_whys(shapes, shape, load, result), _objection(result, "nonlinear")]
        yield labels | {"reference_seconds": result["seconds"], "reference_message": "; ".join(filter(None, whys))}
        if result["message"]:
            continue
        yield labels | {f"reference_{name}": result[name] for name in ("unknowns", "rotation", "strain")}
        for kinematics in axes["kinematics"]:
            yield labels | {"kinematics": kinematics, "reference_applies": not _objection(result, kinematics)}
        for one in shapes.shape[shape].loads[load].quantities:
            row = labels | {"quantity": one.name} | _value(result, one)
            yield row | {"reference_expected_error": _error(row["reference_value"], one.expected)}


def _finite_strain(study, shapes, folder, values):
    """Group of references at finite strain, and the errors of the networks with their law."""
    rows, references = [], {}
    for shape, material, load, law in shapes.finite:
        result = _answer(shapes, folder, shape, material, load, law)
        labels = {"shape": shape, "material": material, "load": load, "law": law}
        references[shape, material, load, law] = result.get("values", {})
        rows.append(labels | {"reference_message": "; ".join(_whys(shapes, shape, load, result))})
        for one in shapes.shape[shape].loads[load].quantities if not result["message"] else ():
            rows.append(labels | {"quantity": one.name} | _value(result, one))
    for one in shapes.scenes:
        reference = references.get((one.shape, one.material, one.load, law_of(one)), {})
        for quantity in shapes.shape[one.shape].loads[one.load].quantities if reference else ():
            labels = vars(one) | {"quantity": quantity.name}
            error = _error(float(values.sel(labels)), reference.get(quantity_key(quantity), np.nan))
            rows.append(labels | {"error": error})
    laws = tuple(dict.fromkeys(law for *_, law in shapes.finite))
    return AT_FINITE_STRAIN.of_rows(study.axes | {"law": laws}, rows)


def _value(result, quantity):
    """Value of a quantity in a reference that did not fail, and its error estimate."""
    key = quantity_key(quantity)
    names = {"reference_value": "values", "reference_error_estimate": "error_estimates"}
    return {name: result[stored_as].get(key, np.nan) for name, stored_as in names.items()}


def _scenes(shapes, folder, answers):
    """Rows of meshes and scenes."""
    for scenes in shape_plan.by_mesh(shapes).values():
        file = shape_plan.file_name(scenes[0])
        notes = stored.read_notes(folder / "meshes", file)
        labels = {name: getattr(scenes[0], name) for name in MESH_AXES}
        yield labels | {name: notes[name] for name in MESH_ROWS if name in notes}
        keys = {one: shape_plan.scene_task(shapes, one)["key"] for one in scenes}
        results = store.read(folder / "solutions" / f"{file}.h5", set(keys.values()))
        for one, key in keys.items():
            yield from _scene(shapes, one, results[key], answers.get((one.shape, one.material, one.load)))


def _scene(shapes, one, result, reference):
    """Rows of a scene."""
    labels, case, whys = vars(one), shapes.shape[one.shape].loads[one.load], []
    if reference:
        whys = [f"no reference: {why}" for why in _whys(shapes, one.shape, one.load, reference)]
        whys.append(_objection(reference, one.kinematics))
    message = named(result.get("message", ""), shapes.shape[one.shape], case)
    message = with_objection(result, message, "; ".join(filter(None, whys)))
    values = {name: result[name] for name in SCENE_ROWS if name in result}
    yield labels | values | {"solve_seconds": result["seconds"], "message": message}
    known = (reference or {}).get("values", {})
    for quantity in case.quantities:
        key = quantity_key(quantity)
        value = result.get("values", {}).get(key, np.nan)
        errors = {"error": _error(value, known.get(key, np.nan)), "expected_error": _error(value, quantity.expected)}
        yield labels | {"quantity": quantity.name, "value": value} | errors


def _error(value, reference):
    """Signed relative error; NaN where there is nothing to divide by."""
    return deformation_error(value, reference) if reference else np.nan


def _fields(study, folder):
    """Group of the drawn networks."""
    shapes = study.shapes
    drawn, cases = shape_plan.shown(shapes), {}
    for one in (one for one in shapes.scenes if one in drawn):
        cases.setdefault(f"{one.shape}, {one.load}", []).append(one)
    rows = [{"case": case} | row for case, scenes in cases.items() for row in _drawn(shapes, folder, scenes)]
    return {SHAPE_FIELDS.name: fields_of_rows(SHAPE_FIELDS, study.axes | {"case": tuple(cases)}, rows)}


def _drawn(shapes, folder, scenes):
    """Rows of a case: its labels, outline, mesh and networks."""
    one, file = scenes[0], shape_plan.file_name(scenes[0])
    about = {f"{name}_name": getattr(one, name) for name in (*CASE_AXES, "kinematics", "mesh_type")}
    yield about | {"case_mesh_size": one.mesh_size}
    body = one.shape, one.material, one.load
    if body in shapes.referred:
        found = _answer(shapes, folder, *body, arrays=("outline_points", "outline_displacements", "outline_lengths"))
        if not found["message"]:
            sizes = found["outline_lengths"]
            rounds = {"outline_round": np.repeat(np.arange(len(sizes)), sizes)}
            yield rounds | outline_row(found["outline_points"], found["outline_displacements"])
    if grouped := stored.read(folder / "meshes", file):
        yield mesh_row(grouped.mesh)
        keys = {scene: fields_key(shape_plan.scene_task(shapes, scene)["key"]) for scene in scenes}
        results = store.read(folder / "solutions" / f"{file}.h5", set(keys.values()), [*FIELD_ARRAYS])
        for scene, key in keys.items():
            if results[key]:
                yield {"definition": scene.definition} | displaced(results[key])

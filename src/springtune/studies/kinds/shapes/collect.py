"""Shapes, gathered in the groups ``/shapes`` and ``/shape_fields``."""

import numpy as np

from springtune.problem.compare import deformation_error
from springtune.problem.shapes import QUANTITY_UNITS
from springtune.reference.answers import beyond_linear

from ...output.dataset import OF_PARTICLES, OF_SPRINGS, UGRID
from ...runs import store
from ..scenes import stored
from ..scenes import variables as shared
from ..scenes.collect import displaced, fields_of_rows, mesh_row, outline_row, with_objection
from ..scenes.stored import FIELD_ARRAYS, fields_key
from ..scenes.variables import declared, topology
from . import kind
from .expand import law_of
from .outputs import CASE_AXES, DRAWING, MESH_AXES, SCENE_AXES
from .task_values import named, quantity_key

MIXED: dict[str, object] = {"comment": "in SI units: quantity_units says which", "units_variable": "quantity_units"}

SEVEN_DIGITS = {name: (*row, np.float32(np.nan)) for name, row in shared.DISPLACEMENT_ROWS.items()}

SHAPES = declared(
    "/shapes",
    {
        (*SCENE_AXES, "quantity"): {
            "value": ("1", "quantity of interest, network"),
            "error": ("1", "signed error, (network - reference) / |reference|"),
            "expected_error": ("1", "signed difference, (network - expected) / |expected|"),
        },
        (*CASE_AXES, "quantity"): {
            "reference_value": ("1", "quantity of interest, reference"),
            **shared.ESTIMATE_ROW,
            "reference_expected_error": ("1", "signed difference, (reference - expected) / |expected|"),
        },
        ("shape", "load", "quantity"): {
            "expected_value": ("1", "quantity of interest, as others give it"),
            "quantity_kind": ("1", "what the quantity is", ""),
            "quantity_component": ("1", "its component", ""),
            "quantity_of": ("1", "the group or point that it is of", ""),
            "quantity_units": ("1", "units of its values", ""),
            "source": ("1", "who gives the expected value", ""),
        },
        SCENE_AXES: shared.SCENE_ROWS,
        MESH_AXES: shared.MESH_ROWS,
        CASE_AXES: {
            **shared.REFERENCE_ROWS,
            "reference_seconds": ("s", "time to solve the reference"),
            "reference_unknowns": ("1", "unknowns of the finest reference"),
        },
        (*CASE_AXES, "kinematics"): shared.APPLIES_ROW,
        ("shape",): {"shape_thickness": ("m", "thickness of the shape")},
    },
    dimensions={"shape": "shape, by name", "quantity": "quantity of interest, by name"},
    flags=shared.YES_OR_NO,
    further=dict.fromkeys(("value", "reference_value", "expected_value"), MIXED),
)

AT_FINITE_STRAIN = declared(
    "/shapes_finite_strain",
    {
        (*CASE_AXES, "law", "quantity"): {
            "reference_value": ("1", "quantity of interest, reference at finite strain"),
            **shared.ESTIMATE_ROW,
        },
        (*CASE_AXES, "law"): shared.NO_REFERENCE_ROW,
        (*SCENE_AXES, "quantity"): {
            "error": ("1", "signed error against finite strain, (network - reference) / |reference|"),
        },
    },
    dimensions=SHAPES.dimensions
    | {"law": "law at finite strain: that of the material, or of St. Venant and Kirchhoff"},
    further={"reference_value": MIXED},
)

SHAPE_FIELDS = declared(
    "/shape_fields",
    topology(("case",), "case")
    | {
        ("case",): {
            f"{name}_name": ("1", name.replace("_", " "), "") for name in (*CASE_AXES, "kinematics", "mesh_type")
        }
        | {"case_mesh_size": ("m", "asked length of an edge; 0 where the mesh is that of a file")},
        ("case", "definition", "particle"): SEVEN_DIGITS,
        ("case", "definition", "spring"): shared.SPRING_FORCE_ROW,
        ("case", "outline_point"): {
            "outline_round": ("1", "number of the round that a point is of, from 0", -1),
            **shared.OUTLINE_ROWS,
            **shared.OUTLINE_DISPLACEMENT_ROWS,
        },
    },
    dimensions={"case": "shape and load"},
    further=UGRID | dict.fromkeys(("displacement_x", "displacement_y"), OF_PARTICLES) | {"spring_force": OF_SPRINGS},
)
"""Networks that are drawn, each shape's and load's on its finest mesh of a size that can be: they are there to be
looked at, their displacements and forces with seven digits."""


def groups(study, folder):
    """Groups of a dataset, see `springtune.studies.kinds.scenes.collect.groups`."""
    part = study.parts["shapes"]
    answers = {case: _answer(part, folder, *case) for case in part.referred}
    rows = [*_quantities(part), *_references(study.axes, part, answers), *_scenes(part, folder, answers)]
    data = SHAPES.of_rows(study.axes, rows)
    finite = {AT_FINITE_STRAIN.name: _finite_strain(study, part, folder, data.value)} if part.finite else {}
    return {SHAPES.name: data} | finite | (_fields(study, folder) if DRAWING in study.outputs else {})


def _answer(part, folder, *case, arrays=()):
    """Stored result of a reference: of a shape, material and load, and a law at finite strain."""
    return store.read_one(folder / "shape_references", kind.reference_task(part, *case)["key"], arrays)


def _quantities(part):
    """Rows of what quantities are."""
    for shape, load in dict.fromkeys((one.shape, one.load) for one in part.scenes):
        yield {"shape": shape, "shape_thickness": part.shape[shape].thickness}
        for one in part.shape[shape].loads[load].quantities:
            about = {f"quantity_{name}": getattr(one, name) for name in ("kind", "component", "of")}
            about |= {"quantity_units": QUANTITY_UNITS[one.kind], "source": one.source, "expected_value": one.expected}
            yield {"shape": shape, "load": load, "quantity": one.name} | about


def _whys(part, shape, load, result):
    """Why a reference, or a quantity of it, is missing, in the names of the study."""
    whys = (result["message"], *result.get("lacking", {}).values())
    return [named(why, part.shape[shape], part.shape[shape].loads[load]) for why in whys if why]


def _objection(result, kinematics):
    """Why a reference does not apply to networks of some kinematics."""
    return "" if result["message"] or kinematics == "linear" else beyond_linear(result["rotation"], result["strain"])


def _references(axes, part, answers):
    """Rows of references."""
    for (shape, material, load), result in answers.items():
        labels = {"shape": shape, "material": material, "load": load}
        whys = [*_whys(part, shape, load, result), _objection(result, "nonlinear")]
        yield labels | {"reference_seconds": result["seconds"], "reference_message": "; ".join(filter(None, whys))}
        if result["message"]:
            continue
        yield labels | {f"reference_{name}": result[name] for name in ("unknowns", "rotation", "strain")}
        for kinematics in axes["kinematics"]:
            yield labels | {"kinematics": kinematics, "reference_applies": not _objection(result, kinematics)}
        for one in part.shape[shape].loads[load].quantities:
            row = labels | {"quantity": one.name} | _value(result, one)
            yield row | {"reference_expected_error": _error(row["reference_value"], one.expected)}


def _finite_strain(study, part, folder, values):
    """Group of references at finite strain, and the errors of the networks with their law."""
    rows, references = [], {}
    for shape, material, load, law in part.finite:
        result = _answer(part, folder, shape, material, load, law)
        labels = {"shape": shape, "material": material, "load": load, "law": law}
        references[shape, material, load, law] = result.get("values", {})
        rows.append(labels | {"reference_message": "; ".join(_whys(part, shape, load, result))})
        for one in part.shape[shape].loads[load].quantities if not result["message"] else ():
            rows.append(labels | {"quantity": one.name} | _value(result, one))
    for one in part.scenes:
        reference = references.get((one.shape, one.material, one.load, law_of(one)), {})
        for quantity in part.shape[one.shape].loads[one.load].quantities if reference else ():
            labels = vars(one) | {"quantity": quantity.name}
            error = _error(float(values.sel(labels)), reference.get(quantity_key(quantity), np.nan))
            rows.append(labels | {"error": error})
    laws = tuple(dict.fromkeys(law for *_, law in part.finite))
    return AT_FINITE_STRAIN.of_rows(study.axes | {"law": laws}, rows)


def _value(result, quantity):
    """Value of a quantity in a reference that did not fail, and its error estimate."""
    key = quantity_key(quantity)
    names = {"reference_value": "values", "reference_error_estimate": "error_estimates"}
    return {name: result[stored_as].get(key, np.nan) for name, stored_as in names.items()}


def _scenes(part, folder, answers):
    """Rows of meshes and scenes."""
    for scenes in kind.by_mesh(part).values():
        file = kind.file_name(scenes[0])
        notes = stored.read_notes(folder / "meshes", file)
        labels = {name: getattr(scenes[0], name) for name in MESH_AXES}
        yield labels | {name: notes[name] for name in shared.MESH_ROWS if name in notes}
        keys = {one: kind.scene_task(part, one)["key"] for one in scenes}
        results = store.read(folder / "solutions" / f"{file}.h5", set(keys.values()))
        for one, key in keys.items():
            yield from _scene(part, one, results[key], answers.get((one.shape, one.material, one.load)))


def _scene(part, one, result, reference):
    """Rows of a scene."""
    labels, case, whys = vars(one), part.shape[one.shape].loads[one.load], []
    if reference:
        whys = [f"no reference: {why}" for why in _whys(part, one.shape, one.load, reference)]
        whys.append(_objection(reference, one.kinematics))
    message = named(result.get("message", ""), part.shape[one.shape], case)
    message = with_objection(result, message, "; ".join(filter(None, whys)))
    values = {name: result[name] for name in shared.SCENE_ROWS if name in result}
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
    part = study.parts["shapes"]
    drawn, cases = kind.shown(part), {}
    for one in (one for one in part.scenes if one in drawn):
        cases.setdefault(f"{one.shape}, {one.load}", []).append(one)
    rows = [{"case": case} | row for case, scenes in cases.items() for row in _drawn(part, folder, scenes)]
    return {SHAPE_FIELDS.name: fields_of_rows(SHAPE_FIELDS, study.axes | {"case": tuple(cases)}, rows)}


def _drawn(part, folder, scenes):
    """Rows of a case: its labels, outline, mesh and networks."""
    one, file = scenes[0], kind.file_name(scenes[0])
    about = {f"{name}_name": getattr(one, name) for name in (*CASE_AXES, "kinematics", "mesh_type")}
    yield about | {"case_mesh_size": one.mesh_size}
    body = one.shape, one.material, one.load
    if body in part.referred:
        found = _answer(part, folder, *body, arrays=("outline_points", "outline_displacements", "outline_lengths"))
        if not found["message"]:
            sizes = found["outline_lengths"]
            rounds = {"outline_round": np.repeat(np.arange(len(sizes)), sizes)}
            yield rounds | outline_row(found["outline_points"], found["outline_displacements"])
    if grouped := stored.read(folder / "meshes", file):
        yield mesh_row(grouped.mesh)
        keys = {scene: fields_key(kind.scene_task(part, scene)["key"]) for scene in scenes}
        results = store.read(folder / "solutions" / f"{file}.h5", set(keys.values()), [*FIELD_ARRAYS])
        for scene, key in keys.items():
            if results[key]:
                yield {"definition": scene.definition} | displaced(results[key])

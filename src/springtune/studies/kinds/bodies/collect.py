"""Groups of a dataset of beams, in the root, and of shapes; ``collect.csv`` declares their variables."""

from dataclasses import replace
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

from springtune.problem.compare import deformation_error
from springtune.problem.loads import LOADS
from springtune.problem.materials import Rubber
from springtune.problem.quantities import SWEPT, Status
from springtune.problem.shapes import QUANTITY_UNITS
from springtune.reference.answers import beyond_linear, objection, outline
from springtune.springs.lattice import predicted_stiffness

from ...config.model import Reference, Study, declared
from ...output import dataset
from ...output.dataset import NO_NODE, SHOWN_PREFIX, Group
from ...runs import store
from . import any_reference, stored
from . import kind as bodies
from .kind import keeps_fields
from .outputs import BODY_NAMES, CASE_AXES, MESH_AXES, SCENE_AXES, SHAPES_OUTPUT, has_pressure
from .stored import FACE_POSITIONS, FIELD_ARRAYS, fields_key, stored_key
from .task_values import quantity_key, with_names

CELL = ("beam", "mesh_type", "mesh_size", "material", "load")

DIMENSIONS = {"MESH": CELL[:3], "REFERENCE": ("beam", "material", "load"), "CELL": CELL, "CURVE": (*CELL, "kinematics")}
DIMENSIONS |= {"SCENE": (*CELL, "definition", "kinematics")}
DIMENSIONS |= {"SHAPE_MESH": MESH_AXES, "SHAPE_CASE": CASE_AXES, "SHAPE_SCENE": SCENE_AXES}
"""Dimensions that the file gives one name."""


def _group(group: str, **further: Any) -> Group:
    """Group of the dataset with its variables and dimensions from the file, and `further` attributes."""
    return Group(group, **declared(__file__, group, **DIMENSIONS), flags={"applies": ("no", "yes")}, further=further)


MESH_ATTRIBUTES = {
    "mesh": {
        "cf_role": "mesh_topology",
        "topology_dimension": np.int32(2),
        "node_coordinates": "x y",
        "edge_node_connectivity": "spring_nodes",
        "face_node_connectivity": "cell_nodes",
        "node_dimension": "particle",
        "edge_dimension": "spring",
        "face_dimension": "cell",
    },
    "spring_nodes": {"cf_role": "edge_node_connectivity", "start_index": np.int32(0)},
    "cell_nodes": {"cf_role": "face_node_connectivity", "start_index": np.int32(0)},
}
MESH_ATTRIBUTES |= dict.fromkeys(("spring_force", "stiffness"), {"mesh": "mesh", "location": "edge"})
PARTICLE_VARIABLES = [f"{name}_{axis}" for name in ("displacement", "particle_reference") for axis in "xy"]
MESH_ATTRIBUTES |= dict.fromkeys(PARTICLE_VARIABLES, {"mesh": "mesh", "location": "node"})
"""Attributes of unstructured meshes by UGRID-1.0, and of variables of springs and particles."""

ROOT, SENSITIVITY = _group("/"), _group("/sensitivity")
FINITE_STRAIN, BLOCK = _group("/finite_strain"), _group("/block")
FIELDS = _group("/fields", **MESH_ATTRIBUTES)
"""Whole fields of the coarsest mesh of each beam and mesh type, by UGRID-1.0 without the padding of its arrays.

The force of springs is not called "force", a dimension of the root where a study sweeps it.
"""

MIXED_UNITS: dict[str, object] = {
    "comment": "in SI units: quantity_units says which",
    "units_variable": "quantity_units",
}

SHAPES = _group("/shapes", value=MIXED_UNITS, reference_value=MIXED_UNITS, expected_value=MIXED_UNITS)
SHAPES_FINITE_STRAIN = _group("/shapes_finite_strain", reference_value=MIXED_UNITS)
SHAPE_FIELDS = _group("/shape_fields", **MESH_ATTRIBUTES)
"""Networks to draw: of each shape and load on one mesh, displacements and forces with seven digits."""

PRINTED_PREFIX = "paper_"  # prefix of variables of printed cells, which have no swept dimensions


def swept(group: Group, study: Study) -> Group:
    """Return a group whose variables have further dimensions: the swept parameters that they depend on."""
    variables = {}
    for name, (dimensions, units, long_name, nothing) in group.variables.items():
        if name in BODY_NAMES.values():
            further = [one for one in study.swept if BODY_NAMES.get(one) == name]
        elif "load" in dimensions and not name.startswith(PRINTED_PREFIX):
            further = [one for one in study.swept if one != "stiffness_scale" or "definition" in dimensions]
        else:
            further = []
        shared = [one for one in dimensions if one in dataset.DIMENSIONS]
        own = [one for one in dimensions if one not in dataset.DIMENSIONS]
        variables[name] = (*shared, *further, *own), units, long_name, nothing
    if group is ROOT and "force" in study.swept:
        del variables["force"]  # a dimension
    if group in (ROOT, FINITE_STRAIN, BLOCK) and study.plane_strain:
        words = "plane of the material, 'stress' or 'strain'; its constants are those in 3-D"
        variables["material_plane"] = ("material",), "1", words, ""
    return replace(group, variables=variables)


def fields_of(study: Study) -> Group:
    """Group of whole fields, which are stored for one value of each swept parameter: the group says which."""
    place, named = ("beam", "mesh_type", "material", "load"), {name: SWEPT[name] for name in study.swept}
    own = {SHOWN_PREFIX + name: (place, unit, f"{text}, of the fields", np.nan) for name, (text, unit) in named.items()}
    return replace(FIELDS, variables=FIELDS.variables | own)


# -- rows --------------------------------------------------------------------------------------------------------------

FACE_VARIABLES = {
    "displacement": "face_displacement",
    "face_mean": "face_mean_displacement",
    "face_profile": "face_profile",
    "last_displacement": "last_face_displacement",
}
"""Values of a pressed face by their names in a result."""


def groups(study, folder):
    """Groups of a dataset by name, from the stored results of a study in a folder."""
    beams = _beam_groups(study, folder) if study.scenes else {}
    return beams | (_shape_groups(study, folder) if study.shapes else {})


# -- what beams and shapes share ---------------------------------------------------------------------------------------


def _with_objection(result, message, why):
    """Message of a scene, with the objection to its reference if the scene is solved."""
    return "; ".join(filter(None, (message, why if result["status"] in (Status.SOLVED, Status.UNSTABLE) else "")))


def _fields_of_rows(group, axes, rows):
    """Group of whole fields; its dimensions are as long as the longest arrays."""

    def longest(name, axis=0, least=1):
        return range(max((row[name].shape[axis] for row in rows if name in row), default=least) or 1)

    axes = axes | {"particle": longest("x"), "spring": longest("spring_nodes"), "spring_end": (0, 1)}
    axes |= {"cell": longest("cell_nodes"), "cell_corner": longest("cell_nodes", 1, least=3)}
    found = group.of_rows(axes | {"outline_point": longest("outline_x")}, rows)
    return found.assign_attrs(Conventions="CF-1.11 UGRID-1.0")


def _mesh_row(mesh):
    """Values of a mesh at rest; triangles among quadrilaterals have no fourth node."""
    cells = np.full((sum(map(len, mesh.cells.values())), max(mesh.cells)), NO_NODE)
    start = 0
    for count, corners in mesh.cells.items():
        cells[start : start + len(corners), :count] = corners
        start += len(corners)
    return {"x": mesh.points[:, 0], "y": mesh.points[:, 1], "spring_nodes": mesh.edges, "cell_nodes": cells}


def _network_row(arrays):
    """Values of a network, and of its reference at the particles, from its stored arrays."""
    row = {}
    for name, array in (("displacement", "displacements"), ("particle_reference", "reference_displacements")):
        if array in arrays:
            row[f"{name}_x"], row[f"{name}_y"] = arrays[array].T
    if "displacements" in arrays:
        row |= {"spring_force": arrays["spring_forces"], "stiffness": arrays["spring_stiffnesses"]}
    return row


def _outline_row(points, moved):
    """Values of the outline of a reference: positions at rest and displacements."""
    names = "outline_x", "outline_y", "reference_displacement_x", "reference_displacement_y"
    return dict(zip(names, (*points.T, *moved.T)))


# -- beams -------------------------------------------------------------------------------------------------------------


def _beam_groups(study, folder):
    axes = study.axes | {"stiffness_ratio": study.stiffness_ratios}
    read = cache(lambda beam, material, load: _reference(study, folder, Reference(beam, material, load, 1.0)))
    answers = {one: read(one.beam, one.material, one.load) for one in study.references}  # for 1 N: each is read once
    planes = [{"material": one.name, "material_plane": one.plane} for one in {one.material for one in answers}]
    cells, faces, fields = _scene_rows(study, folder, answers)
    meshes = [mesh.labels | stored.read_notes(folder / "meshes", bodies.stem(mesh)) for mesh in study.meshes]
    rows = [*planes, *_body_rows(study), *meshes, *_reference_rows(study, answers), *cells, *_printed_rows(study)]
    data = swept(ROOT, study).of_rows(axes, rows)
    _comment(data, answers)
    _write_errors(data.deformation_error, data.displacement, data.reference_displacement)
    found = {"/": data}
    if study.curves:
        found["/sensitivity"] = swept(SENSITIVITY, study).of_rows(axes, _curve_rows(study, folder, answers))
    if study.further_references:
        rows, group = [*planes, *_finite_reference_rows(study, folder)], swept(FINITE_STRAIN, study)
        finite = found["/finite_strain"] = group.of_rows(axes | {"reference": study.further_references}, rows)
        _write_errors(finite.deformation_error, data.displacement, finite.reference_displacement)
    if has_pressure(study):
        in_plane = {one["material_plane"] for one in planes}
        small = f"small-strain-plane-{in_plane.pop()}" if len(in_plane) == 1 else "small-strain"
        kinds, group = (small, *study.further_references), swept(BLOCK, study)
        rows = [*planes, *_face_reference_rows(study, folder, kinds), *faces]
        own = {"reference": kinds, "face_position": tuple(FACE_POSITIONS)}
        block = found["/block"] = group.of_rows(axes | own, rows)
        _write_errors(block.face_error, block.face_displacement, block.reference_face_displacement)
    if keeps_fields(study):
        found["/fields"] = _fields_of_rows(fields_of(study), axes, [*fields, *_rest_rows(study, folder)])
    return found


def _body_rows(study):
    for one in {scene.material for scene in study.scenes}:
        own = {name: getattr(one, name) for name in ("young_modulus", "poisson_ratio", "density")}
        yield {"material": one.name} | own | {f"material_{name}": value for name, value in own.items()}
    for one in {scene.mesh.beam for scene in study.scenes}:
        extents = {f"beam_{name}": getattr(one, name) for name in ("length", "height", "thickness")}
        yield {"beam": one.name, "thickness": one.thickness} | extents


def _comment(data, answers):
    """Add comments on fitted rubbers and on interpolated references."""
    rubbers = {one.material.name: one.material for one in answers if isinstance(one.material, Rubber)}
    if rubbers:
        data.material_young_modulus.attrs["comment"] = "; ".join(
            f"{law.name}: Yeoh's law of {', '.join(f'{c:.6g}' for c in law.coefficients)} Pa, fitted to a uniaxial "
            "test; root mean square of its relative errors "
            + ", ".join(f"{100 * error:.2g} % ({test})" for test, error in law.errors.items())
            for _, law in sorted(rubbers.items())
        )
    if interpolated := sum("solves" in result for result in answers.values()):
        data.reference_displacement.attrs["comment"] = (
            f"{interpolated} of {len(answers)} are interpolated between finite-element solutions over aspect ratio and "
            "Poisson's ratio, which is part of reference_error_estimate; they have no field_error"
        )


def _reference_rows(study, answers):
    for one, result in answers.items():
        labels, message = study.labels(one), objection(result, one.force, "nonlinear")
        for kinematics in study.axes["kinematics"]:
            applies = not objection(result, one.force, kinematics)
            yield labels | {"kinematics": kinematics, "reference_applies": applies}
        size = abs(one.force)
        scales = {"displacement": one.force, "error_estimate": 1.0, "rotation": size, "strain": size, "seconds": 1.0}
        values = {f"reference_{name}": scale * result[name] for name, scale in scales.items() if name in result}
        yield {"force": one.force, "reference_message": message} | labels | values


def _reference(study, folder, one, fields=()):
    reference = bodies.reference_of(study, one.beam, one.material, one.load)
    return any_reference.read(folder / "references", reference, fields)


def _scene_rows(study, folder, answers):
    """Rows of scenes, of pressed faces, and of whole fields; each file is read once."""
    names = "beam", "material", "load", *(one for one in study.swept if one != "stiffness_scale")
    objections = {
        (*study.labels(one).values(), kinematics): objection(result, one.force, kinematics)
        for one, result in answers.items()
        for kinematics in study.axes["kinematics"]
    }
    calibration = stored.read_calibration(folder)
    cells, faces, fields = [], [], []
    for mesh, tasks in bodies.scene_tasks(study).items():
        keys, path = [stored_key(task, calibration) for task in tasks], folder / "solutions" / f"{bodies.stem(mesh)}.h5"
        results = store.read(path, set(keys), ["face_profile"] if has_pressure(study) else [])
        kept = {fields_key(key) for task, key in zip(tasks, keys) if keeps_fields(study) and "keep_fields" in task}
        arrays = store.read(path, kept, [*FIELD_ARRAYS]) if kept else {}
        for scene, key in zip(bodies.by_mesh(study, "scenes")[mesh], keys):
            result, labels = results[key], study.labels(scene)
            against = objections[*(labels[name] for name in names), scene.kinematics]
            message = _with_objection(result, result.get("message", ""), against)
            # Names of the result that collect.csv declares, as `displacement`, become variables; others are left out.
            cells.append(result | labels | {"message": message, "solve_seconds": result["seconds"]})
            if LOADS[scene.load].kind.pressed:
                faces.append(labels | {new: result[old] for old, new in FACE_VARIABLES.items() if old in result})
            if found := arrays.get(fields_key(key)):
                fields.append(labels | _network_row(found))
    return cells, faces, fields


def _printed_rows(study):
    own = [name for name in ROOT.variables if name.startswith(PRINTED_PREFIX)]
    for cell in study.printed:
        labels = {name: getattr(cell, name) for name in CELL}
        if all(label in study.axes[name] for name, label in labels.items()):
            yield labels | {name: getattr(cell, name.removeprefix(PRINTED_PREFIX)) for name in own}


def _curve_rows(study, folder, answers):
    for mesh, curves in bodies.by_mesh(study, "curves").items():
        tasks = [bodies.curve_task(study, curve) for curve in curves]
        path = folder / "curves" / f"{bodies.stem(mesh)}.h5"
        results = store.read(path, [task["key"] for task in tasks], ["displacement", "stable"])
        for curve, task in zip(curves, tasks):
            result, reference = results[task["key"]], Reference(mesh.beam, curve.material, curve.load, curve.force)
            displacement, answer = result["displacement"], curve.force * answers[reference].get("displacement", np.nan)
            status = np.where(result["stable"], Status.SOLVED, Status.UNSTABLE)
            row = {name: result[name] for name in ("displacement", "message", "best_stiffness")} | study.labels(curve)
            row |= {f"best_stiffness_{name}": result[f"best_{name}"] for name in ("status", "message")}
            yield row | {
                "stiffness": np.array(task["stiffnesses"]),
                "status": np.where(np.isnan(displacement), result.get("status", Status.NOT_CONVERGED), status),
                "curve_seconds": result["seconds"],
                "deformation_error": deformation_error(displacement, answer),
                "predicted_stiffness": predicted_stiffness(curve.material, mesh.beam, mesh.mesh_size, curve.load),
            }


def _finite_reference_rows(study, folder):
    for one, kind in product(study.references, study.further_references):
        result = _finite_reference(folder, one, kind)
        values = {f"reference_{name}": result.get(name) for name in ("message", "displacement", "error_estimate")}
        yield study.labels(one) | {"reference": kind} | values


def _finite_reference(folder, one, kind, fields=()):
    return store.read_one(folder / "references", bodies.finite_key(one, kind), fields)


def _write_errors(error, network, reference):
    """Write deformation errors where both displacements are known, often in few cells."""
    network, reference = (array.transpose(*error.dims).values for array in xr.broadcast(network, reference))
    there = np.isfinite(network) & np.isfinite(reference)
    error.values[there] = deformation_error(network[there], reference[there])


def _face_reference_rows(study, folder, kinds):
    """Rows of pressed faces of references: middle, mean and profile."""
    from scipy.interpolate import CubicSpline  # here: only pressed faces need it

    for one, kind in product((one for one in study.references if LOADS[one.load].kind.pressed), kinds):
        if kind in study.further_references:
            result, scale = _finite_reference(folder, one, kind, ["positions", "profile"]), 1.0
        else:
            result, scale = _reference(study, folder, one, ["x", "displacements"]), one.force
            if "x" in result:
                result |= {"positions": result["x"] / one.beam.length, "profile": result["displacements"][:, -1, 1]}
        row = study.labels(one) | {"reference": kind, "reference_message": result["message"]}
        means = ("displacement", "mean_displacement") if "displacement" in result else ()
        row |= {f"reference_face_{name}": scale * result[name] for name in means}
        row["reference_error_estimate"] = result.get("error_estimate")
        if "profile" in result:  # one that is interpolated has none
            profile = CubicSpline(result["positions"], result["profile"])
            row["reference_face_profile"] = scale * profile(FACE_POSITIONS)
        yield row


def _rest_rows(study, folder):
    """Rows of meshes, and of outlines of references, for the scenes with stored fields."""
    shown = [scene for scene in study.scenes if scene in bodies.shown_scenes(study)]
    meshes = {mesh: stored.read(folder / "meshes", bodies.stem(mesh)) for mesh in dict.fromkeys(s.mesh for s in shown)}
    yield from (mesh.labels | _mesh_row(found.mesh) for mesh, found in meshes.items() if found)
    references = {}  # scenes differ in their meshes and definitions
    for scene in shown:
        labels = study.labels(scene)
        yield labels | {f"{SHOWN_PREFIX}{name}": labels[name] for name in study.swept}
        references.setdefault(Reference(scene.mesh.beam, scene.material, scene.load, scene.force), labels)
    for one, labels in references.items():
        result = _reference(study, folder, one, ["x", "y", "displacements"])
        if "x" in result:
            yield labels | _outline_row(*outline(result["x"], result["y"], one.force * result["displacements"]))


# -- shapes ------------------------------------------------------------------------------------------------------------


def _shape_groups(study, folder):
    shapes = study.shapes
    answers = {case: _shape_reference(study, folder, *case) for case in shapes.referred}
    rows = [*_quantity_rows(shapes), *_shape_reference_rows(study, answers), *_shape_scene_rows(study, folder, answers)]
    data = SHAPES.of_rows(study.axes, rows)
    found = {"/shapes": data}
    if shapes.finite:
        found["/shapes_finite_strain"] = _shapes_at_finite_strain(study, folder, data.value)
    if SHAPES_OUTPUT in study.outputs:
        found["/shape_fields"] = _shape_fields(study, folder)
    return found


def _shape_reference(study, folder, *case, arrays=()):
    """Stored reference of a shape, material and load, and a law at finite strain if given."""
    return store.read_one(folder / "references", bodies.shape_reference_task(study, *case)["key"], arrays)


def _quantity_rows(shapes):
    for shape, load in dict.fromkeys((one.shape, one.load) for one in shapes.scenes):
        yield {"shape": shape, "shape_thickness": shapes.shape[shape].thickness}
        for one in shapes.shape[shape].loads[load].quantities:
            about = {f"quantity_{name}": getattr(one, name) for name in ("kind", "component", "of")}
            about |= {"quantity_units": QUANTITY_UNITS[one.kind], "source": one.source, "expected_value": one.expected}
            yield {"shape": shape, "load": load, "quantity": one.name} | about


def _reasons(shapes, shape, load, result):
    """Reasons why a reference or its quantities are missing, with the names of the study."""
    whys = (result["message"], *result.get("lacking", {}).values())
    return [with_names(why, shapes.shape[shape], shapes.shape[shape].loads[load]) for why in whys if why]


def _shape_objection(result, kinematics):
    """Reason why a small-strain reference does not apply, or an empty string."""
    return "" if result["message"] or kinematics == "linear" else beyond_linear(result["rotation"], result["strain"])


def _shape_reference_rows(study, answers):
    for (shape, material, load), result in answers.items():
        labels = {"shape": shape, "material": material, "load": load}
        yield labels | {f"reference_{name}": result.get(name) for name in ("seconds", "unknowns", "rotation", "strain")}
        yield from _rows_of_reference(study.shapes, labels, result, _shape_objection(result, "nonlinear"))
        for kinematics in study.axes["kinematics"] if not result["message"] else ():
            yield labels | {"kinematics": kinematics, "reference_applies": not _shape_objection(result, kinematics)}


def _shapes_at_finite_strain(study, folder, values):
    """Group of references at finite strain, with the errors of networks of the same law."""
    shapes, rows, references = study.shapes, [], {}
    for shape, material, load, law in shapes.finite:
        result = _shape_reference(study, folder, shape, material, load, law)
        references[shape, material, load, law] = result.get("values", {})
        rows += _rows_of_reference(shapes, {"shape": shape, "material": material, "load": load, "law": law}, result)
    for one in shapes.scenes:
        reference = references.get((one.shape, one.material, one.load, one.law), {})
        for quantity in shapes.shape[one.shape].loads[one.load].quantities if reference else ():
            labels = vars(one) | {"quantity": quantity.name}
            error = _error(float(values.sel(labels)), reference.get(quantity_key(quantity), np.nan))
            rows.append(labels | {"error": error})
    laws = tuple(dict.fromkeys(law for *_, law in shapes.finite))
    return SHAPES_FINITE_STRAIN.of_rows(study.axes | {"law": laws}, rows)


def _rows_of_reference(shapes, labels, result, objection=""):
    """Rows of a reference: its message, and value, error estimate and expected error of each quantity."""
    shape, load = labels["shape"], labels["load"]
    whys = [*_reasons(shapes, shape, load, result), objection]
    yield labels | {"reference_message": "; ".join(filter(None, whys))}
    for one in shapes.shape[shape].loads[load].quantities if not result["message"] else ():
        value, estimate = (result[name].get(quantity_key(one), np.nan) for name in ("values", "error_estimates"))
        row = {"quantity": one.name, "reference_value": value, "reference_error_estimate": estimate}
        yield labels | row | {"reference_expected_error": _error(value, one.expected)}


def _shape_scene_rows(study, folder, answers):
    for file, scenes in bodies.shape_scenes_by_mesh(study).items():
        yield {name: getattr(scenes[0], name) for name in MESH_AXES} | stored.read_notes(folder / "meshes", file)
        keys = {one: bodies.shape_scene_task(study, one)["key"] for one in scenes}
        results = store.read(folder / "solutions" / f"{file}.h5", set(keys.values()))
        for one, key in keys.items():
            result, labels, shape, whys = results[key], vars(one), study.shapes.shape[one.shape], []
            case, reference = shape.loads[one.load], answers.get((one.shape, one.material, one.load), {})
            if reference:
                whys = [f"no reference: {why}" for why in _reasons(study.shapes, one.shape, one.load, reference)]
                whys.append(_shape_objection(reference, one.kinematics))
            message = with_names(result.get("message", ""), shape, case)
            message = _with_objection(result, message, "; ".join(filter(None, whys)))
            yield result | labels | {"solve_seconds": result["seconds"], "message": message}
            for quantity in case.quantities:
                key = quantity_key(quantity)
                value, known = (values.get("values", {}).get(key, np.nan) for values in (result, reference))
                errors = {"error": _error(value, known), "expected_error": _error(value, quantity.expected)}
                yield labels | {"quantity": quantity.name, "value": value} | errors


def _error(value, reference):
    """Signed relative error; NaN without a reference or for a reference of zero."""
    return deformation_error(value, reference) if reference else np.nan


def _shape_fields(study, folder):
    drawn = [one for one in study.shapes.scenes if one in bodies.drawn_scenes(study)]
    cases = bodies.group_by(drawn, lambda one: f"{one.shape}, {one.load}")
    rows = [{"case": case} | row for case, scenes in cases.items() for row in _case_rows(study, folder, scenes)]
    return _fields_of_rows(SHAPE_FIELDS, study.axes | {"case": tuple(cases)}, rows)


def _case_rows(study, folder, scenes):
    """Rows of a case: its labels, outline, mesh and networks."""
    one, file = scenes[0], bodies.shape_stem(scenes[0])
    about = {f"{name}_name": getattr(one, name) for name in (*CASE_AXES, "kinematics", "mesh_type")}
    yield about | {"case_mesh_size": one.mesh_size}
    body = one.shape, one.material, one.load
    if body in study.shapes.referred:
        arrays = "outline_points", "outline_displacements", "outline_lengths"
        found = _shape_reference(study, folder, *body, arrays=arrays)
        if not found["message"]:
            sizes = found["outline_lengths"]
            rounds = {"outline_round": np.repeat(np.arange(len(sizes)), sizes)}
            yield rounds | _outline_row(found["outline_points"], found["outline_displacements"])
    if grouped := stored.read(folder / "meshes", file):
        yield _mesh_row(grouped.mesh)
        keys = {scene: fields_key(bodies.shape_scene_task(study, scene)["key"]) for scene in scenes}
        results = store.read(folder / "solutions" / f"{file}.h5", set(keys.values()), [*FIELD_ARRAYS])
        for scene, key in keys.items():
            if results[key]:
                yield {"definition": scene.definition} | _network_row(results[key])

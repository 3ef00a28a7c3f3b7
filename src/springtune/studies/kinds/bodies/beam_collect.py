"""Scenes, references and curves, gathered in the root of a dataset and its groups."""

from functools import cache
from itertools import product

import numpy as np
import xarray as xr

from springtune.problem.boundary import FACE_POSITIONS
from springtune.problem.compare import deformation_error
from springtune.problem.loads import LOADS
from springtune.problem.materials import Rubber
from springtune.problem.status import Status
from springtune.reference.answers import interpolate, objection, outline
from springtune.springs.lattice import predicted_stiffness

from ...config.model import Reference, keeps_fields
from ...output.selection import OF_FIELDS
from ...runs import store
from . import any_reference, beam_plan, stored
from .outputs import pressed
from .rows import displaced, fields_of_rows, mesh_row, outline_row, with_objection
from .stored import FIELD_ARRAYS, fields_key, stored_key
from .variables import BLOCK, CELL, FIELDS, FINITE_STRAIN, OF_PRINT, ROOT, SENSITIVITY, fields_of, swept

SMALL_STRAIN = "small-strain-plane-stress"
"""Name of the reference that all studies have, where all materials are in plane stress."""

FACE_VARIABLES = {
    "displacement": "face_displacement",
    "face_mean": "face_mean_displacement",
    "face_profile": "face_profile",
    "last_displacement": "last_face_displacement",
}
"""Values of a pressed face by their names in a result."""


def groups(study, folder):
    """Groups of a dataset."""
    axes = study.axes | {"stiffness_ratio": study.stiffness_ratios}
    read = cache(lambda beam, material, load: _reference(study, folder, Reference(beam, material, load, 1.0)))
    answers = {one: read(one.beam, one.material, one.load) for one in study.references}  # for 1 N: each is read once
    planes = [{"material": one.name, "material_plane": one.plane} for one in {one.material for one in answers}]
    cells, faces, fields = _scenes(study, folder, answers)
    rows = [*planes, *_bodies(study), *_meshes(study, folder), *_references(study, answers), *cells, *_printed(study)]
    data = swept(ROOT, study).of_rows(axes, rows)
    _comment(data, answers)
    _compare(data.deformation_error, data.displacement, data.reference_displacement)
    found = {ROOT.name: data}
    if study.curves:
        found[SENSITIVITY.name] = swept(SENSITIVITY, study).of_rows(axes, _curves(study, folder, answers))
    if study.further_references:
        rows = [*planes, *_finite_references(study, folder)]
        finite = swept(FINITE_STRAIN, study).of_rows(axes | {"reference": study.further_references}, rows)
        _compare(finite.deformation_error, data.displacement, finite.reference_displacement)
        found[FINITE_STRAIN.name] = finite
    if pressed(study):
        kinds = small_strain(study), *study.further_references
        rows = [*planes, *_face_references(study, folder, kinds), *faces]
        axes_of_faces = axes | {"reference": kinds, "face_position": tuple(FACE_POSITIONS)}
        block = found[BLOCK.name] = swept(BLOCK, study).of_rows(axes_of_faces, rows)
        _compare(block.face_error, block.face_displacement, block.reference_face_displacement)
    if keeps_fields(study):
        found[FIELDS.name] = fields_of_rows(fields_of(study), axes, [*fields, *_at_rest(study, folder)])
    return found


# -- rows of the root --------------------------------------------------------------------------------------------------


def _bodies(study):
    """Rows of materials and beams."""
    for one in {scene.material for scene in study.scenes}:
        labels = {name: getattr(one, name) for name in ("young_modulus", "poisson_ratio")}
        density = {"material_density": np.nan if one.density is None else one.density}
        yield {"material": one.name} | labels | density | {f"material_{name}": labels[name] for name in labels}
    for one in {scene.mesh.beam for scene in study.scenes}:
        extents = {f"beam_{name}": getattr(one, name) for name in ("length", "height", "thickness")}
        yield {"beam": one.name, "thickness": one.thickness} | extents


def _comment(data, answers):
    """Comment on fits of rubbers, and on references that are interpolated."""
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


def _meshes(study, folder):
    return [mesh.labels | stored.read_notes(folder / "meshes", beam_plan.stem(mesh)) for mesh in study.meshes]


def _references(study, answers):
    """Rows of references."""
    for one, result in answers.items():
        labels = study.labels(one)
        for kinematics in study.axes["kinematics"]:
            applies = not objection(result, one.force, kinematics)
            yield labels | {"kinematics": kinematics, "reference_applies": applies}
        row = {"force": one.force, "reference_seconds": result["seconds"]} | labels
        row["reference_message"] = objection(result, one.force, "nonlinear")
        if "displacement" in result:
            row |= {
                "reference_displacement": one.force * result["displacement"],
                "reference_error_estimate": result["error_estimate"],
                "reference_rotation": abs(one.force) * result["rotation"],
                "reference_strain": abs(one.force) * result["strain"],
            }
        yield row


def _reference(study, folder, one, fields=()):
    reference = beam_plan.reference_of(study, one.beam, one.material, one.load)
    return any_reference.read(folder / "references", reference, fields)


def _scenes(study, folder, answers):
    """Rows of the scenes in the root, of pressed faces, and of whole fields; each file is read once."""
    names = "beam", "material", "load", *(one for one in study.swept if one != "stiffness_scale")
    objections = {
        (*study.labels(one).values(), kinematics): objection(result, one.force, kinematics)
        for one, result in answers.items()
        for kinematics in study.axes["kinematics"]
    }
    calibration = stored.read_calibration(folder)
    cells, faces, fields = [], [], []
    for mesh, tasks in beam_plan.scene_tasks(study).items():
        keys = [stored_key(task, calibration) for task in tasks]
        path = folder / "solutions" / f"{beam_plan.stem(mesh)}.h5"
        results = store.read(path, set(keys), ["face_profile"] if pressed(study) else [])
        kept = {fields_key(key) for task, key in zip(tasks, keys) if keeps_fields(study) and "keep_fields" in task}
        arrays = store.read(path, kept, [*FIELD_ARRAYS]) if kept else {}
        for scene, key in zip(beam_plan.scenes_by_mesh(study)[mesh], keys):
            result, labels = results[key], study.labels(scene)
            against = objections[*(labels[name] for name in names), scene.kinematics]
            message = with_objection(result, result.get("message", ""), against)
            cells.append(result | labels | {"message": message, "solve_seconds": result["seconds"]})
            if LOADS[scene.load].kind.pressed:
                faces.append(labels | {new: result[old] for old, new in FACE_VARIABLES.items() if old in result})
            if found := arrays.get(fields_key(key)):
                fields.append(labels | displaced(found) | {"stiffness": found["spring_stiffnesses"]})
    return cells, faces, fields


def _printed(study):
    """Rows of printed cells that the study asks for."""
    for cell in study.printed:
        labels = {name: getattr(cell, name) for name in CELL}
        if all(label in study.axes[name] for name, label in labels.items()):
            own = (name for name in ROOT.variables if name.startswith(OF_PRINT))
            yield labels | {name: getattr(cell, name.removeprefix(OF_PRINT)) for name in own}


# -- rows of groups ----------------------------------------------------------------------------------------------------


def _curves(study, folder, answers):
    """Rows of sensitivity curves."""
    for mesh, curves in beam_plan.curves_by_mesh(study).items():
        tasks = [beam_plan.curve_task(study, curve) for curve in curves]
        path = folder / "curves" / f"{beam_plan.stem(mesh)}.h5"
        results = store.read(path, [task["key"] for task in tasks], ["displacement", "stable"])
        for curve, task in zip(curves, tasks):
            result, reference = results[task["key"]], Reference(mesh.beam, curve.material, curve.load, curve.force)
            displacement = result["displacement"]
            status = np.where(result["stable"], Status.SOLVED, Status.UNSTABLE)
            row = {name: result[name] for name in ("displacement", "message", "best_stiffness")} | study.labels(curve)
            row |= {f"best_stiffness_{name}": result[f"best_{name}"] for name in ("status", "message")}
            yield row | {
                "stiffness": np.array(task["stiffnesses"]),
                "status": np.where(np.isnan(displacement), result.get("status", Status.NOT_CONVERGED), status),
                "curve_seconds": result["seconds"],
                "deformation_error": deformation_error(
                    displacement, curve.force * answers[reference].get("displacement", np.nan)
                ),
                "predicted_stiffness": predicted_stiffness(curve.material, mesh.beam, mesh.mesh_size, curve.load),
            }


def small_strain(study):
    """Name of the reference of small strain, by the planes of the materials."""
    planes = {one.material.plane for one in study.references}
    if planes == {"strain"}:
        return "small-strain-plane-strain"
    return "small-strain" if "strain" in planes else SMALL_STRAIN


def _finite_references(study, folder):
    """Rows of references at finite strain."""
    for one, kind in product(study.references, study.further_references):
        result, known = _finite_reference(folder, one, kind), ("message", "displacement", "error_estimate")
        values = {f"reference_{name}": result[name] for name in known if name in result}
        yield study.labels(one) | {"reference": kind} | values


def _finite_reference(folder, one, kind, fields=()):
    return store.read_one(folder / "references", beam_plan.finite_key(one, kind), fields)


def _compare(error, network, reference):
    """Write deformation errors where both displacements are known: often few cells."""
    network, reference = (array.transpose(*error.dims).values for array in xr.broadcast(network, reference))
    there = np.isfinite(network) & np.isfinite(reference)
    error.values[there] = deformation_error(network[there], reference[there])


def _face_references(study, folder, kinds):
    """Rows of pressed faces of references."""
    for one, kind in product(study.references, kinds):
        if LOADS[one.load].kind.pressed:
            yield study.labels(one) | {"reference": kind} | _face_reference(study, folder, one, kind)


def _face_reference(study, folder, one, kind):
    """Middle, mean and profile of a pressed face of a reference."""
    from scipy.interpolate import CubicSpline  # here: only pressed faces need it

    if kind not in study.further_references:
        result, scale = _reference(study, folder, one, ["x", "displacements"]), one.force
        if "x" in result:
            result |= {"positions": result["x"] / one.beam.length, "profile": result["displacements"][:, -1, 1]}
    else:
        result, scale = _finite_reference(folder, one, kind, ["positions", "profile"]), 1.0
    values = {"reference_message": result["message"]}
    if "displacement" in result:
        values |= {
            "reference_face_displacement": scale * result["displacement"],
            "reference_face_mean_displacement": scale * result["mean_displacement"],
            "reference_error_estimate": result["error_estimate"],
        }
        if "profile" in result:  # one that is interpolated has none
            profile = CubicSpline(result["positions"], result["profile"])
            values["reference_face_profile"] = scale * profile(FACE_POSITIONS)
    return values


# -- rows of whole fields ----------------------------------------------------------------------------------------------


def _at_rest(study, folder):
    """Rows of meshes, outlines, and references at the particles of the scenes whose fields are stored."""
    shown = [scene for scene in study.scenes if scene in beam_plan.shown_scenes(study)]
    meshes = {
        mesh: stored.read(folder / "meshes", beam_plan.stem(mesh)) for mesh in dict.fromkeys(s.mesh for s in shown)
    }
    yield from (mesh.labels | mesh_row(found.mesh) for mesh, found in meshes.items() if found)
    compared = set()  # scenes differ in their definitions
    for scene in shown:
        labels = study.labels(scene)
        yield labels | {f"{OF_FIELDS}{name}": labels[name] for name in study.swept}
        one = Reference(scene.mesh.beam, scene.material, scene.load, scene.force)
        if (scene.mesh, one) in compared:
            continue
        compared.add((scene.mesh, one))
        result = _reference(study, folder, one, ["x", "y", "displacements"])
        if "x" not in result:
            continue
        x, y, moved = result["x"], result["y"], one.force * result["displacements"]
        yield labels | outline_row(*outline(x, y, moved))
        if found := meshes[scene.mesh]:
            along = interpolate(x, y, moved, found.mesh.points).T
            yield labels | dict(zip(("particle_reference_x", "particle_reference_y"), along))

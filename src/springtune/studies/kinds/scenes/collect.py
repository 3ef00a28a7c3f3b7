"""Scenes, references and curves, gathered in the root of a dataset and its groups."""

from functools import cache

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
from ...output.dataset import NO_NODE, Filler
from ...output.selection import OF_FIELDS
from ...runs import store
from . import any_reference, plan, stored
from .outputs import pressed
from .stored import PACKED, fields_key, unpacked
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
    root = Filler(swept(ROOT, study).empty(axes))
    _meshes(study, folder, root)
    displacements, objections = _references(study, folder, root)
    block = _block(study, folder, axes) if pressed(study) else None
    kept = keeps_fields(study) and not plan.shown_scenes(study).isdisjoint(study.scenes)  # a part may show none
    fields = _fields(study, folder, axes) if kept else None
    _scenes(study, folder, root, block, fields, objections)
    _bodies(study, root)
    _printed(study, root)
    data = root.data
    _compare(data.deformation_error, data.displacement, data.reference_displacement)
    found = {ROOT.name: data}
    if study.curves:
        found[SENSITIVITY.name] = _sensitivity(study, folder, displacements, axes)
    if study.further_references:
        found[FINITE_STRAIN.name] = _finite_strain(study, folder, axes, data.displacement)
    if block:
        faces = found[BLOCK.name] = block.data
        _compare(faces.face_error, faces.face_displacement, faces.reference_face_displacement)
    if fields:
        found[FIELDS.name] = fields.data
    return found


def _bodies(study, root):
    """Write materials and beams; the fit of a rubber goes into a comment."""
    fits = {}
    for material in {scene.material for scene in study.scenes}:
        labels = {name: getattr(material, name) for name in ("young_modulus", "poisson_ratio")}
        values = labels | {"density": np.nan if material.density is None else material.density}
        root.put({f"material_{name}": value for name, value in values.items()}, material=material.name, **labels)
        if isinstance(material, Rubber):
            fits[material.name] = material
    if fits:
        root.data.material_young_modulus.attrs["comment"] = "; ".join(
            f"{name}: Yeoh's law of {', '.join(f'{c:.6g}' for c in law.coefficients)} Pa, fitted to a uniaxial test; "
            "root mean square of its relative errors "
            + ", ".join(f"{100 * error:.2g} % ({test})" for test, error in law.errors.items())
            for name, law in sorted(fits.items())
        )
    _planes(study, root)
    for beam in {scene.mesh.beam for scene in study.scenes}:
        body = {f"beam_{name}": getattr(beam, name) for name in ("length", "height", "thickness")}
        root.put(body, beam=beam.name, thickness=beam.thickness)


def _planes(study, group):
    """Write the planes of materials, where any is in plane strain."""
    for material in {one.material for one in study.references} if study.plane_strain else ():
        group.put({"material_plane": material.plane}, material=material.name)


def _reference_of(scene):
    """Reference of a scene or a curve."""
    return Reference(scene.mesh.beam, scene.material, scene.load, scene.force)


def _meshes(study, folder, root):
    for mesh in study.meshes:
        notes = stored.read_notes(folder / "meshes", plan.stem(mesh))
        root.put({label: value for label, value in notes.items() if label in root.data}, **mesh.labels)


def _references(study, folder, root):
    """Write references; return the displacement of each, and the objection by reference and kinematics."""
    displacements, objections, interpolated = {}, {}, 0
    read = cache(lambda beam, material, load: _reference(study, folder, Reference(beam, material, load, 1.0)))
    for one in study.references:
        result = read(one.beam, one.material, one.load)  # for 1 N: whatever the forces, it is read once
        labels = study.labels(one)
        for kinematics in study.axes["kinematics"]:
            objections[one, kinematics] = found = objection(result, one.force, kinematics)
            root.put({"reference_applies": not found}, kinematics=kinematics, **labels)
        values = {"reference_seconds": result["seconds"]}
        values["reference_message"] = objection(result, one.force, "nonlinear")
        if "force" in root.data.data_vars:
            values["force"] = one.force
        if "displacement" in result:
            displacements[one] = one.force * result["displacement"]
            values |= {
                "reference_displacement": displacements[one],
                "reference_error_estimate": result["error_estimate"],
                "reference_rotation": abs(one.force) * result["rotation"],
                "reference_strain": abs(one.force) * result["strain"],
            }
        root.put(values, **labels)
        interpolated += "solves" in result
    if interpolated:
        root.data.reference_displacement.attrs["comment"] = (
            f"{interpolated} of {len(study.references)} are interpolated between finite-element solutions over aspect "
            "ratio and Poisson's ratio, which is part of reference_error_estimate; they have no field_error"
        )
    return displacements, objections


def _reference(study, folder, one, fields=()):
    reference = plan.reference_of(study, one.beam, one.material, one.load)
    return any_reference.read(folder / "references", reference, fields)


def _scenes(study, folder, root, block, fields, objections):
    """Write the results of the scenes into the root and the groups; each file is read once."""
    compared = set()  # places of fields that have their reference
    calibration = store.everything(plan.calibration_path(folder)) if plan.calibrated(study) else {}
    arrays, known = ["face_profile"] * (block is not None), set(root.data.data_vars)
    shown = plan.shown_scenes(study) if fields else ()
    for mesh, scenes in plan.scenes_by_mesh(study).items():
        names = plan.solved_keys(study, mesh, calibration)  # in the store a result's name is its key
        path = folder / "solutions" / f"{plan.stem(mesh)}.h5"
        results = store.read(path, set(names), arrays)
        kept = {fields_key(name) for scene, name in zip(scenes, names) if scene in shown}
        of_fields = store.read(path, kept, [PACKED]) if kept else {}
        labels = [study.labels(scene) for scene in scenes]
        against, rows = {}, []
        for scene, name in zip(scenes, names):
            result = results[name]
            values = {name: value for name, value in result.items() if name in known}
            # By its place: hashing materials for each of 100,000 scenes is slow.
            one = id(scene.material), scene.load, scene.force, scene.kinematics
            if one not in against:
                against[one] = objections[_reference_of(scene), scene.kinematics]
            values["message"] = with_objection(result, result.get("message", ""), against[one])
            rows.append(values | {"solve_seconds": result["seconds"]})
        root.put_each(rows, labels)
        for scene, name, place in zip(scenes, names, labels) if block or of_fields else ():
            if LOADS[scene.load].kind.pressed:
                result = results[name]
                block.put({new: result[old] for old, new in FACE_VARIABLES.items() if old in result}, **place)
            result = unpacked(of_fields.get(fields_key(name), {}))
            if "displacements" in result:  # of one value of what is swept
                x, y = result["displacements"].T
                of_springs = {"stiffness": result["spring_stiffnesses"], "spring_force": result["spring_forces"]}
                fields.put({"displacement_x": x, "displacement_y": y} | of_springs, **place)
                body = mesh.labels | {"material": scene.material.name, "load": scene.load}
                if tuple(body.values()) not in compared:  # scenes differ in their definitions
                    compared.add(tuple(body.values()))
                    fields.put(_at_particles(study, folder, scene, fields.data), **body)


def with_objection(result, message, why):
    """Message of a scene; of a solved one with the objection to its reference."""
    return "; ".join(filter(None, (message, why if result["status"] in (Status.SOLVED, Status.UNSTABLE) else "")))


def _at_particles(study, folder, scene, fields):
    """Displacements of the reference at the places of the particles at rest [m]; empty without a reference."""
    reference = plan.reference_of(study, scene.mesh.beam, scene.material, scene.load)
    found = any_reference.read(folder / "references", reference, ["x", "y", "displacements"])
    if "x" not in found:
        return {}
    places = fields[["x", "y"]].sel(scene.mesh.labels)
    points = np.stack([places.x.values, places.y.values], axis=1)
    points = points[~np.isnan(points[:, 0])]
    x, y = scene.force * interpolate(found["x"], found["y"], found["displacements"], points).T
    return {"particle_reference_x": x, "particle_reference_y": y}


def _printed(study, root):
    for cell in study.printed:
        values = {name: getattr(cell, name.removeprefix(OF_PRINT)) for name in root.data if name.startswith(OF_PRINT)}
        try:
            root.put(values, **{name: getattr(cell, name) for name in CELL})
        except KeyError:
            continue  # a cell that this study does not ask for


def _sensitivity(study, folder, displacements, axes):
    curves = Filler(swept(SENSITIVITY, study).empty(axes))
    for mesh, members in plan.curves_by_mesh(study).items():
        names = [plan.curve_key(study, curve) for curve in members]
        results = store.read(folder / "curves" / f"{plan.stem(mesh)}.h5", names, ["displacement", "stable"])
        for curve, name in zip(members, names):
            result, stiffness = results[name], np.array(plan.stiffnesses(study, curve))
            displacement = result["displacement"]
            reference = displacements.get(_reference_of(curve), np.nan)
            status = np.where(result["stable"], Status.SOLVED, Status.UNSTABLE)
            status = np.where(np.isnan(displacement), result.get("status", Status.NOT_CONVERGED), status)
            values = {name: result[name] for name in ("displacement", "message", "best_stiffness")}
            values |= {f"best_stiffness_{name}": result[f"best_{name}"] for name in ("status", "message")}
            values |= {"stiffness": stiffness, "status": status, "curve_seconds": result["seconds"]}
            values["deformation_error"] = deformation_error(displacement, reference)
            predicted = predicted_stiffness(curve.material, mesh.beam, mesh.mesh_size, curve.load)
            curves.put(values | {"predicted_stiffness": predicted}, **study.labels(curve))
    return curves.data


def small_strain(study):
    """Name of the reference of small strain, by the planes of the materials."""
    planes = {one.material.plane for one in study.references}
    if planes == {"strain"}:
        return "small-strain-plane-strain"
    return "small-strain" if "strain" in planes else SMALL_STRAIN


def _block(study, folder, axes):
    """Group of pressed faces with all references and, so far, no scenes."""
    kinds = (small_strain(study), *study.further_references)
    block = Filler(swept(BLOCK, study).empty(axes | {"reference": kinds, "face_position": tuple(FACE_POSITIONS)}))
    _planes(study, block)
    for one in study.references:
        for kind in kinds if LOADS[one.load].kind.pressed else ():
            block.put(_face_reference(study, folder, one, kind), reference=kind, **study.labels(one))
    return block


def _finite_strain(study, folder, axes, displacement):
    """Group of references at finite strain, and the networks' errors against them."""
    finite = Filler(swept(FINITE_STRAIN, study).empty(axes | {"reference": study.further_references}))
    _planes(study, finite)
    for one in study.references:
        labels = study.labels(one)
        for kind in study.further_references:
            result = _finite_reference(folder, one, kind)
            known = ("message", "displacement", "error_estimate")
            values = {f"reference_{name}": result[name] for name in known if name in result}
            finite.put(values, reference=kind, **labels)
    _compare(finite.data.deformation_error, displacement, finite.data.reference_displacement)
    return finite.data


def _finite_reference(folder, one, kind, fields=()):
    return store.read_one(folder / "references", plan.finite_key(one, kind), fields)


def _compare(error, network, reference):
    """Write deformation errors where both displacements are known: often few cells."""
    network, reference = (array.transpose(*error.dims).values for array in xr.broadcast(network, reference))
    there = np.isfinite(network) & np.isfinite(reference)
    error.values[there] = deformation_error(network[there], reference[there])


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


def _fields(study, folder, axes):
    """Group of whole fields with meshes and references and, so far, no displacements of networks."""
    whole = plan.shown_scenes(study)
    scenes = [scene for scene in study.scenes if scene in whole]
    shown = {scene.mesh for scene in scenes}
    read = {mesh: stored.read(folder / "meshes", plan.stem(mesh)) for mesh in study.meshes if mesh in shown}
    meshes = [(mesh.labels, found.mesh) for mesh, found in read.items() if found]
    outlines = {one: _outline(study, folder, one) for one in dict.fromkeys(map(_reference_of, scenes))}
    fields = fields_on(fields_of(study), axes, meshes, [points for points, _ in outlines.values()])
    for scene in scenes:
        labels = study.labels(scene)
        fields.put({f"{OF_FIELDS}{name}": labels[name] for name in study.swept}, **labels)
    for one, (points, displacements) in outlines.items():
        labels = {"beam": one.beam.name, "material": one.material.name, "load": one.load}
        put_outline(fields, points, one.force * displacements, **labels)
    return fields


def fields_on(group, axes, meshes, outlines):
    """Group of whole fields with meshes, each at its labels."""
    cells = [cells_of(mesh) for _, mesh in meshes]
    lengths = {
        "particle": [len(mesh.points) for _, mesh in meshes],
        "spring": [len(mesh.edges) for _, mesh in meshes],
        "spring_end": [2],
        "cell": list(map(len, cells)),
        "cell_corner": [corners.shape[1] for corners in cells] or [3],
        "outline_point": list(map(len, outlines)),
    }
    found = Filler(group.empty(axes | {name: tuple(range(max(1, *each, 1))) for name, each in lengths.items()}))
    found.data.attrs["Conventions"] = "CF-1.11 UGRID-1.0"
    for (labels, mesh), corners in zip(meshes, cells):
        places = {"x": mesh.points[:, 0], "y": mesh.points[:, 1]}
        found.put(places | {"spring_nodes": mesh.edges, "cell_nodes": corners}, **labels)
    return found


def put_outline(fields, points, moved, **labels):
    """Write the outline of a reference at rest, and its displacements."""
    values = {"outline_x": points[:, 0], "outline_y": points[:, 1]}
    fields.put(values | {"reference_displacement_x": moved[:, 0], "reference_displacement_y": moved[:, 1]}, **labels)


def cells_of(mesh):
    """Corners of the cells of a mesh, -1 where a cell has fewer than another one, shape (n_cells, n_corners)."""
    cells = np.full((sum(map(len, mesh.cells.values())), max(mesh.cells)), NO_NODE)
    start = 0
    for count, corners in mesh.cells.items():
        cells[start : start + len(corners), :count] = corners
        start += len(corners)
    return cells


def _outline(study, folder, one):
    """Points of a reference on the outline of its beam, in order around it, and their displacements for 1 N."""
    result = _reference(study, folder, one, ["x", "y", "displacements"])
    if "x" not in result:
        return np.zeros((0, 2)), np.zeros((0, 2))
    return outline(result["x"], result["y"], result["displacements"])

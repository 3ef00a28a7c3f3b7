"""Stage `collect`: compare what was solved with its references and gather everything in one dataset."""

import json
import platform
import subprocess
import sys
from collections import defaultdict
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from .. import __version__
from ..jobs import atomic, bundles, store
from ..kinds.scenes import stored_reference as references
from ..mesh import read_mesh
from ..output import dataset
from ..problem.boundary import FACE_POSITIONS
from ..problem.compare import band, deformation_error
from ..problem.loads import LOADS
from ..reference.field import outline
from ..reference.limits import objection
from ..springs.lattice import predicted_stiffness
from ..study import load_study
from . import plan as tasks

SOFTWARE = (
    "cvxopt",
    "h5netcdf",
    "h5py",
    "meshio",
    "netgen-mesher",
    "numba",
    "numpy",
    "pyamg",
    "scikit-fem",
    "scipy",
    "snakemake",
    "xarray",
)


COPIED = (
    "displacement",
    "stiffness",
    "message",
    "iterations",
    "residual",
    "negative_pivots",
    "field_error",
    "definition_seconds",
    "definition_evaluations",
    "spring_ratio",
    "load_share",
    "solver",
)
"""What of a scene's result goes into the dataset as it is."""


def run(config, folder, output):
    """Build the dataset of a study from its stored results.

    Parameters
    ----------
    config : str or Path
        YAML file of the study.
    folder : str or Path
        Where the study's results are.
    output : str or Path
        NetCDF file to write.
    """
    study, folder = load_study(config), Path(folder)
    axes = study.axes | {"stiffness_ratio": study.stiffness_ratios}
    root = _Filler(dataset.empty(axes, dataset.ROOT_VARIABLES))
    _meshes(study, folder, root)
    displacements, objections = _references(study, folder, root)
    pressed = any(LOADS[scene.load].kind == "face" for scene in study.scenes)
    block = _block(study, folder, axes) if pressed else None
    fields = _fields(study, folder, axes) if "deformed" in study.outputs else None
    _scenes(study, folder, root, block, fields, objections)
    for material in {scene.material for scene in study.scenes}:
        values = {
            "material_young_modulus": material.young_modulus,
            "material_poisson_ratio": material.poisson_ratio,
            "material_density": np.nan if material.density is None else material.density,
        }
        root.put(values, material=material.name)
    for beam in {scene.mesh.beam for scene in study.scenes}:
        root.put({"beam_length": beam.length, "beam_height": beam.height}, beam=beam.name)
    _printed(study, root)
    data = root.data
    data["deformation_error"].values = deformation_error(
        *xr.broadcast(data.displacement, data.reference_displacement.broadcast_like(data.displacement))
    )
    groups = {"/": data}
    if study.curves:
        groups["/sensitivity"] = _sensitivity(study, folder, displacements, axes)
    if study.moduli:
        groups["/moduli"] = _moduli(study, folder, axes)
    if study.further_references:
        groups["/finite_strain"] = _finite_strain(study, folder, axes, data.displacement)
    if pressed:
        groups["/block"] = _with_face_error(block.data)
    if study.laying:
        groups["/laying"] = _laying(study, folder, axes)
    if study.stability:
        groups["/stability"] = _stability(study, folder, axes)
    if study.benchmark:
        groups["/benchmark"] = _benchmark(study, folder, axes)
    if fields:
        groups["/fields"] = fields.data
    dataset.write(output, groups, _attributes(study, config))
    print(*_objected(data), sep="", end="")
    bundles.remember(folder.parent / tasks.COSTS, bundles.work_of(folder))


def _objected(root):
    """Lines on scenes whose errors are missing or not the networks' own."""
    asked, there = root.status != 0, root.reference_displacement.notnull()
    for scenes, what in (
        (asked & ~there, "have no reference and no error"),
        (asked & there & (root.reference_applies == 0), "are beyond the reference of small strain"),
    ):
        if scenes.any():
            yield f"{int(scenes.sum())} of {int(asked.sum())} scenes {what}: `message` says why\n"


class _Filler:
    """Writes single cells of a dataset by label."""

    def __init__(self, data):
        self.data = data
        # Looking an array up costs more than writing a cell of it.
        self._arrays = {name: (array.dims, array.values) for name, array in data.data_vars.items()}
        self._places = {name: {label: i for i, label in enumerate(data[name].values.tolist())} for name in data.coords}

    def put(self, values, **labels):
        for name, value in values.items():
            dimensions, array = self._arrays[name]
            array[tuple(self._places[name][labels[name]] for name in dimensions if name in labels)] = value

    def put_rows(self, values, **labels):
        """Write rows that may be shorter than the last dimension."""
        for name, row in values.items():
            dimensions, array = self._arrays[name]
            place = tuple(self._places[dimension][labels[dimension]] for dimension in dimensions[:-1])
            array[place][: len(row)] = row


def _mesh_labels(mesh):
    return {"beam": mesh.beam.name, "mesh_type": mesh.mesh_type, "mesh_size": mesh.mesh_size}


def _calibration(folder):
    """Calibrated stiffnesses by group; none where no scene is calibrated."""
    path = folder / "done" / "calibrate.json"
    return atomic.read_json(path) if path.exists() else {}


def _meshes(study, folder, root):
    for mesh in study.meshes:
        notes = atomic.read_json(folder / "meshes" / f"{mesh.name}.json")
        del notes["key"]
        root.put(notes, **_mesh_labels(mesh))


def _references(study, folder, root):
    """Displacement of each reference by (beam, material, load), and by these and kinematics objections to it."""
    displacements, objections = {}, {}
    for asked in study.references:
        result = _reference(folder, asked)
        labels = {"beam": asked.beam.name, "material": asked.material.name, "load": asked.load}
        place = tuple(labels.values())
        for kinematics in study.axes["kinematics"]:
            objections[*place, kinematics] = found = objection(result, asked.force, kinematics)
            root.put({"reference_applies": not found}, kinematics=kinematics, **labels)
        values = {
            "force": asked.force,
            "reference_seconds": result["seconds"],
            "reference_message": objection(result, asked.force, "nonlinear"),
        }
        if "displacement" in result:
            displacements[place] = asked.force * result["displacement"]
            values |= {
                "reference_displacement": displacements[place],
                "reference_error_estimate": result["error_estimate"],
                "reference_rotation": abs(asked.force) * result["rotation"],
                "reference_strain": abs(asked.force) * result["strain"],
            }
        root.put(values, **labels)
    return displacements, objections


def _reference(folder, asked, fields=()):
    reference = tasks.reference_of(asked.beam, asked.material, asked.load)
    return references.read(folder / "references", reference, fields)


def _scenes(study, folder, root, block, fields, objections):
    """Results of the scenes, each mesh's read once, into the root and, where they are there, its groups."""
    calibration = _calibration(folder)
    arrays = ["face_profile"] * (block is not None) + ["displacements"] * (fields is not None)
    for mesh, scenes in _by_mesh(study.scenes).items():
        names = [tasks.solved_key(study, scene, calibration) for scene in scenes]
        results = store.read(folder / "solutions" / f"{mesh.name}.h5", set(names), arrays)
        for scene, name in zip(scenes, names):
            result = results[name]
            values = {"status": dataset.STATUS.index(result["status"]), "solve_seconds": result["seconds"]}
            values |= {label: result[label] for label in COPIED if label in result}
            why = objections[mesh.beam.name, scene.material.name, scene.load, scene.kinematics]
            if why and result["status"] in ("solved", "unstable"):
                values["message"] = "; ".join(filter(None, (values.get("message"), why)))
            labels = {"material": scene.material.name, "load": scene.load, "definition": scene.definition}
            labels |= {"kinematics": scene.kinematics, **_mesh_labels(mesh)}
            root.put(values, **labels)
            if LOADS[scene.load].kind == "face":
                block.put({new: result[old] for old, new in FACE.items() if old in result}, **labels)
            if "displacements" in result:
                x, y = result["displacements"].T
                fields.put_rows({"displacement_x": x, "displacement_y": y}, **labels)


def _printed(study, root):
    for cell in study.printed:
        labels = {name: getattr(cell, name) for name in dataset.CELL}
        try:
            root.put(
                {
                    "paper_displacement": cell.displacement,
                    "paper_reference_displacement": cell.reference_displacement,
                    "paper_deformation_error": cell.deformation_error,
                    "paper_stiffness": cell.stiffness,
                    "paper_table": cell.table,
                    "paper_remark": cell.remark,
                },
                **labels,
            )
        except KeyError:
            continue  # a cell that this study does not ask for


def _sensitivity(study, folder, displacements, axes):
    curves = _Filler(dataset.empty(axes, dataset.SENSITIVITY_VARIABLES))
    for mesh, members in _by_mesh(study.curves).items():
        names = [tasks.curve_key(study, curve) for curve in members]
        results = store.read(folder / "curves" / f"{mesh.name}.h5", names, ["displacement", "stable"])
        for curve, name in zip(members, names):
            result, stiffness = results[name], np.array(tasks.stiffnesses(study, curve))
            displacement = result["displacement"]
            reference = displacements.get((mesh.beam.name, curve.material.name, curve.load), np.nan)
            solved, unstable, missing = map(dataset.STATUS.index, ("solved", "unstable", "not_converged"))
            status = np.where(np.isnan(displacement), missing, np.where(result["stable"], solved, unstable))
            curves.put(
                {
                    "stiffness": stiffness,
                    "displacement": displacement,
                    "deformation_error": deformation_error(displacement, reference),
                    "status": status,
                    "message": result["message"],
                    "best_stiffness": result["best_stiffness"],
                    "best_stiffness_status": dataset.STATUS.index(result["best_status"]),
                    "best_stiffness_message": result["best_message"],
                    "predicted_stiffness": predicted_stiffness(curve.material, mesh.beam, mesh.mesh_size, curve.load),
                    "curve_seconds": result["seconds"],
                },
                material=curve.material.name,
                load=curve.load,
                kinematics=curve.kinematics,
                **_mesh_labels(mesh),
            )
    return curves.data


def _moduli(study, folder, axes):
    moduli = _Filler(dataset.empty(axes, dataset.MODULI_VARIABLES))
    box = {"patch_length": study.patch.length, "patch_height": study.patch.height}
    moduli.data.attrs = {"comment": "of the mesh that a beam of this length and height [m] gets"} | box
    patches = defaultdict(dict)
    for one in study.moduli:
        patches[tasks.patch_name(one)][tasks.moduli_key(study, one)] = one
    for patch, names in patches.items():
        for name, result in store.read(folder / "moduli" / f"{patch}.h5", names).items():
            one = names[name]
            values = result | {"status": dataset.STATUS.index(result["status"])}
            labels = {"mesh_type": one.mesh_type, "mesh_size": one.mesh_size, "poisson_ratio": one.poisson_ratio}
            moduli.put(values, definition=one.definition, **labels)
    return moduli.data


def _block(study, folder, axes):
    """Group of pressed faces with the references of all kinds; scenes are still to come."""
    kinds = (SMALL_STRAIN, *study.further_references)
    block = _Filler(
        dataset.empty(axes | {"reference": kinds, "face_position": tuple(FACE_POSITIONS)}, dataset.BLOCK_VARIABLES)
    )
    for asked in study.references:
        if LOADS[asked.load].kind != "face":
            continue
        labels = {"beam": asked.beam.name, "material": asked.material.name, "load": asked.load}
        for kind in kinds:
            block.put(_face_reference(folder, asked, kind), reference=kind, **labels)
    return block


def _finite_strain(study, folder, axes, displacement):
    """Group of references at finite strain, and the networks' errors against them."""
    finite = _Filler(dataset.empty(axes | {"reference": study.further_references}, dataset.FINITE_STRAIN_VARIABLES))
    for asked in study.references:
        labels = {"beam": asked.beam.name, "material": asked.material.name, "load": asked.load}
        for kind in study.further_references:
            result = _finite_reference(folder, asked, kind)
            values = {"reference_message": result["message"]}
            if "displacement" in result:
                values["reference_displacement"] = result["displacement"]
                values["reference_error_estimate"] = result["error_estimate"]
            finite.put(values, reference=kind, **labels)
    pairs = xr.broadcast(displacement, finite.data.reference_displacement)
    error = finite.data["deformation_error"]
    error.values = deformation_error(*(array.transpose(*error.dims) for array in pairs))
    return finite.data


def _finite_reference(folder, asked, kind, fields=()):
    name = tasks.finite_key(asked, kind)
    return store.read(folder / "references" / f"{name}.h5", [name], fields)[name]


def _with_face_error(data):
    pairs = xr.broadcast(data.face_displacement, data.reference_face_displacement)
    data["face_error"].values = deformation_error(*(array.transpose(*data.face_error.dims) for array in pairs))
    return data


SMALL_STRAIN = "small-strain-plane-stress"
"""Name of the reference that all studies have."""

FACE = {
    "displacement": "face_displacement",
    "face_mean": "face_mean_displacement",
    "face_profile": "face_profile",
    "last_displacement": "last_face_displacement",
}
"""Values of a pressed face by their names in a result."""


def _face_reference(folder, asked, kind):
    """Middle, mean and profile of a pressed face of a reference."""
    if kind == SMALL_STRAIN:
        result, scale = _reference(folder, asked, ["x", "displacements"]), asked.force
        if "x" in result:
            result |= {"positions": result["x"] / asked.beam.length, "profile": result["displacements"][:, -1, 1]}
    else:
        result, scale = _finite_reference(folder, asked, kind, ["positions", "profile"]), 1.0
    values = {"reference_message": result["message"]}
    if "displacement" in result:
        values |= {
            "reference_face_displacement": scale * result["displacement"],
            "reference_face_mean_displacement": scale * result["mean_displacement"],
            "reference_face_profile": scale * CubicSpline(result["positions"], result["profile"])(FACE_POSITIONS),
            "reference_error_estimate": result["error_estimate"],
        }
    return values


def _laying(study, folder, axes):
    """Laid strips, and those of finite elements that they are compared with."""
    every = {
        one: store.read(folder / "laying" / f"{tasks.laying_key(one)}.h5", [tasks.laying_key(one)], ["outline"])
        for one in (*study.laying, *study.laying_references)
    }
    results = {one: next(iter(found.values())) for one, found in every.items()}
    points = max(len(result.get("outline", ())) for result in results.values())
    axes = axes | {"outline_point": tuple(range(points)), "corner": tuple(range(4))}
    laid = _Filler(dataset.empty(axes, dataset.LAYING_VARIABLES))
    for one in study.laying:
        result = results[one]
        labels = {"definition": one.definition, "mesh_size": one.mesh_size}
        labels |= {"loading": one.loading, "friction": one.friction}
        values = {"status": dataset.STATUS.index(result["status"]), "message": result["message"]}
        if "area" in result:
            values |= {
                "load_share": result["load_share"],
                "iterations": result["iterations"],
                "laying_seconds": result["seconds"],
                "skipped": result["skipped"],
                "penetration": result["penetration"],
            }
        if result["status"] == "solved":
            values |= {
                "area_under_strip": result["area"],
                "area_error": result["area"] / one.trapezoid.area - 1,
                "elongation": result["elongation"],
                "contact_force_error": result["force_error"],
            }
        laid.put(values, **labels)
        if "outline" in result:
            laid.put_rows({"strip_x": result["outline"][:, 0], "strip_y": result["outline"][:, 1]}, **labels)
    references = defaultdict(list)
    for one in study.laying_references:
        references[one.loading, one.friction].append(results[one])
    for (loading, friction), meshes in references.items():
        result, labels = meshes[0], {"loading": loading, "friction": friction}
        if result["status"] == "solved":
            values = {}
            for name in ("area", "elongation"):
                values[f"reference_{name}"] = result[name]
                others = [mesh[name] if mesh["status"] == "solved" else np.nan for mesh in meshes]
                values[f"reference_{name}_error_estimate"] = band(others)
            laid.put(values, **labels)
            laid.put_rows({"reference_x": result["outline"][:, 0], "reference_y": result["outline"][:, 1]}, **labels)
    corners = np.array(study.laying[0].trapezoid.corners)
    laid.put({"trapezoid_x": corners[:, 0], "trapezoid_y": corners[:, 1]})
    return laid.data


def _stability(study, folder, axes):
    """Results of the experiments on stability."""
    names = tuple(dict.fromkeys(one.name for one in study.stability))
    variables = dataset.STABILITY_VARIABLES
    results = {}
    for one in study.stability:
        key = tasks.experiment_key(one)
        results[one] = store.read(folder / "stability" / f"{key}.h5", [key], variables)[key]
    there = {name for result in results.values() for name in result} | {"experiment_seconds", "experiment_message"}
    asked = {name: row for name, row in variables.items() if name in there}
    data = dataset.empty(axes | {"experiment": names}, asked)
    for one, result in results.items():
        place = {"experiment": one.name, "definition": one.definition, "mesh_size": list(one.mesh_sizes)}
        result["experiment_seconds"] = result.pop("seconds", np.nan)
        result["experiment_message"] = result.pop("failure", "")
        for name, values in result.items():
            array = data[name]
            array.loc[{dimension: place[dimension] for dimension in array.dims if dimension in place}] = values
    return data


def _benchmark(study, folder, axes):
    """Errors and seconds of the scenes of the benchmark."""
    data = dataset.empty(axes, dataset.BENCHMARK_VARIABLES)
    for race in study.benchmark:
        data.attrs["second_beam"] = race.second_beam.name if race.second_beam else ""
        key = tasks.race_key(race)
        result = store.read(folder / "benchmark" / f"{key}.h5", [key], dataset.BENCHMARK_VARIABLES)[key]
        place = {"scene": race.name, "mesh_size": list(race.mesh_sizes)}
        for name, values in result.items():
            array = data[name]
            array.loc[{dimension: place[dimension] for dimension in array.dims if dimension in place}] = values
    return data


def _fields(study, folder, axes):
    """Group of whole fields with the meshes and the references' outlines; displacements are still to come."""
    shown = tasks.shown_meshes(study)
    meshes = {mesh: read_mesh(folder / "meshes" / f"{mesh.name}.vtu") for mesh in study.meshes if mesh in shown}
    outlines = {asked: _outline(folder, asked) for asked in study.references}
    lengths = {
        "particle": max(len(mesh.points) for mesh in meshes.values()),
        "spring": max(len(mesh.edges) for mesh in meshes.values()),
        "outline_point": max(len(points) for points, _ in outlines.values()),
    }
    numbers = {name: tuple(range(length)) for name, length in lengths.items()}
    fields = _Filler(dataset.empty(axes | numbers, dataset.FIELD_VARIABLES))
    for spec, mesh in meshes.items():
        labels = _mesh_labels(spec)
        fields.put_rows({"x": mesh.points[:, 0], "y": mesh.points[:, 1]}, **labels)
        fields.put_rows({"spring_first": mesh.edges[:, 0], "spring_second": mesh.edges[:, 1]}, **labels)
    for asked in study.references:
        points, displacements = outlines[asked]
        moved = asked.force * displacements
        beam, load = {"beam": asked.beam.name}, {"material": asked.material.name, "load": asked.load}
        fields.put_rows({"outline_x": points[:, 0], "outline_y": points[:, 1]}, **beam)
        fields.put_rows(
            {"reference_displacement_x": moved[:, 0], "reference_displacement_y": moved[:, 1]}, **beam, **load
        )
    return fields


def _outline(folder, asked):
    """Points of a reference on the outline of its beam, in order around it, and their displacements for 1 N."""
    result = _reference(folder, asked, ["x", "y", "displacements"])
    if "x" not in result:
        return np.zeros((0, 2)), np.zeros((0, 2))
    return outline(result["x"], result["y"], result["displacements"])


def _by_mesh(items):
    groups = defaultdict(list)
    for item in items:
        groups[item.mesh].append(item)
    return groups


def _attributes(study, config):
    software = {name: tasks.installed(name) for name in SOFTWARE} | {"python": platform.python_version()}
    return {
        "title": study.title,
        "Conventions": "CF-1.11",
        "study": study.name,
        "config": study.text,
        "springtune_version": __version__,
        "git_commit": _git_commit(Path(config).parent),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "software": json.dumps(software, sort_keys=True),
        "host": platform.node(),
    }


def _git_commit(folder):
    """Commit of the checkout that holds the study, with "+changes" where files differ from it; empty outside of git."""
    try:
        answer = subprocess.run(
            ["git", "describe", "--always", "--abbrev=40", "--dirty=+changes", "--exclude=*"],
            cwd=folder, capture_output=True, text=True, check=True,
        )  # fmt: skip
    except (OSError, subprocess.CalledProcessError):
        return ""
    return answer.stdout.strip()


if __name__ == "__main__":
    run(*sys.argv[1:])

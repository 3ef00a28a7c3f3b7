"""From a study to the tasks of its stages: what each Snakemake job is to do, written to files it can watch.

Scenes are put together in bundles of meshes of about equal cost, since one process a scene would be all start-up. The
file of a bundle changes only when its tasks do, so Snakemake reruns a job only when it has something to look at; a job
then computes only results that are not stored yet.
"""

from dataclasses import asdict
from functools import cache
from importlib.metadata import version
from pathlib import Path

from . import files
from .code import digest

BUNDLE_SECONDS = 4.0
"""Work that a bundle holds: some ten times the start-up of a job."""

SECONDS_PER_PARTICLE = 2e-4
"""Rough cost of all scenes and curves of a mesh; it balances bundles and decides nothing else."""


def write_tasks(study, folder, cores):
    """Write the task files of a study under ``folder/tasks``, those whose content changed.

    Parameters
    ----------
    study : Study
    folder : Path
        Where the study's results go.
    cores : int
        Bundles are made at least for so many cores.

    Returns
    -------
    list of str
        Labels of the bundles.
    """
    bundles = _bundles(study, cores)
    tasks = {"reference": _reference(study, folder), "calibrate": _calibrate(study, folder)}
    for label, meshes in bundles.items():
        for stage, made in (("mesh", _mesh), ("sensitivity", _sensitivity), ("solve", _solve)):
            tasks[f"{stage}_{label}"] = made(study, folder, meshes)
    for name, content in tasks.items():
        path = folder / "tasks" / f"{name}.json"
        if not path.exists() or files.read_json(path) != content:
            files.write_json(path, content)
        done = folder / "done" / f"{name}.json"
        # Snakemake guards what is declared; results are not, so a missing one makes the job run again.
        if done.exists() and not all(Path(file).exists() for file in _products(name, content)):
            done.unlink()
    return list(bundles)


def _bundles(study, cores):
    """Meshes of each bundle: the costliest first, each to the bundle with least to do."""
    costs = {}
    for mesh in study.meshes:
        particles = mesh.beam.length * mesh.beam.height / (0.866 * mesh.mesh_size**2)
        costs[mesh] = 0.05 + SECONDS_PER_PARTICLE * particles
    count = max(cores, round(sum(costs.values()) / BUNDLE_SECONDS))
    count = min(count, len(costs))
    bundles, loads = [[] for _ in range(count)], [0.0] * count
    for mesh in sorted(costs, key=lambda mesh: (-costs[mesh], mesh.name)):
        least = loads.index(min(loads))
        bundles[least].append(mesh)
        loads[least] += costs[mesh]
    return {str(number): bundle for number, bundle in enumerate(bundles)}


@cache
def _stage_key(stage, *packages):
    return [digest(stage), *(f"{package} {version(package)}" for package in packages)]


def mesh_key(mesh):
    """Key of a mesh: its parameters, the code that makes it and the library behind it."""
    packages = ["netgen-mesher"] if mesh.mesh_type == "free" else []
    parameters = [mesh.beam.length, mesh.beam.height, mesh.mesh_type, mesh.mesh_size]
    return files.key(parameters, _stage_key("mesh", "numpy", *packages))


def reference_key(beam, material):
    """Key of a reference: one a beam and material, all loads scale it."""
    return files.key(_beam(beam), _material(material), _stage_key("reference", "numpy", "scipy", "scikit-fem"))


def curve_key(study, curve):
    """Key of a sensitivity curve."""
    parameters = [mesh_key(curve.mesh), curve.force, curve.kinematics, stiffnesses(study, curve)]
    return files.key(parameters, _stage_key("sensitivity", "numpy", "scipy"))


def scene_key(study, scene):
    """Key of a scene; a calibrated one's result is stored under a key that holds the calibrated stiffness, too."""
    parameters = [mesh_key(scene.mesh), scene.mesh.beam.thickness, _material(scene.material)]
    parameters += [scene.force, scene.definition, scene.kinematics, _given_stiffness(study, scene)]
    return files.key(parameters, _stage_key("solve", "numpy", "scipy"))


def solved_key(study, scene, calibration):
    """Key under which a scene's result is stored, given the calibrated stiffnesses by group."""
    name = scene_key(study, scene)
    if scene.definition == "calibrated":
        return files.key(name, calibration[calibration_name(scene)]["stiffness"])
    return name


def stiffnesses(study, curve):
    """Stiffnesses of a sensitivity curve [N/m], ascending."""
    membrane = curve.material.young_modulus * curve.mesh.beam.thickness
    return [ratio * membrane for ratio in study.stiffness_ratios]


def reference_name(beam, material):
    """File stem of a reference."""
    return f"{beam.name}_{material.name}"


def calibration_name(scene):
    """Name of the group of curves that calibrates a scene."""
    return f"{scene.mesh.mesh_type}_{scene.material.name}_{scene.kinematics}"


def _given_stiffness(study, scene):
    return study.stiffness_table[scene.mesh.mesh_type, scene.material.name] if scene.definition == "paper" else None


def _beam(beam):
    return asdict(beam) | {"name": ""}  # a new label is not a new beam


def _material(material):
    return asdict(material) | {"name": ""}


def _mesh(study, folder, meshes):
    return {
        "folder": str(folder / "meshes"),
        "meshes": [
            {
                "name": mesh.name,
                "key": mesh_key(mesh),
                "mesh_type": mesh.mesh_type,
                "mesh_size": mesh.mesh_size,
                "length": mesh.beam.length,
                "height": mesh.beam.height,
            }
            for mesh in meshes
        ],
    }


def _reference(study, folder):
    pairs = dict.fromkeys((reference.beam, reference.material) for reference in study.references)
    return {
        "folder": str(folder / "references"),
        "references": [
            {
                "name": reference_name(beam, material),
                "key": reference_key(beam, material),
                "beam": _beam(beam),
                "material": _material(material),
            }
            for beam, material in pairs
        ],
    }


def _curve(study, curve):
    return {
        "key": curve_key(study, curve),
        "force": curve.force,
        "kinematics": curve.kinematics,
        "stiffnesses": stiffnesses(study, curve),
    }


def _sensitivity(study, folder, meshes):
    families = [
        {
            "name": mesh.name,
            "length": mesh.beam.length,
            "curves": [_curve(study, curve) for curve in study.curves if curve.mesh == mesh],
        }
        for mesh in meshes
    ]
    return {
        "folder": str(folder / "curves"),
        "meshes": str(folder / "meshes"),
        "families": [family for family in families if family["curves"]],
    }


def _solve(study, folder, meshes):
    families = [
        {
            "name": mesh.name,
            "length": mesh.beam.length,
            "thickness": mesh.beam.thickness,
            "scenes": [_scene(study, scene) for scene in study.scenes if scene.mesh == mesh],
        }
        for mesh in meshes
    ]
    return {"folder": str(folder / "solutions"), "meshes": str(folder / "meshes"), "families": families}


def _scene(study, scene):
    task = {
        "key": scene_key(study, scene),
        "material": _material(scene.material),
        "force": scene.force,
        "definition": scene.definition,
        "kinematics": scene.kinematics,
    }
    stiffness = _given_stiffness(study, scene)
    if stiffness is not None:
        task["stiffness"] = stiffness
    if scene.definition == "calibrated":
        task["calibration"] = calibration_name(scene)
    return task


def _calibrate(study, folder):
    groups = {}
    for scene in study.scenes:
        if scene.definition == "calibrated":
            name = calibration_name(scene)
            groups[name] = (scene.mesh.mesh_type, scene.material, scene.kinematics)
    tasks = []
    for name, (mesh_type, material, kinematics) in sorted(groups.items()):
        members = [
            {
                "mesh": curve.mesh.name,
                "reference": reference_name(curve.mesh.beam, material),
                "reference_key": reference_key(curve.mesh.beam, material),
                **_curve(study, curve),
            }
            for curve in study.curves
            if (curve.mesh.beam.name, curve.load) == study.calibration
            and (curve.mesh.mesh_type, curve.material, curve.kinematics) == (mesh_type, material, kinematics)
        ]
        tasks.append({"name": name, "members": members})
    return {"curves": str(folder / "curves"), "references": str(folder / "references"), "groups": tasks}


def _products(name, content):
    """Files that a job makes besides those it declares."""
    stage, folder = name.partition("_")[0], Path(content.get("folder", ""))
    if stage == "mesh":
        return [folder / f"{mesh['name']}{ending}" for mesh in content["meshes"] for ending in (".vtu", ".json")]
    if stage == "reference":
        return [folder / f"{reference['name']}.h5" for reference in content["references"]]
    if stage in ("sensitivity", "solve"):
        return [folder / f"{family['name']}.h5" for family in content["families"]]
    return []

"""From a study to the tasks of its stages: what each Snakemake job is to do, written to files it can watch.

Scenes are put together in bundles of meshes of about equal cost, since one process a scene would be all start-up. The
file of a bundle changes only when its tasks do, so Snakemake reruns a job only when it has something to look at; a job
then computes only results that are not stored yet.
"""

import hashlib
from collections import defaultdict
from dataclasses import asdict
from functools import cache, lru_cache
from importlib.metadata import version
from pathlib import Path

from ..loads import LOADS
from ..mesh import MESH_TYPES
from ..study import MeshSpec
from . import files
from .code import definition_digest, digest

BUNDLE_SECONDS = 8.0
"""Work that a bundle holds: some ten times the start-up of a job and the scheduler's share."""

SCENE_SECONDS = {"linear": (1.5e-3, 2e-6), "nonlinear": (3e-3, 2e-5), "curve": (5e-3, 4e-5), "moduli": (4e-3, 1e-5)}
"""Rough cost of a scene, curve or moduli, in any case and per particle; it balances bundles and nothing else."""

LAYING_SECONDS = 2.0
"""Rough cost of laying a strip on a mesh of 1 mm; it grows with the cube of its fineness."""

EXPERIMENT_SECONDS = {
    "limits": 10.0,
    "maps": 8.0,
    "drift": 9.0,
    "rest": 2.0,
    "sizes": 3.0,
    "strains": 2.0,
    "buckling": 2.0,
}
"""Rough cost of the experiments on stability that take more than half a second."""

SEARCH_SECONDS = {"adjoint": (0.5, 2e-3), "annealed": (0.1, 2e-3), "evolved": (0.1, 2e-3)}
"""Rough cost of definitions that search, which they take besides."""


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
    dict of str to list of str
        Labels of the bundles by stage: ``solve`` (also of `mesh`), ``sensitivity``, ``moduli``, ``laying`` and
        ``stability``.
    """
    bundles = _bundles(study, cores)
    tasks = {"reference": _reference(study, folder), "calibrate": _calibrate(study, folder)}
    scenes, curves = _by_mesh(study.scenes), _by_mesh(study.curves)
    for label, meshes in bundles["solve"].items():
        tasks[f"mesh_{label}"] = _mesh(folder, meshes)
        tasks[f"solve_{label}"] = _solve(study, folder, meshes, scenes)
    for label in bundles["sensitivity"]:
        tasks[f"sensitivity_{label}"] = _sensitivity(study, folder, bundles["solve"][label], curves)
    for label, strips in bundles["laying"].items():
        tasks[f"laying_{label}"] = {"folder": str(folder / "laying"), "strips": [_laid(one) for one in strips]}
    for label, experiments in bundles["stability"].items():
        folder_of = str(folder / "stability")
        tasks[f"stability_{label}"] = {"folder": folder_of, "experiments": [_experiment(one) for one in experiments]}
    for race in study.benchmark:
        content = {"folder": str(folder / "benchmark"), "races": [_race(race, race is study.benchmark[0])]}
        tasks[f"benchmark_{race.name}"] = content
    for label, patches in bundles["moduli"].items():
        tasks[f"moduli_{label}"] = {"folder": str(folder / "moduli"), "patches": patches}
    for name, content in tasks.items():
        path = folder / "tasks" / f"{name}.json"
        if not path.exists() or files.read_json(path) != content:
            files.write_json(path, content)
        done = folder / "done" / f"{name}.json"
        # Snakemake guards what is declared; results are not, so a missing one makes the job run again.
        if done.exists() and not all(Path(file).exists() for file in _products(name, content)):
            done.unlink()
    return {stage: list(content) for stage, content in bundles.items()}


def _bundles(study, cores):
    """Meshes of each bundle by its label for the stages `solve` and `sensitivity`, and patches for `moduli`."""
    costs = {mesh: 0.0 for mesh in study.meshes}
    for scene in study.scenes:
        costs[scene.mesh] += _cost(scene.kinematics, scene.mesh, scene.definition)
    curved = {curve.mesh for curve in study.curves}
    for curve in study.curves:
        costs[curve.mesh] += _cost("curve", curve.mesh)
    meshes = _shared_out(costs, lambda mesh: mesh.name, cores)
    patches = _patches(study)
    costs = {
        name: sum(_cost("moduli", patch_mesh(study, one), one.definition) for one in patch["members"])
        for name, patch in patches.items()
    }
    for patch in patches.values():
        del patch["members"]
    strips = {one: LAYING_SECONDS * (1e-3 / one.mesh_size) ** 3 for one in (*study.laying, *study.laying_references)}
    experiments = {one: EXPERIMENT_SECONDS.get(one.name, 0.5) for one in study.stability}
    return {
        "laying": _shared_out(strips, str, cores),
        "stability": _shared_out(experiments, str, cores),
        "benchmark": {race.name: [race] for race in study.benchmark},
        "solve": meshes,
        "sensitivity": [label for label, bundle in meshes.items() if curved & set(bundle)],
        "moduli": {
            label: [patches[name] for name in bundle] for label, bundle in _shared_out(costs, str, cores).items()
        },
    }


def _cost(kind, mesh, definition=None):
    """Seconds that a scene, a curve or moduli take, roughly."""
    particles = mesh.beam.length * mesh.beam.height / (0.866 * mesh.mesh_size**2)
    parts = (SCENE_SECONDS[kind], SEARCH_SECONDS.get(definition, (0.0, 0.0)))
    return sum(always + each * particles for always, each in parts)


def _shared_out(costs, name, cores):
    """Bundles of about equal cost: the costliest first, each to the bundle with least to do."""
    if not costs:
        return {}
    count = min(max(cores, round(sum(costs.values()) / BUNDLE_SECONDS)), len(costs))
    bundles, loads = [[] for _ in range(count)], [0.0] * count
    for item in sorted(costs, key=lambda item: (-costs[item], name(item))):
        least = loads.index(min(loads))
        bundles[least].append(item)
        loads[least] += costs[item]
    return {str(number): bundle for number, bundle in enumerate(bundles)}


@cache
def _stage_key(stage, *packages):
    return [digest(stage), *(f"{package} {version(package)}" for package in packages)]


@cache
def mesh_key(mesh):
    """Key of a mesh: its parameters or its file, the code that makes it and the library behind it."""
    packages = {"free": ["netgen-mesher"]}.get(mesh.mesh_type, []) if mesh.file is None else ["meshio"]
    return files.key(_mesh_source(mesh), _stage_key("mesh", "numpy", *packages))


def _mesh_source(mesh):
    """What a mesh is made from."""
    source = {"length": mesh.beam.length, "height": mesh.beam.height}
    if mesh.file is None:
        return source | {"mesh_type": mesh.mesh_type, "mesh_size": mesh.mesh_size}
    content = hashlib.sha256(mesh.file.read_bytes()).hexdigest()
    return source | {"file": str(mesh.file), "unit": mesh.unit, "content": content}


@cache
def reference_key(beam, material, load):
    """Key of a reference: one a beam, material and kind of load, which loads of that kind scale."""
    code = _stage_key("reference", "numpy", "scipy", "scikit-fem")
    return files.key(_beam(beam), _material(material), LOADS[load].kind, code)


def finite_key(reference, kind):
    """Key of a reference at finite strain, which no load scales."""
    parameters = [_beam(reference.beam), _material(reference.material), reference.force, kind]
    code = _stage_key("reference", "numpy", "scipy", "scikit-fem")
    return files.key(parameters, LOADS[reference.load].follower, code)


def curve_key(study, curve):
    """Key of a sensitivity curve."""
    parameters = [mesh_key(curve.mesh), LOADS[curve.load].kind, curve.force, curve.kinematics]
    parameters.append(stiffnesses(study, curve))
    return files.key(parameters, _stage_key("sensitivity", "numpy", "scipy"))


def scene_key(study, scene):
    """Key of a scene; a calibrated one's result is stored under a key that holds the calibrated stiffness, too."""
    reference = reference_key(scene.mesh.beam, scene.material, scene.load)
    parameters = [mesh_key(scene.mesh), scene.mesh.beam.thickness, _material(scene.material), reference]
    parameters += [LOADS[scene.load].kind, _follows(scene), scene.force, scene.definition, scene.kinematics]
    parameters += [_given_stiffness(study, scene), _thickness_ratio(study, scene), scene.mesh in shown_meshes(study)]
    return files.key(parameters, _stage_key("solve", "numpy", "scipy"), definition_digest(scene.definition))


def moduli_key(study, one):
    """Key of the effective moduli of a definition on a patch."""
    mesh = patch_mesh(study, one)
    parameters = [_mesh_source(mesh), one.mesh_type, one.mesh_size, one.definition, one.poisson_ratio]
    code = _stage_key("moduli", "numpy", "scipy", "netgen-mesher"), definition_digest(one.definition)
    return files.key(parameters, *code)


def patch_mesh(study, one):
    """Mesh of a patch test: on the study's box, or the first mesh from a file."""
    if one.mesh_type in MESH_TYPES:
        return MeshSpec(study.patch, one.mesh_type, one.mesh_size)
    return next(mesh for label, mesh in study.mesh_files.items() if label[::2] == (one.mesh_type, one.mesh_size))


@lru_cache(maxsize=1)
def _shown_meshes(meshes):
    coarsest = {}
    for mesh in sorted(meshes, key=lambda mesh: -mesh.mesh_size):
        coarsest.setdefault((mesh.beam, mesh.mesh_type), mesh)
    return frozenset(coarsest.values())


def shown_meshes(study):
    """Meshes whose whole fields are kept, the coarsest of each beam and mesh type; none where none are drawn."""
    return _shown_meshes(study.meshes) if "deformed" in study.outputs else frozenset()


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
    """File stem of the references of a beam and material."""
    return f"{beam.name}_{material.name}"


def _thickness_ratio(study, scene):
    """Thickness over that of the beam that calibrates: stiffness is in proportion to it."""
    if scene.definition != "calibrated":
        return 1.0
    calibrating = next(curve.mesh.beam for curve in study.curves if curve.mesh.beam.name == study.calibration[0])
    return scene.mesh.beam.thickness / calibrating.thickness


def calibration_name(scene):
    """Name of the group of curves that calibrates a scene."""
    return f"{scene.mesh.mesh_type}_{scene.material.name}_{scene.kinematics}"


def _follows(scene):
    """Whether the force follows what it acts on: linear kinematics know no other place than that at rest."""
    return LOADS[scene.load].follower and scene.kinematics == "nonlinear"


def _given_stiffness(study, scene):
    return study.stiffness_table[scene.mesh.mesh_type, scene.material.name] if scene.definition == "paper" else None


def _beam(beam):
    return asdict(beam) | {"name": ""}  # a new label is not a new beam


def _material(material):
    known = asdict(material) | {"name": ""}
    del known["density"]  # statics depend on none
    return known


def _by_mesh(items):
    groups = defaultdict(list)
    for item in items:
        groups[item.mesh].append(item)
    return groups


def _mesh(folder, meshes):
    return {
        "folder": str(folder / "meshes"),
        "meshes": [{"name": mesh.name, "key": mesh_key(mesh)} | _mesh_source(mesh) for mesh in meshes],
    }


def _reference(study, folder):
    loads = {}
    for reference in study.references:
        loads.setdefault(reference_key(reference.beam, reference.material, reference.load), reference)
    finite = [
        {
            "name": reference_name(reference.beam, reference.material),
            "key": finite_key(reference, kind),
            "beam": _beam(reference.beam),
            "material": _material(reference.material),
            "force": reference.force,
            "plane": kind.rpartition("-")[2],
            "follower": LOADS[reference.load].follower,
        }
        for reference in study.references
        if LOADS[reference.load].kind == "face"
        for kind in study.further_references
    ]
    return {
        "finite": finite,
        "folder": str(folder / "references"),
        "references": [
            {
                "name": reference_name(reference.beam, reference.material),
                "key": key,
                "beam": _beam(reference.beam),
                "material": _material(reference.material),
                "kind": LOADS[reference.load].kind,
            }
            for key, reference in loads.items()
        ],
    }


def laying_key(one):
    """Key of a laid strip."""
    return files.key(asdict(one), _stage_key("laying", "numpy", "scipy"), definition_digest(one.definition))


def _laid(one):
    return {"key": laying_key(one)} | asdict(one)


def experiment_key(one):
    """Key of an experiment on stability."""
    parameters = asdict(one) | {"beam": _beam(one.beam), "material": asdict(one.material) | {"name": ""}}
    code = _stage_key("stability", "numpy", "scipy", "numba")
    return files.key(parameters, code, definition_digest(one.definition))


def _experiment(one):
    return {"key": experiment_key(one)} | asdict(one)


def race_key(race):
    """Key of a scene of the benchmark."""
    parameters = asdict(race) | {"beam": _beam(race.beam), "material": asdict(race.material) | {"name": ""}}
    code = _stage_key("benchmark", "numpy", "scipy", "numba", "scikit-fem", "netgen-mesher", "pyamg")
    definitions = sorted({method.partition("/")[0] for method in race.methods if "/" in method})
    return files.key(parameters, code, [definition_digest(name) for name in definitions])


def _race(race, first):
    return {"key": race_key(race), "curves": first} | asdict(race)


def patch_name(one):
    """File stem of the moduli of a patch."""
    return f"{one.mesh_type}_{1e3 * one.mesh_size:g}mm"


def _patches(study):
    """What is asked of each patch, by its name."""
    patches = {}
    for one in study.moduli:
        labels = {"name": patch_name(one), "mesh_type": one.mesh_type, "mesh_size": one.mesh_size}
        source = {"mesh": _mesh_source(patch_mesh(study, one))}
        patch = patches.setdefault(patch_name(one), labels | source | {"asked": [], "members": []})
        asked = {"key": moduli_key(study, one), "definition": one.definition, "poisson_ratio": one.poisson_ratio}
        patch["asked"].append(asked)
        patch["members"].append(one)
    return patches


def _curve(study, curve):
    return {
        "key": curve_key(study, curve),
        "kind": LOADS[curve.load].kind,
        "force": curve.force,
        "kinematics": curve.kinematics,
        "stiffnesses": stiffnesses(study, curve),
    }


def _sensitivity(study, folder, meshes, curves):
    families = [
        {"name": mesh.name, "curves": [_curve(study, curve) for curve in curves[mesh]]}
        for mesh in meshes
        if curves[mesh]
    ]
    return {"folder": str(folder / "curves"), "meshes": str(folder / "meshes"), "families": families}


def _solve(study, folder, meshes, scenes):
    families = [
        {
            "name": mesh.name,
            "thickness": mesh.beam.thickness,
            "keep_fields": mesh in shown_meshes(study),
            "scenes": [_scene(study, scene) for scene in scenes[mesh]],
        }
        for mesh in meshes
    ]
    return {
        "folder": str(folder / "solutions"),
        "meshes": str(folder / "meshes"),
        "references": str(folder / "references"),
        "families": families,
    }


def _scene(study, scene):
    task = {
        "key": scene_key(study, scene),
        "material": _material(scene.material),
        "kind": LOADS[scene.load].kind,
        "follower": _follows(scene),
        "force": scene.force,
        "definition": scene.definition,
        "kinematics": scene.kinematics,
        "reference": reference_name(scene.mesh.beam, scene.material),
        "reference_key": reference_key(scene.mesh.beam, scene.material, scene.load),
    }
    stiffness = _given_stiffness(study, scene)
    if stiffness is not None:
        task["stiffness"] = stiffness
    if scene.definition == "calibrated":
        task["calibration"] = calibration_name(scene)
        task["thickness_ratio"] = _thickness_ratio(study, scene)
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
                "reference_key": reference_key(curve.mesh.beam, material, curve.load),
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
    if stage == "moduli":
        return [folder / f"{patch['name']}.h5" for patch in content["patches"]]
    if stage == "laying":
        return [folder / f"{strip['key']}.h5" for strip in content["strips"]]
    if stage == "benchmark":
        return [folder / f"{race['key']}.h5" for race in content["races"]]
    if stage == "stability":
        return [folder / f"{one['key']}.h5" for one in content["experiments"]]
    if stage in ("sensitivity", "solve"):
        return [folder / f"{family['name']}.h5" for family in content["families"]]
    return []

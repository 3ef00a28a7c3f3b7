"""From a study to the tasks of its stages: what each Snakemake job is to do, written to files it can watch.

Scenes are put together in bundles of meshes of about equal cost, since one process a scene would be all start-up. The
file of a bundle changes only when its tasks do, so Snakemake reruns a job only when it has something to look at; a job
then computes only results that are not stored yet.
"""

import hashlib
import os
from collections import defaultdict
from dataclasses import asdict
from functools import cache, lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from ..jobs import atomic, bundles, store
from ..jobs.costs import laying_units
from ..jobs.dependencies import definition_digest, digest
from ..mesh import MESH_TYPES
from ..problem.loads import LOADS
from ..reference.similarity import unit_problem, unit_scales
from ..study import MeshSpec

COSTS = "costs.json"
"""File beside the studies' folders: what tasks cost on this machine."""


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
        Labels of the bundles by stage: ``reference``, ``solve`` (also of `mesh`), ``sensitivity``, ``moduli``,
        ``laying``, ``stability`` and ``benchmark``; ``calibrate`` is empty where no scene is calibrated.
    """
    shared = _bundles(study, folder, cores)
    calibrated = any(scene.definition == "calibrated" for scene in study.scenes)
    tasks = {"calibrate": _calibrate(study, folder)} if calibrated else {}
    scenes, curves = _by_mesh(study.scenes), _by_mesh(study.curves)
    for label, groups in shared["reference"].items():
        tasks[f"reference_{label}"] = _reference(folder, [one for group in groups for one in group])
    for label, meshes in shared["solve"].items():
        tasks[f"mesh_{label}"] = _mesh(folder, meshes)
        tasks[f"solve_{label}"] = _solve(study, folder, meshes, scenes)
    for label in shared["sensitivity"]:
        tasks[f"sensitivity_{label}"] = _sensitivity(study, folder, shared["solve"][label], curves)
    for label, strips in shared["laying"].items():
        tasks[f"laying_{label}"] = {"folder": str(folder / "laying"), "strips": [_laid(one) for one in strips]}
    for label, experiments in shared["stability"].items():
        folder_of = str(folder / "stability")
        tasks[f"stability_{label}"] = {"folder": folder_of, "experiments": [_experiment(one) for one in experiments]}
    for race in study.benchmark:
        content = {"folder": str(folder / "benchmark"), "races": [_race(race, race is study.benchmark[0])]}
        tasks[f"benchmark_{race.name}"] = content
    for label, patches in shared["moduli"].items():
        tasks[f"moduli_{label}"] = {"folder": str(folder / "moduli"), "patches": patches}
    for name, content in tasks.items():
        path = folder / "tasks" / f"{name}.json"
        if not path.exists() or atomic.read_json(path) != content:
            atomic.write_json(path, content)
        done = folder / "done" / f"{name}.json"
        # Snakemake guards what is declared; results are not, so a missing one makes the job run again.
        if done.exists() and not all(Path(file).exists() for file in _products(name, content)):
            done.unlink()
    return {stage: list(content) for stage, content in shared.items()} | {"calibrate": ["calibrate"] * calibrated}


def _bundles(study, folder, cores):
    """Tasks of each bundle by its label: meshes for `solve` and `sensitivity`, patches for `moduli`, and so on."""
    notes = folder / "tasks/bundles.json"
    known = atomic.read_json(notes) if notes.exists() else {"cores": 0}
    # More cores want more bundles; what is solved stays solved, whichever bundle it is in.
    before = known if known["cores"] >= cores else {"cores": cores}
    machine = bundles.Costs(folder.parent / COSTS)
    meshes, costs = {mesh.name: mesh for mesh in study.meshes}, defaultdict(float)
    for mesh in study.meshes:
        costs[mesh.name] += machine.of("mesh", _particles(mesh))
    for scene in study.scenes:
        costs[scene.mesh.name] += machine.of(scene.kinematics, _particles(scene.mesh))
        costs[scene.mesh.name] += _search(machine, scene.definition, scene.mesh)
    for curve in study.curves:
        costs[curve.mesh.name] += machine.of("curve", _particles(curve.mesh))
    curved = {curve.mesh.name for curve in study.curves}
    patches, of_patches = _patches(study), defaultdict(float)
    for one in study.moduli:
        mesh = patch_mesh(study, one)
        of_patches[patch_name(one)] += machine.of("moduli", _particles(mesh)) + _search(machine, one.definition, mesh)
    strips = {store.key(asdict(one)): one for one in (*study.laying, *study.laying_references)}
    experiments = {store.key(asdict(one)): one for one in study.stability}
    references = _unit_references(study) | _finite_references(study)
    asked = {
        "reference": {
            name: sum(machine.of("reference" if kind is None else "finite") for _, kind in group)
            for name, group in references.items()
        },
        "solve": costs,
        "moduli": of_patches,
        "laying": {name: machine.of("laying", laying_units(one.mesh_size)) for name, one in strips.items()},
        "stability": {name: machine.of(one.name) for name, one in experiments.items()},
    }
    found = {
        stage: bundles.share_out(costs, cores, machine.start_up, before.get(stage, {})) if costs else {}
        for stage, costs in asked.items()
    }
    if found | {"cores": before["cores"]} != known:
        atomic.write_json(notes, found | {"cores": before["cores"]})
    members = {"reference": references, "solve": meshes, "moduli": patches, "laying": strips,
               "stability": experiments}  # fmt: skip
    shared = {
        stage: {label: [members[stage][name] for name in names] for label, names in labels.items()}
        for stage, labels in found.items()
    }
    return shared | {
        "benchmark": {race.name: [race] for race in study.benchmark},
        "sensitivity": [label for label, names in found["solve"].items() if curved & set(names)],
    }


def _particles(mesh):
    return mesh.beam.length * mesh.beam.height / (0.866 * mesh.mesh_size**2)


def _search(machine, definition, mesh):
    """Seconds of a definition that searches, on top of its scene's; none of others."""
    return machine.of(definition, _particles(mesh)) if definition in bundles.COSTS else 0.0


@cache
def _stage_key(stage, *packages):
    return [digest(stage), *(f"{package} {installed(package)}" for package in packages)]


def installed(package):
    """Version of a package; "none" where it is an extra that is not there, or not wanted."""
    unused = package == "cvxopt" and os.environ.get("SPRINGTUNE_SOLVER") == "superlu"
    try:
        return "none" if unused else version(package)
    except PackageNotFoundError:
        return "none"


@cache
def mesh_key(mesh):
    """Key of a mesh: its parameters or its file, the code that makes it and the library behind it."""
    packages = {"free": ["netgen-mesher"]}.get(mesh.mesh_type, []) if mesh.file is None else ["meshio"]
    return store.key(_mesh_source(mesh), _stage_key("kinds.scenes.mesh", "numpy", *packages))


def _mesh_source(mesh):
    """What a mesh is made from."""
    source = {"length": mesh.beam.length, "height": mesh.beam.height}
    if mesh.file is None:
        return source | {"mesh_type": mesh.mesh_type, "mesh_size": mesh.mesh_size}
    content = hashlib.sha256(mesh.file.read_bytes()).hexdigest()
    return source | {"file": str(mesh.file), "unit": mesh.unit, "content": content}


@cache
def reference_of(beam, material, load):
    """Reference of a beam, material and load, as `springtune.kinds.scenes.stored_reference.read` takes it.

    Its key is that of the unit problem, which beams and materials that differ by a scale share, and all loads of a
    kind.
    """
    problem = beam, material, LOADS[load].kind
    length, displacement = unit_scales(*problem)
    key = store.key(
        unit_problem(*problem), _stage_key("kinds.scenes.reference", "numpy", "scipy", "cvxopt", "scikit-fem")
    )
    return {"key": key, "length": length, "displacement": displacement}


def finite_key(reference, kind):
    """Key of a reference at finite strain, which no load scales."""
    code = _stage_key("kinds.scenes.reference", "numpy", "scipy", "cvxopt", "scikit-fem")
    return store.key(kind, _finite_problem(reference), code)


def _problem(reference):
    return reference.beam, reference.material, LOADS[reference.load].kind


def _finite_problem(reference):
    parameters = [_beam(reference.beam), _material(reference.material), LOADS[reference.load].kind, reference.force]
    return [*parameters, LOADS[reference.load].follower]


def _unit_references(study):
    """A reference of each unit problem and nothing, in groups that share elements and differ in Poisson's ratio."""
    groups = defaultdict(dict)
    for reference in study.references:
        aspect_ratio, nu, kind = unit_problem(*_problem(reference))
        groups[store.key(aspect_ratio, kind)].setdefault(nu, (reference, None))
    return {name: list(group.values()) for name, group in groups.items()}


def _finite_references(study):
    """References at finite strain and their kinds, each in a group of its own."""
    return {
        store.key(kind, _finite_problem(reference)): [(reference, kind)]
        for reference in study.references
        for kind in study.further_references
    }


def curve_key(study, curve):
    """Key of a sensitivity curve."""
    parameters = [mesh_key(curve.mesh), LOADS[curve.load].kind, curve.force, curve.kinematics]
    parameters += [stiffnesses(study, curve), reference_of(curve.mesh.beam, curve.material, curve.load)]
    return store.key(parameters, _stage_key("kinds.scenes.sensitivity", "numpy", "scipy", "cvxopt"))


def scene_key(study, scene):
    """Key of a scene; a calibrated one's result is stored under a key that holds the calibrated stiffness, too."""
    reference = reference_of(scene.mesh.beam, scene.material, scene.load)
    parameters = [mesh_key(scene.mesh), scene.mesh.beam.thickness, _material(scene.material), reference]
    parameters += [LOADS[scene.load].kind, _follows(scene), scene.force, scene.definition, scene.kinematics]
    parameters += [_given_stiffness(study, scene), _thickness_ratio(study, scene), scene.mesh in shown_meshes(study)]
    return store.key(
        parameters, _stage_key("kinds.scenes.solve", "numpy", "scipy", "cvxopt"), definition_digest(scene.definition)
    )


def moduli_key(study, one):
    """Key of the effective moduli of a definition on a patch."""
    mesh = patch_mesh(study, one)
    parameters = [_mesh_source(mesh), one.definition, one.poisson_ratio]
    code = (
        _stage_key("kinds.moduli.stage", "numpy", "scipy", "cvxopt", "netgen-mesher"),
        definition_digest(one.definition),
    )
    return store.key(parameters, *code)


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
        return store.key(name, calibration[calibration_name(scene)]["stiffness"])
    return name


def stiffnesses(study, curve):
    """Stiffnesses of a sensitivity curve [N/m], ascending."""
    membrane = curve.material.young_modulus * curve.mesh.beam.thickness
    return [ratio * membrane for ratio in study.stiffness_ratios]


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


@cache
def _beam(beam):
    return asdict(beam) | {"name": ""}  # a new label is not a new beam


@cache
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


def _reference(folder, references):
    """References and their kinds at finite strain, nothing of a unit problem."""
    return {
        "folder": str(folder / "references"),
        "references": [
            {"key": reference_of(one.beam, one.material, one.load)["key"], "problem": unit_problem(*_problem(one))}
            for one, kind in references
            if kind is None
        ],
        "finite": [
            {
                "key": finite_key(one, kind),
                "beam": _beam(one.beam),
                "material": _material(one.material),
                "force": one.force,
                "load": LOADS[one.load].kind,
                "plane": kind.rpartition("-")[2],
                "follower": LOADS[one.load].follower,
            }
            for one, kind in references
            if kind is not None
        ],
    }


def laying_key(one):
    """Key of a laid strip."""
    return store.key(
        asdict(one), _stage_key("kinds.laying.stage", "numpy", "scipy", "cvxopt"), definition_digest(one.definition)
    )


def _laid(one):
    return {"key": laying_key(one)} | asdict(one)


def experiment_key(one):
    """Key of an experiment on stability."""
    parameters = asdict(one) | {"beam": _beam(one.beam), "material": asdict(one.material) | {"name": ""}}
    code = _stage_key("kinds.stability.stage", "numpy", "scipy", "cvxopt", "numba")
    return store.key(parameters, code, definition_digest(one.definition))


def _experiment(one):
    return {"key": experiment_key(one)} | asdict(one)


def race_key(race):
    """Key of a scene of the benchmark."""
    parameters = asdict(race) | {"beam": _beam(race.beam), "material": asdict(race.material) | {"name": ""}}
    parameters["second_beam"] = race.second_beam and _beam(race.second_beam)
    code = _stage_key(
        "kinds.benchmark.stage", "numpy", "scipy", "cvxopt", "numba", "scikit-fem", "netgen-mesher", "pyamg"
    )
    definitions = sorted({method.partition("/")[0] for method in race.methods if "/" in method})
    return store.key(parameters, code, [definition_digest(name) for name in definitions])


def _race(race, first):
    return {"key": race_key(race), "curves": first} | asdict(race)


def patch_name(one):
    """File stem of the moduli of a patch."""
    return f"{one.mesh_type}_{1e3 * one.mesh_size:g}mm"


def _patches(study):
    """What is asked of each patch, by its name."""
    patches = {}
    for one in study.moduli:
        source = {"name": patch_name(one), "mesh": _mesh_source(patch_mesh(study, one))}
        patch = patches.setdefault(patch_name(one), source | {"asked": []})
        asked = {"key": moduli_key(study, one), "definition": one.definition, "poisson_ratio": one.poisson_ratio}
        patch["asked"].append(asked)
    return patches


def _curve(study, curve):
    return {
        "key": curve_key(study, curve),
        "kind": LOADS[curve.load].kind,
        "force": curve.force,
        "kinematics": curve.kinematics,
        "stiffnesses": stiffnesses(study, curve),
        "reference": reference_of(curve.mesh.beam, curve.material, curve.load),
    }


def _sensitivity(study, folder, meshes, curves):
    families = [
        {"name": mesh.name, "curves": [_curve(study, curve) for curve in curves[mesh]]}
        for mesh in meshes
        if curves[mesh]
    ]
    return {
        "folder": str(folder / "curves"),
        "meshes": str(folder / "meshes"),
        "references": str(folder / "references"),
        "families": families,
    }


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
        "reference": reference_of(scene.mesh.beam, scene.material, scene.load),
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
            {"mesh": curve.mesh.name, "key": curve_key(study, curve), "load": curve.load, "force": curve.force}
            for curve in study.curves
            if (curve.mesh.beam.name, curve.load) == study.calibration
            and (curve.mesh.mesh_type, curve.material, curve.kinematics) == (mesh_type, material, kinematics)
        ]
        tasks.append({"name": name, "members": members})
    return {"curves": str(folder / "curves"), "groups": tasks}


def _products(name, content):
    """Files that a job makes besides those it declares."""
    stage, folder = name.partition("_")[0], Path(content.get("folder", ""))
    if stage == "mesh":
        return [folder / f"{mesh['name']}{ending}" for mesh in content["meshes"] for ending in (".vtu", ".json")]
    if stage == "reference":
        return [folder / f"{one['key']}.h5" for one in (*content["references"], *content["finite"])]
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

"""Stages of scenes: what their jobs are to do, and the keys of what they store."""

import hashlib
from collections import defaultdict
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from springtune.problem.loads import LOADS
from springtune.reference.answers import unit_problem, unit_scales

from ...config.kind import Stage
from ...config.model import once_a_study, shown
from ...runs.checked_json import hash_of
from ...runs.keys import beam_key, definition_key, material_key, mesh_type_key, stage_key
from ...runs.stages import products
from . import stored
from .interpolated import expected_solves, interpolants
from .stored import calibrated_key

if TYPE_CHECKING:
    from ...config.model import SceneSpec, Study

INTERPOLANT = "interpolant"
"""What stands in the place of a kind at finite strain."""


def particles(mesh):
    """Number of particles of a mesh, about."""
    return mesh.beam.length * mesh.beam.height / (0.866 * mesh.mesh_size**2)


_grouped: dict[int, tuple[Any, Any]] = {}


def by_mesh(items):
    """Scenes or curves of a study by their mesh."""
    # Every bundle asks: the tuple of a study is known by its place, since comparing 10,000 scenes is no way to find it.
    if len(_grouped) > 8:
        _grouped.clear()
    known, groups = _grouped.get(id(items), (None, None))
    if known is not items:
        groups = defaultdict(list)
        for item in items:
            groups[item.mesh].append(item)
        _grouped[id(items)] = items, groups
    return groups


# -- keys --------------------------------------------------------------------------------------------------------------


@cache
def mesh_key(mesh):
    """Key of a mesh: its parameters or its file, the code that makes it and the library behind it."""
    return hash_of(mesh_parameters(mesh), stage_key("studies.kinds.scenes.mesh"), mesh_type_key(mesh.mesh_type))


def mesh_parameters(mesh):
    """What of its source a mesh depends on: not on where its file is, but on its ending, which says its format."""
    source = mesh_source(mesh)
    return source | {"file": mesh.file.suffix} if mesh.file else source


def mesh_source(mesh):
    """What a mesh is made from."""
    source = {"length": mesh.beam.length, "height": mesh.beam.height}
    if mesh.file is None:
        return source | {"mesh_type": mesh.mesh_type, "mesh_size": mesh.mesh_size}
    content = hashlib.sha256(mesh.file.read_bytes()).hexdigest()
    return source | {"file": str(mesh.file), "unit": mesh.unit, "content": content}


@cache
def stem(mesh):
    """Stem of a mesh's files: says what it is, not by which labels a study knows it; beams of one extent share it."""
    extent = f"{1e3 * mesh.beam.length:g}x{1e3 * mesh.beam.height:g}"
    own = f"_{mesh_source(mesh)['content'][:8]}" if mesh.file else ""
    return f"{extent}_{mesh.mesh_type}_{1e3 * mesh.mesh_size:g}mm{own}"


def reference_of(study, beam, material, load):
    """Reference of a beam, material and load, as `springtune.studies.kinds.scenes.any_reference.read` takes it."""
    solved = solved_reference(beam, material, load)
    name = LOADS[load].kind.name
    box, problems = interpolants(study).get(name, (None, {}))
    if (beam, material, load) not in problems:
        return solved
    return solved | {"interpolant": interpolant_key(name, box), "problem": problems[beam, material, load]}


@cache
def interpolant_key(kind, box):
    """Key of an interpolant, which all unit problems in its box share."""
    return hash_of(
        "interpolant", kind, box, stage_key("studies.kinds.scenes.reference", without=("reference.finite_strain",))
    )


@cache
def solved_reference(beam, material, load):
    """Reference that is solved by itself, under the key of its unit problem, which scaled beams share."""
    length, displacement = unit_scales(beam, material, LOADS[load].kind)
    code = stage_key(
        "studies.kinds.scenes.reference", without=("reference.finite_strain", "studies.kinds.scenes.stored_interpolant")
    )
    key = hash_of(_unit_problem(beam, material, load), code)
    return {"key": key, "length": length, "displacement": displacement}


def finite_key(reference, kind):
    """Key of a reference at finite strain, which no load scales."""
    return hash_of(kind, _finite_problem(reference), stage_key("studies.kinds.scenes.reference"))


def _unit_problem(beam, material, load):
    aspect_ratio, nu, kind = unit_problem(beam, material, LOADS[load].kind)
    return aspect_ratio, nu, kind.name


def _finite_problem(reference):
    load = LOADS[reference.load]
    return [beam_key(reference.beam), material_key(reference.material), load.kind.name, reference.force, load.follower]


def curve_key(study, curve):
    """Key of a sensitivity curve."""
    parameters = [mesh_key(curve.mesh), LOADS[curve.load].kind.name, curve.force, curve.kinematics]
    parameters += [stiffnesses(study, curve), reference_of(study, curve.mesh.beam, curve.material, curve.load)]
    return hash_of(parameters, stage_key("studies.kinds.scenes.sensitivity"))


def scene_key(study: "Study", scene: "SceneSpec") -> str:
    """Key of a scene; a calibrated one's result is stored under a key that holds the calibrated stiffness, too."""
    return hash_of(
        _commons(study).of(scene)["key"],
        scene.force,
        _given_stiffness(study, scene),
        _thickness_ratio(study, scene),
        scene.stiffness_scale,
    )


@once_a_study("scenes", "curves", "grids", "outputs", "stiffness_table", "calibration")
def scene_keys(study):
    """Keys of a study's scenes by their mesh, in the order of `by_mesh`: tasks and the dataset both want them."""
    return {mesh: [scene_key(study, scene) for scene in scenes] for mesh, scenes in by_mesh(study.scenes).items()}


class _Commons:
    """What scenes share that differ in force or by a factor on the stiffness, asked for once."""

    def __init__(self, study):
        self._study, self._known = study, {}

    def of(self, scene):
        """A part of a scene's task, and its key."""
        # By their places: hashing materials for each of 100,000 scenes is no way to know them.
        place = id(scene.mesh), id(scene.material), scene.load, scene.definition, scene.kinematics
        if place not in self._known:
            # The scene is kept with it, so that nothing else comes to be in these places.
            self._known[place] = self._found(scene), scene
        return self._known[place][0]

    def _found(self, scene):
        load, mesh = LOADS[scene.load], scene.mesh
        task = {
            "material": material_key(scene.material),
            "kind": load.kind.name,
            # Linear kinematics know no other place of what a force follows than that at rest.
            "follower": load.follower and scene.kinematics == "nonlinear",
            "definition": scene.definition,
            "kinematics": scene.kinematics,
        }
        reference = reference_of(self._study, mesh.beam, scene.material, scene.load)
        if "interpolant" not in reference:  # which has no field, all that a scene wants of it
            task["reference"] = reference
        code = stage_key("studies.kinds.scenes.solve"), definition_key(scene.definition)
        return {"task": task, "key": hash_of(mesh_key(mesh), mesh.beam.thickness, task, code)}


_commons = once_a_study("grids", "outputs")(_Commons)


@once_a_study("grids")
def shown_scenes(study):
    """Scenes whose whole fields are kept, whether or not they are drawn: of a part those of the whole study."""
    scenes = study.scenes if study.part is None else {scene for grid in study.grids for scene in grid.scenes}
    return shown(scenes, study.swept)


def solved_keys(study, mesh, calibration):
    """Keys under which results of a mesh's scenes are stored, given the calibrated stiffnesses by group."""
    return [
        calibrated_key(key, calibration[calibration_name(scene)]["stiffness"])
        if scene.definition == "calibrated"
        else key
        for scene, key in zip(by_mesh(study.scenes)[mesh], scene_keys(study)[mesh])
    ]


def stiffnesses(study, curve):
    """Stiffnesses of a sensitivity curve [N/m], ascending."""
    membrane = curve.material.young_modulus * curve.mesh.beam.thickness
    return [ratio * membrane for ratio in study.stiffness_ratios]


def _thickness_ratio(study, scene):
    """Thickness over that of the beam that calibrates: stiffness is in proportion to it."""
    if scene.definition != "calibrated":
        return 1.0
    return scene.mesh.beam.thickness / _calibrating(study)[calibration_name(scene)]


@once_a_study("curves")
def _calibrating(study):
    """Thickness of the beam that calibrates each group of scenes [m]; a study gives a group one."""
    curves = [one for one in study.curves if (one.mesh.beam.name, one.load) == study.calibration]
    return {calibration_name(one): one.mesh.beam.thickness for one in curves}


def calibration_name(scene):
    """Name of the group of curves that calibrates a scene."""
    return f"{scene.mesh.mesh_type}_{hash_of(material_key(scene.material))[:8]}_{scene.kinematics}"


def _given_stiffness(study, scene):
    return study.stiffness_table[scene.mesh.mesh_type, scene.material.name] if scene.definition == "paper" else None


# -- stages ------------------------------------------------------------------------------------------------------------


def _mesh_members(study, costs):
    """Meshes, and what they and all their scenes and curves cost."""
    seconds = {stem(mesh): costs.of("mesh", particles(mesh)) for mesh in study.meshes}
    for mesh, scenes in by_mesh(study.scenes).items():
        name, cost = stem(mesh), cache(partial(costs.of, units=particles(mesh)))
        for scene in scenes:
            seconds[name] += cost(scene.kinematics)
            seconds[name] += cost(scene.definition)
    for curve in study.curves:
        seconds[stem(curve.mesh)] += costs.of("curve", particles(curve.mesh))
    members = defaultdict(list)
    for mesh in study.meshes:
        members[stem(mesh)].append(mesh)
    return {name: (seconds[name], meshes) for name, meshes in members.items()}


def _meshes(study, folder, members):
    return {
        "folder": str(folder / "meshes"),
        "files": [{"name": stem(mesh), "key": mesh_key(mesh)} | mesh_source(mesh) for mesh, *_ in members],
    }


def mesh_products(content):
    """Files of the meshes of a job, beams' or shapes'."""
    return [path for mesh in content["files"] for path in stored.files(content["folder"], mesh["name"])]


def _reference_members(study, costs):
    """References in groups: unit problems that share elements and differ in Poisson's ratio; each at finite strain."""
    groups, boxes = defaultdict(dict), {}
    for reference in study.references:
        if "interpolant" in reference_of(study, reference.beam, reference.material, reference.load):
            kind = LOADS[reference.load].kind.name
            boxes[kind] = interpolants(study)[kind]
            continue
        aspect_ratio, nu, kind = _unit_problem(reference.beam, reference.material, reference.load)
        groups[hash_of(aspect_ratio, kind)].setdefault(nu, (reference, None))
    members = {
        name: (sum(costs.of("reference") for _ in group), list(group.values())) for name, group in groups.items()
    }
    for kind, (box, _) in boxes.items():
        members[interpolant_key(kind, box)] = costs.of("interpolant", expected_solves(box)), [(kind, INTERPOLANT)]
    for reference in study.references:
        for kind in study.further_references:
            name = hash_of(kind, _finite_problem(reference))
            members[name] = costs.of("finite"), [(reference, kind)]
    return members


def _references(study, folder, groups):
    """References and their kinds at finite strain, nothing of a unit problem."""
    members = [one for group in groups for one in group]
    interpolated = [_interpolant(study, name) for name, kind in members if kind == INTERPOLANT]
    references = [member for member in members if member[1] != INTERPOLANT]
    tasks = [
        {"key": solved_reference(*problem)["key"], "cost": ["reference", 0], "problem": _unit_problem(*problem)}
        for problem in ((one.beam, one.material, one.load) for one, kind in references if kind is None)
    ]
    tasks += [
        {
            "key": finite_key(one, kind),
            "cost": ["finite", 0],
            "beam": beam_key(one.beam),
            "material": material_key(one.material),
            "force": one.force,
            "load": LOADS[one.load].kind.name,
            "law": kind.partition("-plane-")[0],
            "plane": kind.partition("-plane-")[2],
            "follower": LOADS[one.load].follower,
        }
        for one, kind in references
        if kind is not None
    ]
    files = [{"name": task["key"], "tasks": [task]} for task in tasks]
    more = {"interpolants": interpolated} if interpolated else {}
    return {"folder": str(folder / "references"), "files": files} | more


def _interpolant(study, kind):
    """Interpolant, and the unit problems that are asked of it by the keys of those that are solved by themselves."""
    box, problems = interpolants(study)[kind]
    keys = {solved_reference(*body)["key"]: problem for body, problem in problems.items()}
    return {"key": interpolant_key(kind, box), "kind": kind, "box": box, "problems": keys}


def _reference_products(content):
    interpolants = content.get("interpolants", ())
    return products(content) + [Path(content["folder"]) / f"{one['key']}.h5" for one in interpolants]


def _curve(study, curve):
    return {
        "key": curve_key(study, curve),
        "kind": LOADS[curve.load].kind.name,
        "force": curve.force,
        "kinematics": curve.kinematics,
        "stiffnesses": stiffnesses(study, curve),
        "reference": reference_of(study, curve.mesh.beam, curve.material, curve.load),
    }


def _sensitivity(study, folder, members):
    curves = by_mesh(study.curves)
    files = [
        {"name": stem(mesh), "tasks": [_curve(study, curve) for curve in curves[mesh]]}
        for meshes in members
        for mesh in meshes
        if mesh in curves  # asking otherwise would add it for all who ask later
    ]
    return files and {
        "folder": str(folder / "curves"),
        "meshes": str(folder / "meshes"),
        "references": str(folder / "references"),
        "files": files,
    }


def _solve(study, folder, members):
    scenes = by_mesh(study.scenes)
    files = [
        {"name": stem(mesh), "thickness": mesh.beam.thickness, "tasks": _scenes(study, mesh)}
        for meshes in members
        for mesh in meshes
        if mesh in scenes  # as above; a part of a study may have curves alone
    ]
    return files and {
        "calibration": str(calibration_path(folder)) if calibrated(study) else None,
        "folder": str(folder / "solutions"),
        "meshes": str(folder / "meshes"),
        "references": str(folder / "references"),
        "files": files,
    }


def _scenes(study, mesh):
    """Tasks of a mesh's scenes."""
    scenes, keys = by_mesh(study.scenes)[mesh], scene_keys(study)[mesh]
    commons, kept = _commons(study), shown_scenes(study)
    return [_scene(study, scene, commons.of(scene)["task"], key, kept) for scene, key in zip(scenes, keys)]


def _scene(study, scene, common, key, kept):
    task = common | {"key": key, "force": scene.force}
    stiffness = _given_stiffness(study, scene)
    if stiffness is not None:
        task["stiffness"] = stiffness
    if scene.stiffness_scale != 1:
        task["stiffness_scale"] = scene.stiffness_scale
    if scene in kept:
        task["keep_fields"] = True
    if scene.definition == "calibrated":
        task["calibration"] = calibration_name(scene)
        task["thickness_ratio"] = _thickness_ratio(study, scene)
    return task


@once_a_study("scenes")
def calibrated(study):
    """Scenes whose stiffness is calibrated."""
    return [scene for scene in study.scenes if scene.definition == "calibrated"]


def calibration_path(folder):
    """Where the calibrated stiffnesses of a study are."""
    return folder / "calibration.json"


def _calibrate_members(study, costs):
    """Groups of scenes that share a calibrated stiffness, in one job."""
    groups = {}
    for scene in calibrated(study):
        groups[calibration_name(scene)] = scene.mesh.mesh_type, scene.material, scene.kinematics
    return {"all": (0.0, sorted(groups.items()))} if groups else {}


def _calibrate(study, folder, members):
    tasks = []
    for name, (mesh_type, material, kinematics) in (pair for groups in members for pair in groups):
        curves = [
            {"mesh": stem(curve.mesh), "curve": curve_key(study, curve), "load": curve.load, "force": curve.force}
            for curve in study.curves
            if (curve.mesh.beam.name, curve.load) == study.calibration
            and (curve.mesh.mesh_type, curve.material, curve.kinematics) == (mesh_type, material, kinematics)
        ]
        tasks.append({"name": name, "members": curves})
    return {
        "file": str(calibration_path(folder)),
        "curves": str(folder / "curves"),
        "groups": tasks,
        "code": stage_key("studies.kinds.scenes.calibrate"),
    }


STAGES = (
    Stage(
        "reference",
        "studies.kinds.scenes.reference",
        "Solving the finite-element references",
        _references,
        _reference_products,
        _reference_members,
        folder="references",
    ),
    Stage("mesh", "studies.kinds.scenes.mesh", "Meshing", _meshes, mesh_products, _mesh_members, folder="meshes"),
    Stage(
        "sensitivity",
        "studies.kinds.scenes.sensitivity",
        "Tracing the sensitivity curves",
        _sensitivity,
        products,
        like="mesh",
        same=("mesh",),
        every=("reference",),
        folder="curves",
    ),
    Stage(
        "calibrate",
        "studies.kinds.scenes.calibrate",
        "Calibrating the uniform stiffness",
        _calibrate,
        lambda content: [Path(content["file"])],
        _calibrate_members,
        every=("sensitivity",),
    ),
    Stage(
        "solve",
        "studies.kinds.scenes.solve",
        "Solving the networks",
        _solve,
        products,
        like="mesh",
        same=("mesh",),
        every=("reference", "calibrate"),
        folder="solutions",
    ),
)

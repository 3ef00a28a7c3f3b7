"""Bodies: the beams of a study's grids, and the shapes of its sections ``shapes`` and ``shape_grids``.

Stages, tasks and keys; `stored` reads what the stages store, and `collect` makes rows for the groups of the dataset.
"""

from collections import Counter, defaultdict
from functools import cache, lru_cache
from math import ceil, floor, log10
from operator import attrgetter
from pathlib import Path

import numpy as np

from springtune.problem.loads import LOADS
from springtune.problem.materials import Material
from springtune.problem.shapes import Beam, size_text
from springtune.reference.answers import unit_problem, unit_scales
from springtune.safe_io import aligned
from springtune.springs.base import DEFINITIONS

from ...config.model import SceneSpec, Stage, Study, StudyKind, swept_value
from ...runs import attempts
from ...runs.keys import beam_key, definition_key, material_key, mesh_type_key, stage_key
from ...runs.plan import Task
from ...runs.source import checksum, hash_of, hash_of_text
from . import shapes as of_shapes
from .outputs import MESH_OF_FILE, OUTPUTS, SHAPES_OUTPUT, cache_by_study, mesh_name, shown_order, stems
from .stored import CALIBRATION_STEM

Body = tuple[Beam, Material, str]

Box = tuple[tuple[float, float], tuple[float, float]]


def particles(area, mesh_size):
    """Approximate number of particles of a mesh."""
    return area / (0.866 * mesh_size**2)


@cache
def expected_seconds(particles, definition=""):
    """Expected seconds of a scene, a curve or a mesh; a definition that searches takes fifty times as long."""
    # A plane mesh is factorized in about n^1.5 operations.
    return (5e-4 + 1e-7 * particles**1.5) * (50 if definition and DEFINITIONS[definition].cost == 2 else 1)


def group_by(items, key):
    """Items grouped by a key, in order."""
    groups = defaultdict(list)
    for item in items:
        groups[key(item)].append(item)
    return dict(groups)


@cache_by_study
def by_mesh(study, name):
    """The ``scenes`` or ``curves`` of a study by their mesh."""
    return group_by(getattr(study, name), attrgetter("mesh"))


@cache_by_study
def shape_scenes_by_mesh(study):
    """Scenes of shapes by the stem of their mesh."""
    return group_by(study.shapes.scenes if study.shapes else (), shape_stem)


# -- references that are interpolated ----------------------------------------------------------------------------------
#
# An interpolant has no whole fields, so references that need them are solved one by one.

MOST_SOLVED_ALONE = 100  # unit problems of one kind of load that are solved one by one, some 3 s; more are interpolated

ASPECT_STEPS_IN_DECADE = 10
"""Possible ends of a range of aspect ratios in a decade. So new aspect ratios mostly need no new interpolant."""

NU_STEP = 0.05  # distance of possible ends of a range of Poisson's ratios [1]


@cache_by_study
def interpolants(study: "Study") -> "dict[str, tuple[Box, dict[Body, tuple[float, float]]]]":
    """Interpolants of a study by kind of load: box, and unit problem of each body in it."""
    if "block" in study.outputs or "definitions" in study.outputs:  # which show whole fields of all references
        return {}
    with_fields = [one for one in study.scenes if DEFINITIONS[one.definition].needs == "cases"]
    if keeps_fields(study):
        with_fields += shown_scenes(study)
    # Bodies and loads that share a unit problem share its solution, too.
    whole = {unit_problem(one.mesh.beam, one.material, LOADS[one.load].kind) for one in with_fields}
    kinds: dict[str, dict[Body, tuple[float, float]]] = {}
    for body in dict.fromkeys((one.beam, one.material, one.load) for one in study.references):
        beam, material, load = body
        aspect_ratio, nu, kind = problem = unit_problem(beam, material, LOADS[load].kind)
        if problem not in whole and kind.mirrored and -1 < nu <= 0.5:
            kinds.setdefault(kind.name, {})[body] = aspect_ratio, nu
    several = {name: own for name, own in kinds.items() if len({*own.values()}) > MOST_SOLVED_ALONE}
    return {name: (box_of({*own.values()}), own) for name, own in several.items()}


def box_of(problems: set[tuple[float, float]]) -> "Box":
    """Box of aspect ratios and Poisson's ratios around unit problems, its ends rounded outwards.

    >>> box_of({(1.5, 0.3), (5, 0.3)}), box_of({(2, -0.98), (2, 0.49)})
    (((1.258925, 5.011872), (0.3, 0.3)), ((2.0, 2.0), (-0.98, 0.5)))
    """
    aspects, nus = ([float(one[axis]) for one in problems] for axis in range(2))
    first, last, least, largest = min(aspects), max(aspects), min(nus), max(nus)
    if first < last:
        # An end that is one of the steps stays where it is, though its logarithm is rounded.
        lower, upper = (ASPECT_STEPS_IN_DECADE * log10(end) for end in (first, last))
        steps = floor(lower + 1e-5), ceil(upper - 1e-5)
        lower, upper = (float(f"{10 ** (step / ASPECT_STEPS_IN_DECADE):.7g}") for step in steps)
        first, last = min(first, lower), max(last, upper)
    if least < largest:
        steps = floor(least / NU_STEP + 1e-6), ceil(largest / NU_STEP - 1e-6)
        below, above = (round(step * NU_STEP, 2) for step in steps)
        least, largest = min(least, below) if below > -1 else least, min(max(largest, above), 0.5)
    return (first, last), (least, largest)


# -- keys --------------------------------------------------------------------------------------------------------------

FINITE_STRAIN = "reference.finite_shapes", "reference.finite_strain"  # modules of references at finite strain
TASK_VALUES = "studies.kinds.bodies.task_values"  # module of shapes, which stages import for them alone


@cache
def mesh_key(mesh):
    """Key of the mesh of a beam."""
    code = stage_key("studies.kinds.bodies.mesh", without=(TASK_VALUES,))
    return hash_of(parameters(mesh_source(mesh)), code, mesh_type_key(mesh.mesh_type))


def parameters(source):
    """Parameters of a mesh for keys: of a file the ending, not the folder."""
    return source | {"file": Path(source["file"]).suffix} if "file" in source else source


def mesh_source(mesh):
    """Parameters to make the mesh of a beam, from a box and mesh size or from a file."""
    made = {"mesh_type": mesh.mesh_type, "mesh_size": mesh.mesh_size}
    made = file_source(mesh.file, mesh.unit) if mesh.file else made
    return {"length": mesh.beam.length, "height": mesh.beam.height} | made


def file_source(file, unit):
    """Parameters to read a mesh file: path, unit and hash of the content."""
    state = Path(file).stat()
    return {"file": str(file), "unit": unit, "content": _content(file, state.st_size, state.st_mtime_ns)}


@lru_cache(maxsize=256)
def _content(file, size, time):
    """Hash of a file; cached by its state, since each scene asks."""
    return checksum(file)


@cache
def stem(mesh):
    """Stem of a mesh's files; beams of one extent share it."""
    extent = f"{1e3 * mesh.beam.length:.12g}x{1e3 * mesh.beam.height:.12g}"
    own = f"_{mesh_source(mesh)['content'][:8]}" if mesh.file else ""
    return f"{extent}_{mesh.mesh_type}_{1e3 * mesh.mesh_size:.12g}mm{own}"


@lru_cache(maxsize=1024)
def reference_of(study, *body):
    """Argument of `any_reference.read` for the reference of a beam, material and load."""
    solved, name = solved_reference(*body), LOADS[body[-1]].kind.name
    box, problems = interpolants(study).get(name, (None, {}))
    return solved | ({"interpolant": interpolant_key(name, box), "problem": problems[body]} if body in problems else {})


REFERENCES_OF_SHAPES = (TASK_VALUES, "mesh.sheets", "reference.shapes", "reference.finite_shapes")
"""Modules that the stage `reference` imports, but references of beams do not call."""


def _reference_code(*without):
    """Key of the code that solves references of beams."""
    return stage_key("studies.kinds.bodies.reference", without=(*REFERENCES_OF_SHAPES, *without))


SHAPE_MODULES = (TASK_VALUES, "reference.small_strain", *FINITE_STRAIN, "reference.shapes")
"""Modules that the stage `solve` imports, but scenes of beams do not call."""


@cache
def interpolant_key(kind, box):
    """Key of an interpolant."""
    return hash_of("interpolant", kind, box, _reference_code("reference.finite_strain"))


@cache
def solved_reference(beam, material, load):
    """Key of the unit problem of a reference, and its scales."""
    code = _reference_code("reference.finite_strain", "reference.interpolant")
    key, scales = hash_of(unit_problem_of(beam, material, load), code), unit_scales(beam, material, LOADS[load].kind)
    return {"key": key} | dict(zip(("length", "displacement"), scales))


def finite_key(reference, kind):
    """Key of a reference at finite strain."""
    return hash_of(finite_problem(reference, kind), _reference_code())


def unit_problem_of(beam, material, load):
    """Aspect ratio, Poisson's ratio and name of the kind of load of a beam's reference."""
    aspect_ratio, nu, kind = unit_problem(beam, material, LOADS[load].kind)
    return aspect_ratio, nu, kind.name


def finite_problem(reference, kind):
    """Task of a reference at finite strain."""
    (law, _, plane), load = kind.partition("-plane-"), LOADS[reference.load]
    found = {"law": law, "plane": plane, "load": load.kind.name, "force": reference.force, "follower": load.follower}
    return found | {"beam": beam_key(reference.beam), "material": material_key(reference.material)}


@cache_by_study
def scene_tasks(study):
    """Tasks of a study's scenes by mesh; `stored.stored_key` adds the calibrated stiffness to their keys."""
    return {mesh: list(_scene_tasks(study, mesh, scenes)) for mesh, scenes in by_mesh(study, "scenes").items()}


def _scene_tasks(study, mesh, scenes):
    shared, kept = {}, shown_scenes(study)
    for scene in scenes:
        place = scene.material, scene.load, scene.definition, scene.kinematics
        if place not in shared:
            shared[place] = _network_task(study, mesh, *place)
        task, key = shared[place]
        own, further = {"force": scene.force}, {"keep_fields": True} if scene in kept else {}
        if scene.definition == "paper":
            own["stiffness"] = study.stiffness_table[mesh.mesh_type, scene.material.name]
        if scene.stiffness_scale != 1:
            own["stiffness_scale"] = scene.stiffness_scale
        if scene.definition == "calibrated":  # stiffness is proportional to thickness
            group = calibration_name(scene)
            further["calibration"] = calibrations(study)[group].key
            own["thickness_ratio"] = mesh.beam.thickness / calibration_curves(study)[group][0].mesh.beam.thickness
        # As a text: JSON of 100,000 scenes takes a third of a second.
        yield {**task, **own, **further, "key": hash_of_text(f"{key} {own}")}


def _network_task(study, mesh, material, load, definition, kinematics):
    """Task and key that scenes of a mesh share which differ in force or stiffness only."""
    task = {
        "material": material_key(material),
        "kind": LOADS[load].kind.name,
        # In linear kinematics follower forces keep their initial direction.
        "follower": LOADS[load].follower and kinematics == "nonlinear",
        "definition": definition,
        "kinematics": kinematics,
    }
    reference = reference_of(study, mesh.beam, material, load)
    if "interpolant" not in reference:  # which has no field, all that a scene wants of it
        task["reference"] = reference
    code = stage_key("studies.kinds.bodies.solve", without=SHAPE_MODULES), definition_key(definition)
    return task, hash_of(mesh_key(mesh), mesh.beam.thickness, task, code)


def curve_task(study, curve):
    """Task of a sensitivity curve; its stiffnesses [N/m] ascend."""
    membrane = curve.material.in_plane.young_modulus * curve.mesh.beam.thickness
    task = {
        "kind": LOADS[curve.load].kind.name,
        "force": curve.force,
        "kinematics": curve.kinematics,
        "stiffnesses": [ratio * membrane for ratio in study.stiffness_ratios],
        "reference": reference_of(study, curve.mesh.beam, curve.material, curve.load),
    }
    return {"key": hash_of(mesh_key(curve.mesh), task, stage_key("studies.kinds.bodies.sensitivity"))} | task


def keeps_fields(study):
    """Return whether a study's dataset has whole fields, its group `/fields`."""
    return "deformed" in study.outputs or "paraview" in study.outputs


@cache_by_study
def shown_scenes(study):
    """Scenes with stored fields: those on the coarsest mesh, with one value of each swept parameter."""
    found = set()
    for own in group_by(study.scenes, attrgetter("mesh.beam.name", "mesh.mesh_type", "material.name", "load")).values():
        coarsest = max(scene.mesh.mesh_size for scene in own)
        there = [scene for scene in own if scene.mesh.mesh_size == coarsest]
        ranks = [[shown_order(name, swept_value(one, one.mesh.beam, name)) for name in study.swept] for one in there]
        last = max(ranks)
        found |= {scene for scene, rank in zip(there, ranks) if rank == last}
    return frozenset(found)


@cache_by_study
def calibration_curves(study):
    """Curves that calibrate each group of scenes."""
    chosen = (one for one in study.curves if (one.mesh.beam.name, one.load) == study.calibration)
    return group_by(chosen, calibration_name)


def calibration_name(scene):
    """Name of the group of curves that calibrates a scene, or that has a curve."""
    return f"{scene.mesh.mesh_type}_{hash_of(material_key(scene.material))[:8]}_{scene.kinematics}"


@cache_by_study
def calibrations(study):
    """Tasks of the calibrated stiffnesses by group, all in one job and file."""
    code, found = stage_key("studies.kinds.bodies.calibrate"), {}
    for name in sorted({calibration_name(scene) for scene in study.scenes if scene.definition == "calibrated"}):
        members = [
            {"mesh": stem(one.mesh), "curve": curve_task(study, one)["key"], "load": one.load, "force": one.force}
            for one in calibration_curves(study)[name]
        ]
        found[name] = Task({"members": members}, name="all", file=CALIBRATION_STEM, key=hash_of(members, code))
    return found


# -- shapes ------------------------------------------------------------------------------------------------------------

MOST_PARTICLES_DRAWN = 1500
"""Approximate number of particles of the largest mesh that is drawn, if there is a coarser one."""

FILE_PARTICLES = 2000.0  # assumed number of particles of a mesh file, for expected seconds


def shape_stem(one):
    """Stem of the files of a scene of a shape."""
    return f"shape_{mesh_name(one)}"


def shape_particles(study, one):
    """Approximate number of particles of a scene's mesh."""
    shape = study.shape(one.shape)
    return FILE_PARTICLES if shape.file else particles(shape.area, one.mesh_size)


@cache_by_study
def drawn_scenes(study):
    """Scenes with drawn networks: of each shape and load the finest mesh that is not too large, and one material."""
    found, size, ways = set(), attrgetter("mesh_size"), attrgetter("material", "kinematics")
    for scenes in group_by(study.shapes.scenes, attrgetter("shape", "load")).values():
        few = [one for one in scenes if shape_particles(study, one) <= MOST_PARTICLES_DRAWN]
        mesh = mesh_name(min(few, key=size) if few else max(scenes, key=size))
        alike = [one for one in scenes if mesh_name(one) == mesh]
        found |= {one for one in alike if ways(one) == ways(alike[0])}
    return found


def shape_source(shape, file=""):
    """Parameters of the geometry of a shape, or of one of its files."""
    from .task_values import geometry  # here, as below: studies of beams read this module as well

    return geometry(shape) | (file_source(file or shape.file, shape.unit) if shape.file else {})


def shape_mesh_source(study, one):
    """Parameters to make the mesh of a shape."""
    source = shape_source(study.shape(one.shape), study.shapes.files[one.shape].get(one.mesh_size, ""))
    if "file" in source:
        return source
    refined = {name: share * one.mesh_size for name, share in study.shapes.refined[one.shape].items()}
    return source | {"mesh_size": one.mesh_size, "refined": refined}


@cache_by_study
def shape_mesh_keys(study):
    """Keys of the meshes of shapes by their stem."""
    code = stage_key("studies.kinds.bodies.mesh")
    return {
        name: hash_of(parameters(shape_mesh_source(study, one)), code, _reader_key(study.shape(one.shape)))
        for name, (one, *_) in shape_scenes_by_mesh(study).items()
    }


def _reader_key(shape):
    """Key of the code that reads the mesh file of a shape, or an empty string."""
    return mesh_type_key(MESH_OF_FILE) if shape.file else ""


@lru_cache(maxsize=1024)
def _case_values(study, shape, material, name):
    """Thickness, load and materials of a scene; with densities only under gravity."""
    from .task_values import load

    body = study.shape(shape)
    case, materials = body.loads[name], study.materials_of(shape, material)
    materials = {part: material_key(one, any(case.gravity)) for part, one in materials.items()}
    return {"thickness": body.thickness, "load": load(case), "materials": materials}


def shape_reference_task(study, shape, material, name, law=""):
    """Task of a reference of small strain, or of a law at finite strain."""
    body = study.shape(shape)
    task = {"shape": shape_source(body)} | _case_values(study, shape, material, name) | ({"law": law} if law else {})
    without = "reference.interpolant", *(() if law else FINITE_STRAIN)
    code = stage_key("studies.kinds.bodies.reference", attempts.MODULE, without=without), _reader_key(body)
    return {"key": hash_of(task | {"shape": parameters(task["shape"])}, code)} | task


def shape_scene_task(study, one):
    """Task of a scene of a shape."""
    code = stage_key("studies.kinds.bodies.solve", without=FINITE_STRAIN), definition_key(one.definition)
    task = _case_values(study, one.shape, one.material, one.load)
    task = {**task, "definition": one.definition, "kinematics": one.kinematics}
    kept = SHAPES_OUTPUT in study.outputs and one in drawn_scenes(study)
    key = hash_of(shape_mesh_keys(study)[shape_stem(one)], task, code)
    return {"key": key} | task | ({"keep_fields": True} if kept else {})


# -- stages ------------------------------------------------------------------------------------------------------------


def _mesh_task(name, source, key, particles, scenes, curves=(), meshing=0.0):
    """Task of a mesh with the expected seconds of its scenes and curves."""
    seconds = meshing + (1 + len(curves)) * expected_seconds(particles)
    seconds += sum(expected_seconds(particles, scene.definition) for scene in scenes)
    return Task(source, seconds=seconds, name=name, file=name, key=key)


def _mesh_tasks(study):
    curves = by_mesh(study, "curves")
    for mesh, scenes in by_mesh(study, "scenes").items():
        count, own = particles(mesh.beam.length * mesh.beam.height, mesh.mesh_size), curves.get(mesh, ())
        yield _mesh_task(stem(mesh), mesh_source(mesh), mesh_key(mesh), count, scenes, own)
    for name, scenes in shape_scenes_by_mesh(study).items():
        source, count = shape_mesh_source(study, scenes[0]), shape_particles(study, scenes[0])
        yield _mesh_task(name, source, shape_mesh_keys(study)[name], count, scenes, meshing=0.1)


def _reference_tasks(study):
    """Tasks of references and interpolants; references that share elements are in one job."""
    found = {}
    for one in study.references:
        body = one.beam, one.material, one.load
        if "interpolant" not in (solved := reference_of(study, *body)):
            problem, key = unit_problem_of(*body), solved["key"]
            found[key] = Task({"problem": problem}, seconds=3e-2, name=hash_of(problem[0], problem[2]), key=key)
        for kind in study.further_references:
            values, key = finite_problem(one, kind), finite_key(one, kind)
            found[key] = Task(values, seconds=1.0, name=hash_of(values), key=key)
    yield from found.values()
    for kind, (box, problems) in interpolants(study).items():
        key, keys = interpolant_key(kind, box), {solved_reference(*one)["key"]: unit for one, unit in problems.items()}
        yield Task({"kind": kind, "box": box, "problems": keys}, seconds=10.0, name=key, key=key)
    for one in (*study.shapes.referred, *study.shapes.finite) if study.shapes else ():
        task = shape_reference_task(study, *one)
        yield Task(task, seconds=2.0, name="/".join(one), key=task["key"])


def _curve_tasks(study):
    for one in study.curves:
        task, name = curve_task(study, one), stem(one.mesh)
        yield Task(task, name=name, file=name, key=task["key"])


def _solve_tasks(study):
    for mesh, tasks in scene_tasks(study).items():
        shared, name = {"beam": (mesh.beam.length, mesh.beam.height, mesh.beam.thickness)}, stem(mesh)
        for task in tasks:
            yield Task(task, name=name, file=name, shared=shared, key=task["key"])
    for name, scenes in shape_scenes_by_mesh(study).items():
        shared = {"shape": parameters(shape_source(study.shape(scenes[0].shape)))}
        for task in (shape_scene_task(study, one) for one in scenes):
            yield Task(task, name=name, file=name, shared=shared, key=task["key"])


UNKEYED_VALUES = "keep_fields", "calibration"  # values of scenes that are not in their keys

STAGES = (
    Stage("reference", "studies.kinds.bodies.reference", _reference_tasks, "references"),
    Stage("mesh", "studies.kinds.bodies.mesh", _mesh_tasks, "meshes", endings=(".vtu", ".h5")),
    Stage("sensitivity", "studies.kinds.bodies.sensitivity", _curve_tasks, "curves", like="mesh"),
    Stage("calibrate", "studies.kinds.bodies.calibrate", lambda study: calibrations(study).values(), "curves"),
    Stage("solve", "studies.kinds.bodies.solve", _solve_tasks, "solutions", like="mesh", unkeyed=UNKEYED_VALUES),
)


# -- kind --------------------------------------------------------------------------------------------------------------


def _axes(found):
    if not (shapes := found["shapes"]):
        return {}
    scenes = shapes.scenes
    labels = {name: tuple(dict.fromkeys(getattr(one, name) for one in scenes)) for name in vars(scenes[0])}
    pairs = dict.fromkeys((one.shape, one.load) for one in scenes)
    asked = [one.name for shape, load in pairs for one in shapes.shape[shape].loads[load].quantities]
    return labels | {"quantity": tuple(dict.fromkeys(asked))}


def _extents(shape, file):
    if not file:
        return size_text(*np.ptp(shape.extent, axis=0))
    from springtune.mesh.formats import read_shape  # here: few studies have files

    try:
        sides = np.ptp(read_shape(file, shape.unit).mesh.points, axis=0)
    except ValueError as error:
        return str(error)
    return f"{size_text(*sides)}, {Path(file).name} in units of {shape.unit:g} m"


def _summary(found):
    if not (shapes := found["shapes"]):
        return []
    cases = {(one.shape, one.load) for one in shapes.scenes}
    quantities = sum(len(shapes.shape[shape].loads[load].quantities) for shape, load in cases)
    counts = Counter(one.shape for one in shapes.scenes)
    words = f"{len(counts)} shape{'s' * (len(counts) > 1)} on {len(set(map(mesh_name, shapes.scenes)))} meshes"
    rows = [["shape scenes", len(shapes.scenes), f"of {words}, {quantities} quantities"]]
    for name, count in counts.items():
        shape, files = shapes.shape[name], shapes.files[name].values()
        rows += [[f"  {name}", count, "; ".join(_extents(shape, file) for file in files or [""])]]
    if count := len(shapes.referred) + len(shapes.finite):
        rows.append(["shape references", count, "finite elements on the shapes themselves"])
    return rows


def _files(found):
    shapes = found["shapes"] if found else None
    used = dict.fromkeys(one.shape for one in shapes.scenes) if shapes else ()
    return [Path(file) for shape in used for file in shapes.files[shape].values()]


KIND = StudyKind(
    "bodies",
    study_fields={"shapes": of_shapes.SHAPES_KEY, "shape_grids": of_shapes.SHAPE_GRIDS_KEY},
    instead_of_grids=("shape_grids",),
    reads=("grids",),
    files=_files,
    check=of_shapes.check,
    # Not an empty part, which would say that the study has no bodies.
    expand=lambda config, declared: {"shapes": of_shapes.expand(config, declared) if config.shape_grids else None},
    axes=_axes,
    summary=_summary,
    stages=STAGES,
    outputs=OUTPUTS,
    tables=stems,
)


def summary(study: Study, further: list[list[object]]) -> str:
    """Summary of a study as text: numbers of scenes, meshes, references and curves."""
    title = f"{study.name}: {study.title}"
    if not study.scenes:
        return "\n\n".join([title, aligned(further, left=0, right=(1,))])
    # Sheets of several thicknesses share a mesh.
    meshes = len({(one.beam.length, one.beam.height, one.mesh_type, one.mesh_size, one.file) for one in study.meshes})
    each = (len(study.scenes) + len(study.curves)) / meshes
    requested = sum(len(grid.scenes) for grid in study.grids)
    repeated = requested - len(study.scenes)
    bodies = dict.fromkeys((one.beam, one.material, one.load) for one in study.references)
    solved = {unit_problem_of(*body) for body in bodies if "interpolant" not in reference_of(study, *body)}
    counts = {"solution": len(solved), "interpolant": len(interpolants(study))}
    parts = " and ".join(f"{n} {what}{'s' * (n != 1)}" for what, n in counts.items() if n) or "0 solutions"
    rows: list[list[object]] = [
        ["scenes", len(study.scenes), f"{repeated} of {requested} are in more than one grid" if repeated else ""],
        ["meshes", meshes, f"each serves {each:.3g} scenes and curves on average"],
        ["references", len(study.references), f"from {parts}: small strain scales with force, E t and size"],
        ["curves", len(study.curves), f"{len(study.stiffness_ratios)} stiffnesses each, along one solution path"],
        *further,
        *([["printed", len(study.printed), "cells to compare with"]] if study.printed else []),
    ]
    grids: list[list[object]] = [["grid", "scenes", "new", "meshes", "references", "curves"]]
    seen: set[SceneSpec] = set()
    for grid in study.grids:
        scenes = set(grid.scenes)
        forces = {(scene.mesh.beam, scene.material, scene.load, scene.force) for scene in scenes}
        sizes = len(scenes), len(scenes - seen), len({scene.mesh for scene in scenes}), len(forces), len(grid.curves)
        grids.append([grid.name, *sizes])
        seen |= scenes
    return "\n\n".join([title, aligned(rows, left=0, right=(1,)), aligned(grids, left=0, right=(1, 2, 3, 4, 5))])

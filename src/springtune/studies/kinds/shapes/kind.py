"""Shapes: a study's sections ``shapes`` and ``shape_grids``, one scene each combination of a grid.

Stages with the tasks of their jobs, and keys of results. Most studies have no shapes: their sections, checks and scenes
are imported where one has.
"""

from collections import Counter, defaultdict
from operator import attrgetter
from pathlib import Path

import numpy as np

from springtune.mesh.cells import MeshError
from springtune.problem.geometry import size_text

from ...config.kind import Kind, Stage
from ...runs.attempts import MODULE
from ...runs.keys import definition_key, material_key, mesh_type_key, stage_key
from ...runs.plan import Task
from ...runs.source import hash_of
from ..scenes.plan import (
    expected_seconds,
    file_source,
    parameters,
    particles_in,
)
from .outputs import DRAWING, OUTPUTS, OWN_FILE, mesh_name, stems
from .sections import SHAPE_GRIDS_KEY, SHAPES_KEY

MOST_DRAWN = 1500
"""Particles, about, of the largest mesh that is drawn where a coarser one is there."""

FILE_PARTICLES = 2000.0
"""Particles of a mesh from a file, for costs, before it is read."""


def file_name(one):
    """Stem of its files, which differs from those of beams."""
    return f"shape_{mesh_name(one)}"


def particles(part, one):
    """Approximate number of particles of a scene's mesh."""
    shape = part.shape[one.shape]
    return FILE_PARTICLES if shape.file else particles_in(shape.area, one.mesh_size)


# -- keys --------------------------------------------------------------------------------------------------------------


def _source(shape, file=""):
    """Geometry of a shape, or one of its files."""
    from .task_values import geometry  # here, as below: studies of beams read the stages as well

    return geometry(shape) | (file_source(file or shape.file, shape.unit) if shape.file else {})


def mesh_source(part, one):
    """Source of a scene's mesh."""
    source = _source(part.shape[one.shape], part.files[one.shape].get(one.mesh_size, ""))
    if "file" in source:
        return source
    refined = {name: share * one.mesh_size for name, share in part.refined[one.shape].items()}
    return source | {"mesh_size": one.mesh_size, "refined": refined}


def mesh_key(part, one):
    """Key of a scene's mesh."""
    return hash_of(
        parameters(mesh_source(part, one)), stage_key("studies.kinds.shapes.mesh"), _reader(part.shape[one.shape])
    )


def _reader(shape):
    """Key of the code that reads the mesh file of a shape; empty without a file."""
    return mesh_type_key(OWN_FILE) if shape.file else ""


def _case(part, shape, material, name):
    """Thickness, load and materials of a scene; densities only under gravity."""
    from .task_values import load

    case = part.shape[shape].loads[name]
    weighs = any(case.gravity)
    materials = {key: material_key(one, weighs) for key, one in part.materials_of(shape, material).items()}
    return {"thickness": part.shape[shape].thickness, "load": load(case), "materials": materials}


def reference_task(part, shape, material, name, law=""):
    """Task of a reference of small strain, or of a law at finite strain."""
    task = {"shape": _source(part.shape[shape])} | _case(part, shape, material, name) | ({"law": law} if law else {})
    without = () if law else ("reference.finite_shapes", "reference.finite_strain")
    code = stage_key("studies.kinds.shapes.reference", MODULE, without=without), _reader(part.shape[shape])
    key = hash_of(task | {"shape": parameters(task["shape"])}, code)
    return {"key": key} | task


def scene_task(part, one, kept=()):
    """Task of a scene."""
    task = _case(part, one.shape, one.material, one.load)
    task |= {"definition": one.definition, "kinematics": one.kinematics}
    # References of shapes have tasks of their own.
    without = "reference.finite_shapes", "reference.finite_strain"
    code = stage_key("studies.kinds.shapes.solve", without=without), definition_key(one.definition)
    key = hash_of(mesh_key(part, one), task, code)
    return {"key": key} | task | ({"keep_fields": True} if one in kept else {})


def shown(part):
    """Scenes whose networks are drawn: of a shape and load the finest mesh that is not too large, one material."""
    cases, size = defaultdict(list), attrgetter("mesh_size")
    for one in part.scenes:
        cases[one.shape, one.load].append(one)
    found = set()
    for scenes in cases.values():
        few = [one for one in scenes if particles(part, one) <= MOST_DRAWN]
        mesh = min(few, key=size) if few else max(scenes, key=size)
        alike = [one for one in scenes if mesh_name(one) == mesh_name(mesh)]
        found |= {one for one in alike if (one.material, one.kinematics) == (alike[0].material, alike[0].kinematics)}
    return found


def by_mesh(part):
    """Scenes by the name of their mesh."""
    found = defaultdict(list)
    for one in part.scenes:
        found[mesh_name(one)].append(one)
    return found


# -- stages ------------------------------------------------------------------------------------------------------------


def _mesh_tasks(study):
    """Tasks of meshes, each with the expected seconds of all its scenes."""
    part = study.parts["shapes"]
    for name, scenes in by_mesh(part).items():
        seconds = sum(expected_seconds(particles(part, one), one.definition) for one in scenes)
        one = scenes[0]
        yield Task(mesh_source(part, one), seconds=seconds, name=name, file=file_name(one), key=mesh_key(part, one))


def _reference_tasks(study):
    part = study.parts["shapes"]
    for one in (*part.referred, *part.finite):
        task = reference_task(part, *one)
        yield Task(task, seconds=2.0, name="/".join(one), key=task["key"])


def _solve_tasks(study):
    part = study.parts["shapes"]
    kept = shown(part) if DRAWING in study.outputs else ()
    for name, scenes in by_mesh(part).items():
        shared = {"shape": parameters(_source(part.shape[scenes[0].shape]))}
        for task in (scene_task(part, one, kept) for one in scenes):
            yield Task(task, name=name, file=file_name(scenes[0]), shared=shared, key=task["key"])


STAGES = (
    Stage("shape_reference", "studies.kinds.shapes.reference", _reference_tasks, "shape_references"),
    Stage("shape_mesh", "studies.kinds.shapes.mesh", _mesh_tasks, "meshes", endings=(".vtu", ".h5")),
    Stage("shape_solve", "studies.kinds.shapes.solve", _solve_tasks, "solutions", like="shape_mesh"),
)


def _check(config, problems):
    from .expand import check

    check(config, problems)


def _expand(config, declared):
    if not config.shape_grids:
        return ()
    from .expand import expand

    return expand(config, declared)


def _axes(part):
    labels = {name: tuple(dict.fromkeys(getattr(one, name) for one in part.scenes)) for name in vars(part.scenes[0])}
    pairs = dict.fromkeys((one.shape, one.load) for one in part.scenes)
    asked = [one.name for shape, load in pairs for one in part.shape[shape].loads[load].quantities]
    return labels | {"quantity": tuple(dict.fromkeys(asked))}


def _size(shape, file):
    """Extents of a shape in words, or of a mesh file of it."""
    if not file:
        return size_text(*np.ptp(shape.extent, axis=0))
    from springtune.mesh.formats import read_shape  # here: few studies have files

    try:
        sides = np.ptp(read_shape(file, shape.unit).mesh.points, axis=0)
    except MeshError as error:
        return str(error)
    return f"{size_text(*sides)}, {Path(file).name} in units of {shape.unit:g} m"


def _summary(part):
    sizes = Counter((one.shape, one.mesh_size * (one.mesh_type == OWN_FILE)) for one in part.scenes)
    cases = {(one.shape, one.load) for one in part.scenes}
    quantities = sum(len(part.shape[shape].loads[load].quantities) for shape, load in cases)
    used = {one.shape for one in part.scenes}
    shapes = f"{len(used)} shape{'s' * (len(used) > 1)} on {len(by_mesh(part))} meshes"
    rows = [["shape scenes", len(part.scenes), f"of {shapes}, {quantities} quantities"]]
    rows += [
        [f"  {name}", count, _size(part.shape[name], part.files[name].get(size, ""))]
        for (name, size), count in sizes.items()
    ]
    if count := len(part.referred) + len(part.finite):
        rows.append(["shape references", count, "finite elements on the shapes themselves"])
    return rows


def _files(part):
    used = dict.fromkeys(one.shape for one in part.scenes) if part else ()
    return [Path(file) for shape in used for file in part.files[shape].values()]


KIND = Kind(
    "shapes",
    study_fields={"shapes": SHAPES_KEY, "shape_grids": SHAPE_GRIDS_KEY},
    alone={"shape_grids": ("shapes", "materials")},
    files=_files,
    check=_check,
    expand=_expand,
    axes=_axes,
    summary=_summary,
    stages=STAGES,
    outputs=OUTPUTS,
    tables=stems,
)

"""Keys and tasks of shapes; a study without any imports none of their sections, checks and scenes."""

from collections import defaultdict
from operator import attrgetter

from ...runs import attempts
from ...runs.keys import definition_key, material_key, mesh_type_key, stage_key
from ...runs.source import hash_of
from .beam_plan import file_source, parameters, particles_in
from .outputs import OWN_FILE, mesh_name

MOST_DRAWN = 1500
"""Particles, about, of the largest mesh that is drawn where a coarser one is there."""

FILE_PARTICLES = 2000.0
"""Particles of a mesh from a file, for costs, before it is read."""


def file_name(one):
    """Stem of its files, which differs from those of beams."""
    return f"shape_{mesh_name(one)}"


def particles(shapes, one):
    """Approximate number of particles of a scene's mesh."""
    shape = shapes.shape[one.shape]
    return FILE_PARTICLES if shape.file else particles_in(shape.area, one.mesh_size)


# -- keys --------------------------------------------------------------------------------------------------------------


def source_of(shape, file=""):
    """Geometry of a shape, or one of its files."""
    from .task_values import geometry  # here, as below: studies of beams read the stages as well

    return geometry(shape) | (file_source(file or shape.file, shape.unit) if shape.file else {})


def mesh_source(shapes, one):
    """Source of a scene's mesh."""
    source = source_of(shapes.shape[one.shape], shapes.files[one.shape].get(one.mesh_size, ""))
    if "file" in source:
        return source
    refined = {name: share * one.mesh_size for name, share in shapes.refined[one.shape].items()}
    return source | {"mesh_size": one.mesh_size, "refined": refined}


def mesh_key(shapes, one):
    """Key of a scene's mesh."""
    return hash_of(
        parameters(mesh_source(shapes, one)), stage_key("studies.kinds.bodies.mesh"), _reader(shapes.shape[one.shape])
    )


def _reader(shape):
    """Key of the code that reads the mesh file of a shape; empty without a file."""
    return mesh_type_key(OWN_FILE) if shape.file else ""


def _case(shapes, shape, material, name):
    """Thickness, load and materials of a scene; densities only under gravity."""
    from .task_values import load

    case = shapes.shape[shape].loads[name]
    weighs = any(case.gravity)
    materials = {key: material_key(one, weighs) for key, one in shapes.materials_of(shape, material).items()}
    return {"thickness": shapes.shape[shape].thickness, "load": load(case), "materials": materials}


def reference_task(shapes, shape, material, name, law=""):
    """Task of a reference of small strain, or of a law at finite strain."""
    task = {"shape": source_of(shapes.shape[shape])} | _case(shapes, shape, material, name)
    task |= {"law": law} if law else {}
    without = () if law else ("reference.finite_shapes", "reference.finite_strain")
    code = (
        stage_key("studies.kinds.bodies.shape_reference", attempts.MODULE, without=without),
        _reader(shapes.shape[shape]),
    )
    key = hash_of(task | {"shape": parameters(task["shape"])}, code)
    return {"key": key} | task


def scene_task(shapes, one, kept=()):
    """Task of a scene."""
    task = _case(shapes, one.shape, one.material, one.load)
    task |= {"definition": one.definition, "kinematics": one.kinematics}
    # References of shapes have tasks of their own.
    without = "reference.finite_shapes", "reference.finite_strain"
    code = stage_key("studies.kinds.bodies.solve", without=without), definition_key(one.definition)
    key = hash_of(mesh_key(shapes, one), task, code)
    return {"key": key} | task | ({"keep_fields": True} if one in kept else {})


def shown(shapes):
    """Scenes whose networks are drawn: of a shape and load the finest mesh that is not too large, one material."""
    cases, size = defaultdict(list), attrgetter("mesh_size")
    for one in shapes.scenes:
        cases[one.shape, one.load].append(one)
    found = set()
    for scenes in cases.values():
        few = [one for one in scenes if particles(shapes, one) <= MOST_DRAWN]
        mesh = min(few, key=size) if few else max(scenes, key=size)
        alike = [one for one in scenes if mesh_name(one) == mesh_name(mesh)]
        found |= {one for one in alike if (one.material, one.kinematics) == (alike[0].material, alike[0].kinematics)}
    return found


def by_mesh(shapes):
    """Scenes by the name of their mesh."""
    found = defaultdict(list)
    for one in shapes.scenes:
        found[mesh_name(one)].append(one)
    return found

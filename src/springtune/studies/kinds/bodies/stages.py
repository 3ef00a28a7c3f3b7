"""Stages of beams and shapes: `mesh`, `sensitivity` and `solve` share bundles of meshes."""

from ...config.kind import Stage
from ...runs.plan import Task
from ...runs.source import hash_of
from . import beam_plan, shape_plan
from .beam_plan import expected_seconds, stem
from .outputs import DRAWING
from .shape_plan import file_name


def _mesh_tasks(study):
    """Tasks of meshes, each with the expected seconds of all that is solved on it."""
    curves, shapes = beam_plan.curves_by_mesh(study), study.shapes
    for mesh, scenes in beam_plan.scenes_by_mesh(study).items():
        count, name = beam_plan.particles(mesh), stem(mesh)
        seconds = (1 + len(curves.get(mesh, ()))) * expected_seconds(count)
        seconds += sum(expected_seconds(count, scene.definition) for scene in scenes)
        yield Task(beam_plan.mesh_source(mesh), seconds=seconds, name=name, file=name, key=beam_plan.mesh_key(mesh))
    for one, *others in shape_plan.by_mesh(shapes).values() if shapes else ():
        count, name = shape_plan.particles(shapes, one), file_name(one)
        seconds = sum(expected_seconds(count, scene.definition) for scene in (one, *others))
        source = shape_plan.mesh_source(shapes, one)
        yield Task(source, seconds=seconds, name=name, file=name, key=shape_plan.mesh_key(shapes, one))


def _reference_tasks(study):
    """Tasks of references, of which those that share elements are in one job, and of interpolants."""
    found, shapes = {}, study.shapes
    for one in study.references:
        body = one.beam, one.material, one.load
        if "interpolant" not in beam_plan.reference_of(study, *body):
            problem, key = beam_plan.unit_problem_of(*body), beam_plan.solved_reference(*body)["key"]
            name = hash_of(problem[0], problem[2])
            found[key] = Task({"problem": problem}, seconds=3e-2, name=name, key=key)
        for kind in study.further_references:
            values, key = beam_plan.finite_problem(one, kind), beam_plan.finite_key(one, kind)
            found[key] = Task(values, seconds=1.0, name=hash_of(values), key=key)
    yield from found.values()
    for kind, (box, problems) in beam_plan.interpolants(study).items():
        key = beam_plan.interpolant_key(kind, box)
        keys = {beam_plan.solved_reference(*body)["key"]: problem for body, problem in problems.items()}
        values = {"kind": kind, "box": box, "problems": keys}
        yield Task(values, seconds=3e-2 * beam_plan.expected_solves(box), name=key, key=key)
    for one in (*shapes.referred, *shapes.finite) if shapes else ():
        task = shape_plan.reference_task(shapes, *one)
        yield Task(task, seconds=2.0, name="/".join(one), key=task["key"])


def _curve_tasks(study):
    for mesh, curves in beam_plan.curves_by_mesh(study).items():
        for task in (beam_plan.curve_task(study, one) for one in curves):
            yield Task(task, name=stem(mesh), file=stem(mesh), key=task["key"])


def _calibration_tasks(study):
    return beam_plan.calibrations(study).values()


def _solve_tasks(study):
    for mesh, tasks in beam_plan.scene_tasks(study).items():
        shared, name = {"beam": (mesh.beam.length, mesh.beam.height, mesh.beam.thickness)}, stem(mesh)
        for task in tasks:
            yield Task(task, name=name, file=name, shared=shared, key=task["key"])
    if shapes := study.shapes:
        kept = shape_plan.shown(shapes) if DRAWING in study.outputs else ()
        for scenes in shape_plan.by_mesh(shapes).values():
            name = file_name(scenes[0])
            shared = {"shape": beam_plan.parameters(shape_plan.source_of(shapes.shape[scenes[0].shape]))}
            for task in (shape_plan.scene_task(shapes, one, kept) for one in scenes):
                yield Task(task, name=name, file=name, shared=shared, key=task["key"])


STAGES = (
    Stage("reference", "studies.kinds.bodies.reference", _reference_tasks, "references"),
    Stage("mesh", "studies.kinds.bodies.mesh", _mesh_tasks, "meshes", endings=(".vtu", ".h5")),
    Stage("sensitivity", "studies.kinds.bodies.sensitivity", _curve_tasks, "curves", like="mesh"),
    Stage("calibrate", "studies.kinds.bodies.calibrate", _calibration_tasks, "curves"),
    Stage("solve", "studies.kinds.bodies.solve", _solve_tasks, "solutions", like="mesh"),
)

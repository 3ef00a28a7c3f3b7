"""Bodies: the beams of a study's grids, and the shapes of its sections ``shapes`` and ``shape_grids``."""

from collections import Counter
from pathlib import Path

import numpy as np

from springtune.problem.loads import LOADS
from springtune.problem.shapes import size_text
from springtune.reference.answers import unit_problem
from springtune.safe_io.texts import aligned

from ...config.kind import StudyKind
from ...config.model import SceneSpec, Study
from .outputs import OUTPUTS, mesh_name, stems
from .plan import STAGES, interpolants, reference_of
from .shape_sections import SHAPE_GRIDS_KEY, SHAPES_KEY


def _check(config, problems):
    if not (config.shapes or config.shape_grids):
        return
    from .shape_expand import check  # here, as below: most studies have no shapes

    check(config, problems)


def _expand(config, declared):
    if not config.shape_grids:
        return {"shapes": None}  # grids alone: an empty part would say that the study has no bodies
    from .shape_expand import expand

    return {"shapes": expand(config, declared)}


def _axes(found):
    shapes = found["shapes"]
    if not shapes:
        return {}
    scenes = shapes.scenes
    labels = {name: tuple(dict.fromkeys(getattr(one, name) for one in scenes)) for name in vars(scenes[0])}
    pairs = dict.fromkeys((one.shape, one.load) for one in scenes)
    asked = [one.name for shape, load in pairs for one in shapes.shape[shape].loads[load].quantities]
    return labels | {"quantity": tuple(dict.fromkeys(asked))}


def _extents(shape, file):
    """Text of the extents of a shape or of its mesh file."""
    if not file:
        return size_text(*np.ptp(shape.extent, axis=0))
    from springtune.mesh.formats import read_shape  # here: few studies have files

    try:
        sides = np.ptp(read_shape(file, shape.unit).mesh.points, axis=0)
    except ValueError as error:
        return str(error)
    return f"{size_text(*sides)}, {Path(file).name} in units of {shape.unit:g} m"


def _summary(found):
    shapes = found["shapes"]
    if not shapes:
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
    study_fields={"shapes": SHAPES_KEY, "shape_grids": SHAPE_GRIDS_KEY},
    alone=("shape_grids",),
    reads=("grids",),
    files=_files,
    check=_check,
    expand=_expand,
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
        return "\n".join([title, "", aligned(further, left=0, right=(1,))])
    # Sheets of several thicknesses share a mesh.
    meshes = len({(one.beam.length, one.beam.height, one.mesh_type, one.mesh_size, one.file) for one in study.meshes})
    each = (len(study.scenes) + len(study.curves)) / meshes
    requested = sum(len(grid.scenes) for grid in study.grids)
    repeated = requested - len(study.scenes)
    again = f"{repeated} of {requested} are in more than one grid" if repeated else ""
    scaled = "small strain scales with force, E t and size"
    rows: list[list[object]] = [
        ["scenes", len(study.scenes), again],
        ["meshes", meshes, f"each serves {each:.3g} scenes and curves on average"],
        ["references", len(study.references), f"from {_count_solutions(study)}: {scaled}"],
        ["curves", len(study.curves), f"{len(study.stiffness_ratios)} stiffnesses each, along one solution path"],
        *further,
        *([["printed", len(study.printed), "cells to compare with"]] if study.printed else []),
    ]
    grids = aligned(_grid_rows(study), left=0, right=(1, 2, 3, 4, 5))
    return "\n".join([title, "", aligned(rows, left=0, right=(1,)), "", grids])


def _count_solutions(study: Study) -> str:
    """Text of the number of finite-element solutions and interpolants."""
    problems = {
        unit_problem(one.beam, one.material, LOADS[one.load].kind)
        for one in study.references
        if "interpolant" not in reference_of(study, one.beam, one.material, one.load)
    }
    alone, interpolated = len(problems), len(interpolants(study))
    words = [f"{alone} solution{'s' * (alone != 1)}"] if alone or not interpolated else []
    words += [f"{interpolated} interpolant{'s' * (interpolated != 1)}"] if interpolated else []
    return " and ".join(words)


def _grid_rows(study: Study) -> list[list[object]]:
    """Rows of the table of grids; new scenes are in no grid above."""
    rows: list[list[object]] = [["grid", "scenes", "new", "meshes", "references", "curves"]]
    seen: set[SceneSpec] = set()
    for grid in study.grids:
        scenes = set(grid.scenes)
        references = {(scene.mesh.beam, scene.material, scene.load, scene.force) for scene in scenes}
        meshes = {scene.mesh for scene in scenes}
        rows.append([grid.name, len(scenes), len(scenes - seen), len(meshes), len(references), len(grid.curves)])
        seen |= scenes
    return rows

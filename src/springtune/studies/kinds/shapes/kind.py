"""Shapes: a study's sections ``shapes`` and ``shape_grids``, one scene each combination of a grid.

Most studies have none: their sections, checks and scenes are imported where one has.
"""

from pathlib import Path

from pydantic import Field

from ...config.kind import Kind
from ...config.sections import Later
from .outputs import OUTPUTS, stems
from .plan import STAGES, pieces, take


def _check(config, problems):
    if config.shapes or config.shape_grids:
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


def _summary(part):
    meshes = {(one.shape, one.mesh_type, one.mesh_size) for one in part.scenes}
    cases = {(one.shape, one.load) for one in part.scenes}
    quantities = sum(len(part.shape[shape].loads[load].quantities) for shape, load in cases)
    shapes = f"{len(part.shapes)} shape{'s' * (len(part.shapes) > 1)}"
    rows = [["shape scenes", len(part.scenes), f"of {shapes} on {len(meshes)} meshes, {quantities} quantities"]]
    if part.referred:
        rows.append(["shape references", len(part.referred), "finite elements on the shapes themselves"])
    return rows


def _files(part):
    return [Path(shape.file) for shape in part.shapes if shape.file] if part else []


KIND = Kind(
    "shapes",
    study_fields={
        "shapes": (
            Later("studies.kinds.shapes.sections", "NAMED_SHAPES"),
            Field(None, description="Shapes: bodies of any outline, or those of mesh files, and their loads."),
        ),
        "shape_grids": (
            Later("studies.kinds.shapes.sections", "NAMED_GRIDS"),
            Field(
                None,
                description="What is to be computed of the shapes; it makes the group `/shapes`. A study that has it "
                "needs neither beams nor grids.",
            ),
        ),
    },
    alone=("shape_grids",),
    files=_files,
    check=_check,
    expand=_expand,
    axes=_axes,
    summary=_summary,
    stages=STAGES,
    outputs=OUTPUTS,
    tables=stems,
    tables_by="outputs",
    pieces=pieces,
    take=take,
    costs={"shape_mesh": (2e-2, 2.5e-5), "shape_reference": (2.0, 0.0), "shape_scene": (5e-3, 2e-5)},
)

"""Scenes of the grids: a study's own sections say what they are, see `springtune.studies.config.sections`.

And the summary of a study before it runs.
"""

from springtune.problem.loads import LOADS
from springtune.reference.answers import unit_problem
from springtune.safe_io.tables import aligned

from ...config.kind import Kind
from ...config.model import SceneSpec, Study
from .outputs import OUTPUTS, stems
from .plan import STAGES, expected_solves, interpolants, reference_of

KIND = Kind(
    "scenes",
    # Scenes are a study's own: its part says only that it has some.
    expand=lambda config, declared: config.grids,
    stages=STAGES,
    outputs=OUTPUTS,
    tables=stems,
)


def summary(study: Study, further: list[list[object]]) -> str:
    """Summary of a study as text: what it asks for, and what is shared."""
    title = f"{study.name}: {study.title}"
    if not study.scenes:
        return "\n".join([title, "", aligned(further, left=0, right=(1,))])
    # Sheets of several thicknesses share a mesh.
    meshes = len({(one.beam.length, one.beam.height, one.mesh_type, one.mesh_size, one.file) for one in study.meshes})
    each = (len(study.scenes) + len(study.curves)) / meshes
    requested = sum(len(grid.scenes) for grid in study.grids)
    repeated = requested - len(study.scenes)
    again = f"{requested} asked, {repeated} of them more than once" if repeated else ""
    scaled = "small strain scales with force, E t and size"
    rows: list[list[object]] = [
        ["scenes", len(study.scenes), again],
        ["meshes", meshes, f"each serves {each:.3g} scenes and curves on average"],
        ["references", len(study.references), f"from {_solutions(study)}: {scaled}"],
        ["curves", len(study.curves), f"of {len(study.stiffness_ratios)} stiffnesses, each one continuation in F/k"],
        *further,
        *([["printed", len(study.printed), "cells to compare with"]] if study.printed else []),
    ]
    grids = aligned(_contributions(study), left=0, right=(1, 2, 3, 4, 5))
    return "\n".join([title, "", aligned(rows, left=0, right=(1,)), "", grids])


def _solutions(study: Study) -> str:
    """Number of finite-element solutions of the references, in words."""
    known = interpolants(study)
    problems = {
        unit_problem(one.beam, one.material, LOADS[one.load].kind)
        for one in study.references
        if "interpolant" not in reference_of(study, one.beam, one.material, one.load)
    }
    if not known:
        return f"{len(problems)} solution{'s' * (len(problems) != 1)}"
    count = len(problems) + sum(expected_solves(box) for box, _ in known.values())
    return f"about {count} solutions and interpolation between them"


def _contributions(study: Study) -> list[list[object]]:
    """Rows of a table of grids; new scenes are those that no grid above has."""
    rows: list[list[object]] = [["grid", "scenes", "new", "meshes", "references", "curves"]]
    seen: set[SceneSpec] = set()
    for grid in study.grids:
        scenes = set(grid.scenes)
        references = {(scene.mesh.beam, scene.material, scene.load, scene.force) for scene in scenes}
        meshes = {scene.mesh for scene in scenes}
        rows.append([grid.name, len(scenes), len(scenes - seen), len(meshes), len(references), len(grid.curves)])
        seen |= scenes
    return rows

"""Scenes of the grids: a study's own sections say what they are, see `springtune.studies.config.sections`.

And the summary of a study before it runs.
"""

from math import prod

from springtune.problem.loads import LOADS
from springtune.reference.answers import unit_problem
from springtune.safe_io.tables import aligned
from springtune.springs.base import DEFINITIONS

from ...config.kind import Kind
from ...config.model import SceneSpec, Study
from .outputs import OUTPUTS, stems
from .plan import STAGES, expected_solves, interpolants

KIND = Kind(
    "scenes",
    # Scenes are a study's own: its part says only that it has some.
    expand=lambda config, declared: config.grids,
    stages=STAGES,
    outputs=OUTPUTS,
    tables=stems,
)


SCENE_DIMENSIONS = ("beam", "mesh_type", "mesh_size", "material", "load", "definition", "kinematics")
"""Dimensions of every dataset."""

SPARSE = 50
"""So many cells to a scene are worth a word."""


def summary(study: Study, further: list[list[object]]) -> str:
    """Summary of a study as text: what it asks for, and what is shared."""
    title = f"{study.name}: {study.title}"
    if not study.scenes:
        return "\n".join([title, "", aligned(further, left=0, right=(1,))])
    solutions = _solutions(study)
    networks = _networks(study)
    requested = sum(len(grid.scenes) for grid in study.grids)
    # Sheets of several thicknesses share a mesh.
    meshes = len({(one.beam.length, one.beam.height, one.mesh_type, one.mesh_size, one.file) for one in study.meshes})
    users = len(study.scenes) + len(study.curves)
    repeated = requested - len(study.scenes)
    again = f"{requested} asked, {repeated} of them more than once" if repeated else ""
    rows: list[list[object]] = [
        ["scenes", len(study.scenes), again],
        ["meshes", meshes, f"each serves {users / meshes:.3g} scenes and curves on average"],
        ["references", len(study.references), f"from {solutions}: small strain scales with force, E t and size"],
        ["curves", len(study.curves), f"of {len(study.stiffness_ratios)} stiffnesses, each one continuation in F/k"],
        ["networks", networks, "to factorize at rest, at most: loads and uniform stiffnesses share one a mesh"],
    ]
    cells = prod(len(study.axes[name]) for name in (*SCENE_DIMENSIONS, *study.swept))
    if cells > SPARSE * len(study.scenes):
        rows.append(["cells", cells, "of all labels together, each held by the dataset: fewer in studies of their own"])
    rows += further
    if study.printed:
        rows.append(["printed", len(study.printed), f"cells to compare with, {_within(study)} of them in this study"])
    lines = [title, "", aligned(rows, left=0, right=(1,)), ""]
    return "\n".join([*lines, aligned(_contributions(study), left=0, right=(1, 2, 3, 4, 5))])


def _solutions(study: Study) -> str:
    """Number of finite-element solutions of the references, in words."""
    problems, known = set(), interpolants(study)
    for one in study.references:
        kind = LOADS[one.load].kind
        if (one.beam, one.material, one.load) not in known.get(kind.name, (None, {}))[1]:
            problems.add(unit_problem(one.beam, one.material, kind))
    if not known:
        return _count(len(problems), "solution")
    count = len(problems) + sum(expected_solves(box) for box, _ in known.values())
    return f"about {count} solutions and interpolation between them"


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}{'e' if noun.endswith('ch') else ''}s"


def _networks(study: Study) -> int:
    """Number of distinct tangents at rest, at most: uniform networks of a mesh differ by a factor only."""
    found: set[tuple[object, ...]] = {(curve.mesh, LOADS[curve.load].kind.held, "uniform") for curve in study.curves}
    for scene in study.scenes:
        uniform = DEFINITIONS[scene.definition].uniform
        held = LOADS[scene.load].kind.held
        found.add(
            (scene.mesh, held, "uniform" if uniform else (scene.definition, scene.material.in_plane.poisson_ratio))
        )
    return len(found)


def _within(study: Study) -> int:
    """Number of printed cells that the study has scenes for."""
    cells = {(*scene.mesh.labels.values(), scene.material.name, scene.load) for scene in study.scenes}
    return sum((cell.beam, cell.mesh_type, cell.mesh_size, cell.material, cell.load) in cells for cell in study.printed)


def _contributions(study: Study) -> list[list[object]]:
    """Rows of a table of grids; new scenes are those that no grid above has."""
    rows: list[list[object]] = [["grid", "scenes", "new", "meshes", "references", "curves"]]
    seen: set[SceneSpec] = set()
    own, traced = set(study.scenes), set(study.curves)
    for grid in study.grids:
        scenes = [scene for scene in grid.scenes if scene in own]
        meshes = {scene.mesh for scene in scenes}
        references = {(scene.mesh.beam, scene.material, scene.load, scene.force) for scene in scenes}
        new = set(scenes) - seen
        seen |= new
        curves = traced.intersection(grid.curves)
        rows.append([grid.name, len(scenes), len(new), len(meshes), len(references), len(curves)])
    extra = set(study.curves) - {curve for grid in study.grids for curve in grid.curves}
    if extra:
        rows.append(["(calibration)", "", "", "", "", len(extra)])
    return rows

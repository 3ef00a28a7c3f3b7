"""Outputs of beams and shapes: their figures and tables."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache, partial
from operator import itemgetter
from typing import Any

from springtune.problem.loads import LOADS

from ...config.model import Output, Study
from ...config.model import stem as figure_stem

SENSITIVITY_LABELS = ("beam", "mesh_type", "material", "load")
"""Dimensions with one label in a figure of sensitivity curves."""

SCENE_LABELS = ("mesh_type", "material", "load")
"""Dimensions with one label in figures of errors and of deformed networks."""

SWEPT_SHOWN = {
    "force": ("Force [N]", "force_N", 1.0),
    "thickness": ("Thickness [mm]", "thickness_mm", 1e3),
    "young_modulus": ("Young's modulus [MPa]", "young_modulus_MPa", 1e-6),
    "poisson_ratio": ("Poisson's ratio", "poisson_ratio", 1.0),
    "stiffness_scale": ("Factor on the stiffness", "stiffness_scale", 1.0),
}
"""Swept parameters: label of an axis, column of a table, and factor on values of the dataset."""

BODY_NAMES = {"thickness": "beam_thickness"} | {name: f"material_{name}" for name in ("young_modulus", "poisson_ratio")}
"""Variable of a dataset that holds a parameter of beams or materials."""

PLOTS = "studies.kinds.bodies.beam_figures"

TABLE_LABELS = ("load", "mesh_type", "material")  # dimensions with one label in a table, as in the paper


cache_by_study = lru_cache(maxsize=8)  # decorator of a function of a study whose last answers are kept


def shown_order(name: str, value: float) -> float:
    """Rank of a swept parameter's value: if only one can be shown, it is the last one present."""
    return -abs(value - 1) if name == "stiffness_scale" else value


def distinct_cells(name: str, labels: Iterable[str], cells: Iterable[Mapping[str, Any]]) -> dict[str, dict[str, str]]:
    """Distinct selections of the dimensions `labels` among a study's cells, in order, by stem."""
    chosen = [{label: cell[label] for label in labels} for cell in cells]
    return {figure_stem(name, one): one for one in chosen}


def stem(selection: Mapping[str, str], number: int | None = None) -> str:
    """Stem of a table's file, by the paper's number or by its labels."""
    return f"table_{number}" if number else "_".join(selection[label] for label in TABLE_LABELS)


@cache_by_study
def stems(study: Study) -> list[str]:
    """Stems of the tables of a study's scenes."""
    numbers = {(cell.load, cell.mesh_type, cell.material): cell.table for cell in study.printed}
    chosen = dict.fromkeys((scene.load, scene.mesh.mesh_type, scene.material.name) for scene in study.scenes)
    found = [stem(dict(zip(TABLE_LABELS, labels)), numbers.get(labels)) for labels in chosen]
    further = {"finite_strain": study.further_references, "block": has_pressure(study), "shapes": study.shapes}
    return found + [name for name, there in further.items() if there]


@cache_by_study
def has_pressure(study: Study) -> bool:
    """Whether a study has scenes under pressure."""
    return any(LOADS[scene.load].kind.pressed for scene in study.scenes)


def _lack_of_pressure(study: Study) -> str:
    return "" if has_pressure(study) else "shows scenes under pressure and no grid has them; add load 'pressure'"


def _sweeps(study: Study) -> dict[str, Mapping[str, object]]:
    """Selections of the figures of swept parameters with several values, by stem."""
    found: dict[str, Mapping[str, object]] = {}
    for name in study.swept:
        place = itemgetter(*SCENE_LABELS, "kinematics", "beam", name)
        counts = Counter(values[:-1] for values in dict.fromkeys(map(place, map(study.labels, study.scenes))))
        several = [dict(zip(SCENE_LABELS, values)) for values, count in counts.items() if count > 1]
        found |= distinct_cells(f"sweep_{name}", SCENE_LABELS, several)
    return found


MESH_AXES = ("shape", "mesh_type", "mesh_size")
CASE_AXES = ("shape", "material", "load")
SCENE_AXES = (*MESH_AXES, "material", "load", "definition", "kinematics")  # dimensions of the group ``/shapes``

GENERATED_MESH = "free"  # mesh type of shapes with an outline: Delaunay triangles inside it

MESH_OF_FILE = "file"  # mesh type of a shape with mesh files

SHAPES_OUTPUT = "shapes"  # output that needs whole networks

ERRORS_STEM, DEFORMED_STEM = "shapes_errors", "shapes_deformed"
"""Begins of the stems of the figures of a shape under a load."""


def mesh_name(one: Any) -> str:
    """Readable name of a scene's mesh."""
    return f"{one.shape}_{one.mesh_type}" + (f"_{1e3 * one.mesh_size:.9g}mm" if one.mesh_size else "")


def shape_figures(cases: list[dict[str, str]]) -> dict[str, dict[str, str]]:
    """Selections by stem: of all quantities, and of the errors and networks of each shape and load."""
    found: dict[str, dict[str, str]] = {"shapes_overview": {}} if cases else {}
    return found | {figure_stem(name, one): one for name in (ERRORS_STEM, DEFORMED_STEM) for one in cases}


def _figures_of_shapes(study: Study) -> dict[str, dict[str, str]]:
    pairs = dict.fromkeys((one.shape, one.load) for one in study.shapes.scenes) if study.shapes else ()
    return shape_figures([{"shape": shape, "load": load} for shape, load in pairs])


def _of_scenes(name: str) -> Callable[[Study], dict[str, dict[str, str]]]:
    """Figures of the scenes of each mesh type, material and load."""
    return lambda study: distinct_cells(name, SCENE_LABELS, map(study.labels, study.scenes))


SceneOutput = partial(Output, job="scenes", usual=True)

OUTPUTS = (
    SceneOutput(
        "sensitivity",
        "sensitivity curves",
        lambda study: distinct_cells("sensitivity", SENSITIVITY_LABELS, map(study.labels, study.curves)),
        plot=f"{PLOTS}:sensitivity",
        job="sensitivity",
    ),
    SceneOutput("size", "errors against mesh size", _of_scenes("size"), plot=f"{PLOTS}:size"),
    SceneOutput(
        "deformed", "deformed networks, and the group `/fields`", _of_scenes("deformed"), plot=f"{PLOTS}:deformed"
    ),
    SceneOutput(
        "sweep",
        "errors against a swept force, thickness, modulus, Poisson's ratio or stiffness",
        _sweeps,
        plot=f"{PLOTS}:sweep",
    ),
    Output(
        "paraview",
        "files for ParaView, with the force of each spring, and the group `/fields`",
        tables=lambda study: ["scenes.csv"],
        write="studies.output.export:write_scenes",
        into="paraview",
        job="scenes",
    ),
    SceneOutput("tables", "the paper's tables, on one page", page=True),
    Output(
        "block",
        "a pressed face",
        lambda study: {"block": {}},
        plot=f"{PLOTS}:block",
        job="scenes",
        lack=_lack_of_pressure,
    ),
    Output(
        SHAPES_OUTPUT,
        "errors and deformed networks of shapes, and the group `/shape_fields`",
        figures=_figures_of_shapes,
        plot="studies.kinds.bodies.shape_figures:shapes",
        job="shapes",
        usual=True,
    ),
)

"""Figures, table and browse views of runs in engines."""

from ...config.kind import Output
from ...output.browse import Plot, View


def _figures(study):
    shown = [("curves" if run.of_curve else "errors", run.labels["scene"]) for run in study.parts["engines"]]
    return {f"engines_{name}_{scene}": {"scene": scene} for name, scene in shown}


OUTPUTS = (
    Output(
        "engines",
        "errors over frame time and sensitivity curves in engines",
        figures=_figures,
        plot="studies.kinds.engines.figures:engines",
        shows="scenes in engines",
    ),
)

VIEWS = (
    View(
        "/engines",
        "Engines",
        "Scenes in engines at rest: error and time of a frame by setting.",
        (
            Plot("error over iterations", "error", "iterations", "engine", log="xy"),
            Plot("error over the time of a frame", "error", "frame_seconds", "engine", along="iterations", log="xy"),
            Plot("error over substeps", "error", "substeps", "engine", log="xy"),
            Plot("error by setting", "error", "iterations", "substeps", "map"),
            Plot("how runs end", "engine_status", "iterations", "substeps", "map"),
            Plot("error by engine and definition", "error", "engine", "definition", "map"),
            Plot("time of a frame", "frame_seconds", "iterations", "engine", log="xy"),
        ),
    ),
    View(
        "/engine_curves",
        "Engine curves",
        "Sensitivity curves in engines: error by the factor on the typed stiffness.",
        (
            Plot("error over the typed factor", "error", "stiffness_factor", "engine", log="xy"),
            Plot("error over the typed factor, by iterations", "error", "stiffness_factor", "iterations", log="xy"),
            Plot("best factor over iterations", "best_factor", "iterations", "engine", log="xy"),
        ),
    ),
)

ENGINE_COLUMNS = {
    "dt_ms": ("dt", 1e3),
    "displacement_mm": ("displacement", 1e3),
    "reference_mm": ("reference_displacement", 1e3),
    "error_percent": ("error", 100),
    "definition_error_percent": ("definition_error", 100),
    "solver_error_percent": ("solver_error", 100),
    "frame_ms": ("frame_seconds", 1e3),
}
"""Columns of the table: variable and factor."""


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.bodies.tables.tables`."""
    from ...output.selection import table_rows  # here, since a plan does without xarray
    from . import RUN_ENDS

    if "engines" not in tree:
        return []
    data = tree["engines"].to_dataset()
    names = ("scene", "definition", "engine", "precision", "substeps", "iterations", "engine_status", "message")
    rows = table_rows(data, data.status != 0, names, ENGINE_COLUMNS)
    rows = [row | {"engine_status": RUN_ENDS[row["engine_status"]]} for row in rows]
    note = "Displacement at rest against finite elements: error of the definition in equilibrium, and of the solver."
    return [{"stem": "engines", "title": "Scenes in engines", "note": note, "rows": rows}]

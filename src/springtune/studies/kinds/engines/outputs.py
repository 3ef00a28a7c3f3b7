"""Figures, table and browse views of runs in engines."""

from ...config.kind import Output


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


ENGINE_COLUMNS = (
    {"dt_ms": ("dt", 1e3), "displacement_mm": ("displacement", 1e3), "reference_mm": ("reference_displacement", 1e3)}
    | {f"{name}_percent": (name, 100) for name in ("error", "definition_error", "solver_error")}
    | {"frame_ms": ("frame_seconds", 1e3)}
)
"""Columns of the table: variable and factor."""


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.bodies.tables.tables`."""
    from ...output.dataset import table_rows  # here, since a plan does without xarray
    from . import RUN_ENDS

    if "engines" not in tree:
        return []
    data = tree["engines"].to_dataset()
    names = ("scene", "definition", "engine", "precision", "substeps", "iterations", "engine_status", "message")
    rows = table_rows(data, data.status != 0, names, ENGINE_COLUMNS)
    rows = [row | {"engine_status": RUN_ENDS[row["engine_status"]]} for row in rows]
    note = "Displacement at rest against finite elements: error of the definition in equilibrium, and of the solver."
    return [{"stem": "engines", "title": "Scenes in engines", "note": note, "rows": rows}]

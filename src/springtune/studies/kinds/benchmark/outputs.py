"""Figures, tables and browse views of the benchmark."""

from ...config.kind import Output
from . import PARTS

OUTPUTS = (
    Output(
        "benchmark",
        "run time against error",
        figures=lambda study: {f"benchmark_{scene}": {"scene": scene} for scene in study.parts["benchmark"]},
        plot="studies.kinds.benchmark.figures:benchmark",
        shows="a benchmark",
    ),
)


CASE_COLUMNS = {"mesh_size_mm": ("mesh_size", 1e3), "error_percent": ("error", 100)}
CASE_COLUMNS |= {"assured_error_percent": ("assured_error", 100), "time_ms": ("seconds", 1e3)}
CASE_COLUMNS |= {f"{part}_ms": (f"{part}_seconds", 1e3) for part in PARTS}
"""Columns of the table: variable and factor."""

STEP_COLUMNS = {"mesh_size_mm": ("mesh_size", 1e3), "million_springs_a_second": ("spring_updates", 1e-6)}


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.bodies.tables.tables`."""
    from ...output.dataset import (
        STATUS,  # here, since a plan does without xarray
        table_rows,
    )

    if "benchmark" not in tree:
        return []
    data = tree["benchmark"].to_dataset()
    asked = (data.status != 0).transpose("scene", "mesh_size", "approach")
    cases = table_rows(data, asked, ("scene", "approach", "status", "message"), CASE_COLUMNS)
    cases = [row | {"status": STATUS[row["status"]]} for row in cases]
    steps = table_rows(data, data.spring_updates.notnull(), ("precision", "thread_count"), STEP_COLUMNS)
    note = "Error, and run time with its parts, meshing included: medians of warm runs."
    about = "Nonlinear springs that explicit steps advance per second."
    return [
        {"stem": "benchmark", "title": "Run time against error", "note": note, "rows": cases},
        {"stem": "explicit_steps", "title": "Explicit steps", "note": about, "rows": steps},
    ]

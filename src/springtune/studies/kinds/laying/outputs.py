"""Figure, table and browse view of laid strips."""

from ...config.kind import Output

OUTPUTS = (
    Output(
        "laying",
        "laid strips",
        figures=lambda study: {"laying": {}},
        plot="studies.kinds.laying.figures:laying",
        shows="laid strips",
    ),
)

LAYING_COLUMNS = {"mesh_size_mm": ("mesh_size", 1e3), "area_mm2": ("area_under_strip", 1e6)}
LAYING_COLUMNS |= {f"{name}_percent": (name, 100) for name in ("area_error", "elongation", "reference_elongation")}
LAYING_COLUMNS |= {"reference_elongation_known_to_points": ("reference_elongation_error_estimate", 100)}
LAYING_COLUMNS |= {"penetration_per_mesh_size": ("penetration", 1)}
"""Columns of the table: variable and factor."""


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.bodies.tables.tables`."""
    from ...output.dataset import table_rows  # here, since a plan does without xarray

    if "laying" not in tree:
        return []
    laid = tree["laying"].to_dataset()
    present = laid.area_under_strip.notnull().transpose("loading", "friction", "mesh_size", "definition")
    rows = table_rows(laid, present, ("loading", "friction", "definition"), LAYING_COLUMNS)
    note = (
        "Area between strip and floor, and elongation of the strip's lower fibre. The reference elongation has an "
        "error band of twice the spread of three meshes: corners of the trapezoid catch between particles of the strip "
        "at places that depend on the mesh. Networks scatter as much."
    )
    return [{"stem": "laying", "title": "Laid strips", "note": note, "rows": rows}]

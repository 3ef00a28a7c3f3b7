"""Figure and table of laid strips, and what the page to browse shows of them."""

from ...config.kind import Output
from ...output.browse import Plot, View

OUTPUTS = (
    Output(
        "laying",
        "laid strips",
        figures=lambda study: {"laying": {}},
        plot="studies.kinds.laying.figures:laying",
        shows="laid strips",
    ),
)

REFERENCE_LINES = (("reference_x", "reference_y", "finite elements"), ("trapezoid_x", "trapezoid_y", "trapezoid"))

VIEWS = (
    View(
        "/laying",
        "Laying",
        "A strip laid on the floor: its outline, the area that it leaves under it, and how far it stretches.",
        (
            Plot("outline of the strip", "strip_y", "strip_x", "definition", along="outline_point", equal=True,
                 beside=REFERENCE_LINES),
            Plot("error of the area", "area_error", "mesh_size", "definition"),
            Plot("errors of the area by friction", "area_error", "friction", "definition", "map"),
            Plot("elongation of the lower fibre", "elongation", "mesh_size", "definition"),
            Plot("seconds", "laying_seconds", "mesh_size", "definition", log="xy"),
        ),
    ),
)  # fmt: skip


LAYING_COLUMNS = {
    "mesh_size_mm": ("mesh_size", 1e3),
    "area_mm2": ("area_under_strip", 1e6),
    "area_error_percent": ("area_error", 100),
    "elongation_percent": ("elongation", 100),
    "reference_elongation_percent": ("reference_elongation", 100),
    "reference_elongation_known_to_points": ("reference_elongation_error_estimate", 100),
    "penetration_per_mesh_size": ("penetration", 1),
}
"""Columns of the table: variable, and the factor on it."""


def tables(tree):
    """Tables of the page, see `springtune.studies.kinds.bodies.tables.tables`."""
    from ...output.selection import listed  # here, since a plan does without xarray

    if "laying" not in tree:
        return []
    laid = tree["laying"].to_dataset()
    present = laid.area_under_strip.notnull().transpose("loading", "friction", "mesh_size", "definition")
    rows = listed(laid, present, ("loading", "friction", "definition"), LAYING_COLUMNS)
    note = (
        "Area between strip and floor and elongation of the strip's lower fibre; the reference's is known to so many "
        "points: twice the spread of three meshes, since the trapezoid's corners catch between a strip's particles, "
        "where depends on the mesh. The networks' own scatter as much."
    )
    return [{"stem": "laying", "title": "Laid strips", "note": note, "rows": rows}]

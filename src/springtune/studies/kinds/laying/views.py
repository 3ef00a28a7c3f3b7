"""What the page to browse shows of laid strips."""

from ...output.views import Plot, View

VIEWS = (
    View(
        "/laying",
        "Laying",
        "A strip laid on the floor: its outline, the area that it leaves under it, and how far it stretches.",
        (
            Plot(
                "outline of the strip",
                "strip_y",
                "strip_x",
                "definition",
                along="outline_point",
                equal=True,
                beside=(
                    ("reference_x", "reference_y", "finite elements"),
                    ("trapezoid_x", "trapezoid_y", "trapezoid"),
                ),
            ),
            Plot("error of the area", "area_error", "mesh_size", "definition"),
            Plot("errors of the area by friction", "area_error", "friction", "definition", "map"),
            Plot("elongation of the lower fibre", "elongation", "mesh_size", "definition"),
            Plot("seconds", "laying_seconds", "mesh_size", "definition", log="xy"),
        ),
    ),
)

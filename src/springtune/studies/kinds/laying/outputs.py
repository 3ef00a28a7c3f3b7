"""The figure of laid strips, and what the page to browse shows of them."""

from typing import TYPE_CHECKING

from ...config.kind import Output
from ...output.browse import Plot, View

if TYPE_CHECKING:
    from ...config.model import Study


def _lack(study: "Study") -> str:
    return "" if study.parts["laying"] else "shows laid strips and the study has none; add a section 'laying'"


OUTPUTS = (
    Output(
        "laying",
        "the figure of laid strips",
        figures=lambda study: {"laying": {}},
        plot="studies.kinds.laying.figures:laying",
        lack=_lack,
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

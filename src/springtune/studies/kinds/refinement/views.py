"""What the page to browse shows of refinements."""

from ...output.views import Plot, View
from .names import VARIED

VIEWS = (
    View(
        "/refinement",
        "Refinement",
        "The deformation error over a parameter, with more values where it changes its sign or crosses the tolerance.",
        tuple(
            Plot(
                f"error over {known.meaning}",
                "deformation_error",
                f"refined_{name}",
                "definition",
                along="point",
                ascending=True,
            )
            for name, known in VARIED.items()
        ),  # fmt: skip
    ),
)

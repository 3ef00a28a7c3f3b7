"""Parameters that a refinement may vary, the figure and tables of refinements, and what the page to browse shows."""

from dataclasses import dataclass

from ...config.kind import Output, needs
from ...output.browse import Plot, View


@dataclass(frozen=True)
class Parameter:
    """A parameter of a scene; ``scales`` are units and SI sizes."""

    meaning: str
    unit: str
    scales: tuple[tuple[str, float], ...] = (("", 1.0),)

    def scale(self, largest: float) -> tuple[str, float]:
        """Unit in which values are shown, and its size in SI.

        Examples
        --------
        >>> VARIED["force"].scale(20.0), VARIED["force"].scale(2e4)
        (('N', 1.0), ('kN', 1000.0))
        """
        return next((one for one in self.scales if largest >= one[1]), self.scales[-1])


LENGTHS = (("mm", 1e-3),)
"""Units of lengths."""

VARIED = {
    "mesh_size": Parameter("asked length of an edge", "m", LENGTHS),
    "force": Parameter("size of the force", "N", (("kN", 1e3), ("N", 1.0))),
    "thickness": Parameter("thickness of the sheet", "m", LENGTHS),
    "young_modulus": Parameter("Young's modulus", "Pa", (("GPa", 1e9), ("MPa", 1e6), ("kPa", 1e3))),
    "poisson_ratio": Parameter("Poisson's ratio", "1"),
    "stiffness_scale": Parameter("factor on the stiffness that the definition gives", "1"),
}
"""Parameters by name."""

SPACINGS = ("linear", "logarithmic")
"""How values are spaced."""

REFINEMENT_TABLES = ("refinement.csv", "refinement_crossings.csv")
"""Tables of the values, and of where errors are zero or the tolerance."""


OUTPUTS = (
    Output(
        "refinement",
        "the figure of refinements, and tables of their values and of where errors are zero or the tolerance",
        figures=lambda study: {"refinement": {}},
        plot="studies.kinds.refinement.figures:refinement",
        tables=lambda study: REFINEMENT_TABLES,
        write="studies.kinds.refinement.collect:write",
        lack=needs("refinement", "shows refinements and the study has none; add a section 'refine'"),
    ),
)

VIEWS = (
    View(
        "/refinement",
        "Refinement",
        "The deformation error over a parameter, with more values where it changes its sign or crosses the tolerance.",
        tuple(
            Plot(f"error over {known.meaning}", "deformation_error", f"refined_{name}", "definition", along="point",
                 ascending=True)
            for name, known in VARIED.items()
        ),
    ),
)  # fmt: skip

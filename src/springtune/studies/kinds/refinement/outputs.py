"""What is made of refinements."""

from typing import TYPE_CHECKING

from ...config.kind import Output

if TYPE_CHECKING:
    from ...config.model import Study

REFINEMENT_TABLES = ("refinement.csv", "refinement_crossings.csv")
"""Tables of the values, and of where errors are zero or the tolerance."""


def _lack(study: "Study") -> str:
    return "" if study.parts["refinement"] else "shows refinements and the study has none; add a section 'refine'"


OUTPUTS = (
    Output(
        "refinement",
        "the figure of refinements, and tables of their values and of where errors are zero or the tolerance",
        figures=lambda study: {"refinement": {}},
        plot="studies.kinds.refinement.figures:refinement",
        tables=lambda study: REFINEMENT_TABLES,
        write="studies.kinds.refinement.tables",
        lack=_lack,
    ),
)

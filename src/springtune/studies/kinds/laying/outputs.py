"""What is made of laid strips."""

from typing import TYPE_CHECKING

from ...config.kind import Output

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

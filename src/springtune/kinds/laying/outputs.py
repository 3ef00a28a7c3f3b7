"""What is made of laid strips."""

from ..base import Output


def _lack(study):
    return "" if study.parts["laying"] else "shows laid strips and the study has none; add a section 'laying'"


OUTPUTS = (
    Output(
        "laying",
        "the figure of laid strips",
        figures=lambda study: {"laying": {}},
        plot="kinds.laying.figures:laying",
        lack=_lack,
    ),
)

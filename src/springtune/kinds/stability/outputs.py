"""What is made of the experiments on stability."""

from ..base import Output

PAGE = "stability.md"


def _lack(study):
    return "" if study.parts["stability"] else "shows experiments and the study has none; add a section 'stability'"


OUTPUTS = (
    Output(
        "stability",
        "figures and the page of the experiments on stability",
        tables=lambda study: [PAGE],
        write="kinds.stability.tables",
        lack=_lack,
    ),
)

"""What is made of the experiments on stability."""

from ..base import Output

PAGE = "stability.md"


NEEDED = {
    "limits": "limits",
    "maps": "maps",
    "energy": "drift",
    "rest": "rest",
    "meshes": "slivers",
    "strains": "strains",
    "buckling": "buckling",
}
"""The experiment that each figure needs."""


def figures(experiments):
    """Figures of experiments, by stem."""
    return {f"stability_{name}": {} for name, needed in NEEDED.items() if needed in experiments}


def _lack(study):
    return "" if study.parts["stability"] else "shows experiments and the study has none; add a section 'stability'"


OUTPUTS = (
    Output(
        "stability",
        "figures and the page of the experiments on stability",
        figures=lambda study: figures({one.name for one in study.parts["stability"]}),
        plot="kinds.stability.figures:stability",
        tables=lambda study: [PAGE],
        write="kinds.stability.tables",
        lack=_lack,
    ),
)

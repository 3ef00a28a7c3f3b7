"""What is made of the experiments on stability."""

from collections.abc import Collection
from typing import TYPE_CHECKING

from ...config.kind import Output

if TYPE_CHECKING:
    from ...config.model import Study

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


def figures(experiments: Collection[str]) -> dict[str, dict[str, object]]:
    """Figures of experiments, by stem."""
    return {f"stability_{name}": {} for name, needed in NEEDED.items() if needed in experiments}


def _lack(study: "Study") -> str:
    return "" if study.parts["stability"] else "shows experiments and the study has none; add a section 'stability'"


OUTPUTS = (
    Output(
        "stability",
        "figures and the page of the experiments on stability",
        figures=lambda study: figures({one.name for one in study.parts["stability"]}),
        plot="studies.kinds.stability.figures:stability",
        tables=lambda study: [PAGE],
        write="studies.kinds.stability.tables",
        lack=_lack,
    ),
)

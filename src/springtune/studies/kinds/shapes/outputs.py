"""Outputs of shapes."""

from typing import TYPE_CHECKING

from ...config.kind import Output, stem

if TYPE_CHECKING:
    from ...config.model import Study

DRAWING = "shapes"
"""Output that is made of whole networks."""

OVERVIEW = "shapes_overview"
"""Stem of the figure of all quantities."""

ERRORS, DEFORMED = "shapes_errors", "shapes_deformed"
"""First parts of the stems of the figures of a shape under a load."""


def figures(cases: "list[dict[str, str]]") -> "dict[str, dict[str, str]]":
    """Figures by stem: of all quantities, and of each shape and load its errors and its networks."""
    found: dict[str, dict[str, str]] = {OVERVIEW: {}} if cases else {}
    for name in (ERRORS, DEFORMED):
        found |= {stem(name, one): one for one in cases}
    return found


def _cases(study: "Study") -> "list[dict[str, str]]":
    part = study.parts["shapes"]
    pairs = dict.fromkeys((one.shape, one.load) for one in part.scenes) if part else ()
    return [{"shape": shape, "load": load} for shape, load in pairs]


def stems(study: "Study") -> list[str]:
    """Stems of the tables on the page of all tables."""
    return ["shapes"] if study.parts["shapes"] else []


OUTPUTS = (
    Output(
        DRAWING,
        "figures of shapes: errors of their quantities, and their deformed networks (and the group `/shape_fields` "
        "behind them)",
        figures=lambda study: figures(_cases(study)),
        collect="studies.kinds.shapes.fields",
        plot="studies.kinds.shapes.figures:shapes",
        usual=True,
    ),
)

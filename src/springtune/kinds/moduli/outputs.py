"""What is made of moduli, beside the errors of scenes."""

from ..base import Output

TABLES = ("definitions.csv", "moduli.csv", "which_definition.md")
"""Tables that compare definitions: of scenes, of moduli, and what to use."""


def figures(loads, mesh_types):
    """Figures by stem: moduli, errors against mesh size by load, and heat maps by mesh type."""
    found = {"definitions_moduli": {}}
    found |= {f"definitions_size_{load}": {"load": load} for load in loads}
    return found | {f"definitions_loads_{mesh_type}": {"mesh_type": mesh_type} for mesh_type in mesh_types}


def _lack(study):
    return "" if study.parts["moduli"] else "compares moduli and no grid has them; add 'moduli: true' to a grid"


OUTPUTS = (
    Output(
        "definitions",
        "figures and tables that compare definitions",
        figures=lambda study: figures(study.axes["load"], study.axes["mesh_type"]),
        plot="kinds.moduli.figures:definitions",
        tables=lambda study: list(TABLES),
        write="kinds.moduli.tables",
        lack=_lack,
    ),
)

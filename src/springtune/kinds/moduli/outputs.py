"""What is made of moduli, beside the errors of scenes."""

from ..base import Output

TABLES = ("definitions.csv", "moduli.csv", "which_definition.md")
"""Tables that compare definitions: of scenes, of moduli, and what to use."""


def _lack(study):
    return "" if study.parts["moduli"] else "compares moduli and no grid has them; add 'moduli: true' to a grid"


OUTPUTS = (
    Output(
        "definitions",
        "figures and tables that compare definitions",
        tables=lambda study: list(TABLES),
        write="kinds.moduli.tables",
        lack=_lack,
    ),
)

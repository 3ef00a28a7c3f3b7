"""What is made of scenes."""

from ...problem.loads import LOADS
from .. import page_files
from ..base import Output

TABLE = ("load", "mesh_type", "material")
"""What a table of the page is about, as in the paper."""


def stem(selection, number=None):
    """Stem of a table's file: the paper's number where it has one, else the labels."""
    return f"table_{number}" if number else "_".join(selection[label] for label in TABLE)


def stems(study):
    """Stems of the tables of a study's scenes."""
    numbers = {(cell.load, cell.mesh_type, cell.material): cell.table for cell in study.printed}
    chosen = dict.fromkeys((scene.load, scene.mesh.mesh_type, scene.material.name) for scene in study.scenes)
    found = [stem(dict(zip(TABLE, labels)), numbers.get(labels)) for labels in chosen]
    found += ["finite_strain"] if study.further_references else []
    found += ["block"] if pressed(study) else []
    return found


def pressed(study):
    """Whether a study has scenes under pressure."""
    return any(LOADS[scene.load].kind.pressed for scene in study.scenes)


def _lack_of_pressure(study):
    return "" if pressed(study) else "shows scenes under pressure and no grid has them; add load 'pressure'"


OUTPUTS = (
    Output("sensitivity", "figures of sensitivity curves", usual=True),
    Output("size", "figures of errors against mesh size", usual=True),
    Output("deformed", "figures of deformed networks (and the group `/fields` behind them)", usual=True),
    Output("tables", "tables as the paper's, on one page", tables=page_files, write="campaign.page", usual=True),
    Output("block", "the figure of a pressed face", lack=_lack_of_pressure),
)

"""Which tables a study has: one a load, mesh type and material, as in the paper; and those that compare definitions."""

from ..problem.loads import LOADS

TABLE = ("load", "mesh_type", "material")

DEFINITIONS = ("definitions.csv", "moduli.csv", "which_definition.md")
"""Tables that compare definitions: of scenes, of moduli, and what to use."""


BENCHMARK = "speed.md"
"""Page of the benchmark."""

STABILITY = "stability.md"
"""Page of the experiments on stability."""


def stem(selection, number=None):
    """Stem of a table's file: the paper's number where it has one, else the labels."""
    return f"table_{number}" if number else "_".join(selection[label] for label in TABLE)


def of_study(study):
    """Files of the tables of a study, by kind; empty where it does not ask for them.

    Parameters
    ----------
    study : Study

    Returns
    -------
    dict of str to list of str
        ``tables``, ``definitions``, ``stability`` and ``benchmark``.
    """
    numbers = {(cell.load, cell.mesh_type, cell.material): cell.table for cell in study.printed}
    chosen = dict.fromkeys((scene.load, scene.mesh.mesh_type, scene.material.name) for scene in study.scenes)
    stems = [stem(dict(zip(TABLE, labels)), numbers.get(labels)) for labels in chosen]
    stems += ["finite_strain"] if study.further_references else []
    stems += ["block"] if any(LOADS[scene.load].kind == "face" for scene in study.scenes) else []
    stems += ["laying"] if study.laying else []
    files = {"tables": [*(f"{name}.csv" for name in stems), "index.html"]}
    files |= {"definitions": list(DEFINITIONS), "stability": [STABILITY], "benchmark": [BENCHMARK]}
    return {kind: names if kind in study.outputs else [] for kind, names in files.items()}

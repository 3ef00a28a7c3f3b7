"""Which tables a study has: one a load, mesh type and material, as in the paper."""

TABLE = ("load", "mesh_type", "material")


def stem(selection, number=None):
    """Stem of a table's file: the paper's number where it has one, else the labels."""
    return f"table_{number}" if number else "_".join(selection[label] for label in TABLE)


def of_study(study):
    """Stems of the tables of a study.

    Parameters
    ----------
    study : Study

    Returns
    -------
    list of str
    """
    numbers = {(cell.load, cell.mesh_type, cell.material): cell.table for cell in study.printed}
    chosen = dict.fromkeys((scene.load, scene.mesh.mesh_type, scene.material.name) for scene in study.scenes)
    return [stem(dict(zip(TABLE, labels)), numbers.get(labels)) for labels in chosen]

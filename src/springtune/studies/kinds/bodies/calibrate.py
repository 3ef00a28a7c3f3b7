"""Stage `calibrate`: the calibrated stiffness of each mesh type, from the best stiffness of its sensitivity curves."""

from pathlib import Path

from springtune.springs.calibrated import calibrate

from ...runs import store


def prepare(file, content):
    """Folder of the curves."""
    return Path(content["folder"])


def solve(task, folder):
    """Calibrated stiffness of a group of scenes [N/m], or None with the reason."""
    try:
        return {"stiffness": calibrate(_best_stiffness(folder, member) for member in task["members"])}
    except ValueError as error:
        return {"stiffness": None, "message": str(error)}


def failed(task, why):
    """Result of a group that cannot be calibrated."""
    return {"stiffness": None, "message": why}


def _best_stiffness(folder, member):
    """Name of a curve, its best stiffness [N/m], and the reason if it has none."""
    name = member["curve"]
    curve = store.read(folder / f"{member['mesh']}.h5", [name])[name]
    called = f"{member['mesh']} in {member['load']} of {member['force']:g} N"
    return called, curve["best_stiffness"], curve["best_message"]

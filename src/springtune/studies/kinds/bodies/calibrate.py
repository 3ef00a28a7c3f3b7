"""Stage `calibrate`: the calibrated stiffness of each mesh type, from the best stiffness of its sensitivity curves."""

from pathlib import Path

from springtune.springs.calibrated import calibrate

from ...runs import store


def prepare(file, content):
    """Folder of the stored curves."""
    return Path(content["folder"])


def solve(task, folder):
    """Calibrated stiffness [N/m] of a group of scenes, or None with the reason."""
    try:
        return {"stiffness": calibrate(_best_stiffness(folder, member) for member in task["members"])}
    except ValueError as error:
        return {"stiffness": None, "message": str(error)}


def failed(task, why):
    """Result of a task that fails."""
    return {"stiffness": None, "message": why}


def _best_stiffness(folder, member):
    """Name, best stiffness [N/m] and message of a curve."""
    name = member["curve"]
    curve = store.read(folder / f"{member['mesh']}.h5", [name])[name]
    called = f"{member['mesh']} in {member['load']} of {member['force']:g} N"
    return called, curve["best_stiffness"], curve["best_message"]

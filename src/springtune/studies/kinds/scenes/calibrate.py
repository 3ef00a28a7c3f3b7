"""Stage `calibrate`: the calibrated stiffness of each mesh type, from the best stiffness of its sensitivity curves."""

from pathlib import Path

from springtune.springs.calibrated import calibrate

from ...runs import store


def run(content, attempts):
    """Calibrate from the stored curves."""
    results = {}
    for group in content["groups"]:
        try:
            results[group["name"]] = {"stiffness": calibrate(_best(content, member) for member in group["members"])}
        except ValueError as error:
            results[group["name"]] = {"stiffness": None, "message": str(error)}
    store.add(content["file"], results)


def _best(content, member):
    """Name of a curve, its best stiffness [N/m], and the reason if it has none."""
    name = member["curve"]
    curve = store.read(Path(content["curves"]) / f"{member['mesh']}.h5", [name])[name]
    called = f"{member['mesh']} in {member['load']} of {member['force']:g} N"
    return called, curve["best_stiffness"], curve["best_message"]

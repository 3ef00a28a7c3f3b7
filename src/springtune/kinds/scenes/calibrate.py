"""Stage `calibrate`: the calibrated stiffness of each mesh type, from the best stiffness of its sensitivity curves."""

import sys
from pathlib import Path

from ...jobs import atomic, store
from ...springs.calibrated import calibrate


def run(tasks, done):
    """Calibrate from the stored curves.

    Parameters
    ----------
    tasks : str or Path
        JSON file: ``curves`` (folder) and ``groups``, each with ``name`` and ``members``, and each of these with
        ``mesh, key, load, force``.
    done : str or Path
        JSON file to write: calibrated stiffness [N/m] by name of the group, and a message where there is none.
    """
    tasks = atomic.read_json(tasks)
    results = {}
    for group in tasks["groups"]:
        try:
            results[group["name"]] = {"stiffness": calibrate(_best(tasks, member) for member in group["members"])}
        except ValueError as error:
            results[group["name"]] = {"stiffness": None, "message": str(error)}
    atomic.write_json(done, results)


def _best(tasks, member):
    """What a curve is called, its best stiffness [N/m], and why there is none."""
    name = member["key"]
    curve = store.read(Path(tasks["curves"]) / f"{member['mesh']}.h5", [name])[name]
    called = f"{member['mesh']} in {member['load']} of {member['force']:g} N"
    return called, curve["best_stiffness"], curve["best_message"]


if __name__ == "__main__":
    run(*sys.argv[1:])

"""Stage `calibrate`: best stiffness of every sensitivity curve, and the calibrated stiffness of each mesh type."""

import sys
from pathlib import Path

import numpy as np

from ..compare import best_stiffness
from ..springs.calibrated import calibrate
from . import files, references, store


def run(tasks, done):
    """Calibrate from the stored curves.

    Parameters
    ----------
    tasks : str or Path
        JSON file: ``curves`` (folder), ``references`` (folder) and ``groups``, each with ``name`` and ``members``, and
        each of these with ``mesh, key, reference, force, stiffnesses``.
    done : str or Path
        JSON file to write: calibrated stiffness [N/m] by name of the group, and a message where there is none.
    """
    tasks = files.read_json(tasks)
    results = {}
    for group in tasks["groups"]:
        try:
            results[group["name"]] = {"stiffness": calibrate(_best(tasks, member) for member in group["members"])}
        except ValueError as error:
            results[group["name"]] = {"stiffness": None, "message": str(error)}
    files.write_json(done, results)


def _best(tasks, member):
    name = member["key"]
    curve = store.read(Path(tasks["curves"]) / f"{member['mesh']}.h5", [name], ["displacement"])[name]
    reference = references.read(tasks["references"], member["reference"])
    displacement = member["force"] * reference.get("displacement", np.nan)
    return best_stiffness(np.array(member["stiffnesses"]), curve["displacement"], displacement)


if __name__ == "__main__":
    run(*sys.argv[1:])

"""What the stages of a study store, in a file: ``python computed.py STUDY OUTPUT``.

Any Python that has the packages runs it. Results are told by their place, since versions are part of their keys.
An output that ends in ``.nc`` is the study's dataset.
"""

import pickle
import sys
import tempfile
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import h5py

from springtune.studies.kinds import load_study
from springtune.studies.kinds.scenes import stored
from springtune.studies.kinds.scenes.stored import fields_key, stored_key
from springtune.studies.runs import job as jobs
from springtune.studies.runs import store
from springtune.studies.runs.plan import plan

PACKAGES = ("numpy", "scipy", "numba", "cvxopt", "netgen-mesher", "pyamg", "scikit-fem", "h5py", "meshio")


def keys(content, calibration):
    """Keys of the results of a job, in order."""
    found = []
    for value in (value for name, value in content.items() if isinstance(value, list) and name != "members"):
        for one in (one for one in value if isinstance(one, dict)):
            found += [stored_key(one, calibration)] if "key" in one else keys(one, calibration)
    return found


def results_in(path):
    """Results in a file by key, arrays included."""
    results = store.read(path, store.stored(path))
    with h5py.File(path) as file:
        for key in set(file) & set(results):
            results[key] |= {name: array[()] for name, array in file[key].items()}
    return results


def computed(study, folder):
    """Results by stage, place and name: numbers, texts and arrays; and the meshes' points."""
    found = {}
    for job in plan(study, folder, 1).jobs.values():
        jobs.do(job.stage.module, job.content)
        if job.stage.name in ("mesh", "shape_mesh"):
            for one in job.content["files"]:
                found["mesh", one["name"], "points"] = stored.read(job.content["folder"], one["name"]).mesh.points
            continue
        path = folder / "calibration.h5"
        calibration = store.everything(path) if path.exists() else None
        results = {key: one for path in job.products if path.endswith(".h5") for key, one in results_in(path).items()}
        for place, key in enumerate(keys(job.content, calibration)):
            one = results[key] | results.get(fields_key(key), {})
            found |= {(job.stage.name, place, name): value for name, value in one.items()}
    return found


def installed(name):
    """Version of a package."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


def collected(study, output):
    """Write the dataset of a study, all stages in this process."""
    from springtune.studies.kinds import collect  # here: what solves physics alone does without xarray

    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "results"
        for job in plan(load_study(study), folder, 1).jobs.values():
            jobs.do(job.stage.module, job.content)
        collect.run(load_study(study), study, folder, Path(output))


if __name__ == "__main__":
    if sys.argv[2].endswith(".nc"):
        collected(*sys.argv[1:])
        sys.exit()
    with tempfile.TemporaryDirectory() as scratch:
        result = computed(load_study(sys.argv[1]), Path(scratch))
    result["versions"] = {name: installed(name) for name in PACKAGES}
    with open(sys.argv[2], "wb") as output:
        pickle.dump(result, output)

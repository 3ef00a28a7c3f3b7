"""A study run job by job in forks of one process, as the rules run it: each job costs milliseconds."""

import contextlib
import ctypes
import json
import os
import re
import shutil
import sys
import traceback
from functools import cache
from pathlib import Path

import h5py
import netCDF4
import numpy as np
import xarray

from springtune.safe_io.atomic import remove_unfinished
from springtune.studies.kinds import load_study
from springtune.studies.kinds.benchmark import solve as benchmark
from springtune.studies.kinds.laying import solve as laying
from springtune.studies.runs import checked_json, driver, rerun, store
from springtune.studies.runs.plan import plan
from springtune.studies.runs.task_costs import TaskCosts

from campaigns import Campaign

STUDY = Path(__file__).with_name("small.yaml")
FOLDER = Path("results/small")
BEGIN = "begin"
"""What a run does before its first job."""

ADOPTING = 36
"""Linux's number for what makes a process the parent of those whose own is gone (prctl)."""

TIMES = re.compile("seconds|time|speed|created|history", re.IGNORECASE)
"""What of names says that a value is another one in every run."""

DATE = re.compile(rb"\d{4}-\d\d-\d\dT[\d:+]+")


def warm_up(scratch):
    """Do all jobs of stages once in this process, so that its forks find modules imported and kernels compiled.

    What takes longest is not computed again after that: here it is about what becomes of files.
    """
    for module in (benchmark, laying):
        module.solve = _remembered(module.solve)
    for job in plan(load_study(STUDY), scratch, 1).jobs.values():
        driver.run(job.stage.module, job.content, TaskCosts())


def _remembered(function):
    known = cache(lambda text: function(json.loads(text)))
    return lambda task: known(json.dumps(task, sort_keys=True))


class Run(Campaign):
    """The study of this folder, as it is to be run now."""

    def __init__(self):
        super().__init__("small.yaml")

    def begin(self):
        """What a run does before its first job."""
        self.plan.write()
        remove_unfinished(FOLDER)
        remove_unfinished(FOLDER.parent, below=False)

    def do(self, name):
        """A job, or what comes before the first one."""
        if name == BEGIN:
            self.begin()
        else:
            super().do(name)

    def finish(self, step):
        """A plain run after a failure of a step.

        What is made of the dataset is made again only where it failed: elsewhere the dataset says that it is the same.
        """
        after = [name for name in self.jobs if name not in (*self.plan.jobs, rerun.COLLECT)]
        names = [name for name in self.due() if name == step or name not in after]
        for name in [BEGIN, *names] if names else ():
            self.do(name)


def complete(folder, snapshots):
    """Steps of the study, run in a new folder; how it is before each of them is copied."""
    folder.mkdir()
    shutil.copy(STUDY, folder)
    with contextlib.chdir(folder):
        run = Run()
        steps = [BEGIN, *run.due()]
        for name in steps:
            shutil.copytree(folder, snapshots / name)
            run.do(name)
        assert not Run().due()
    return steps


def forked(function, folder, log):
    """Status of a process, forked off this one, that calls a function in a folder; what it says goes into a file."""
    ctypes.CDLL(None).prctl(ADOPTING, 1)
    child = os.fork()
    if child:
        status = os.waitpid(child, 0)[1]
        with contextlib.suppress(ChildProcessError):
            while True:  # until all that it started is gone, too
                os.waitpid(-child, 0)
        return status
    code = 1
    try:
        os.setsid()
        output = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        for stream in (1, 2):
            os.dup2(output, stream)
        sys.stdout = sys.stderr = open(2, "w", buffering=1, closefd=False)
        os.chdir(folder)
        function()
        code = 0
    except SystemExit as error:
        print(error, file=sys.stderr)
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


def faulty(step, faults):
    """Do a step with faults, or count its operations, for `forked`."""
    run = Run()
    xarray.DataTree.to_netcdf = faults.watch_library(xarray.DataTree.to_netcdf)
    with faults:
        run.do(step)


# -- what is there -----------------------------------------------------------------------------------------------------


def contents(folder, logs=True):
    """What every file below a folder holds, without times: by path. A file that is not whole raises an error."""
    files = [path for path in sorted(folder.rglob("*")) if path.is_file()]
    files = [path for path in files if logs or path.parent.name not in ("logs", "benchmarks")]
    return {str(path.relative_to(folder)): content(path) for path in files}


def content(path):
    """What a file holds, without times."""
    if path.suffix == ".h5":
        return _stored(path)
    if path.suffix == ".nc":
        with netCDF4.Dataset(path) as file:
            return _group(file)
    if path.suffix == ".json" and path.parent.name != "tables":
        found = checked_json.read(path)
        assert found is not None, f"{path} is not whole"
        if path.name == "costs.json":
            return None
        if path.parent.name == "done":
            return {"digest": found["digest"], "products": sorted(found["products"])}
        return _timeless(found)
    if path.name == "index.html" and path.parent.name != "tables":  # it holds the whole dataset, times included
        text = path.read_bytes()
        assert text.rstrip().endswith(b"</html>"), f"{path} is not whole"
        return None
    return DATE.sub(b"", path.read_bytes())


def _timeless(found):
    if isinstance(found, dict):
        return {name: _timeless(value) for name, value in found.items() if not TIMES.search(name)}
    return found


def _stored(path):
    results = store.read(path, store.stored(path))
    found = _timeless(results)
    with h5py.File(path) as file:
        for key in file:
            if key in results:
                for name, values in file[key].items():
                    if not TIMES.search(name):
                        found[key][name] = (values.dtype.str, values.shape, values[()].tobytes())
    return repr(sorted((key, sorted(one.items())) for key, one in found.items()))


def _group(group):
    group.set_auto_maskandscale(False)
    found = {name: str(group.getncattr(name)) for name in group.ncattrs() if not TIMES.search(name)}
    for name, variable in group.variables.items():
        if not TIMES.search(name):
            values = np.asarray(variable[...])
            raw = values.tolist() if values.dtype == object else values.tobytes()
            found[name] = (str(variable.dtype), variable.shape, raw)
    return found | {f"{name}/": _group(below) for name, below in group.groups.items()}


def differences(found, wanted, partly=False):
    """Paths whose content is not what it should be; with `partly` files may be missing."""
    expected = found.keys() if partly else found.keys() | wanted.keys()
    return sorted(path for path in expected if not (path in found and path in wanted and found[path] == wanted[path]))

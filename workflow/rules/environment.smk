"""What jobs find in their environment, wherever they run."""

import os
import sys
import time
from pathlib import Path

from snakemake.exceptions import WorkflowError

from springtune.studies.runs import workload
from springtune.studies.runs.run_tasks import STATE, source_state

BEGUN = time.time()
"""When this run began [s since the epoch]: what is newer was made by it."""

# One thread a process: the solvers are sequential, and cores are Snakemake's to share out.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

# Memory that a solve gives back is memory that the next one takes: glibc is not to return it to the system between
# them, which costs a third of the seconds of a solve.
os.environ.setdefault("MALLOC_MMAP_THRESHOLD_", str(2**25))
os.environ.setdefault("MALLOC_TRIM_THRESHOLD_", str(2**29))
os.environ.setdefault("MALLOC_TOP_PAD_", str(2**25))

# A file is written by one process, under a name of its own, before others can see it: locks of HDF5 protect nothing,
# and where a shared filesystem has none, HDF5 would open no file.
os.environ.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")

# Jobs run on the Python that runs Snakemake, whether its environment is activated or not.
os.environ |= {"PATH": os.pathsep.join([str(Path(sys.executable).parent), *os.get_exec_path()])}

# What a run begins with is what its jobs are to work by.
os.environ.setdefault(STATE, source_state())


def chosen_config():
    """The study that --configfile names, or the paper's; one that is read for the paper is told by it."""
    if "study" in config:
        return Path(config["study"])
    named = [str(path) for path in workflow.configfiles]
    if len(named) > 1:
        raise WorkflowError(f"one study at a time: --configfile names {len(named)}: {', '.join(named)}")
    path = Path(named[0] if named else "config/paper.yaml")
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path


CONFIG = chosen_config()

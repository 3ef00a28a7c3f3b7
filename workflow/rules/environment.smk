"""The environment of jobs, and the path of the study."""

import os
import sys
import time
from pathlib import Path

from snakemake.exceptions import WorkflowError

from springtune.studies.runs import workload
from springtune.studies.runs.source import STATE, USUAL_STUDY, config_file, source_state, workflow_folder

BEGUN = time.time()
"""Start of this run [s since the epoch]; newer files are its products."""

# One thread a process: solvers are sequential, and Snakemake shares out the cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

# Keep freed memory in the process: returning it to the system between solves costs a third of their time.
os.environ.setdefault("MALLOC_MMAP_THRESHOLD_", str(2**25))
os.environ.setdefault("MALLOC_TRIM_THRESHOLD_", str(2**29))
os.environ.setdefault("MALLOC_TOP_PAD_", str(2**25))

# HDF5 cannot open files on shared filesystems without locks. It needs none: files are renamed when complete.
os.environ.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")

# Jobs run on the Python that runs Snakemake, whether its environment is activated or not.
os.environ |= {"PATH": os.pathsep.join([str(Path(sys.executable).parent), *os.get_exec_path()])}

# Jobs refuse to run if the source was edited since the run began.
os.environ.setdefault(STATE, source_state())


def chosen_config():
    """The study of --configfile or of the paper; `config["study"]` of a module."""
    if "study" in config:
        if not isinstance(config["study"], str):
            raise WorkflowError(f"study: {config['study']!r} is no path; give that of a study's YAML file")
        return Path(config["study"])
    named = [str(path) for path in workflow.configfiles]
    if len(named) > 1:
        raise WorkflowError(f"one study at a time: --configfile names {len(named)}: {', '.join(named)}")
    deployed = Path("config/config.yaml")  # where workflows that others deploy have theirs
    path = Path(named[0]) if named else deployed if deployed.is_file() else config_file(USUAL_STUDY)
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path


CONFIG = chosen_config()

HERE = Path(str(workflow.current_basedir))
SOURCE = HERE.parents[1] if HERE.is_dir() else workflow_folder()
"""Folder of the Snakefile; of a remote one, which Snakemake reads file by file, that of the installed package."""

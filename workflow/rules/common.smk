"""Helpers of the rules: the study, its folder and its bundles."""

import os
import sys
from pathlib import Path

from snakemake.exceptions import WorkflowError

from springtune.campaign import plan
from springtune.jobs.dependencies import PACKAGE, modules
from springtune.kinds import KINDS, kinds, load_study, outputs
from springtune.study import StudyError

# One thread a process: the solvers are sequential, and cores are Snakemake's to share out.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

# Memory that a solve gives back is memory that the next one takes: glibc is not to return it to the system between
# them, which costs a third of the seconds of a solve.
os.environ.setdefault("MALLOC_MMAP_THRESHOLD_", str(2**25))
os.environ.setdefault("MALLOC_TRIM_THRESHOLD_", str(2**29))
os.environ.setdefault("MALLOC_TOP_PAD_", str(2**25))

# Jobs run on the Python that runs Snakemake, whether its environment is activated or not.
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])


def chosen_config():
    """The study that --configfile names, or the paper's."""
    named = [str(path) for path in workflow.configfiles]
    if len(named) > 1:
        raise WorkflowError(f"one study at a time: --configfile names {len(named)}: {', '.join(named)}")
    path = Path(named[0] if named else "config/paper.yaml")
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path


def loaded_study():
    try:
        return load_study(CONFIG)
    except StudyError as error:
        # The message says it all; a traceback through Snakemake would bury it.
        print(error, file=sys.stderr)
        sys.exit(1)


CONFIG = chosen_config()
STUDY = loaded_study()
RESULTS = Path("results") / STUDY.name
BUNDLES = plan.write_tasks(STUDY, RESULTS, workflow.cores or 1)

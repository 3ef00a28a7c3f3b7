"""The study and its jobs, functions that rules share, and the begin and end of a run.

Reading a Snakefile writes nothing.
"""

import gc
import json
import os
import re
import sys
import threading
import time
import warnings
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.logging import logger

from springtune.problem.shapes import AssumptionWarning
from springtune.safe_io import remove_unfinished, reset_future_times, rst
from springtune.studies.config.messages import StudyError
from springtune.studies.config.model import FORMATS
from springtune.studies.kinds import load_study
from springtune.studies.runs import keys, locks, plan
from springtune.studies.runs.source import DIGESTS, STATE, USUAL_STUDY, config_file, source_state, workflow_folder

BEGUN = time.time()
"""Start of this run [s since the epoch]; its products are newer."""

SOURCE = workflow_folder()
IS_MODULE = "study" in config

for variable, value in {
    # One thread a process: solvers are sequential, and Snakemake shares out the cores.
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
    # Keep freed memory in the process: returning it to the system between solves costs a third of their time.
    "MALLOC_MMAP_THRESHOLD_": str(2**25),
    "MALLOC_TRIM_THRESHOLD_": str(2**29),
    "MALLOC_TOP_PAD_": str(2**25),
    # HDF5 cannot open files on shared filesystems without locks. It needs none: files are renamed when complete.
    "HDF5_USE_FILE_LOCKING": "FALSE",
    # Jobs refuse to run if the source was edited since the run began.
    STATE: source_state(),
}.items():
    os.environ.setdefault(variable, value)
# Jobs run on the Python that runs Snakemake, whether its environment is activated or not.
os.environ |= {"PATH": os.pathsep.join([str(Path(sys.executable).parent), *os.get_exec_path()])}


# The study.


def chosen_study():
    """The study of --configfile or of the paper; `config["study"]` of a module."""
    if IS_MODULE:
        if not isinstance(config["study"], str):
            raise WorkflowError(f"study: {config['study']!r} is no path; give that of a study's YAML file")
        return Path(config["study"])
    named = [str(path) for path in workflow.configfiles]
    if len(named) > 1:
        raise WorkflowError(f"one study at a time: --configfile names {len(named)}: {', '.join(named)}")
    deployed = Path("config/config.yaml")  # where workflows that others deploy have theirs
    path = Path(named[0]) if named else deployed if deployed.is_file() else config_file(USUAL_STUDY)
    return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path


def refused(why):
    """Print a message and exit, without a traceback through Snakemake."""
    print(why, file=sys.stderr)
    sys.exit(1)


def loaded_study():
    """Load the study of CONFIG; its folder of results must be its own."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("once", AssumptionWarning)
            warnings.showwarning = lambda message, *where: print(f"warning: {message}", file=sys.stderr)
            found = load_study(CONFIG)
        locks.check_claim(Path("results") / found.name, CONFIG)
        return found
    except (StudyError, locks.LockedError) as error:
        refused(error)


CONFIG = chosen_study()
# Scenes and tasks stay until the end: collecting garbage among them takes a fifth of the time.
gc.disable()
STUDY = loaded_study()
RESULTS = Path("results") / STUDY.name
JOBS = plan.jobs(STUDY, RESULTS)
os.environ[DIGESTS] = json.dumps(keys.package_digests())
gc.freeze()
gc.enable()
plan.STUDIES_READ.append((STUDY, JOBS))
BUNDLES = [name for name, job in JOBS.items() if job.stage]
"""Names of all jobs before the dataset."""

if not IS_MODULE:
    config |= {"title": rst(STUDY.title), "results": str(RESULTS)}  # for the report's text


# Functions that rules use.


def done(stage):
    """Records of all jobs of a stage."""
    return [JOBS[name].record for name in BUNDLES if JOBS[name].stage.name == stage]


def bundles():
    """Pattern of the labels of bundles."""
    return "|".join(sorted({re.escape(JOBS[name].label) for name in BUNDLES})) or "none"


def digest(wildcards):
    """Digest of a job: it changes with everything that its results depend on."""
    return JOBS[f"{wildcards.stage}_{wildcards.bundle}"].digest


def study(wildcards):
    """Path of the study, as a function, so that Snakemake does not expand braces in it."""
    return str(CONFIG)


# Figures and tables in Snakemake's report.

SHOWN = FORMATS[0]  # the format that browsers show
CAPTIONS = {path.stem for path in (SOURCE / "workflow/report").glob("*.rst")}


def in_report(one):
    """Figures and tables of an output; browsable figures and all tables go into the report."""
    of_figures = one.figures(STUDY)
    paths = [RESULTS / file for file in plan.output_files(one, STUDY)]
    chosen = [of_figures.get(path.stem, {}) if path.parent.name == "figures" else {} for path in paths]
    return [
        shown(one, path, selection) if path.parent.name == "tables" or path.suffix == f".{SHOWN}" else path
        for path, selection in zip(paths, chosen)
    ]


def shown(one, path, selection):
    """A file of an output with its labels in the report."""
    named = path.stem.removesuffix("_".join(["", *selection.values()])) if selection else path.stem
    labels = {"name": named.replace("_", " ")}
    labels |= {dimension.replace("_", " "): str(label) for dimension, label in selection.items()}
    caption = f"../report/{one.name if one.name in CAPTIONS else 'output'}.rst"
    return report(path, caption=caption, category=one.name, subcategory=path.parent.name, labels=labels)


# The begin and the end of a run.


def begin():
    """Lock the studies and write the tasks of their jobs. A second call does nothing."""
    if locks.LOCKED_NOTES:
        return
    try:
        for _, jobs in plan.STUDIES_READ:
            locks.check_idle(jobs["collect"].folder)
        locks.lock([jobs["collect"].folder for _, jobs in plan.STUDIES_READ])
        for one, jobs in plan.STUDIES_READ:
            folder = jobs["collect"].folder
            remove_unfinished(folder)
            reset_future_times(folder)  # Snakemake refuses products that are older than what they are made of
            remove_unfinished(folder.parent, below=False)  # of what studies share
            locks.claim(folder, one.path)
            for job in jobs.values():
                job.write()
    except locks.LockedError as error:
        raise WorkflowError(str(error)) from None
    except OSError as error:
        locks.unlock()
        remedy = "make room or give leave to write there, then call the same command again"
        raise WorkflowError(f"{error.filename or RESULTS} cannot be written: {error.strerror}; {remedy}") from None


def end(how):
    """Unlock the studies and log their summary, by a function of `springtune.studies.output.summary`."""
    if not locks.LOCKED_NOTES:
        return
    from springtune.studies.output import summary  # here: only a run needs it

    locks.unlock()
    for thread in threading.enumerate():
        if isinstance(thread, threading.Timer):  # Snakemake's, to look for jobs to start: it would hold up the end
            thread.cancel()
    text = getattr(summary, how)(*plan.STUDIES_READ[0], BEGUN)
    text += "".join(summary.other_study_report(*one, BEGUN) for one in plan.STUDIES_READ[1:])
    logger.info(text, extra={"ends": True})

"""The study, the plan of its jobs, and helpers that the rules share."""

import gc
import os
import re
import sys
import warnings
from math import inf
from pathlib import Path

from springtune.problem.geometry import AssumptionWarning
from springtune.safe_io.escapes import rst
from springtune.studies.config.kind import FORMATS
from springtune.studies.config.messages import StudyError
from springtune.studies.kinds import load_study
from springtune.studies.runs import locks, rerun, workload
from springtune.studies.runs.keys import CODE_FILE, OURS
from springtune.studies.runs.plan import plan, stages


def refused(why):
    """End before anything runs, with a message and no traceback through Snakemake."""
    print(why, file=sys.stderr)
    sys.exit(1)


def loaded_study():
    """The study; its warnings are printed by the run and not by its jobs, which read it, too."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore" if IS_CHILD else "once", AssumptionWarning)
            warnings.showwarning = lambda message, *where: print(f"warning: {message}", file=sys.stderr)
            return load_study(CONFIG)
    except StudyError as error:
        remedy = f"; as a module springtune takes its study by config: {{'study': 'config/mine.yaml'}}"
        refused(f"{error}{remedy if MODULE and 'study' not in config else ''}")


def job_seconds():
    """Intended seconds of a job, from a cluster's profile or ``--config job_minutes=5``; None in the jobs themselves."""
    if IS_CHILD:
        return None
    minutes = config.get("job_minutes", 0)
    if isinstance(minutes, bool) or not isinstance(minutes, int | float) or not 0 <= minutes < inf:
        usual = "the profile slurm has 5, a machine of one's own 0, for as few as pay"
        refused(f"--config job_minutes={minutes}: no number of minutes; {usual}")
    return 60.0 * minutes


# Keys of results have the versions of the packages that Snakemake sees, so jobs must run on these.
# Snakemake takes braces in a path of it for wildcards.
ENVIRONMENT = None if DEPLOYED or "{" in str(SOURCE) else "../envs/springtune.yaml"
"""What rules need, for readers and for `--lint`; see docs/how-to/use-conda.md."""

if DEPLOYED and not IS_CHILD:
    print("note: jobs run in the environment of Snakemake; --software-deployment-method is not used", file=sys.stderr)

ON_CLUSTER = NODES is not None
UNUSABLE_PATH = workload.refusal(CONFIG, Path.cwd(), SOURCE, Path(sys.executable), ON_CLUSTER)
if UNUSABLE_PATH and not IS_CHILD:
    refused(UNUSABLE_PATH)
if MOVED:
    refused(f"module {MODULE}: results are in results/<study> and take no other prefix; leave the prefix out")

# Scenes and their tasks stay to the end: collecting garbage among them takes a fifth of the reading.
gc.disable()
STUDY = loaded_study()
RESULTS = Path("results") / STUDY.name
if not MODULE:
    config |= {"title": rst(STUDY.title), "results": str(RESULTS)}  # for the report's text

# The number of jobs follows from the cores; on a cluster, which has room for all, from the seconds of a job.
CORES = 1 if ON_CLUSTER or IS_CHILD else workflow.cores or 1
OURS.recall(RESULTS.parent / CODE_FILE)
PLAN = plan(STUDY, RESULTS, CORES, job_seconds())
JOBS = rerun.jobs(STUDY, PLAN)
gc.freeze()
gc.enable()
try:
    locks.check_claim(RESULTS, CONFIG)
except locks.LockedError as error:
    refused(error)
workload.READ.append((STUDY, PLAN))

STORED = [PLAN.record(name) for name in PLAN.jobs]
"""Records of all jobs before the dataset."""


# Helpers of the stages.


def done(stage):
    """Records of all jobs of a stage."""
    return [PLAN.record(job.name) for job in PLAN.jobs.values() if job.stage.name == stage]


def bundles(stage):
    """Pattern of a stage's bundles, for the constraint of its wildcard."""
    return "|".join(map(re.escape, PLAN.labels(stage))) or "none"


def digest(name):
    """Parameter of a job that changes with all that its results depend on, by the name of its record.

    A function of the wildcards alone: Snakemake does not compare parameters that depend on input or output.
    """
    return lambda wildcards: JOBS[name.format(**dict(wildcards))].digest


# A change of these resources is no reason to run a job again.


def minutes(name):
    """Resource ``runtime`` of the jobs of a rule, by the name of their record."""
    return lambda wildcards, attempt: needs(name, wildcards).minutes(attempt)


def megabytes(name):
    """Resource ``mem_mb`` of the jobs of a rule, by the name of their record."""
    return lambda wildcards, attempt: needs(name, wildcards).megabytes(attempt)


def needs(name, wildcards):
    """Expected seconds and memory of a job, from measured costs of its tasks."""
    job = name.format(**dict(wildcards))
    if job in PLAN.jobs:
        return PLAN.needs[PLAN.jobs[job].stage.name, PLAN.jobs[job].label]
    return workload.presented_needs(RESULTS, job, len(JOBS[job].products) if job in JOBS else 1)


# Figures and tables in Snakemake's report.

SHOWN = FORMATS[0]  # the format that browsers show
CAPTIONS = {path.stem for path in (SOURCE / "workflow/report").glob("*.rst")}


def files(one):
    """Figures and tables of an output; browsable figures and all tables go into the report."""
    of_figures = one.figures(STUDY)
    paths = [RESULTS / file for file in rerun.output_files(one, STUDY)]
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
    return report(path, caption=caption(one.name), category=one.name, subcategory=path.parent.name, labels=labels)


def caption(name):
    """Caption of an output: its own, or the general one."""
    return f"../report/{name if name in CAPTIONS else 'output'}.rst"

"""The study, the plan of its jobs, and helpers that the rules share."""

import gc
import re
import sys
import warnings
from pathlib import Path

from springtune.problem.geometry import AssumptionWarning
from springtune.safe_io.escapes import rst
from springtune.studies.config.kind import FORMATS
from springtune.studies.config.messages import StudyError
from springtune.studies.kinds import load_study
from springtune.studies.runs import locks, rerun, workload
from springtune.studies.runs.plan import plan


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


# Keys of results have the versions of the packages that Snakemake sees, so jobs must run on these.
# Snakemake takes braces in a path of it for wildcards.
ENVIRONMENT = None if DEPLOYED or "{" in str(SOURCE) else "../envs/springtune.yaml"
"""What rules need, for readers and for `--lint`; see docs/how-to/use-conda-or-a-container.md."""

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

PLAN = plan(STUDY, RESULTS, cluster=ON_CLUSTER or IS_CHILD)
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


def bundles():
    """Pattern of the labels of bundles."""
    return "|".join(sorted({re.escape(job.label) for job in PLAN.jobs.values()})) or "none"


def digest(name):
    """Parameter of a job that changes with all that its results depend on, by the name of its record.

    A function of the wildcards alone: Snakemake does not compare parameters that depend on input or output.
    """
    return lambda wildcards: JOBS[name.format(**dict(wildcards))].digest


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

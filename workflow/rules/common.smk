"""Helpers of the rules: the study, its folder and its bundles."""

import os
import re
import sys
import time
import warnings
from math import inf
from pathlib import Path

from snakemake.logging import logger

from springtune.studies.runs import locks, rerun, workload
from springtune.studies.runs.workload import READ
from springtune.studies.runs.plan import plan, stages
from springtune.safe_io.escapes import rst
from springtune.safe_io.atomic import remove_unfinished
from springtune.studies.runs.dependencies import CODE_FILE, OURS
from springtune.studies.kinds import load_study
from springtune.studies.config.kind import FORMATS
from springtune.problem.geometry import AssumptionWarning
from springtune.studies.config.messages import StudyError


def loaded_study():
    try:
        with warnings.catch_warnings():
            # Jobs read it, too: the run says it once.
            warnings.simplefilter("ignore" if IS_CHILD else "default", AssumptionWarning)
            warnings.showwarning = lambda message, *where: print(f"warning: {message}", file=sys.stderr)
            return load_study(CONFIG)
    except StudyError as error:
        refused(error)


def lasting():
    """Seconds that a job is to last, by the profile of a cluster or ``--config job_minutes=5``; a child does not judge."""
    if IS_CHILD:
        return None
    minutes = config.get("job_minutes", 0)
    if isinstance(minutes, bool) or not isinstance(minutes, int | float) or not 0 <= minutes < inf:
        usual = "the profile slurm has 5, a machine of one's own 0, for as few as pay"
        refused(f"--config job_minutes={minutes}: no number of minutes; {usual}")
    return 60.0 * minutes


def chosen_untold():
    """What the dataset is to leave empty or not, by ``--config no_host=true``; for studies that the paper reads, too."""
    chosen = {}
    for option in rerun.BLANKED:
        variable = f"SPRINGTUNE_{option.upper()}"  # of `springtune run`: a --config would replace that of a profile
        value = str(config.get(option, os.environ.get(variable, ""))).lower()
        if value not in ("", "true", "false"):
            refused(f"--config {option}={value}: neither true nor false; give one of them")
        if value:
            os.environ[variable], chosen[option] = value, value == "true"
    return chosen


def refused(why):
    """End before anything runs: the message says it all, and a traceback through Snakemake would bury it."""
    print(why, file=sys.stderr)
    sys.exit(1)


ON_CLUSTER = NODES is not None
WHY_NOT = workload.refusal(CONFIG, Path.cwd(), Path(workflow.basedir), Path(sys.executable), ON_CLUSTER)
if WHY_NOT and not IS_CHILD:
    refused(WHY_NOT)
UNTOLD = chosen_untold()
STUDY = loaded_study()
RESULTS = Path("results") / STUDY.name
config |= {"title": rst(STUDY.title), "results": str(RESULTS)}  # for the report's text
OURS.recall(RESULTS.parent / CODE_FILE)
# A cluster has room for all jobs: only how long one lasts says how many there are. A child plans as the run did.
CORES = 1 if ON_CLUSTER or IS_CHILD else workflow.cores or 1
PLAN = plan(STUDY, RESULTS, CORES, lasting())
JOBS = rerun.jobs(STUDY, PLAN, UNTOLD)
try:
    locks.check_claim(RESULTS, CONFIG)
except locks.LockedError as error:
    refused(error)
READ.append((STUDY, PLAN))
SHOWN = FORMATS[0]  # of a figure's files, the one that a browser shows
CAPTIONS = {path.stem for path in (Path(workflow.basedir) / "workflow/report").glob("*.rst")}


def done(stage):
    """Records of all jobs of a stage."""
    return [PLAN.record(job.name) for job in PLAN.jobs.values() if job.stage.name == stage]


def bundles(stage):
    """Bundles of a stage, for the constraint of its wildcard."""
    return "|".join(map(re.escape, PLAN.labels(stage))) or "none"


def digest(name):
    """Parameter of a job that changes with all that its results depend on, by the name of its record.

    A function of the wildcards alone: Snakemake does not compare parameters that depend on input or output.
    """
    return lambda wildcards: JOBS[name.format(**dict(wildcards))].digest


STORED = [PLAN.record(name) for name in PLAN.jobs]
"""Records of all jobs before the dataset."""


def files(one):
    """Figures and tables of an output."""
    of_figures = one.figures(STUDY)
    paths = [RESULTS / file for file in rerun.output_files(one, STUDY)]
    chosen = [of_figures.get(path.stem, {}) if path.parent.name == "figures" else {} for path in paths]
    return [
        shown(one, path, selection) if path.parent.name == "tables" or path.suffix == f".{SHOWN}" else path
        for path, selection in zip(paths, chosen)
    ]


def shown(one, path, selection):
    """A file of an output, in Snakemake's report under what it is, with what it selects."""
    named = path.stem.removesuffix("_".join(["", *selection.values()])) if selection else path.stem
    labels = {"name": named.replace("_", " ")}
    labels |= {dimension.replace("_", " "): str(label) for dimension, label in selection.items()}
    return report(path, caption=caption(one.name), category=one.name, subcategory=path.parent.name, labels=labels)


def caption(name):
    """Caption of an output, or that of any."""
    return f"../report/{name if name in CAPTIONS else 'output'}.rst"


def minutes(name):
    """Resource ``runtime`` of the jobs of a rule, by the name of their record."""
    return lambda wildcards, attempt: needs(name, wildcards).minutes(attempt)


def megabytes(name):
    """Resource ``mem_mb`` of the jobs of a rule, by the name of their record."""
    return lambda wildcards, attempt: needs(name, wildcards).megabytes(attempt)


def needs(name, wildcards):
    """What a job asks a cluster for: by what such tasks have cost, not by what it has done; no reason to run again."""
    job = name.format(**dict(wildcards))
    if job in PLAN.jobs:
        return PLAN.needs[PLAN.jobs[job].stage.name, PLAN.jobs[job].label]
    return workload.presented_needs(RESULTS, job, len(JOBS[job].products) if job in JOBS else 1)


def begin():
    """What happens when jobs are about to run, and not when the Snakefile is read."""
    try:
        for _, one in READ:
            locks.check_idle(one.folder)
        locks.begin([one.folder for _, one in READ])
        for study, one in READ:
            remove_unfinished(one.folder)
            remove_unfinished(one.folder.parent, below=False)  # of what studies share
            locks.claim(one.folder, study.path)
            one.write()
        OURS.remember(RESULTS.parent / CODE_FILE)
        if ON_CLUSTER:
            workload.remember_commands(RESULTS, jobs_to_run())
    except locks.LockedError as error:
        raise WorkflowError(str(error)) from None
    except OSError as error:
        locks.end()
        remedy = "make room or give leave to write there, then call the same command again"
        raise WorkflowError(f"{error.filename or RESULTS} cannot be written: {error.strerror}; {remedy}") from None
    tell_start()


def tell_start():
    """Say how much there is to do; the progress display reads what each job is expected to take."""
    jobs = [(job["number"], job["rule"], job["threads"], job["outputs"]) for job in jobs_to_run()]
    found, names = {}, []
    for study, one in READ:
        prefix = "" if study is STUDY else f"{study.name}_"
        own = [
            (number, rule.removeprefix(prefix), threads, outputs)
            for number, rule, threads, outputs in jobs
            if outputs and Path(outputs[0]).is_relative_to(one.folder)
        ]
        names += [study.name] if own or study is STUDY else []
        found |= workload.estimates(study, one, own)
    cores = (
        max(1, min(workflow.resource_settings.nodes, len(jobs))) if ON_CLUSTER else CORES
    )  # on a cluster, jobs side by side
    text = f"{', '.join(names)}: {workload.told(found, cores)}"
    logger.info(text, extra={"estimates": found, "cores": cores})


def tell_end(how):
    """Say what became of the study, see `springtune.studies.output.summary`; `--quiet all` alone keeps it back."""
    from springtune.studies.output import summary  # here: only a run needs it

    locks.end()
    text = getattr(summary, how)(*READ[0], BEGUN)
    text += "".join(summary.beside(*one, BEGUN) for one in READ[1:])
    logger.info(text, extra={"ends": True})

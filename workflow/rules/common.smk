"""Helpers of the rules: the study, its folder and its bundles."""

import os
import re
import sys
import time
import warnings
from math import inf
from pathlib import Path

from snakemake.logging import logger
from snakemake.settings.enums import Quietness
from snakemake_logger_plugin_springtune import LogHandler

from springtune.studies.runs import locks, rerun, workload
from springtune.studies.runs.plan import plan, stages
from springtune.safe_io.escapes import rst
from springtune.studies.runs import commands
from springtune.safe_io.atomic import remove_unfinished
from springtune.studies.runs.dependencies import CODE_FILE, OURS
from springtune.studies.kinds import load_study
from springtune.studies.config.kind import FORMATS, KINDS
from springtune.problem.geometry import AssumptionWarning
from springtune.studies.config.messages import StudyError


def loaded_study():
    try:
        with warnings.catch_warnings():
            # Jobs read it, too: the run says it once.
            warnings.simplefilter("default" if workflow.is_main_process else "ignore", AssumptionWarning)
            warnings.showwarning = lambda message, *where: print(f"warning: {message}", file=sys.stderr)
            return load_study(CONFIG)
    except StudyError as error:
        # The message says it all; a traceback through Snakemake would bury it.
        print(error, file=sys.stderr)
        sys.exit(1)


def lasting():
    """Seconds that a job is to last, by the profile of a cluster or ``--config job_minutes=5``; a child does not judge."""
    if not workflow.is_main_process:
        return None
    minutes = config.get("job_minutes", 0)
    if isinstance(minutes, bool) or not isinstance(minutes, int | float) or not 0 <= minutes < inf:
        print(f"--config job_minutes={minutes}: no number of minutes; the profile slurm has 5, a machine of one's own 0, "
              "for as few as pay", file=sys.stderr)  # fmt: skip
        sys.exit(1)
    return 60.0 * minutes


def chosen_untold():
    """What the dataset is to leave empty or not, by ``--config no_host=true``; for studies that the paper reads, too."""
    chosen = {}
    for option in rerun.BLANKED:
        variable = f"SPRINGTUNE_{option.upper()}"  # of `springtune run`: a --config would replace that of a profile
        value = str(config.get(option, os.environ.get(variable, ""))).lower()
        if value not in ("", "true", "false"):
            print(f"--config {option}={value}: neither true nor false; give one of them", file=sys.stderr)
            sys.exit(1)
        if value:
            os.environ[variable], chosen[option] = value, value == "true"
    return chosen


UNTOLD = chosen_untold()
STUDY = loaded_study()
RESULTS = Path("results") / STUDY.name
config |= {"title": rst(STUDY.title), "results": str(RESULTS)}  # for the report's text
OURS.recall(RESULTS.parent / CODE_FILE)
ON_CLUSTER = workflow.resource_settings.nodes is not None
# A cluster has room for all jobs: only how long one lasts says how many there are. A child plans as the run did.
CORES = 1 if ON_CLUSTER or not workflow.is_main_process else workflow.resource_settings.cores or 1
PLAN = plan(STUDY, RESULTS, CORES, lasting())
JOBS = rerun.jobs(STUDY, PLAN, UNTOLD)
try:
    locks.check_claim(RESULTS, CONFIG)
except locks.LockedError as error:
    print(error, file=sys.stderr)
    sys.exit(1)
# The one that is run; for the paper, those that it reads besides.
READ = workflow.__dict__.setdefault("studies_read", [])
READ.append((STUDY, PLAN))
SHOWN = FORMATS[0]  # of a figure's files, the one that a browser shows
CAPTIONS = {path.stem for path in (Path(workflow.basedir) / "workflow/report").glob("*.rst")}

DISPLAY = LogHandler.latest
if "study" not in config and DISPLAY:
    DISPLAY.results = RESULTS  # whose summary to show where nothing is to be done


def done(stage):
    """Records of all jobs of a stage."""
    return [PLAN.record(job.name) for job in PLAN.jobs.values() if job.stage.name == stage]


def bundles(stage):
    """Bundles of a stage, for the constraint of its wildcard."""
    return "|".join(map(re.escape, PLAN.labels(stage))) or "none"


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
            commands.remember(RESULTS, map(told_elsewhere, workflow.dag.needrun_jobs()))
    except locks.LockedError as error:
        raise WorkflowError(str(error)) from None
    except OSError as error:
        locks.end()
        remedy = "make room or give leave to write there, then call the same command again"
        raise WorkflowError(f"{error.filename or RESULTS} cannot be written: {error.strerror}; {remedy}") from None
    tell_start()


def told_elsewhere(job):
    """What a job needs to know where it runs."""
    return {
        "rule": job.rule.name,
        "wildcards": dict(job.wildcards_dict),
        # With wildcards: what the child calls in its turn is named by them.
        "output": list(map(str, job.rule.output)),
        "log": list(map(str, job.rule.log)),
        "benchmark": str(job.rule.benchmark),
        "threads": job.threads,
        "command": job.shellcmd,
    }


def asks_for_storage():
    """Whether a target is one of `storage.smk`, whatever else was forgotten."""
    return not {"publish", "fetch"}.isdisjoint(sys.argv[1:])


def tell_start():
    """Say how much there is to do; the progress display reads what each job is expected to take."""
    dag = workflow.dag
    jobs = [(dag.jobid(job), job.rule.name, job.threads, list(map(str, job.output))) for job in dag.needrun_jobs()]
    found, names = {}, []
    for study, one in READ:
        prefix = "" if study is STUDY else f"{study.name}_"
        own = [
            (number, rule.removeprefix(prefix), threads, outputs)
            for number, rule, threads, outputs in jobs
            if outputs and Path(outputs[0]).is_relative_to(one.folder)
        ]
        names += [study.name] if own or study is STUDY else []
        found |= workload.loads(study, one, own)
    cores = max(1, min(workflow.nodes, len(jobs))) if ON_CLUSTER else CORES  # on a cluster, jobs side by side
    text = f"{', '.join(names)}: {workload.told(found, cores)}"
    logger.info(text, extra={"quietness": Quietness.PROGRESS, "loads": found, "cores": cores})


def tell_end(how):
    """Say what became of the study, see `springtune.studies.output.summary`; `--quiet all` alone keeps it back."""
    from springtune.studies.output import summary  # here: only a run needs it

    locks.end()
    text = getattr(summary, how)(*READ[0], BEGUN)
    text += "".join(summary.beside(*one, BEGUN) for one in READ[1:])
    logger.info(text, extra={"ends": True})

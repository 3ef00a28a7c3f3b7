"""Helpers of the rules: the study, its folder and its bundles."""

import os
import sys
import time
from pathlib import Path

from snakemake.exceptions import WorkflowError
from snakemake.logging import logger
from snakemake.settings.enums import Quietness

from springtune.campaign import plan
from springtune.jobs import atomic
from springtune.jobs.dependencies import PACKAGE, modules
from springtune.kinds import KINDS, kinds, load_study, outputs
from springtune.kinds.base import FORMATS
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
os.environ |= {"PATH": os.pathsep.join([str(Path(sys.executable).parent), *os.get_exec_path()])}


def chosen_config():
    """The study that --configfile names, or the paper's; one that is read for the paper is told by it."""
    if "study" in config:
        return Path(config["study"])
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
config |= {"title": STUDY.title, "results": str(RESULTS)}  # for the report's text
BUNDLES = plan.write_tasks(STUDY, RESULTS, workflow.cores or 1)
READ = workflow.__dict__.setdefault("studies_read", [])  # the one that is run; for the paper, those that it reads besides
READ.append((STUDY, RESULTS, [f"{stage}_{label}" for stage, labels in BUNDLES.items() for label in labels]))
SHOWN = FORMATS[0]  # of a figure's files, the one that a browser shows
CAPTIONS = {path.stem for path in (Path(workflow.basedir) / "workflow/report").glob("*.rst")}

if "study" not in config:
    for handler in workflow.logger_manager.get_log_handlers():
        handler.results = RESULTS  # whose summary to show where nothing is to be done


def done(stage):
    """What all jobs of a stage make when they are done."""
    return [RESULTS / "done" / f"{stage}_{label}.json" for label in BUNDLES[stage]]


def files(one):
    """Figures and tables of an output."""
    figures = [
        shown(one, path, selection) if ending == SHOWN else path
        for stem, selection in one.figures(STUDY).items()
        for ending in FORMATS
        for path in [RESULTS / "figures" / f"{stem}.{ending}"]
    ]
    return figures + [shown(one, RESULTS / "tables" / name, {}) for name in plan.table_files(one, STUDY)]


def shown(one, path, selection):
    """A file of an output, in Snakemake's report under what it is, with what it selects."""
    named = path.stem.removesuffix("_".join(["", *selection.values()])) if selection else path.stem
    labels = {"name": named.replace("_", " ")}
    labels |= {dimension.replace("_", " "): str(label) for dimension, label in selection.items()}
    return report(path, caption=caption(one.name), category=one.name, subcategory=path.parent.name, labels=labels)


def caption(name):
    """Caption of an output, or that of any."""
    return f"../report/{name if name in CAPTIONS else 'output'}.rst"


def code(one):
    """Modules that an output is made by."""
    made = ["campaign.present", *(f"kinds.{name}.outputs" for name in KINDS), *filter(None, (one.module, one.write))]
    if one.page:
        made += ["campaign.page", *(f"kinds.{name}.kind" for name in KINDS)]
        made += [f"kinds.{kind.name}.tables" for kind in kinds() if kind.tables]
    found = modules(*made)
    return [*found, PACKAGE / "output/page.html"] if one.page else list(found)


def tell_start():
    """Say how much there is to do; the progress display reads what each job is expected to take."""
    from springtune.campaign import workload  # here: only a run needs it

    for _, results, _ in READ:
        atomic.sweep(results)
    dag = workflow.dag
    jobs = [(dag.jobid(job), job.rule.name, job.threads, list(map(str, job.output))) for job in dag.needrun_jobs()]
    found, names = {}, []
    for study, results, _ in READ:
        prefix = "" if study is STUDY else f"{study.name}_"
        own = [
            (number, rule.removeprefix(prefix), threads, outputs)
            for number, rule, threads, outputs in jobs
            if outputs and Path(outputs[0]).is_relative_to(results)
        ]
        names += [study.name] if own or study is STUDY else []
        found |= workload.loads(study, results, own)
    cores = workflow.cores or min(workflow.nodes or 1, len(jobs) or 1)  # on a cluster, jobs side by side
    text = f"{', '.join(names)}: {workload.told(found, cores)}"
    logger.info(text, extra={"quietness": Quietness.PROGRESS, "loads": found, "cores": cores})


def tell_end(how):
    """Say what became of the study, see `springtune.campaign.summary`; `--quiet all` alone keeps it back."""
    from springtune.campaign import summary  # here: only a run needs it

    since = workflow.start_time.timestamp()
    text = getattr(summary, how)(*READ[0], since)
    text += "".join(summary.beside(*one, since) for one in READ[1:])
    logger.info(text, extra={"ends": True})

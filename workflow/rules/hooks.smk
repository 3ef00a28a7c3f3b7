"""Before the first job and after the last one: locks, notes of jobs, and messages. Reading the Snakefile writes nothing."""

from snakemake.logging import logger

from springtune.safe_io.atomic import remove_unfinished, to_present
from springtune.studies.runs.workload import READ


def begin():
    """Lock the studies and write the notes of their jobs; then log the expected work. A second call does nothing."""
    if workload.BEGUN:
        return
    workload.BEGUN.append(RESULTS)
    try:
        for _, one in READ:
            locks.check_idle(one.folder)
        locks.begin([one.folder for _, one in READ])
        for study, one in READ:
            remove_unfinished(one.folder)
            to_present(one.folder)  # Snakemake refuses products that are older than what they are made of
            remove_unfinished(one.folder.parent, below=False)  # of what studies share
            locks.claim(one.folder, study.path)
            one.write()
    except locks.LockedError as error:
        raise WorkflowError(str(error)) from None
    except OSError as error:
        locks.end()
        remedy = "make room or give leave to write there, then call the same command again"
        raise WorkflowError(f"{error.filename or RESULTS} cannot be written: {error.strerror}; {remedy}") from None
    log_begin()


def log_begin():
    """Log the jobs of the run; the progress display reads what each is for, and how many results it has."""
    jobs, work = jobs_to_run(), {}
    for _, one in READ:
        work |= workload.results_by_stage(
            one, {n: paths for n, paths in jobs.items() if Path(paths[0]).is_relative_to(one.folder)}
        )
    logger.info(f"{STUDY.name}: {len(jobs)} jobs", extra={"work": work})


def log_end(how):
    """Unlock the studies and log their summary, see `springtune.studies.output.summary`; once for each begin."""
    if not workload.BEGUN:
        return
    workload.BEGUN.clear()
    from springtune.studies.output import summary  # here: only a run needs it

    end_timers()
    locks.end()
    text = getattr(summary, how)(*READ[0], BEGUN)
    text += "".join(summary.beside(*one, BEGUN) for one in READ[1:])
    logger.info(text, extra={"ends": True})

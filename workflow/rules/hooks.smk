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
        OURS.remember(RESULTS.parent / CODE_FILE)
        if ON_CLUSTER:
            workload.remember_commands(RESULTS, jobs_to_run())
    except locks.LockedError as error:
        raise WorkflowError(str(error)) from None
    except OSError as error:
        locks.end()
        remedy = "make room or give leave to write there, then call the same command again"
        raise WorkflowError(f"{error.filename or RESULTS} cannot be written: {error.strerror}; {remedy}") from None
    log_begin()


def log_begin():
    """Log the expected work of the run; the progress display reads the estimate of each job."""
    jobs = [(job["number"], job["rule"], job["threads"], job["outputs"]) for job in jobs_to_run()]
    estimates, names = {}, []
    for study, one in READ:
        prefix = "" if study is STUDY else f"{study.name}_"
        own = [
            (number, rule.removeprefix(prefix), threads, outputs)
            for number, rule, threads, outputs in jobs
            if outputs and Path(outputs[0]).is_relative_to(one.folder)
        ]
        names += [study.name] if own or study is STUDY else []
        estimates |= workload.estimates(study, one, own)
    side_by_side = max(1, min(NODES, len(jobs))) if ON_CLUSTER else CORES
    load = 0.0 if ON_CLUSTER else os.getloadavg()[0]
    slower = workload.slowdown(side_by_side, load, os.cpu_count() or 1)
    text = f"{', '.join(names)}: {workload.told(estimates, side_by_side, slower, load)}"
    logger.info(text, extra={"estimates": estimates, "cores": side_by_side, "slowdown": slower})


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

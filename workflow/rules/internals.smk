"""Undocumented parts of Snakemake, all in this file. A run works without each of them.

`make test-versions` runs this file with the oldest and the newest Snakemake.
"""

import sys
import threading

WORDS = sys.argv[1:]
"""Words of the command. Snakemake has its targets only after reading the Snakefile, and some cost seconds to prepare."""

MODULE = getattr(getattr(workflow, "modifier", None), "namespace", None)
"""Name of this workflow in one that uses it as a module; None without."""

HAS_TARGET = getattr(workflow, "default_target", None) is not None
"""Whether the workflow that uses this one has a first rule of its own."""

PATHS = getattr(getattr(workflow, "modifier", None), "path_modifier", None)
MOVED = bool(MODULE and PATHS and PATHS.replace_prefix("results/") != "results/")
"""Whether the module's results are to have another prefix."""

IS_CHILD = not getattr(workflow, "is_main_process", True)
"""Whether this process is a job of a run."""

NODES = getattr(workflow.resource_settings, "nodes", None)
"""Number of parallel jobs on other machines; None without a cluster."""

DEPLOYED = bool(getattr(workflow.deployment_settings, "deployment_method", ()))
"""Whether the command has --software-deployment-method."""


def jobs_to_run():
    """Jobs of this run; an empty list if Snakemake does not tell."""
    try:
        return [
            {
                "number": workflow.dag.jobid(job),
                "rule": job.rule.name,
                "wildcards": dict(job.wildcards_dict),
                "outputs": list(map(str, job.output)),
                # With wildcards, which name the jobs that a child starts.
                "output": list(map(str, job.rule.output)),
                "log": list(map(str, job.rule.log)),
                "benchmark": str(job.rule.benchmark),
                "threads": job.threads,
                "command": job.shellcmd,
            }
            for job in workflow.dag.needrun_jobs()
        ]
    except AttributeError:
        return []


def end_timers():
    """End the timers of the scheduler, for which Snakemake would wait up to a second before it exits."""
    for one in threading.enumerate():
        if isinstance(one, threading.Timer):
            one.cancel()


HOOKS = {name: getattr(workflow, f"_{name}", None) for name in ("onstart", "onsuccess", "onerror")}
"""Hooks of the workflow that uses this one, so far."""


def add_hooks(**added):
    """Call the hooks of a module after those of its user; without it, its user's hooks are to call them."""
    for name, before in HOOKS.items():
        if before:
            setattr(workflow, f"_{name}", lambda log, before=before, own=added[name]: (before(log), own()))


def noted_job():
    """The job of this process on a cluster, from the notes of its run, so that no study is read and planned."""
    if MODULE or not IS_CHILD or "--target-jobs" not in WORDS:
        return None
    try:
        from snakemake.target_jobs import parse_target_jobs_cli_args
    except ImportError:
        return None
    rest = WORDS[WORDS.index("--target-jobs") + 1 :]
    number = next((place for place, word in enumerate(rest) if word.startswith("-")), len(rest))
    targets = parse_target_jobs_cli_args(rest[:number])
    if len(targets) != 1:  # a group's
        return None
    return workload.recall_command(Path("results") / CONFIG.stem, targets[0].rulename, targets[0].wildcards_dict)


NOTED = noted_job()

if NOTED:

    rule:
        name:
            NOTED["rule"]
        output:
            NOTED["output"],
        params:
            # A function, so that braces in the command are not wildcards.
            command=lambda wildcards: NOTED["command"],
        threads: NOTED["threads"]
        log:
            NOTED["log"],
        benchmark:
            NOTED["benchmark"]
        shell:
            "{params.command}"

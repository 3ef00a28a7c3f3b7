"""Undocumented parts of Snakemake, all in this file. A run works without each of them.

`make slow` runs this file with the oldest and the newest Snakemake.
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
    """Outputs of each job of this run, by its number; empty if Snakemake does not tell."""
    try:
        return {workflow.dag.jobid(job): [*map(str, job.output)] for job in workflow.dag.needrun_jobs() if job.output}
    except AttributeError:
        return {}


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

"""All that the workflow uses of Snakemake beyond what it documents; each is a comfort, without which a run still works.

`make test-versions` runs this with the oldest and the newest Snakemake.
"""

import sys

WORDS = sys.argv[1:]
"""Words of the command: Snakemake knows its targets after the Snakefile is read, and some cost seconds to prepare."""

IS_CHILD = not getattr(workflow, "is_main_process", True)
"""Whether a run has started this process for one of its jobs."""

NODES = getattr(workflow.resource_settings, "nodes", None)
"""Jobs side by side on other machines; None where all run on this one."""


def jobs_to_run():
    """Jobs that this run is about to do; none where Snakemake does not say."""
    try:
        return [
            {
                "number": workflow.dag.jobid(job),
                "rule": job.rule.name,
                "wildcards": dict(job.wildcards_dict),
                "outputs": list(map(str, job.output)),
                # With wildcards: what the child calls in its turn is named by them.
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


def noted_job():
    """The one job that a cluster starts this process for, as its run noted it: no study is read and planned for it."""
    if not IS_CHILD or "--target-jobs" not in WORDS:
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
            # As it is: braces in it are no wildcards.
            command=lambda wildcards: NOTED["command"],
        threads: NOTED["threads"]
        log:
            NOTED["log"],
        benchmark:
            NOTED["benchmark"]
        shell:
            "{params.command}"

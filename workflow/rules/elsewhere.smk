"""A job that a run has sent to another machine: by what the run noted of it, so that no study is read and planned again."""

from snakemake.target_jobs import parse_target_jobs_cli_args


def told():
    """What the run has noted of the one job that this process is to do; None where it does not say."""
    words = sys.argv[1:]
    if workflow.is_main_process or "--target-jobs" not in words:
        return None
    rest = words[words.index("--target-jobs") + 1 :]
    number = next((place for place, word in enumerate(rest) if word.startswith("-")), len(rest))
    targets = parse_target_jobs_cli_args(rest[:number])
    if len(targets) != 1:  # a group's
        return None
    return commands.recall(Path("results") / CONFIG.stem, targets[0].rulename, targets[0].wildcards_dict)


TOLD = told()

if TOLD:

    rule:
        name:
            TOLD["rule"]
        output:
            TOLD["output"],
        params:
            # As it is: braces in it are no wildcards.
            command=lambda wildcards: TOLD["command"],
        threads: TOLD["threads"]
        log:
            TOLD["log"],
        benchmark:
            TOLD["benchmark"]
        shell:
            "{params.command}"

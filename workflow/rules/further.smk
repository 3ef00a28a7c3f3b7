"""Stages of study kinds without a file of rules, such as your own: one rule each, like `mesh` in scenes.smk."""


def has_rule(name):
    """Whether an earlier file has a rule of that name."""
    try:
        return bool(getattr(rules, name))
    except (AttributeError, WorkflowError):
        return False


for stage in stages():
    if not has_rule(stage.name):

        rule:
            name:
                stage.name
            message:
                f"{stage.message}, bundle {{wildcards.bundle}}"
            input:
                [RESULTS / "done" / f"{other}_{{bundle}}.json" for other in filter(None, [stage.like])],
                [path for other in stage.every for path in done(other)],
            output:
                RESULTS / "done" / f"{stage.name}_{{bundle}}.json",
            wildcard_constraints:
                bundle=bundles(stage.name),
            params:
                tasks=str(RESULTS / "tasks" / f"{stage.name}_{{bundle}}.json"),
                digest=digest(f"{stage.name}_{{bundle}}"),
            threads: CORES if stage.alone else 1
            resources:
                runtime=minutes(f"{stage.name}_{{bundle}}"),
                mem_mb=megabytes(f"{stage.name}_{{bundle}}"),
            log:
                RESULTS / "logs" / f"{stage.name}_{{bundle}}.log",
            benchmark:
                RESULTS / "benchmarks" / f"{stage.name}_{{bundle}}.tsv"
            conda:
                ENVIRONMENT
            shell:
                "python -m springtune.studies.runs.run_tasks {params.tasks:q} {output:q} {params.digest:q} > {log:q} 2>&1"

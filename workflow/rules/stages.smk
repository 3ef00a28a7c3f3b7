"""The stages before the dataset, one rule each: every study kind declares its own."""

import re

for stage in stages():

    rule:
        name:
            stage.name
        message:
            f"{stage.message}, bundle {{wildcards.bundle}}"
        input:
            same=[RESULTS / "done" / f"{other}_{{bundle}}.json" for other in stage.same],
            every=[path for other in stage.every for path in done(other)],
            again=looked_at(JOBS, f"{stage.name}_{{bundle}}"),
        output:
            RESULTS / "done" / f"{stage.name}_{{bundle}}.json",
        wildcard_constraints:
            bundle="|".join(map(re.escape, PLAN.labels(stage.name))) or "none",
        params:
            # The note is written when a run begins, so that a plan is made without.
            tasks=str(RESULTS / "tasks" / f"{stage.name}_{{bundle}}.json"),
            digest=lambda wildcards, output: JOBS[Path(output[0]).stem].digest,
        # On a cluster a node of its own is for the profile to ask for.
        threads: CORES if stage.alone else 1
        resources:
            runtime=minutes(f"{stage.name}_{{bundle}}"),
            mem_mb=megabytes(f"{stage.name}_{{bundle}}"),
        log:
            RESULTS / "logs" / f"{stage.name}_{{bundle}}.log",
        benchmark:
            RESULTS / "benchmarks" / f"{stage.name}_{{bundle}}.tsv"
        shell:
            "python -m springtune.studies.runs.run_tasks {params.tasks:q} {output:q} {params.digest:q} > {log:q} 2>&1"


DONE = [path for stage in stages() for path in done(stage.name)]
